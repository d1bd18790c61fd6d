//! What the geometry encoder measures: the quantities, true values and estimates of them, and how far estimates are off.

use crate::data::Sequence;
use crate::pmf::Pmf;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Quantity that the encoder estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Measure {
    /// Shortest side of the box around the object (m).
    Short,
    /// Its middle side (m).
    Middle,
    /// Its longest side (m).
    Long,
    /// Extent between the fingers, along the way on which they close (m).
    Width,
    /// Extent across the fingers (m).
    Depth,
    /// Extent along the gripper's axis (m).
    Height,
    /// Distance of its middle from the middle between the fingers (m).
    Aside,
    /// Distance of its middle from the plane in which the fingers bend (m).
    Across,
    /// Distance of its middle from the palm (m).
    Below,
    /// Mass (kg).
    Mass,
}

impl Measure {
    /// All, in the order of the network's outputs.
    pub const ALL: [Self; 10] = [
        Self::Short,
        Self::Middle,
        Self::Long,
        Self::Width,
        Self::Depth,
        Self::Height,
        Self::Aside,
        Self::Across,
        Self::Below,
        Self::Mass,
    ];

    /// True for quantities that are estimated on a logarithmic scale.
    pub(super) fn is_logarithmic(self) -> bool {
        !matches!(self, Self::Aside | Self::Across | Self::Below)
    }

    pub(super) fn on_scale(self, x: f64) -> f64 {
        if self.is_logarithmic() { x.max(1e-6).ln() } else { x }
    }

    pub(super) fn off_scale(self, x: f64) -> f64 {
        if self.is_logarithmic() { x.exp() } else { x }
    }
}

/// True geometry of a grasped object.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// Value of each of [`Measure::ALL`].
    pub values: [f64; Measure::ALL.len()],
    /// Approximate shape, an index into the encoder's shapes; `None` if unknown.
    pub shape: Option<usize>,
}

/// Grasp of an object of known geometry.
#[derive(Clone, Debug)]
pub struct Touch {
    /// Readings.
    pub grasp: Arc<Sequence>,
    /// The object.
    pub geometry: Geometry,
    /// Number of the object: grasps of one object are held out together.
    pub object: usize,
}

/// Estimate of one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasureEstimate {
    /// The quantity.
    pub measure: Measure,
    /// Median (m or kg).
    pub value: f64,
    /// Ends of the range that holds the true value with 90 % probability (m or kg).
    pub range: [f64; 2],
}

/// The lower end of a range that is so many times as long is not felt: fingers that meet feel alike on all that is thinner.
const VAGUE: f64 = 3.0;
/// Opening of the gripper whose grasps the encoder has learned (m): nothing wider stood between its fingers.
const OPENING: f64 = 0.084;

impl MeasureEstimate {
    /// The ends of its range that are felt (m). The upper end of a height is that of the objects that were learned, for nothing
    /// touches what stands out above and below the pads; a bottle is longer. So is that of a width above the opening of the
    /// gripper.
    pub fn felt(&self) -> [Option<f64>; 2] {
        let [from, to] = self.range;
        match self.measure {
            Measure::Height => [Some(from), None],
            Measure::Width if to > OPENING => [Some(from), None],
            _ if to > VAGUE * from => [None, Some(to)],
            _ => [Some(from), Some(to)],
        }
    }

    /// A length in words: `34 mm (30 to 38)`, with `between` between the ends; `over 16 mm` or `under 30 mm` where one end is
    /// felt.
    pub fn words(&self, between: &str) -> String {
        let (value, ends) = (self.value * 1e3, self.felt().map(|end| end.map(|x| x * 1e3)));
        match ends {
            [Some(from), Some(to)] => format!("{value:.0} mm ({from:.0}{between}{to:.0})"),
            [Some(from), None] => format!("over {from:.0} mm"),
            [None, Some(to)] => format!("under {to:.0} mm"),
            [None, None] => String::new(),
        }
    }
}

/// What one grasp tells about the geometry of the object.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Estimate of each of [`Measure::ALL`].
    pub estimates: Vec<MeasureEstimate>,
    /// Probability of each of the encoder's shapes.
    pub shape: Pmf,
}

impl Measured {
    /// The estimate of a quantity.
    pub fn of(&self, measure: Measure) -> Option<&MeasureEstimate> {
        self.estimates.iter().find(|estimate| estimate.measure == measure)
    }

    /// The same, but no height between fingers that may touch each other.
    pub fn felt(&self, measure: Measure) -> Option<&MeasureEstimate> {
        let may_meet = self.of(Measure::Width).is_some_and(|width| width.felt()[0].is_none());
        self.of(measure).filter(|_| measure != Measure::Height || !may_meet)
    }
}

/// How far estimates of a quantity are off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasureScore {
    /// The quantity.
    pub measure: Measure,
    /// Median distance from the true value (m or kg).
    pub median_error: f64,
    /// Share of grasps whose 90 % range holds it.
    pub inside: f64,
}

/// How far the estimates on some grasps are off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GeometryScores {
    /// Each of [`Measure::ALL`].
    pub measures: Vec<MeasureScore>,
    /// Share of grasps whose shape is recognised.
    pub shape: f64,
    /// Number of grasps.
    pub grasps: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_of_which_little_is_known_has_no_number_in_its_middle() {
        let of =
            |measure: Measure, value: f64, range: [f64; 2]| MeasureEstimate { measure, value, range }.words(" to ");
        assert_eq!(of(Measure::Width, 0.034, [0.030, 0.038]), "34 mm (30 to 38)");
        assert_eq!(of(Measure::Width, 0.016, [0.008, 0.030]), "under 30 mm", "the fingers may touch each other");
        assert_eq!(of(Measure::Width, 0.085, [0.082, 0.088]), "over 82 mm", "as wide as the hand opens, or wider");
        assert_eq!(of(Measure::Width, 0.0, [0.0, 0.0]), "0 mm (0 to 0)");
        assert_eq!(of(Measure::Height, 0.010, [0.007, 0.013]), "over 7 mm", "an egg cup stands out of the hand");
        let estimate = |measure, range| MeasureEstimate { measure, value: 0.010, range };
        let tells_height = |width: [f64; 2]| {
            let estimates = vec![estimate(Measure::Width, width), estimate(Measure::Height, [0.007, 0.013])];
            let measured = Measured { estimates, shape: Pmf::uniform(2) };
            measured.felt(Measure::Height).is_some()
        };
        assert_eq!([[0.008, 0.030], [0.030, 0.038]].map(tells_height), [false, true]);
    }
}
