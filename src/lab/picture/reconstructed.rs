//! A real finger reconstructed from its flex strip: bent evenly, because one strip reads one number.

use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Phase, Side, Sway};

/// A frame in which each finger is an arc of the curvature that its strip reads (1/m); straight where nothing is read.
pub(crate) fn evenly_bent(gripper: &GripperModel, curvature: [Option<f64>; 2]) -> Frame {
    let (joints, segment) = (gripper.finger.joints, gripper.finger.segment_length());
    let angle = |side: Side| curvature[side.index()].filter(|kappa| kappa.is_finite()).unwrap_or(0.0) * segment;
    let q = Side::BOTH.into_iter().flat_map(|side| std::iter::repeat_n(angle(side), joints)).collect();
    Frame {
        sample: 0,
        t: 0.0,
        line_bar: 0.0,
        phase: Phase::Close,
        q,
        sways: [Sway::NONE; 2],
        hand: glam::DVec3::ZERO,
        world_from_object: None,
        taxels: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_tactile::{Sensors, SignalDefinition};

    #[test]
    fn a_reconstructed_finger_has_the_curvature_of_its_strip() {
        let gripper = GripperModel::default();
        let sensors = Sensors::whole_fingers(&gripper, SignalDefinition::Parts);
        for curvature in [[0.0, 5.0], [-3.0, 12.0]] {
            let read = sensors.read(&evenly_bent(&gripper, curvature.map(Some)));
            for (read, wanted) in read.iter().zip(curvature) {
                assert!(
                    (read.expect("a number") - wanted).abs() <= 1e-3 * wanted.abs(),
                    "{read:?} instead of {wanted}"
                );
            }
        }
        let unread = evenly_bent(&gripper, [None, Some(f64::NAN)]);
        assert!(unread.q.iter().all(|q| *q == 0.0));
    }
}
