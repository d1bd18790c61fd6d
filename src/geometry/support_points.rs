//! Points of a surface with which a solid can touch its support: its extreme corners, and an even cover of the
//! rest, since a pedestal is smaller than most things that lie on it.

use super::TriMesh;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Directions in which corners are sought. 512 lie 9 degrees apart.
const DIRECTIONS: usize = 512;

/// Points of the even cover at most; spacing grows on larger surfaces.
const MOST_COVER_POINTS: f64 = 600.0;

/// Spacing of the even cover (m) on small surfaces. A round body of 8 mm radius dips by 0.1 mm between two points.
const COVER_SPACING: f64 = 2.5e-3;

/// Extreme corners in many directions (all corners of a box, both rims of a cylinder), then points that cover the
/// rest of the surface evenly.
pub fn support_points(mesh: &TriMesh) -> Vec<DVec3> {
    let mut chosen: Vec<usize> =
        (0..DIRECTIONS).map(spiral_direction).filter_map(|d| farthest_along(&mesh.points, d)).collect();
    chosen.sort_unstable();
    chosen.dedup();
    let corners: Vec<DVec3> = chosen.into_iter().map(|i| mesh.points[i]).collect();
    let spacing = COVER_SPACING.max((area(mesh) / MOST_COVER_POINTS).sqrt());
    let mut cover = Cover::new(spacing);
    for p in &corners {
        cover.keep(*p);
    }
    for t in &mesh.triangles {
        for p in lattice(mesh.corners(*t), 0.5 * spacing) {
            if cover.is_far_from_all(p) {
                cover.keep(p);
            }
        }
    }
    cover.points
}

fn area(mesh: &TriMesh) -> f64 {
    mesh.triangles.iter().map(|t| mesh.corners(*t)).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
}

/// Points of a triangle no farther apart than `spacing`, corners included; at most some thousands.
fn lattice([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let steps = (longest / spacing).ceil().clamp(1.0, 200.0) as usize;
    (0..=steps).flat_map(move |i| {
        (0..=steps - i).map(move |j| {
            let (u, v) = (i as f64 / steps as f64, j as f64 / steps as f64);
            a + (b - a) * u + (c - a) * v
        })
    })
}

/// A cell and its neighbours. Most points that are not far lie near one in their own cell.
const NEAREST_FIRST: [[i64; 3]; 27] = {
    let mut cells = [[0; 3]; 27];
    let mut n = 0;
    while n < 27 {
        // The cell itself stands in the middle of the count.
        let m = (n + 13) % 27;
        cells[n] = [(m / 9) as i64 - 1, (m / 3 % 3) as i64 - 1, (m % 3) as i64 - 1];
        n += 1;
    }
    cells
};

/// Points kept so far, found again by the cell they lie in.
struct Cover {
    spacing: f64,
    points: Vec<DVec3>,
    by_cell: FxHashMap<[i64; 3], Vec<u32>>,
    /// The point that was found near last: triangles follow each other along the surface.
    last: usize,
}

impl Cover {
    fn new(spacing: f64) -> Self {
        Self { spacing, points: Vec::new(), by_cell: FxHashMap::default(), last: 0 }
    }

    fn cell(&self, p: DVec3) -> [i64; 3] {
        (p / self.spacing).floor().to_array().map(|x| x as i64)
    }

    fn keep(&mut self, p: DVec3) {
        let cell = self.cell(p);
        self.by_cell.entry(cell).or_default().push(self.points.len() as u32);
        self.points.push(p);
    }

    fn is_far_from_all(&mut self, p: DVec3) -> bool {
        let is_near = |n: &usize| self.points.get(*n).is_some_and(|point| point.distance(p) < self.spacing);
        if is_near(&self.last) {
            return false;
        }
        let [i, j, k] = self.cell(p);
        let in_cell = |[di, dj, dk]: &[i64; 3]| {
            let near = self.by_cell.get(&[i + di, j + dj, k + dk])?;
            near.iter().map(|n| *n as usize).find(is_near)
        };
        let found = NEAREST_FIRST.iter().find_map(in_cell);
        self.last = found.unwrap_or(self.last);
        found.is_none()
    }
}

fn farthest_along(points: &[DVec3], direction: DVec3) -> Option<usize> {
    let heights = points.iter().map(|p| p.dot(direction)).enumerate();
    heights.max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(index, _)| index)
}

/// Evenly spread directions on a golden spiral.
fn spiral_direction(k: usize) -> DVec3 {
    let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
    let (sin, cos) = (golden_angle * k as f64).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    DVec3::new(radius * cos, radius * sin, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Primitive;

    #[test]
    fn a_box_keeps_its_corners_and_its_faces_are_covered() {
        let shape = Primitive::Cuboid { half: DVec3::new(0.04, 0.02, 0.01) };
        let mesh = shape.tessellate();
        let points = support_points(&mesh);
        assert_eq!(points[..8], mesh.points);
        assert!(points.iter().all(|p| shape.distance(*p).abs() < 1e-12));
        // No hole wider than two spacings, checked on the top face.
        let spacing = COVER_SPACING.max((area(&mesh) / MOST_COVER_POINTS).sqrt());
        for i in 0..40 {
            for j in 0..20 {
                let p = DVec3::new(-0.039 + 0.002 * f64::from(i), -0.019 + 0.002 * f64::from(j), 0.01);
                let nearest = points.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1.3 * spacing, "{p}: {nearest}");
            }
        }
    }

    #[test]
    fn large_things_stay_countable() {
        let mesh = Primitive::Sphere { radius: 0.5 }.tessellate();
        assert!(support_points(&mesh).len() < 2000);
    }
}
