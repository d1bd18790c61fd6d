//! Place of the flex strip on the back of each finger (paper, section IV-B: Spectra Symbol FS-L-0055-253-ST).
//!
//! The part is 77.6 mm long and measures over 55.37 mm of that; its contacts stand at the palm. The 22.2 mm between are
//! crimp and carrier, so that it measures the bend from 22.2 mm to 77.6 mm of the finger: the middle of one of 100 mm.

use super::{Auto, Finger};
use serde::{Deserialize, Serialize};

/// Stretch of each finger over which its flex strip measures the bend.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Strip {
    /// Beginning of the active length, from the palm (m); `auto` is [`Strip::LEAD`], less where the strip would otherwise
    /// end beyond the tip.
    pub from_m: Auto,
    /// Active length (m); `auto` is [`Strip::ACTIVE_LENGTH`], or the whole finger where that is shorter.
    pub length_m: Auto,
}

impl Strip {
    /// Active length of the paper's part (m): code 0055 of its order number.
    pub const ACTIVE_LENGTH: f64 = 0.055_37;
    /// Length of the part between its contacts and the active length (m): 77.6 mm less that.
    pub const LEAD: f64 = 0.0776 - Self::ACTIVE_LENGTH;

    /// Beginning and end of the active length on a finger, from the palm (m).
    pub fn reach(&self, finger: &Finger) -> [f64; 2] {
        let length = self.length_m.value().unwrap_or(Self::ACTIVE_LENGTH.min(finger.length));
        let from = self.from_m.value().unwrap_or_else(|| Self::LEAD.min(finger.length - length).max(0.0));
        [from, from + length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_part_lies_on_the_middle_of_the_finger_and_on_short_ones_nearer_to_the_palm() {
        let reach = |strip: &Strip, length: f64| strip.reach(&Finger { length, ..Finger::default() }).map(|m| 1e3 * m);
        let near = |[from, to]: [f64; 2], wanted: [f64; 2]| {
            assert!((from - wanted[0]).abs() < 1e-9 && (to - wanted[1]).abs() < 1e-9, "{from} {to}");
        };
        let auto = Strip::default();
        near(reach(&auto, 0.1), [22.23, 77.6]);
        near(reach(&auto, 0.07), [14.63, 70.0]);
        near(reach(&auto, 0.04), [0.0, 40.0]);
        let whole = Strip { length_m: Auto::Value(0.1), ..auto.clone() };
        near(reach(&whole, 0.1), [0.0, 100.0]);
        near(reach(&Strip { from_m: Auto::Value(0.0), ..auto }, 0.1), [0.0, 55.37]);
    }
}
