//! Baking signed distances onto a grid: how far by parry3d's closest-point query, inside or outside by winding.
//!
//! Sign. Along a line through a node, the winding number of an oriented surface is the sum, over the crossings
//! beyond the node, of +1 where the surface is left and -1 where it is entered (Jacobson et al. 2013, on a line).
//! It copes with pieces that overlap. Lines along x, y and z vote, so that a sliver that one of them misses
//! cannot turn a whole row inside out.

use super::{Bounds, DistanceGrid, Pose, Primitive, TriMesh};
use glam::{DVec3, Vec3};
use parry3d::query::PointQuery;
use parry3d::shape::TriMesh as ParryMesh;
use rayon::prelude::*;

/// One solid of a union.
#[derive(Clone, Debug)]
pub enum SolidPart {
    /// A primitive and its place in the solid's frame.
    Primitive(Primitive, Pose),
    /// A repaired mesh, already in the solid's frame.
    Mesh(TriMesh),
}

impl SolidPart {
    /// Bounding box in the solid's frame (m).
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Primitive(shape, pose) => {
                let mut mesh = shape.tessellate();
                mesh.transform(pose);
                mesh.bounds()
            }
            Self::Mesh(mesh) => mesh.bounds(),
        }
    }
}

/// Error of baking a distance grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BakeError {
    #[error("the object has no solid part to compute distances from")]
    NothingSolid,
    #[error("a distance grid of {nodes} nodes is too fine; raise solver.distance_cell (the limit is 8 million nodes)")]
    TooFine {
        /// Nodes needed.
        nodes: usize,
    },
}

/// Nodes beyond this are refused: 32 MB and some ten seconds.
const MOST_NODES: usize = 8_000_000;

/// Distance from the solid (m) up to which the grid holds exact values: the ends of contact springs are at most this
/// thick, so contact detection never reads values at the border of the grid.
const REACH: f64 = 8e-3;

/// Hollows that a ball of this radius (m) cannot reach are filled.
const HOLLOW: f64 = 8e-3;

/// Cells beyond [`REACH`], for interpolation.
const MARGIN: f64 = 2.0;

/// At nodes farther from a mesh than [`REACH`] plus [`MARGIN`] cells, the value is only a lower bound, computed from a
/// grid that is this many times coarser. Most nodes around a 60 mm object are that far away, so this saves most of the
/// time.
const STRIDE: usize = 4;

/// A grid spacing (m): 0.75 mm, less if there would be under six cells across the thinnest extent, but never more than
/// 160 cells along the longest.
pub fn choose_cell(bounds: &Bounds) -> f64 {
    let size = bounds.size();
    (0.75e-3f64).min(size.min_element() / 6.0).max(size.max_element() / 160.0)
}

/// Samples the union of some solids with grid spacing `cell` (m).
pub fn bake(parts: &[SolidPart], cell: f64) -> Result<DistanceGrid, BakeError> {
    let solid = parts.iter().map(SolidPart::bounds).fold(Bounds::EMPTY, Bounds::union);
    let size = solid.size();
    if parts.is_empty() || size.max_element() <= 0.0 || !size.is_finite() {
        return Err(BakeError::NothingSolid);
    }
    let box_around = solid.grown(REACH + MARGIN * cell);
    let counts = (box_around.size() / cell).ceil() + DVec3::ONE;
    let nodes = counts.x * counts.y * counts.z;
    if nodes.is_nan() || nodes > MOST_NODES as f64 {
        return Err(BakeError::TooFine { nodes: nodes as usize });
    }
    let mut grid = DistanceGrid {
        // Centred, so that a symmetric solid has a symmetric field.
        origin: box_around.centre() - 0.5 * cell * (counts - DVec3::ONE),
        cell,
        size: counts.to_array().map(|n| n as usize),
        values: vec![f32::INFINITY; nodes as usize],
        solid,
    };
    for part in parts {
        let distances = match part {
            SolidPart::Primitive(shape, pose) => {
                let inverse = pose.inverse();
                sample(&grid, |p| shape.distance(inverse.point(p)))
            }
            SolidPart::Mesh(mesh) => mesh_distances(&grid, mesh),
        };
        for (value, distance) in grid.values.iter_mut().zip(distances) {
            *value = value.min(distance);
        }
    }
    grid.fill_hollows(HOLLOW);
    Ok(grid)
}

/// Evaluates a function at every node, in parallel; the result does not depend on the number of threads.
fn sample(grid: &DistanceGrid, distance: impl Fn(DVec3) -> f64 + Sync) -> Vec<f32> {
    let [nx, ny, nz] = grid.size;
    (0..nx * ny * nz)
        .into_par_iter()
        .map(|n| distance(grid.node([n / (ny * nz), n / nz % ny, n % nz])) as f32)
        .collect()
}

fn mesh_distances(grid: &DistanceGrid, mesh: &TriMesh) -> Vec<f32> {
    let points: Vec<Vec3> = mesh.points.iter().map(|p| p.as_vec3()).collect();
    let Ok(surface) = ParryMesh::new(points, mesh.triangles.clone()) else {
        return vec![f32::INFINITY; grid.values.len()];
    };
    let unsigned = |p: DVec3, limit: f64| -> f64 {
        let query = p.as_vec3();
        surface
            .project_local_point_with_max_dist(query, false, limit as f32)
            .map_or(limit, |hit| f64::from((hit.point - query).length()))
    };
    let coarse = CoarseGrid::new(grid, |p| unsigned(p, f64::from(f32::MAX)));
    let inside = inside_by_winding(grid, mesh);
    let band = REACH + MARGIN * grid.cell;
    let [_, ny, nz] = grid.size;
    (0..grid.values.len())
        .into_par_iter()
        .map(|n| {
            let index = [n / (ny * nz), n / nz % ny, n % nz];
            let (estimate, uncertainty) = coarse.estimate(index);
            let distance = if estimate - uncertainty > band {
                estimate - uncertainty // a lower bound will do for sphere tracing
            } else {
                // A hair more than the bound, so that rounding cannot hide the closest triangle.
                unsigned(grid.node(index), (estimate + uncertainty) * 1.001 + 1e-6)
            };
            if inside[n] { -distance as f32 } else { distance as f32 }
        })
        .collect()
}

/// Unsigned distances on every [`STRIDE`]-th node.
struct CoarseGrid {
    cell: f64,
    size: [usize; 3],
    values: Vec<f64>,
}

impl CoarseGrid {
    fn new(grid: &DistanceGrid, distance: impl Fn(DVec3) -> f64 + Sync) -> Self {
        let size = grid.size.map(|n| n.div_ceil(STRIDE) + 1);
        let [nx, ny, nz] = size;
        let values = (0..nx * ny * nz)
            .into_par_iter()
            .map(|n| distance(grid.node([n / (ny * nz), n / nz % ny, n % nz].map(|i| i * STRIDE))))
            .collect();
        Self { cell: grid.cell, size, values }
    }

    /// The distance at the nearest coarse node and how far off it can be here (distances are 1-Lipschitz).
    fn estimate(&self, index: [usize; 3]) -> (f64, f64) {
        let nearest = index.map(|i| (i + STRIDE / 2) / STRIDE);
        let step = |a: usize| index[a].abs_diff(nearest[a] * STRIDE) as f64;
        let away = DVec3::new(step(0), step(1), step(2)).length() * self.cell;
        let [_, ny, nz] = self.size;
        let [i, j, k] = nearest;
        (self.values[(i * ny + j) * nz + k], away)
    }
}

/// Marks the nodes that lie inside, by majority of the winding numbers along x, y and z.
fn inside_by_winding(grid: &DistanceGrid, mesh: &TriMesh) -> Vec<bool> {
    let votes: Vec<Vec<bool>> = [0, 1, 2].into_par_iter().map(|axis| inside_along(grid, mesh, axis)).collect();
    (0..grid.values.len()).map(|n| votes.iter().filter(|vote| vote[n]).count() >= 2).collect()
}

/// Lines are shifted off the nodes by these shares of a cell, so that they do not run along edges of meshes
/// modelled on round numbers.
pub(super) const LINE_SHIFT: [f64; 2] = [0.001_373, 0.000_719];

fn inside_along(grid: &DistanceGrid, mesh: &TriMesh, axis: usize) -> Vec<bool> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let (nu, nv) = (grid.size[u], grid.size[v]);
    // Crossings of each line: where along the axis, and +1 on leaving or -1 on entering the solid.
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); nu * nv];
    for t in &mesh.triangles {
        let corners = mesh.corners(*t).map(|p| ((p - grid.origin) / grid.cell).to_array());
        let flat = corners.map(|c| [c[u] - LINE_SHIFT[0], c[v] - LINE_SHIFT[1]]);
        let lines = |k: usize, count: usize| {
            let low = flat.iter().map(|f| f[k]).fold(f64::INFINITY, f64::min).ceil().max(0.0);
            let high = flat.iter().map(|f| f[k]).fold(f64::NEG_INFINITY, f64::max).floor();
            low as usize..((high + 1.0).max(0.0) as usize).min(count)
        };
        for i in lines(0, nu) {
            for j in lines(1, nv) {
                if let Some((weights, turn)) = shares_at(&flat, [i as f64, j as f64]) {
                    let along = (0..3).map(|c| weights[c] * corners[c][axis]).sum();
                    crossings[i * nv + j].push((along, turn));
                }
            }
        }
    }
    let [_, ny, nz] = grid.size;
    let mut inside = vec![false; grid.values.len()];
    let mut index = [0; 3];
    for i in 0..nu {
        for j in 0..nv {
            let line = &crossings[i * nv + j];
            if line.is_empty() {
                continue;
            }
            for k in 0..grid.size[axis] {
                let winding: i32 = line.iter().filter(|(at, _)| *at > k as f64).map(|(_, w)| w).sum();
                (index[axis], index[u], index[v]) = (k, i, j);
                inside[(index[0] * ny + index[1]) * nz + index[2]] = winding >= 1;
            }
        }
    }
    inside
}

/// Shares of the corners of a planar triangle at a point inside it, and +1 where it is walked to the left, -1 to the right.
pub(super) fn shares_at(corners: &[[f64; 2]; 3], p: [f64; 2]) -> Option<([f64; 3], i32)> {
    let [a, b, c] = *corners;
    let area = cross(a, b, c);
    let shares = [(b, c), (c, a), (a, b)].map(|(from, to)| cross(from, to, p) / area);
    (area != 0.0 && shares.iter().all(|share| *share >= 0.0)).then_some((shares, if area > 0.0 { 1 } else { -1 }))
}

/// Twice the signed area of a planar triangle.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DistanceField;
    use std::sync::Arc;

    fn check(field: &DistanceField, exact: impl Fn(DVec3) -> f64, reach: f64, tolerance: f64) {
        for k in 0..4000u32 {
            let unit = |m: u32, p: u32| f64::from(k.wrapping_mul(m) % p) / f64::from(p) - 0.5;
            let p = DVec3::new(unit(7919, 1009), unit(104_729, 1013), unit(15_485_863, 1019)) * 2.0 * reach;
            let (got, want) = (field.distance(p), exact(p));
            if want.abs() < 0.002 {
                assert!((got - want).abs() < tolerance, "at {p}: {got} instead of {want}");
            } else {
                let bounded = got.abs() <= want.abs() + tolerance && got.signum() == want.signum();
                assert!(bounded, "at {p}: {got} for {want}");
            }
        }
    }

    #[test]
    fn a_baked_ball_agrees_with_the_closed_form() {
        let ball = Primitive::Sphere { radius: 0.02 };
        let grid = bake(&[SolidPart::Mesh(ball.tessellate())], 0.75e-3).expect("bakes");
        let field = DistanceField::Grid(Arc::new(grid));
        check(&field, |p| ball.distance(p), 0.03, 4e-5);
        let p = DVec3::new(0.012, -0.008, 0.014);
        // Facets of the 64-gon turn by up to 0.05 rad from the ball they stand for.
        assert!(field.surface(p).1.angle_between(p) < 0.06);
    }

    #[test]
    fn overlapping_parts_are_one_solid() {
        let slab = Primitive::Cuboid { half: DVec3::new(0.02, 0.01, 0.01) };
        let shift = |x: f64| Pose::from_position(DVec3::new(x, 0.0, 0.0));
        let mut soup = slab.tessellate();
        soup.transform(&shift(-0.01));
        let mut other = slab.tessellate();
        other.transform(&shift(0.01));
        soup.append(&other);
        let whole = Primitive::Cuboid { half: DVec3::new(0.03, 0.01, 0.01) };
        let as_one_mesh = bake(&[SolidPart::Mesh(soup)], 0.5e-3).expect("bakes");
        let as_parts =
            bake(&[SolidPart::Primitive(slab, shift(-0.01)), SolidPart::Primitive(slab, shift(0.01))], 0.5e-3)
                .expect("bakes");
        for grid in [as_one_mesh, as_parts] {
            let field = DistanceField::Grid(Arc::new(grid));
            for x in [-0.035, -0.029, 0.031] {
                let p = DVec3::new(x, 0.003, -0.002);
                assert!((field.distance(p) - whole.distance(p)).abs() < 1e-4);
            }
            assert!(field.distance(DVec3::ZERO) < 0.0, "the overlap is inside");
        }
    }

    #[test]
    fn a_ring_has_a_hole() {
        // A square ring: four overlapping bars around an opening.
        let bar = |half: DVec3, at: DVec3| SolidPart::Primitive(Primitive::Cuboid { half }, Pose::from_position(at));
        let long = DVec3::new(0.03, 0.005, 0.005);
        let side = DVec3::new(0.005, 0.03, 0.005);
        let ring = bake(
            &[
                bar(long, DVec3::new(0.0, 0.025, 0.0)),
                bar(long, DVec3::new(0.0, -0.025, 0.0)),
                bar(side, DVec3::new(0.025, 0.0, 0.0)),
                bar(side, DVec3::new(-0.025, 0.0, 0.0)),
            ],
            0.5e-3,
        )
        .expect("bakes");
        assert!(ring.distance(DVec3::ZERO) > 0.015);
        assert!(ring.distance(DVec3::new(0.025, 0.0, 0.0)) < -0.004);
    }

    #[test]
    fn absurd_requests_are_refused() {
        assert_eq!(bake(&[], 1e-3).err(), Some(BakeError::NothingSolid));
        let ball = SolidPart::Primitive(Primitive::Sphere { radius: 0.05 }, Pose::IDENTITY);
        assert!(matches!(bake(std::slice::from_ref(&ball), 1e-6), Err(BakeError::TooFine { .. })));
        assert!(bake(&[ball], f64::NAN).is_err());
    }
}
