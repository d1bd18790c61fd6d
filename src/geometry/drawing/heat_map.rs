//! A heat map: a grid of values, each cell in the colour of its value, as plain data. The window draws it, and figures
//! are drawn from the same values.

use super::PlotAxis;
use crate::palette::{Rgb, SIGNED_MAP, SILICONE, load_colour, signed_colour};
use crate::units::{SPACE, symbol, three_digits, true_minus};

/// Grid of values as colours.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    pub title: String,
    /// Quantity of the values.
    pub quantity: String,
    /// Unit of the values.
    pub unit: String,
    /// Columns, from the left.
    pub x: CellAxis,
    /// Rows, from the top.
    pub y: CellAxis,
    /// Values row by row, NaN where undefined.
    pub values: Vec<f32>,
    /// Colours of the values.
    pub scale: ColourScale,
}

/// Axis of a heat map: equal cells side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct CellAxis {
    /// What it counts or measures.
    pub name: String,
    /// Unit; empty for plain numbers.
    pub unit: String,
    /// Number of cells.
    pub count: usize,
    /// Outer edges of the first and of the last cell, in its unit.
    pub range: [f64; 2],
}

/// Map from values to colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColourScale {
    /// Load on a pad from zero to this value; the silicone's own colour close to zero.
    Load(f32),
    /// Share from zero to this value, the darker the larger; the least share can be told from none.
    Share(f32),
    /// Signed values between minus and plus this value; neutral at zero.
    Signed(f32),
}

impl CellAxis {
    /// True of a length that does not begin at zero: what lies before is left out.
    pub fn is_cut(&self) -> bool {
        self.unit == "mm" && self.range[0] > 0.0
    }

    /// Middle of a cell, in the axis' unit.
    pub fn middle(&self, cell: usize) -> f64 {
        let [from, to] = self.range;
        from + (to - from) * (cell as f64 + 0.5) / self.count.max(1) as f64
    }

    /// Cell that holds a value; `None` outside.
    pub fn cell(&self, value: f64) -> Option<usize> {
        let [from, to] = self.range;
        let share = (value - from) / (to - from);
        let inside = self.count > 0 && (0.0..=1.0).contains(&share);
        inside.then(|| ((share * self.count as f64) as usize).min(self.count - 1))
    }

    /// Name, middle and unit of a cell: `time 1.23 s`; without unit a whole number: `joint 4`.
    pub fn text(&self, cell: usize) -> String {
        let Self { name, unit, .. } = self;
        let middle = self.middle(cell);
        if unit.is_empty() {
            format!("{name} {middle:.0}")
        } else {
            format!("{name} {}{SPACE}{unit}", true_minus(&three_digits(middle)))
        }
    }

    /// The same as an axis of a plot.
    pub fn plot_axis(&self) -> PlotAxis {
        let Self { name, unit, range, .. } = self;
        let title = if unit.is_empty() { name.clone() } else { format!("{name} ({unit})") };
        PlotAxis { range: Some(*range), ..PlotAxis::linear(title) }
    }
}

/// Colour of the least share, as a share of that of all.
const LEAST: f32 = 0.15;

impl ColourScale {
    /// Colour of a value; none where it is undefined.
    pub fn colour(self, value: f32) -> Option<Rgb> {
        (!value.is_nan()).then(|| match self {
            Self::Load(full) => load_colour(value / full),
            Self::Share(full) if value > 0.0 => SILICONE.mix(SIGNED_MAP[0], LEAST + (1.0 - LEAST) * value / full),
            Self::Share(_) => SILICONE,
            Self::Signed(full) => signed_colour(value / full),
        })
    }

    /// Values at the ends of the legend.
    pub fn limits(self) -> [f32; 2] {
        match self {
            Self::Load(full) | Self::Share(full) => [0.0, full],
            Self::Signed(full) => [-full, full],
        }
    }
}

impl HeatMap {
    /// Value of a cell; NaN where undefined or outside.
    pub fn value(&self, row: usize, column: usize) -> f32 {
        let inside = column < self.x.count;
        self.values.get(row * self.x.count + column).copied().filter(|_| inside).unwrap_or(f32::NAN)
    }

    /// Place and value of a cell in words: `joint 4, time 1.23 s: 5.12 °`.
    pub fn text(&self, row: usize, column: usize) -> String {
        let value = self.value(row, column);
        let value = if value.is_nan() {
            "no value".to_owned()
        } else {
            format!("{}{SPACE}{}", true_minus(&three_digits(f64::from(value))), symbol(&self.unit))
        };
        format!("{}, {}: {value}", self.y.text(row), self.x.text(column))
    }

    /// The same map with no more columns and rows than these. Each cell keeps the value farthest from zero of those that it
    /// replaces, so that short and narrow peaks survive.
    pub fn at_most(self, columns: usize, rows: usize) -> Self {
        let (width, height) = (self.x.count, self.y.count);
        let (columns, rows) = (width.min(columns.max(1)), height.min(rows.max(1)));
        if (columns, rows) == (width, height) {
            return self;
        }
        let mut values = vec![f32::NAN; rows * columns];
        for (k, value) in self.values.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
            let kept = &mut values[k / width * rows / height * columns + k % width * columns / width];
            if kept.is_nan() || value.abs() > kept.abs() {
                *kept = *value;
            }
        }
        Self { x: CellAxis { count: columns, ..self.x }, y: CellAxis { count: rows, ..self.y }, values, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::palette::SILICONE;

    fn map(rows: usize, columns: usize, values: Vec<f32>) -> HeatMap {
        let axis = |name: &str, unit: &str, count: usize, range: [f64; 2]| CellAxis {
            name: name.to_owned(),
            unit: unit.to_owned(),
            count,
            range,
        };
        HeatMap {
            title: "left".to_owned(),
            quantity: "joint angle".to_owned(),
            unit: "°".to_owned(),
            x: axis("time", "s", columns, [0.0, 4.0]),
            y: axis("joint", "", rows, [0.5, rows as f64 + 0.5]),
            values,
            scale: ColourScale::Signed(10.0),
        }
    }

    #[test]
    fn cells_lie_between_their_edges() {
        let map = map(2, 4, vec![0.0, 1.0, 2.0, 3.0, 4.0, -5.0, f32::NAN, 7.0]);
        assert_eq!((map.x.middle(0), map.x.middle(3), map.y.middle(1)), (0.5, 3.5, 2.0));
        assert_eq!(
            [-0.1, 0.0, 0.99, 1.0, 4.0, 4.1].map(|t| map.x.cell(t)),
            [None, Some(0), Some(0), Some(1), Some(3), None]
        );
        assert_eq!(map.text(1, 1), "joint 2, time 1.50\u{a0}s: −5.00\u{a0}°");
        assert_eq!(map.text(1, 2), "joint 2, time 2.50\u{a0}s: no value");
        assert!(map.value(0, 4).is_nan() && map.value(2, 0).is_nan());
        assert_eq!(map.x.plot_axis().title, "time (s)");
        assert_eq!(map.y.plot_axis().range, Some([0.5, 2.5]));
        let [whole, cut] =
            [0.0, 80.0].map(|from| CellAxis { unit: "mm".to_owned(), range: [from, 100.0], ..map.x.clone() });
        assert!(cut.is_cut() && !whole.is_cut() && !map.y.is_cut());
    }

    #[test]
    fn peaks_survive_fewer_columns_and_gaps_stay() {
        let mut values = vec![0.25; 2 * 1000];
        values[437] = 9.0;
        values[1000 + 701] = -8.0;
        values[1000..1010].fill(f32::NAN);
        let few = map(2, 1000, values).at_most(100, 9);
        assert_eq!((few.x.count, few.values.len(), few.x.range), (100, 200, [0.0, 4.0]));
        for column in 0..100 {
            assert_eq!(few.value(0, column), if column == 43 { 9.0 } else { 0.25 });
        }
        assert!(few.value(1, 0).is_nan());
        assert_eq!((few.value(1, 1), few.value(1, 70)), (0.25, -8.0));
        // A map that is narrow enough stays.
        assert_eq!(few.clone().at_most(100, 9).x, few.x);
        // Also where the numbers do not divide: each value goes to the column that holds its middle.
        // A single loaded row among forty is seen in ten.
        let tip = map(40, 1, (0..40).map(|k| if k == 37 { 5.0 } else { 0.0 }).collect()).at_most(1, 10);
        assert_eq!((tip.y.count, tip.values[9], tip.values.iter().sum::<f32>()), (10, 5.0, 5.0));
        let uneven = map(1, 7, (0..7).map(|k| k as f32).collect()).at_most(3, 1);
        assert_eq!(uneven.values, [2.0, 4.0, 6.0]);
    }

    #[test]
    fn colours_follow_the_value_and_nothing_has_none() {
        let load = ColourScale::Load(40.0);
        assert_eq!((load.colour(0.0), load.colour(0.5)), (Some(SILICONE), Some(SILICONE)));
        assert_eq!(load.colour(80.0), load.colour(40.0));
        assert_eq!(load.colour(f32::NAN), None);
        // A confusion of one per cent is seen, and the larger, the darker.
        let share = |value| ColourScale::Share(100.0).colour(value).expect("a colour");
        assert!(share(1.0).contrast(share(0.0)) > 1.15, "{}", share(1.0).contrast(share(0.0)));
        assert!([1.0, 10.0, 50.0, 100.0].windows(2).all(|two| share(two[1]).luminance() < share(two[0]).luminance()));
        assert_eq!((load.limits(), ColourScale::Signed(2.0).limits()), ([0.0, 40.0], [-2.0, 2.0]));
        let [low, zero, high] = [-2.0, 0.0, 2.0].map(|value| ColourScale::Signed(2.0).colour(value).expect("a colour"));
        assert!(low.2 > low.0 && high.0 > high.2 && zero.0 == zero.2);
    }
}
