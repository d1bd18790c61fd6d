//! Rigid frames. A pose is named `a_from_b`: it takes coordinates in frame b to coordinates in frame a,
//! so in a product the neighbouring names must match: `a_from_c = a_from_b * b_from_c`.

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A rigid transform: rotate, then translate (m).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Origin of the inner frame in the outer frame (m).
    pub position: DVec3,
    /// Orientation of the inner frame in the outer frame (unit quaternion).
    pub rotation: DQuat,
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Pose {
    /// The pose that changes nothing.
    pub const IDENTITY: Self = Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY };

    /// A pose from its two parts; the rotation is normalised.
    pub fn new(position: DVec3, rotation: DQuat) -> Self {
        Self { position, rotation: rotation.normalize() }
    }

    /// A translation (m).
    pub fn from_position(position: DVec3) -> Self {
        Self { position, rotation: DQuat::IDENTITY }
    }

    /// URDF's convention: fixed-axis roll, pitch, yaw (rad), i.e. R = Rz(yaw) Ry(pitch) Rx(roll).
    pub fn from_xyz_rpy(xyz: DVec3, rpy: DVec3) -> Self {
        Self::new(xyz, DQuat::from_rotation_z(rpy.z) * DQuat::from_rotation_y(rpy.y) * DQuat::from_rotation_x(rpy.x))
    }

    /// The transform the other way round.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { position: rotation * -self.position, rotation }
    }

    /// Takes a point from the inner frame to the outer one.
    pub fn point(&self, inner: DVec3) -> DVec3 {
        self.position + self.rotation * inner
    }

    /// Takes a direction from the inner frame to the outer one.
    pub fn direction(&self, inner: DVec3) -> DVec3 {
        self.rotation * inner
    }

    /// The rotation as a matrix whose columns are the inner axes in the outer frame.
    pub fn matrix(&self) -> DMat3 {
        DMat3::from_quat(self.rotation)
    }

    /// True when every number in it is finite.
    pub fn is_finite(&self) -> bool {
        self.position.is_finite() && self.rotation.is_finite()
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;
    fn mul(self, inner: Self) -> Self {
        Self { position: self.point(inner.position), rotation: self.rotation * inner.rotation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_quarter_turn_and_back() {
        let a_from_b = Pose::from_xyz_rpy(DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 0.0, FRAC_PI_2));
        assert!(a_from_b.point(DVec3::X).abs_diff_eq(DVec3::new(1.0, 1.0, 0.0), 1e-15));
        let back = a_from_b.inverse() * a_from_b;
        assert!(back.position.length() < 1e-15 && back.rotation.angle_between(DQuat::IDENTITY) < 1e-7);
    }

    #[test]
    fn roll_pitch_yaw_turns_about_fixed_axes() {
        // Roll by 90 degrees takes y to z; yaw by 90 degrees then leaves z alone.
        let pose = Pose::from_xyz_rpy(DVec3::ZERO, DVec3::new(FRAC_PI_2, 0.0, FRAC_PI_2));
        assert!(pose.direction(DVec3::Y).abs_diff_eq(DVec3::Z, 1e-15));
    }
}
