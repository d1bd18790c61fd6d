//! Fixed environment of the gripper: table and pedestal, in the gripper frame.

use crate::scene::{Support, SupportKind};
use glam::{DMat3, DVec3};
use palpate_geometry::{Pose, Primitive};
use std::f64::consts::TAU;

/// Contact points on the rim of the pedestal, for overhanging objects. With 24, a cylinder lying across a 16 mm
/// pedestal sinks by at most 0.07 mm between two of them.
const RIM_POINTS: usize = 24;

/// Table and pedestal as one solid.
#[derive(Clone, Debug)]
pub(super) struct Environment {
    table: Option<Plane>,
    pedestal: Option<Pedestal>,
    /// Height of the highest surface above the world's origin (m).
    top: f64,
    gripper_from_world: Pose,
}

/// Motion of the surroundings in the hand's frame over a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Passing {
    /// Displacement at the start of the step (m).
    pub(super) place: DVec3,
    /// Velocity at the end of the step (m/s).
    pub(super) velocity: DVec3,
    /// Acceleration of the hand over the step (m/s²).
    pub(super) acceleration: DVec3,
}

#[derive(Clone, Copy, Debug)]
struct Plane {
    up: DVec3,
    offset: f64,
}

#[derive(Clone, Debug)]
struct Pedestal {
    shape: Primitive,
    /// Rotation from the gripper's axes to the shape's, and the gripper's origin there.
    axes: DMat3,
    origin: DVec3,
    rim: Vec<DVec3>,
}

impl Environment {
    pub(super) fn new(support: &Support, world_from_gripper: &Pose) -> Self {
        let gripper_from_world = world_from_gripper.inverse();
        let up = gripper_from_world.direction(DVec3::Z);
        let table =
            (support.kind != SupportKind::None).then(|| Plane { up, offset: gripper_from_world.position.dot(up) });
        let pedestal = (support.kind == SupportKind::Pedestal).then(|| {
            let half_length = 0.5 * support.height;
            let gripper_from_shape = gripper_from_world * Pose::from_position(DVec3::Z * half_length);
            let rim = (0..RIM_POINTS).map(|k| {
                let (sin, cos) = (TAU * k as f64 / RIM_POINTS as f64).sin_cos();
                let r = support.radius;
                gripper_from_world.point(DVec3::new(r * cos, r * sin, support.height))
            });
            let shape_from_gripper = gripper_from_shape.inverse();
            Pedestal {
                shape: Primitive::Cylinder { radius: support.radius, half_length },
                axes: shape_from_gripper.matrix(),
                origin: shape_from_gripper.position,
                rim: rim.collect(),
            }
        });
        Self { table, top: if pedestal.is_some() { support.height } else { 0.0 }, pedestal, gripper_from_world }
    }

    /// Becomes another one shifted by a way (m), without allocating.
    pub(super) fn shifted(&mut self, original: &Self, by: DVec3) {
        self.gripper_from_world.position = original.gripper_from_world.position + by;
        self.table = original.table.map(|plane| Plane { offset: plane.offset + by.dot(plane.up), ..plane });
        if let (Some(own), Some(other)) = (&mut self.pedestal, &original.pedestal) {
            own.origin = other.origin - other.axes * by;
            for (own, other) in own.rim.iter_mut().zip(&other.rim) {
                *own = *other + by;
            }
        }
    }

    /// Displacement from another one (m).
    pub(super) fn way_from(&self, original: &Self) -> DVec3 {
        self.gripper_from_world.position - original.gripper_from_world.position
    }

    /// True when there is nothing to touch.
    pub(super) fn is_empty(&self) -> bool {
        self.table.is_none() && self.pedestal.is_none()
    }

    /// Distance (m) to the nearest surface, negative inside; infinite when there is nothing.
    #[inline]
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        let table = self.table.map_or(f64::INFINITY, |plane| plane.up.dot(p) - plane.offset);
        match &self.pedestal {
            Some(column) => table.min(column.shape.distance(column.axes * p + column.origin)),
            None => table,
        }
    }

    /// Outward normal of the surface nearest to a point.
    pub(super) fn normal(&self, p: DVec3) -> DVec3 {
        let up = self.gripper_from_world.direction(DVec3::Z);
        let table = self.table.map_or(f64::INFINITY, |plane| plane.up.dot(p) - plane.offset);
        match &self.pedestal {
            Some(column) => {
                let local = column.axes * p + column.origin;
                if column.shape.distance(local) < table {
                    column.axes.transpose() * column.shape.gradient(local)
                } else {
                    up
                }
            }
            None => up,
        }
    }

    /// Unit vector against gravity.
    pub(super) fn up(&self) -> DVec3 {
        self.gripper_from_world.direction(DVec3::Z)
    }

    /// Height of a point above the highest surface (m); negative below it, where only part of the environment is.
    pub(super) fn height_above_top(&self, p: DVec3) -> f64 {
        self.up().dot(p - self.gripper_from_world.position) - self.top
    }

    /// Points on the pedestal's upper edge.
    pub(super) fn rim(&self) -> &[DVec3] {
        self.pedestal.as_ref().map_or(&[], |column| &column.rim)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pedestal_on_a_table_seen_from_above() {
        let world_from_gripper = Pose::from_xyz_rpy(DVec3::new(0.01, 0.0, 0.2), DVec3::new(0.0, 0.0, 0.7));
        let environment = Environment::new(&Support::default(), &world_from_gripper);
        let at = |world: DVec3| world_from_gripper.inverse().point(world);
        let (height, radius) = (Support::default().height, Support::default().radius);
        assert!((environment.distance(at(DVec3::Z * (height + 0.005))) - 0.005).abs() < 1e-12);
        assert!((environment.distance(at(DVec3::new(0.3, 0.0, 0.02))) - 0.02).abs() < 1e-12);
        assert!((environment.distance(at(DVec3::new(0.0, radius + 0.003, 0.5 * height))) - 0.003).abs() < 1e-12);
        let sideways = world_from_gripper.direction(environment.normal(at(DVec3::new(0.0, radius + 0.003, 0.03))));
        assert!(sideways.abs_diff_eq(DVec3::Y, 1e-12));
        assert!((environment.height_above_top(at(DVec3::Z * (height + 0.005))) - 0.005).abs() < 1e-12);
        assert_eq!(environment.rim().len(), RIM_POINTS);
        // Moved in the gripper's frame, everything is where it was seen from a gripper that moved the other way.
        let by = DVec3::new(0.004, -0.03, 0.002);
        let mut moved = environment.clone();
        moved.shifted(&environment, by);
        assert!(moved.way_from(&environment).abs_diff_eq(by, 1e-15));
        for p in [DVec3::new(0.01, 0.02, -0.1), DVec3::new(-0.02, 0.0, -0.16), DVec3::new(0.0, 0.05, -0.19)] {
            assert!((moved.distance(p + by) - environment.distance(p)).abs() < 1e-12);
            assert!(moved.normal(p + by).abs_diff_eq(environment.normal(p), 1e-12));
            assert!((moved.height_above_top(p + by) - environment.height_above_top(p)).abs() < 1e-12);
        }
        assert!(moved.rim()[3].abs_diff_eq(environment.rim()[3] + by, 1e-15));
    }
}
