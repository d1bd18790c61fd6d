//! Mass of what several solids enclose together: what two of them share counts once.
//!
//! Lines through the solids are cut into the stretches that lie inside any of them, and the integrals of volume, centre and
//! inertia are taken along each stretch exactly and across the lines by the midpoint rule.

use super::bake::{LINE_SHIFT, shares_at};
use super::{Bounds, MassProperties, SolidPart, TriMesh};
use glam::{DMat3, DVec3};

/// Lines in each of the two directions across. A sphere's volume is then off by some 1e-4.
const LINES: usize = 400;

/// Parallel lines through some solids.
struct Lines {
    /// Axis along which they run, and the two across.
    axes: [usize; 3],
    /// Corner of the box around the solids (m).
    corner: DVec3,
    /// Spacing across (m).
    spacing: [f64; 2],
}

impl Lines {
    fn through(bounds: &Bounds) -> Self {
        let size = bounds.size().to_array();
        let along = (0..3).fold(0, |longest, axis| if size[axis] > size[longest] { axis } else { longest });
        let axes = [along, (along + 1) % 3, (along + 2) % 3];
        Self { axes, corner: bounds.min, spacing: [1, 2].map(|k| size[axes[k]] / LINES as f64) }
    }

    /// Place of a line across the axis (m).
    fn across(&self, line: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|k| {
            self.corner.to_array()[self.axes[k + 1]] + (line[k] as f64 + 0.5 + LINE_SHIFT[k]) * self.spacing[k]
        })
    }

    /// The lines that pass between two places, in one direction across.
    fn between(&self, k: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let line = |x: f64| (x - self.corner.to_array()[self.axes[k + 1]]) / self.spacing[k] - 0.5 - LINE_SHIFT[k];
        let (first, last) = (line(low).ceil().max(0.0), line(high).floor());
        first as usize..((last + 1.0).max(0.0) as usize).min(LINES)
    }

    fn point(&self, along: f64, across: [f64; 2]) -> DVec3 {
        let mut p = [0.0; 3];
        (p[self.axes[0]], p[self.axes[1]], p[self.axes[2]]) = (along, across[0], across[1]);
        DVec3::from_array(p)
    }
}

/// Stretch of a line inside a solid: the line, and from where to where (m).
type Stretch = (usize, f64, f64);

/// Mass properties of the union of some solids, filled at `density` (kg/m³). Meshes must be closed and face outward.
pub fn union_mass(parts: &[SolidPart], density: f64) -> MassProperties {
    let bounds = parts.iter().map(SolidPart::bounds).fold(Bounds::EMPTY, Bounds::union);
    if !bounds.size().is_finite() || bounds.size().min_element() <= 0.0 {
        return MassProperties::ZERO;
    }
    let lines = Lines::through(&bounds);
    let mut stretches: Vec<Stretch> = Vec::new();
    for part in parts {
        match part {
            SolidPart::Mesh(mesh) => through_mesh(&lines, mesh, &mut stretches),
            SolidPart::Primitive(..) => through_primitive(&lines, part, &mut stretches),
        }
    }
    stretches.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut sums = Sums { volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO };
    let mut stretches = stretches.into_iter().peekable();
    while let Some((line, from, mut to)) = stretches.next() {
        while let Some((_, _, other)) = stretches.next_if(|next| next.0 == line && next.1 <= to) {
            to = to.max(other);
        }
        sums.add(&lines, line, from, to);
    }
    sums.properties(&lines, density)
}

/// The stretches inside a mesh: those around which it winds.
fn through_mesh(lines: &Lines, mesh: &TriMesh, stretches: &mut Vec<Stretch>) {
    let [along, u, v] = lines.axes;
    // Line, place, and +1 on leaving or -1 on entering.
    let mut crossings: Vec<(usize, f64, i32)> = Vec::new();
    for t in &mesh.triangles {
        let corners = mesh.corners(*t).map(|p| p.to_array());
        let flat = corners.map(|c| [c[u], c[v]]);
        let range = |k: usize| {
            let low = flat.iter().map(|f| f[k]).fold(f64::INFINITY, f64::min);
            let high = flat.iter().map(|f| f[k]).fold(f64::NEG_INFINITY, f64::max);
            lines.between(k, low, high)
        };
        for i in range(0) {
            for j in range(1) {
                if let Some((shares, turn)) = shares_at(&flat, lines.across([i, j])) {
                    let place = (0..3).map(|c| shares[c] * corners[c][along]).sum();
                    crossings.push((i * LINES + j, place, turn));
                }
            }
        }
    }
    // Beyond a crossing on leaving, less is inside.
    crossings.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for line in crossings.chunk_by(|a, b| a.0 == b.0) {
        let mut winding = 0;
        for pair in line.windows(2) {
            winding -= pair[0].2;
            if winding >= 1 {
                stretches.push((pair[0].0, pair[0].1, pair[1].1));
            }
        }
    }
}

/// The stretches inside a primitive, which is convex.
fn through_primitive(lines: &Lines, part: &SolidPart, stretches: &mut Vec<Stretch>) {
    let SolidPart::Primitive(shape, pose) = part else { return };
    let (bounds, inverse) = (part.bounds(), pose.inverse());
    // Round ones reach beyond the flat facets that bound them.
    let [low, high] = [bounds.min - 0.01 * bounds.size(), bounds.max + 0.01 * bounds.size()].map(|p| p.to_array());
    let [along, u, v] = lines.axes;
    let way = inverse.direction(lines.point(1.0, [0.0; 2]));
    for i in lines.between(0, low[u], high[u]) {
        for j in lines.between(1, low[v], high[v]) {
            let from = inverse.point(lines.point(lines.corner[along], lines.across([i, j])));
            if let Some([a, b]) = shape.stretch_along(from, way) {
                stretches.push((i * LINES + j, lines.corner[along] + a, lines.corner[along] + b));
            }
        }
    }
}

/// Integrals over the stretches, about the corner of the lines.
struct Sums {
    volume: f64,
    first: DVec3,
    second: DMat3,
}

impl Sums {
    fn add(&mut self, lines: &Lines, line: usize, from: f64, to: f64) {
        let corner = lines.corner.to_array();
        let across = lines.across([line / LINES, line % LINES]);
        let [along, u, v] = lines.axes;
        let (a, b) = (from - corner[along], to - corner[along]);
        let (y, z) = (across[0] - corner[u], across[1] - corner[v]);
        let length = b - a;
        let (x, xx) = (0.5 * (b * b - a * a), (b * b * b - a * a * a) / 3.0);
        let mut first = [0.0; 3];
        (first[along], first[u], first[v]) = (x, y * length, z * length);
        let mut second = [[0.0; 3]; 3];
        second[along][along] = xx;
        (second[along][u], second[u][along]) = (x * y, x * y);
        (second[along][v], second[v][along]) = (x * z, x * z);
        (second[u][v], second[v][u]) = (y * z * length, y * z * length);
        second[u][u] = (y * y + lines.spacing[0].powi(2) / 12.0) * length;
        second[v][v] = (z * z + lines.spacing[1].powi(2) / 12.0) * length;
        self.volume += length;
        self.first += DVec3::from_array(first);
        self.second += DMat3::from_cols_array_2d(&second);
    }

    fn properties(&self, lines: &Lines, density: f64) -> MassProperties {
        if self.volume <= 0.0 {
            return MassProperties::ZERO;
        }
        let mass = density * lines.spacing[0] * lines.spacing[1] * self.volume;
        let centre = self.first / self.volume;
        // Second moments about the centre, and the inertia that they make.
        let c = DMat3::from_cols(centre * centre.x, centre * centre.y, centre * centre.z);
        let moments = (self.second * (1.0 / self.volume) - c) * mass;
        let trace = moments.x_axis.x + moments.y_axis.y + moments.z_axis.z;
        let inertia = DMat3::from_diagonal(DVec3::splat(trace)) - moments;
        MassProperties { mass, centre: lines.corner + centre, inertia: (inertia + inertia.transpose()) * 0.5 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Pose, Primitive, mass_properties};
    use glam::DQuat;
    use proptest::prelude::*;

    fn near(a: &MassProperties, b: &MassProperties, share: f64) -> bool {
        let size = (b.inertia.x_axis.x / b.mass).sqrt();
        (a.mass / b.mass - 1.0).abs() < share
            && a.centre.distance(b.centre) < share * size
            && (a.inertia - b.inertia)
                .to_cols_array()
                .iter()
                .all(|x| x.abs() < 3.0 * share * b.inertia.x_axis.x.max(b.inertia.z_axis.z))
    }

    #[test]
    fn one_solid_has_its_own_mass() {
        let place = Pose::new(DVec3::new(0.01, -0.02, 0.005), DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, -0.2));
        let shapes = [
            Primitive::Sphere { radius: 0.02 },
            Primitive::Cuboid { half: DVec3::new(0.01, 0.02, 0.03) },
            Primitive::Cylinder { radius: 0.01, half_length: 0.03 },
            Primitive::Capsule { radius: 0.01, half_length: 0.02 },
        ];
        for shape in shapes {
            let unit = shape.mass_properties();
            let exact = unit.with_mass(unit.mass * 800.0).seen_from(&place);
            let found = union_mass(&[SolidPart::Primitive(shape, place)], 800.0);
            assert!(near(&found, &exact, 1e-3), "{shape:?}: {found:?} {exact:?}");
            let mut mesh = shape.tessellate();
            mesh.transform(&place);
            let (found, exact) = (union_mass(&[SolidPart::Mesh(mesh.clone())], 800.0), mass_properties(&mesh, 800.0));
            assert!(near(&found, &exact, 1e-3), "{shape:?}: {found:?} {exact:?}");
        }
    }

    #[test]
    fn what_solids_share_counts_once() {
        let cuboid = |x: f64| {
            SolidPart::Primitive(Primitive::Cuboid { half: DVec3::splat(0.01) }, Pose::from_position(DVec3::X * x))
        };
        let exact = Primitive::Cuboid { half: DVec3::new(0.0125, 0.01, 0.01) }.mass_properties();
        let exact = exact.with_mass(exact.mass * 500.0).seen_from(&Pose::from_position(DVec3::X * 0.0025));
        assert!(near(&union_mass(&[cuboid(0.0), cuboid(0.005)], 500.0), &exact, 1e-3));
        assert!((union_mass(&vec![cuboid(0.0); 300], 500.0).mass - 0.004).abs() < 1e-5);
        assert_eq!(union_mass(&[], 500.0), MassProperties::ZERO);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn a_union_of_boxes_and_balls_has_the_volume_of_a_voxel_count(
            solids in prop::collection::vec((any::<bool>(), prop::array::uniform3(-0.01..0.01), prop::array::uniform3(0.004..0.015), prop::array::uniform3(-1.5..1.5)), 1..5),
        ) {
            let parts: Vec<SolidPart> = solids.iter().map(|(round, place, half, turn)| {
                let shape = if *round { Primitive::Sphere { radius: half[0] } } else { Primitive::Cuboid { half: DVec3::from_array(*half) } };
                let pose = Pose::new(DVec3::from_array(*place), DQuat::from_euler(glam::EulerRot::XYZ, turn[0], turn[1], turn[2]));
                // Some as meshes, as they come from files.
                if half[1] < 0.01 && !round { let mut mesh = shape.tessellate(); mesh.transform(&pose); SolidPart::Mesh(mesh) } else { SolidPart::Primitive(shape, pose) }
            }).collect();
            let inside = |p: DVec3| solids.iter().any(|(round, place, half, turn)| {
                let pose = Pose::new(DVec3::from_array(*place), DQuat::from_euler(glam::EulerRot::XYZ, turn[0], turn[1], turn[2])).inverse();
                let q = pose.point(p);
                if *round { q.length() < half[0] } else { q.abs().cmplt(DVec3::from_array(*half)).all() }
            });
            let bounds = parts.iter().map(SolidPart::bounds).fold(Bounds::EMPTY, Bounds::union).grown(1e-3);
            let cell = bounds.size() / 90.0;
            let count = (0..90 * 90 * 90).filter(|n| {
                let index = DVec3::new(f64::from(n % 90), f64::from(n / 90 % 90), f64::from(n / 8100)) + 0.5;
                inside(bounds.min + index * cell)
            }).count();
            let counted = count as f64 * cell.x * cell.y * cell.z;
            let found = union_mass(&parts, 1.0).mass;
            prop_assert!((found / counted - 1.0).abs() < 0.01, "{found} {counted}");
        }
    }
}
