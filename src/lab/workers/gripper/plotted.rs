//! Decimation of readings for plots: at most a hundred rows a second, with minima and maxima kept.

use crate::grasping::Row;
use palpate_tactile::Channel;
use palpate_tactile::board::Reading;
use palpate_tactile::calibration::SensorEstimate;

/// Rate above which readings are binned (1/s).
const MOST_HZ: f64 = 110.0;
/// Length of a bin (s); each gives two rows, minimum and maximum.
const BIN_S: f64 = 0.02;

/// Makes trace rows of readings.
#[derive(Debug)]
pub(super) struct Plotted {
    channels: Vec<Channel>,
    counts: usize,
    bin: Option<Bin>,
    last_s: Option<f64>,
}

/// Bin of readings.
#[derive(Debug)]
struct Bin {
    from_s: f64,
    last_s: f64,
    line_bar: f64,
    least: Box<[f32]>,
    largest: Box<[f32]>,
    /// Readings in it.
    many: u32,
}

impl Plotted {
    /// Rows have the derived channels first, then the counts of so many channels of the board.
    pub(super) fn new(channels: Vec<Channel>, counts: usize) -> Self {
        Self { channels, counts, bin: None, last_s: None }
    }

    /// The row of a reading: derived channels, then counts of the board.
    pub(super) fn row(&self, reading: &Reading, estimate: &SensorEstimate, commanded: Option<f64>) -> Row {
        Row::of_reading(reading, commanded, estimate, &self.channels, self.counts)
    }

    /// Adds a row; returns the rows to plot.
    pub(super) fn push(&mut self, row: Row) -> Vec<Row> {
        let Row { t_s, line_bar, phase, values } = row;
        let fast = self.last_s.is_some_and(|last| t_s - last < 1.0 / MOST_HZ);
        self.last_s = Some(t_s);
        let done = self.bin.as_ref().is_some_and(|bin| !fast || !(bin.from_s..bin.from_s + BIN_S).contains(&t_s));
        let mut rows = if done { self.flush() } else { Vec::new() };
        match &mut self.bin {
            Some(bin) => bin.add(t_s, &values),
            None if fast => {
                self.bin =
                    Some(Bin { from_s: t_s, last_s: t_s, line_bar, least: values.clone(), largest: values, many: 1 });
            }
            None => rows.push(Row { t_s, line_bar, phase, values }),
        }
        rows
    }

    /// Readings are missing here: curves break.
    pub(super) fn gap(&mut self, from_s: f64) -> Vec<Row> {
        let mut rows = self.flush();
        let values = vec![f32::NAN; self.channels.len() + self.counts];
        rows.push(Row { t_s: from_s + 1e-6, line_bar: f64::NAN, phase: None, values: values.into() });
        rows
    }

    /// Ends the bin and returns its rows.
    pub(super) fn flush(&mut self) -> Vec<Row> {
        let Some(Bin { from_s, last_s, line_bar, least, largest, many }) = self.bin.take() else { return Vec::new() };
        let mut rows = vec![Row { t_s: from_s, line_bar, phase: None, values: least }];
        if many > 1 {
            rows.push(Row { t_s: 0.5 * (from_s + last_s), line_bar, phase: None, values: largest });
        }
        rows
    }
}

impl Bin {
    fn add(&mut self, t_s: f64, values: &[f32]) {
        self.last_s = t_s;
        self.many += 1;
        for ((least, largest), value) in self.least.iter_mut().zip(&mut self.largest).zip(values) {
            // `min` and `max` skip NaN.
            *least = least.min(*value);
            *largest = largest.max(*value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(t_s: f64, count: f32) -> Reading {
        Reading { t_s, arrived_s: t_s, seq: None, counts: vec![Some(count)], line_bar: None }
    }

    #[test]
    fn slow_boards_are_plotted_reading_by_reading() {
        let mut plotted = Plotted::new(Vec::new(), 2);
        for k in 0..10u8 {
            let rows = plotted.push(plotted.row(
                &reading(0.02 * f64::from(k), f32::from(k)),
                &SensorEstimate::default(),
                Some(0.5),
            ));
            assert_eq!(rows.len(), 1);
            assert_eq!((rows[0].values[0], rows[0].line_bar), (f32::from(k), 0.5));
            assert!(rows[0].values[1].is_nan());
        }
    }

    #[test]
    fn fast_boards_keep_their_extremes() {
        let mut plotted = Plotted::new(Vec::new(), 1);
        let mut rows = Vec::new();
        for k in 0..10_000u32 {
            let spike = if k == 5003 { 4095.0 } else { 100.0 };
            rows.extend(plotted.push(plotted.row(
                &reading(1e-3 * f64::from(k), spike),
                &SensorEstimate::default(),
                None,
            )));
        }
        assert!((980..=1010).contains(&rows.len()), "{}", rows.len());
        assert!(rows.windows(2).all(|pair| pair[0].t_s < pair[1].t_s));
        assert_eq!(rows.iter().map(|row| row.values[0]).fold(0.0, f32::max), 4095.0);
        let broken = plotted.gap(10.0);
        assert!(broken.last().is_some_and(|row| row.values[0].is_nan() && row.t_s > 10.0));
    }
}
