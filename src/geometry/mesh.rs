//! Triangle meshes as plain data (m).

use super::Pose;
use glam::DVec3;

/// A triangle soup with shared corners: what files hold and what repair works on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Corner positions (m).
    pub points: Vec<DVec3>,
    /// Corner indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// The three corners of a triangle (m).
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| self.points[i as usize])
    }

    /// Volume enclosed (m³): positive when the triangles face outward. Meaningful for closed meshes only.
    pub fn signed_volume(&self) -> f64 {
        self.signed_volume_of(&self.triangles)
    }

    /// The share of some of the triangles in [`TriMesh::signed_volume`] (m³).
    pub(super) fn signed_volume_of(&self, triangles: &[[u32; 3]]) -> f64 {
        let six_volumes: f64 = triangles.iter().map(|t| self.corners(*t)).map(|[a, b, c]| a.dot(b.cross(c))).sum();
        six_volumes / 6.0
    }

    /// Bounding box of the points (m).
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.points.iter().copied())
    }

    /// Moves every point.
    pub fn transform(&mut self, outer_from_inner: &Pose) {
        for p in &mut self.points {
            *p = outer_from_inner.point(*p);
        }
    }

    /// Scales every point about the origin, axis by axis. A mirroring scale keeps the triangles facing outward.
    pub fn scale(&mut self, factors: DVec3) {
        for p in &mut self.points {
            *p *= factors;
        }
        if factors.x * factors.y * factors.z < 0.0 {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
    }

    /// Adds another mesh's triangles.
    pub fn append(&mut self, other: &Self) {
        let offset = self.points.len() as u32;
        self.points.extend_from_slice(&other.points);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + offset)));
    }
}

/// An axis-aligned box (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Bounds {
    /// The box that holds nothing: it grows to the first point added.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest box around some points.
    pub fn of(points: impl Iterator<Item = DVec3>) -> Self {
        points.fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around two boxes.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box grown by a margin on every side (m).
    pub fn grown(self, margin: f64) -> Self {
        Self { min: self.min - DVec3::splat(margin), max: self.max + DVec3::splat(margin) }
    }

    /// Edge lengths (m); zero for the empty box.
    pub fn size(&self) -> DVec3 {
        (self.max - self.min).max(DVec3::ZERO)
    }

    /// Middle of the box (m).
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Distance from a point to the box (m); zero inside.
    pub fn distance(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Primitive;

    #[test]
    fn a_mirrored_box_still_faces_outward() {
        let mut mesh = Primitive::Cuboid { half: DVec3::splat(0.5) }.tessellate();
        assert!((mesh.signed_volume() - 1.0).abs() < 1e-12);
        mesh.scale(DVec3::new(-2.0, 1.0, 1.0));
        assert!((mesh.signed_volume() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn distance_to_a_box() {
        let unit = Bounds { min: DVec3::ZERO, max: DVec3::ONE };
        assert_eq!(unit.distance(DVec3::new(0.5, 0.2, 0.9)), 0.0);
        assert_eq!(unit.distance(DVec3::new(4.0, 5.0, 1.0)), 5.0);
    }
}
