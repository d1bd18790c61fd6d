//! The room of a plot's axes on the page.

use super::labels::Box2;
use palpate_geometry::drawing::Plot;
use std::ops::RangeInclusive;

/// Size of small text (points per em).
pub(super) const SMALL: f64 = 11.0;

/// Axes on the page.
pub(super) struct Frame {
    pub(super) room: Box2,
    pub(super) x: RangeInclusive<f64>,
    pub(super) y: RangeInclusive<f64>,
}

impl Frame {
    /// Place of coordinates on the page.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |range: &RangeInclusive<f64>, c: f64| (c - range.start()) / (range.end() - range.start());
        let [low, high] = self.room;
        [low[0] + share(&self.x, x) * (high[0] - low[0]), high[1] - share(&self.y, y) * (high[1] - low[1])]
    }

    /// Place of values of a plot; `None` outside of the axes.
    pub(super) fn of(&self, plot: &Plot, at: [f64; 2]) -> Option<[f64; 2]> {
        let place = plot.place(at)?;
        (self.x.contains(&place[0]) && self.y.contains(&place[1])).then(|| self.at(place))
    }
}
