//! Mass, centre of mass and inertia of a solid of even density (parry3d does the integrals).

use super::{Pose, TriMesh};
use glam::{DMat3, DVec3, Vec3};

/// Mass properties of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass (m).
    pub centre: DVec3,
    /// Inertia about the centre of mass, in the axes of the frame the body is given in (kg m²).
    pub inertia: DMat3,
}

impl MassProperties {
    /// A body of no mass.
    pub const ZERO: Self = Self { mass: 0.0, centre: DVec3::ZERO, inertia: DMat3::ZERO };

    /// The same body with another mass of the same distribution.
    pub fn with_mass(self, mass: f64) -> Self {
        Self { mass, centre: self.centre, inertia: self.inertia * (mass / self.mass) }
    }

    /// The same body seen from an outer frame.
    pub fn seen_from(&self, outer_from_body: &Pose) -> Self {
        let r = outer_from_body.matrix();
        Self { mass: self.mass, centre: outer_from_body.point(self.centre), inertia: r * self.inertia * r.transpose() }
    }

    /// Two bodies welded together (parallel-axis theorem).
    pub fn welded_to(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return Self::ZERO;
        }
        let centre = (self.centre * self.mass + other.centre * other.mass) / mass;
        let about = |body: &Self| {
            let r = body.centre - centre;
            let steiner =
                DMat3::from_diagonal(DVec3::splat(r.length_squared())) - DMat3::from_cols(r * r.x, r * r.y, r * r.z);
            body.inertia + steiner * body.mass
        };
        Self { mass, centre, inertia: about(self) + about(other) }
    }

    /// True for what a real body can have: positive finite mass, an inertia that is symmetric, positive and
    /// obeys the triangle inequality of principal moments (with 1 % slack for rounded files).
    pub fn is_physical(&self) -> bool {
        let m = self.inertia;
        let finite = self.mass.is_finite() && self.centre.is_finite() && m.is_finite();
        if !finite || self.mass <= 0.0 {
            return false;
        }
        let (xx, yy, zz) = (m.x_axis.x, m.y_axis.y, m.z_axis.z);
        let scale = xx.max(yy).max(zz);
        let symmetric = (m - m.transpose()).abs_diff_eq(DMat3::ZERO, 1e-9 * scale);
        // J = tr(I)/2 - I is the second-moment matrix, which must be positive definite up to rounding.
        let second_moment = DMat3::from_diagonal(DVec3::splat(0.5 * (xx + yy + zz))) - m;
        let slack = second_moment + DMat3::from_diagonal(DVec3::splat(0.01 * scale));
        symmetric && scale > 0.0 && is_positive_definite(&slack)
    }
}

fn is_positive_definite(m: &DMat3) -> bool {
    let minor = m.x_axis.x * m.y_axis.y - m.y_axis.x * m.x_axis.y;
    m.x_axis.x > 0.0 && minor > 0.0 && m.determinant() > 0.0
}

/// Mass properties of a closed, outward-facing mesh filled at `density` (kg/m³).
pub fn mass_properties(mesh: &TriMesh, density: f64) -> MassProperties {
    // parry works in single precision: bring the mesh to unit size about its middle first.
    let bounds = mesh.bounds();
    let size = bounds.size().max_element();
    if size <= 0.0 || !size.is_finite() {
        return MassProperties::ZERO;
    }
    let points: Vec<Vec3> = mesh.points.iter().map(|p| ((*p - bounds.centre()) / size).as_vec3()).collect();
    let unit = parry3d::mass_properties::MassProperties::from_trimesh(1.0, &points, &mesh.triangles);
    let inertia = unit.reconstruct_inertia_matrix().as_dmat3();
    let symmetric = (inertia + inertia.transpose()) * 0.5;
    MassProperties {
        mass: f64::from(unit.mass()) * size.powi(3) * density,
        centre: bounds.centre() + unit.local_com.as_dvec3() * size,
        inertia: symmetric * size.powi(5) * density,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Primitive;

    #[test]
    fn a_brick_away_from_the_origin() {
        let half = DVec3::new(0.03, 0.02, 0.01);
        let mut mesh = Primitive::Cuboid { half }.tessellate();
        let shift = Pose::from_position(DVec3::new(0.5, -0.2, 0.1));
        mesh.transform(&shift);
        let got = mass_properties(&mesh, 800.0);
        let want = Primitive::Cuboid { half }.mass_properties();
        assert!((got.mass / (800.0 * want.mass) - 1.0).abs() < 1e-5);
        assert!(got.centre.abs_diff_eq(shift.position, 1e-7));
        assert!(got.inertia.abs_diff_eq(want.inertia * 800.0, 1e-5 * 800.0 * want.inertia.x_axis.x));
    }

    #[test]
    fn two_halves_weld_to_the_whole() {
        let half = Primitive::Cuboid { half: DVec3::new(0.5, 1.0, 1.0) }.mass_properties();
        let at = |x: f64| half.seen_from(&Pose::from_position(DVec3::new(x, 0.0, 0.0)));
        let whole = at(-0.5).welded_to(&at(0.5));
        let cube = Primitive::Cuboid { half: DVec3::ONE }.mass_properties();
        assert!((whole.mass - cube.mass).abs() < 1e-12 && whole.centre.length() < 1e-15);
        assert!(whole.inertia.abs_diff_eq(cube.inertia, 1e-12));
    }

    #[test]
    fn nonsense_is_recognised() {
        let sound = Primitive::Sphere { radius: 1.0 }.mass_properties();
        assert!(sound.is_physical());
        assert!(!MassProperties { mass: 0.0, ..sound }.is_physical());
        assert!(!MassProperties { mass: f64::NAN, ..sound }.is_physical());
        // The moments (1, 1, 3) break the triangle inequality.
        let impossible = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 3.0));
        assert!(!MassProperties { inertia: impossible, ..sound }.is_physical());
        assert!(!MassProperties { inertia: DMat3::ZERO, ..sound }.is_physical());
    }
}
