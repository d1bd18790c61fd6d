//! Signed distance to a solid (m), negative inside: in closed form for one primitive, otherwise from a baked grid.

use super::{Bounds, Pose, Primitive};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Signed distance of a solid, as contact detection reads it. Points are in the solid's own frame.
#[derive(Clone, Debug)]
pub enum DistanceField {
    /// One primitive somewhere in the frame, exact.
    Primitive {
        /// The shape, centred in its own frame.
        shape: Primitive,
        /// Rotation from the solid's axes to the shape's.
        axes: DMat3,
        /// Origin of the solid's frame in the shape's (m).
        origin: DVec3,
    },
    /// Anything else, sampled.
    Grid(Arc<DistanceGrid>),
}

impl DistanceField {
    /// A primitive placed in the solid's frame.
    pub fn primitive(shape: Primitive, solid_from_shape: &Pose) -> Self {
        let shape_from_solid = solid_from_shape.inverse();
        Self::Primitive { shape, axes: shape_from_solid.matrix(), origin: shape_from_solid.position }
    }

    /// Signed distance (m). Near the surface it is the distance; farther away it may be a lower bound, which is
    /// all that sphere tracing needs.
    #[inline]
    pub fn distance(&self, p: DVec3) -> f64 {
        match self {
            Self::Primitive { shape, axes, origin } => shape.distance(*axes * p + *origin),
            Self::Grid(grid) => grid.distance(p),
        }
    }

    /// Signed distance (m) and outward unit normal near the surface, smooth where the solid is.
    #[inline]
    pub fn surface(&self, p: DVec3) -> (f64, DVec3) {
        match self {
            Self::Primitive { shape, axes, origin } => {
                let local = *axes * p + *origin;
                (shape.distance(local), axes.transpose() * shape.gradient(local))
            }
            Self::Grid(grid) => grid.surface(p),
        }
    }

    /// Radius (m) of a ball about `centre` that holds the solid.
    pub fn radius_about(&self, centre: DVec3) -> f64 {
        let (bounds, c) = match self {
            Self::Primitive { shape, axes, origin } => (shape.bounds(), *axes * centre + *origin),
            Self::Grid(grid) => (grid.solid, centre),
        };
        (bounds.max - c).abs().max((bounds.min - c).abs()).length()
    }
}

/// Signed distances on a regular grid, read by trilinear interpolation.
///
/// The error of a smooth surface of radius R is about cell² / (8 R): 4 µm for 0.75 mm cells on a 20 mm ball.
/// Edges are rounded at about half a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceGrid {
    /// Position of the first node (m).
    pub origin: DVec3,
    /// Lattice spacing (m).
    pub cell: f64,
    /// Nodes along x, y, z; at least two each.
    pub size: [usize; 3],
    /// Distances (m), z fastest.
    pub values: Vec<f32>,
    /// Bounding box of the solid itself, inside the grid.
    pub solid: Bounds,
}

impl DistanceGrid {
    /// Position of a node (m).
    pub fn node(&self, index: [usize; 3]) -> DVec3 {
        self.origin + DVec3::from_array(index.map(|i| i as f64)) * self.cell
    }

    /// Signed distance; outside the grid a lower bound.
    #[inline]
    pub fn distance(&self, p: DVec3) -> f64 {
        self.interpolated(p).unwrap_or_else(|| self.distance_outside(p))
    }

    /// Distance by trilinear interpolation, inside the grid (m).
    #[inline]
    pub(super) fn interpolated(&self, p: DVec3) -> Option<f64> {
        let (c, t) = self.corner_values(p)?;
        let near = lerp(lerp(c[0], c[1], t.z), lerp(c[2], c[3], t.z), t.y);
        let far = lerp(lerp(c[4], c[5], t.z), lerp(c[6], c[7], t.z), t.y);
        Some(lerp(near, far, t.x))
    }

    /// The distance at the border less the way to it, or that to the solid's box, if that is more.
    #[cold]
    fn distance_outside(&self, p: DVec3) -> f64 {
        let to_box = self.solid.distance(p);
        if !p.is_finite() {
            return to_box;
        }
        let span = DVec3::from_array(self.size.map(|n| (n - 1) as f64)) * self.cell;
        let border = p.clamp(self.origin, self.origin + span * (1.0 - 1e-12));
        let inside = border.max(self.origin + 1e-9 * self.cell).min(self.origin + span - 1e-9 * self.cell);
        self.interpolated(inside).map_or(to_box, |distance| to_box.max(distance - (p - inside).length()))
    }

    /// Distance and its gradient from a quadratic B-spline through 27 nodes. Both are continuous, where the gradient
    /// of a trilinear interpolation jumps from cell to cell, which a contact feels as an edge.
    #[inline]
    pub fn surface(&self, p: DVec3) -> (f64, DVec3) {
        let u = (p - self.origin) / self.cell;
        let last = DVec3::from_array(self.size.map(|n| n as f64 - 1.5));
        if !(u.cmpge(DVec3::splat(0.5)).all() && u.cmplt(last).all()) {
            let outward = (p - p.clamp(self.solid.min, self.solid.max)).normalize_or(DVec3::Z);
            return (self.distance(p), outward);
        }
        let nearest = [u.x, u.y, u.z].map(|u| (u + 0.5) as usize);
        let t = u - DVec3::from_array(nearest.map(|i| i as f64));
        // Weights of the three nodes along an axis, and their slopes.
        let weights =
            |t: f64| ([0.5 * (0.5 - t).powi(2), 0.75 - t * t, 0.5 * (0.5 + t).powi(2)], [t - 0.5, -2.0 * t, t + 0.5]);
        let ((wx, dx), (wy, dy), (wz, dz)) = (weights(t.x), weights(t.y), weights(t.z));
        let row = self.size[2];
        let sheet = row * self.size[1];
        let base = (nearest[0] - 1) * sheet + (nearest[1] - 1) * row + nearest[2] - 1;
        // Every line of three nodes lies within this.
        let around = &self.values[base..][..2 * (sheet + row) + 3];
        let (mut distance, mut gradient) = (0.0, DVec3::ZERO);
        for i in 0..3 {
            let (mut value, mut slope_y, mut slope_z) = (0.0, 0.0, 0.0);
            for j in 0..3 {
                let nodes = &around[i * sheet + j * row..][..3];
                let [a, b, c] = [nodes[0], nodes[1], nodes[2]].map(f64::from);
                let line = wz[0] * a + wz[1] * b + wz[2] * c;
                value += wy[j] * line;
                slope_y += dy[j] * line;
                slope_z += wy[j] * (dz[0] * a + dz[1] * b + dz[2] * c);
            }
            distance += wx[i] * value;
            gradient += DVec3::new(dx[i] * value, wx[i] * slope_y, wx[i] * slope_z);
        }
        (distance, gradient / self.cell)
    }

    /// The eight values around a point (z fastest, then y, then x) and where in the cell it lies.
    #[inline]
    fn corner_values(&self, p: DVec3) -> Option<([f64; 8], DVec3)> {
        let u = (p - self.origin) / self.cell;
        let last = DVec3::from_array(self.size.map(|n| (n - 1) as f64));
        // Written so that NaN falls outside.
        if !(u.cmpge(DVec3::ZERO).all() && u.cmplt(last).all()) {
            return None;
        }
        let (i, j, k) = (u.x as usize, u.y as usize, u.z as usize);
        let t = u - DVec3::new(i as f64, j as f64, k as f64);
        let row = self.size[2];
        let sheet = row * self.size[1];
        let base = i * sheet + j * row + k;
        let two = |from: usize| match self.values[from..] {
            [a, b, ..] => [f64::from(a), f64::from(b)],
            _ => [f64::INFINITY; 2],
        };
        let ([a, b], [c, d]) = (two(base), two(base + row));
        let ([e, f], [g, h]) = (two(base + sheet), two(base + sheet + row));
        Some(([a, b, c, d, e, f, g, h], t))
    }
}

#[inline]
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}
