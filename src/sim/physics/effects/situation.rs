//! Inputs of the effect rules: scene, object, placement, and the few quantities that several effects need.

use crate::gripper::{Finger, GripperModel};
use crate::objects::ObjectModel;
use crate::physics::placement::Placement;
use crate::scene::Scene;

/// A scene about to be built.
pub(super) struct Situation<'a> {
    pub(super) scene: &'a Scene,
    pub(super) object: Option<&'a ObjectModel>,
    pub(super) placement: &'a Placement,
}

impl Situation<'_> {
    pub(super) fn gripper(&self) -> &GripperModel {
        &self.scene.gripper
    }

    pub(super) fn finger(&self) -> &Finger {
        &self.scene.gripper.finger
    }

    /// The object, where it can move.
    pub(super) fn free_object(&self) -> Option<&ObjectModel> {
        self.object.filter(|_| !self.scene.holds_object())
    }

    /// Torque on every joint at the programme's peak (N m).
    pub(super) fn peak_torque(&self) -> f64 {
        self.gripper().actuation.torque(self.scene.programme.peak_bar).abs()
    }

    /// Force with which a straight finger's tip presses against a wall at the programme's peak (N): the moment alone
    /// would move the tip of a cantilever by M L² / 2 E I, a force takes back F L³ / 3 E I, hence F = 3 M / 2 L.
    pub(super) fn grip_force(&self) -> f64 {
        1.5 * self.peak_torque() / self.finger().length
    }

    /// Length of the closing (s), within the trial.
    pub(super) fn closing_s(&self) -> f64 {
        let ticks = f64::from(self.scene.programme.close_ticks());
        (ticks / f64::from(self.scene.timing.actuation_hz)).min(self.scene.timing.duration_s)
    }

    /// Length of the release (s).
    pub(super) fn release_s(&self) -> f64 {
        f64::from(self.scene.programme.release_ticks()) / f64::from(self.scene.timing.actuation_hz)
    }

    /// Length of the hold (s), within the trial.
    pub(super) fn hold_s(&self) -> f64 {
        let hold = f64::from(self.scene.programme.hold_ticks) / f64::from(self.scene.timing.actuation_hz);
        hold.min(self.scene.timing.duration_s - self.closing_s())
    }
}
