//! Columns of features as codes of at most 255 bins; splits of training rows depend on their order only.
//!
//! A column with at most 255 distinct values has a bin for each, without loss. Others are cut at quantiles: bins hold
//! about equally many rows, and equal values share a bin.

use super::Table;

const MOST_BINS: usize = 255;

/// Training rows, column by column.
pub(super) struct Bins {
    pub(super) columns: Vec<Column>,
}

/// Feature of all training rows.
pub(super) struct Column {
    /// Value of each row.
    pub(super) values: Vec<f32>,
    /// Bin of each row, ascending with the value.
    pub(super) codes: Vec<u8>,
    /// Smallest training value of each bin.
    least: Vec<f32>,
    /// Largest training value of each bin.
    most: Vec<f32>,
}

impl Bins {
    pub(super) fn new(table: &Table<'_>) -> Self {
        let column = |k: usize| {
            let values: Vec<f32> = table.values.iter().copied().skip(k).step_by(table.columns).collect();
            Column::new(values)
        };
        Self { columns: (0..table.columns).map(column).collect() }
    }
}

impl Column {
    fn new(values: Vec<f32>) -> Self {
        let mut sorted = values.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let runs = || sorted.chunk_by(|a, b| a == b);
        let is_exact = runs().count() <= MOST_BINS;
        let (mut least, mut most): (Vec<f32>, Vec<f32>) = (Vec::new(), Vec::new());
        let (mut below, mut newest) = (0, 0);
        for (k, run) in runs().enumerate() {
            let bin = if is_exact { k } else { below * MOST_BINS / sorted.len() };
            match most.last_mut() {
                Some(most) if bin == newest => *most = run[0],
                _ => {
                    least.push(run[0]);
                    most.push(run[0]);
                }
            }
            newest = bin;
            below += run.len();
        }
        let codes = values.iter().map(|value| most.partition_point(|most| most < value) as u8).collect();
        Self { values, codes, least, most }
    }

    /// Number of bins.
    pub(super) fn bins(&self) -> usize {
        self.most.len()
    }

    /// Threshold between two bins: midway between their neighbouring values, rounded down, so that the same values lie
    /// below it as below the exact middle.
    pub(super) fn threshold(&self, left: u8, right: u8) -> f32 {
        let middle = 0.5 * (f64::from(self.most[usize::from(left)]) + f64::from(self.least[usize::from(right)]));
        let rounded = middle as f32;
        if f64::from(rounded) > middle { rounded.next_down() } else { rounded }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_values_have_a_bin_each() {
        let column = Column::new(vec![3.0, -1.0, 3.0, 0.0, -0.0, 10.0]);
        assert_eq!(column.codes, [2, 0, 2, 1, 1, 3]);
        assert_eq!(column.threshold(1, 2), 1.5);
        assert_eq!(column.threshold(0, 3), 4.5);
    }

    #[test]
    fn many_values_share_bins_equally() {
        let values: Vec<f32> = (0..2550u32).map(|k| ((k * 7919) % 2550) as f32).collect();
        let column = Column::new(values.clone());
        assert_eq!(column.bins(), 255);
        for (code, value) in column.codes.iter().zip(&values) {
            assert_eq!(usize::from(*code), *value as usize / 10);
        }
        assert_eq!(column.threshold(0, 1), 9.5);
    }

    #[test]
    fn equal_values_share_a_bin() {
        let values: Vec<f32> = (0..1000u32).map(|k| k.min(500) as f32).collect();
        let column = Column::new(values);
        assert!(column.bins() <= 255);
        assert!(column.codes[500..].iter().all(|code| *code == column.codes[500]));
    }

    #[test]
    fn a_threshold_lies_between_neighbouring_numbers() {
        for low in [1.0_f32, f32::MAX.next_down(), f32::MIN, 1e-45, -1e-45] {
            let high = low.next_up();
            let threshold = Column::new(vec![low, high]).threshold(0, 1);
            assert!(low <= threshold && threshold < high, "{low:e} {threshold:e} {high:e}");
        }
    }
}
