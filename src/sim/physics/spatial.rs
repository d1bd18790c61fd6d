//! Velocities of rigid bodies, and blocks of inertia or stiffness over them.

use glam::{DMat3, DVec3};

/// Velocity of a rigid body: of the point at the reference, and angular.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spatial {
    pub(super) linear: DVec3,
    pub(super) angular: DVec3,
}

impl Spatial {
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self { linear: self.linear * factor, angular: self.angular * factor }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }

    pub(super) fn to_array(self) -> [f64; 6] {
        let ([a, b, c], [d, e, f]) = (self.linear.to_array(), self.angular.to_array());
        [a, b, c, d, e, f]
    }

    /// Power of a wrench on a body with this velocity.
    pub(super) fn dot(&self, wrench: &Self) -> f64 {
        self.linear.dot(wrench.linear) + self.angular.dot(wrench.angular)
    }
}

/// A symmetric 6 x 6 block over (linear, angular), as contacts at different arms add up to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) linear: DMat3,
    /// Angular rows, linear columns.
    pub(super) mixed: DMat3,
    pub(super) angular: DMat3,
}

impl Block {
    pub(super) const ZERO: Self = Self { linear: DMat3::ZERO, mixed: DMat3::ZERO, angular: DMat3::ZERO };

    /// Adds a contact's 3 x 3 Hessian G at an arm r: J' G J with J = [1, -[r]x].
    #[inline]
    pub(super) fn add_at(&mut self, g: &DMat3, arm: DVec3) {
        let crossed = |m: &DMat3| DMat3::from_cols(arm.cross(m.x_axis), arm.cross(m.y_axis), arm.cross(m.z_axis));
        let mixed = crossed(g);
        self.linear += *g;
        self.mixed += mixed;
        self.angular += crossed(&mixed.transpose());
    }

    #[inline]
    pub(super) fn add(&mut self, other: &Self) {
        self.linear += other.linear;
        self.mixed += other.mixed;
        self.angular += other.angular;
    }

    #[inline]
    pub(super) fn times(&self, x: &Spatial) -> Spatial {
        Spatial {
            linear: self.linear * x.linear + self.mixed.transpose() * x.angular,
            angular: self.mixed * x.linear + self.angular * x.angular,
        }
    }
}
