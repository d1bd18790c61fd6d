//! The primitive solids of URDF, centred at the origin, cylinder and capsule along z: exact signed distance,
//! mass properties in closed form, and a mesh for drawing.

use super::{Bounds, MassProperties, TriMesh};
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A solid whose distance is known in closed form. All lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// A ball.
    Sphere { radius: f64 },
    /// A box.
    Cuboid {
        /// Half the edge lengths.
        half: DVec3,
    },
    /// A cylinder along z with flat ends.
    Cylinder { radius: f64, half_length: f64 },
    /// A cylinder along z with round ends; `half_length` counts the straight part only.
    Capsule {
        radius: f64,
        /// Half the length of the straight part.
        half_length: f64,
    },
}

/// A line that lies inside as a whole.
const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Stretch of a line inside a ball about the origin.
fn inside_ball(from: DVec3, way: DVec3, radius: f64) -> Option<[f64; 2]> {
    let (a, b, c) = (way.length_squared(), from.dot(way), from.length_squared() - radius * radius);
    if a == 0.0 {
        return (c < 0.0).then_some(EVERYWHERE);
    }
    let root = (b * b - a * c).sqrt();
    root.is_finite().then(|| [(-b - root) / a, (-b + root) / a])
}

/// Stretch of a line between two planes at plus and minus `half` along an axis.
fn inside_slab(from: f64, way: f64, half: f64) -> Option<[f64; 2]> {
    if way == 0.0 {
        return (from.abs() < half).then_some(EVERYWHERE);
    }
    let (a, b) = ((-half - from) / way, (half - from) / way);
    Some([a.min(b), a.max(b)])
}

/// What two stretches have in common.
fn common([a, b]: [f64; 2], [c, d]: [f64; 2]) -> Option<[f64; 2]> {
    let both = [a.max(c), b.min(d)];
    (both[0] < both[1]).then_some(both)
}

impl Primitive {
    /// Signed distance (m) to the surface, negative inside.
    #[inline]
    pub fn distance(&self, p: DVec3) -> f64 {
        match *self {
            Self::Sphere { radius } => p.length() - radius,
            Self::Cuboid { half } => {
                let beyond = p.abs() - half;
                beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)
            }
            Self::Cylinder { radius, half_length } => {
                let beyond = DVec2::new(p.truncate().length() - radius, p.z.abs() - half_length);
                beyond.max(DVec2::ZERO).length() + beyond.max_element().min(0.0)
            }
            Self::Capsule { radius, half_length } => {
                (p - DVec3::Z * p.z.clamp(-half_length, half_length)).length() - radius
            }
        }
    }

    /// Stretch of the line `from + t way` that lies inside, as the least and the largest t.
    pub fn stretch_along(&self, from: DVec3, way: DVec3) -> Option<[f64; 2]> {
        match *self {
            Self::Sphere { radius } => inside_ball(from, way, radius),
            Self::Cuboid { half } => {
                let slabs = [0, 1, 2].map(|k| inside_slab(from[k], way[k], half[k]));
                slabs.into_iter().try_fold(EVERYWHERE, |own, slab| common(own, slab?))
            }
            Self::Cylinder { radius, half_length } => {
                let flat = |p: DVec3| DVec3::new(p.x, p.y, 0.0);
                common(inside_ball(flat(from), flat(way), radius)?, inside_slab(from.z, way.z, half_length)?)
            }
            Self::Capsule { radius, half_length } => {
                let ball = |z: f64| inside_ball(from - DVec3::Z * z, way, radius);
                let straight = Self::Cylinder { radius, half_length }.stretch_along(from, way);
                let parts = [straight, ball(half_length), ball(-half_length)].into_iter().flatten();
                // The whole is convex.
                parts.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
            }
        }
    }

    /// Direction in which the distance grows (unit length; any of them where it is not unique).
    #[inline]
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        match *self {
            Self::Sphere { .. } => p.normalize_or(DVec3::X),
            Self::Cuboid { half } => {
                let beyond = p.abs() - half;
                let outside = beyond.max(DVec3::ZERO);
                let direction = if outside != DVec3::ZERO { outside.normalize() } else { axis_of_largest(beyond) };
                direction.copysign(p)
            }
            Self::Cylinder { radius, half_length } => {
                let radial = p.truncate().normalize_or(DVec2::X);
                let axial = DVec3::Z * 1f64.copysign(p.z);
                let beyond = DVec2::new(p.truncate().length() - radius, p.z.abs() - half_length);
                let outside = beyond.max(DVec2::ZERO);
                if outside != DVec2::ZERO {
                    (radial.extend(0.0) * outside.x + axial * outside.y).normalize()
                } else if beyond.x >= beyond.y {
                    radial.extend(0.0)
                } else {
                    axial
                }
            }
            Self::Capsule { half_length, .. } => {
                (p - DVec3::Z * p.z.clamp(-half_length, half_length)).normalize_or(DVec3::X)
            }
        }
    }

    /// The same shape with all lengths multiplied.
    pub fn scaled(&self, factor: f64) -> Self {
        match *self {
            Self::Sphere { radius } => Self::Sphere { radius: radius * factor },
            Self::Cuboid { half } => Self::Cuboid { half: half * factor },
            Self::Cylinder { radius, half_length } => {
                Self::Cylinder { radius: radius * factor, half_length: half_length * factor }
            }
            Self::Capsule { radius, half_length } => {
                Self::Capsule { radius: radius * factor, half_length: half_length * factor }
            }
        }
    }

    /// Axis-aligned bounds (m).
    pub fn bounds(&self) -> Bounds {
        let half = match *self {
            Self::Sphere { radius } => DVec3::splat(radius),
            Self::Cuboid { half } => half,
            Self::Cylinder { radius, half_length } => DVec3::new(radius, radius, half_length),
            Self::Capsule { radius, half_length } => DVec3::new(radius, radius, half_length + radius),
        };
        Bounds { min: -half, max: half }
    }

    /// Volume and inertia at unit density (1 kg/m³).
    pub fn mass_properties(&self) -> MassProperties {
        let (volume, moments) = match *self {
            Self::Sphere { radius } => {
                let volume = 4.0 / 3.0 * PI * radius.powi(3);
                (volume, DVec3::splat(0.4 * volume * radius * radius))
            }
            Self::Cuboid { half } => {
                let volume = 8.0 * half.x * half.y * half.z;
                let sq = half * half;
                let moments = DVec3::new(sq.y + sq.z, sq.z + sq.x, sq.x + sq.y) * (volume / 3.0);
                (volume, moments)
            }
            Self::Cylinder { radius, half_length } => {
                let volume = TAU * radius * radius * half_length;
                (volume, volume * cylinder_moments(radius, half_length))
            }
            Self::Capsule { radius, half_length } => {
                let cylinder = TAU * radius * radius * half_length;
                let ball = 4.0 / 3.0 * PI * radius.powi(3);
                // Two half balls, each with its centre of mass 3r/8 beyond the end of the straight part.
                let shift = half_length * half_length + 0.75 * half_length * radius;
                let across = ball * (0.4 * radius * radius + shift);
                let along = ball * 0.4 * radius * radius;
                let moments = cylinder * cylinder_moments(radius, half_length) + DVec3::new(across, across, along);
                (cylinder + ball, moments)
            }
        };
        MassProperties { mass: volume, centre: DVec3::ZERO, inertia: DMat3::from_diagonal(moments) }
    }

    /// A closed mesh of the surface, fine enough to be drawn smoothly.
    pub fn tessellate(&self) -> TriMesh {
        match *self {
            Self::Sphere { radius } => lathe(&arc_profile(radius, 0.0)),
            Self::Cuboid { half } => cuboid_mesh(half),
            Self::Cylinder { radius, half_length } => lathe(&[
                DVec2::new(0.0, -half_length),
                DVec2::new(radius, -half_length),
                DVec2::new(radius, half_length),
                DVec2::new(0.0, half_length),
            ]),
            Self::Capsule { radius, half_length } => lathe(&arc_profile(radius, half_length)),
        }
    }
}

fn axis_of_largest(v: DVec3) -> DVec3 {
    if v.x >= v.y && v.x >= v.z {
        DVec3::X
    } else if v.y >= v.z {
        DVec3::Y
    } else {
        DVec3::Z
    }
}

/// Moments of a cylinder of unit mass about its centre.
fn cylinder_moments(radius: f64, half_length: f64) -> DVec3 {
    let across = radius * radius / 4.0 + half_length * half_length / 3.0;
    DVec3::new(across, across, radius * radius / 2.0)
}

/// Half a circle from pole to pole in (radius, z), cut at the equator and pulled apart by `2 * half_length`.
fn arc_profile(radius: f64, half_length: f64) -> Vec<DVec2> {
    const STEPS: usize = 24;
    let mut profile = Vec::with_capacity(2 * STEPS + 2);
    for half in [-1.0, 1.0] {
        for i in 0..=STEPS {
            let angle = 0.25 * TAU * (i as f64 / STEPS as f64 - if half < 0.0 { 1.0 } else { 0.0 });
            profile.push(DVec2::new(radius * angle.cos(), radius * angle.sin() + half * half_length));
        }
    }
    profile.dedup_by(|a, b| a.distance_squared(*b) < 1e-24);
    if let Some(first) = profile.first_mut() {
        first.x = 0.0;
    }
    if let Some(last) = profile.last_mut() {
        last.x = 0.0;
    }
    profile
}

/// A solid of revolution about z from a profile in (radius, z) that starts and ends on the axis, going up.
pub fn lathe(profile: &[DVec2]) -> TriMesh {
    const AROUND: u32 = 64;
    let mut mesh = TriMesh::default();
    let mut rings: Vec<Vec<u32>> = Vec::new();
    for p in profile {
        let start = mesh.points.len() as u32;
        if p.x <= 0.0 {
            mesh.points.push(DVec3::new(0.0, 0.0, p.y));
            rings.push(vec![start; AROUND as usize]);
        } else {
            for k in 0..AROUND {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
                mesh.points.push(DVec3::new(p.x * cos, p.x * sin, p.y));
            }
            rings.push((start..start + AROUND).collect());
        }
    }
    for pair in rings.windows(2) {
        for k in 0..AROUND as usize {
            let next = (k + 1) % AROUND as usize;
            let (a, b, c, d) = (pair[0][k], pair[0][next], pair[1][next], pair[1][k]);
            for t in [[a, b, c], [a, c, d]] {
                if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                    mesh.triangles.push(t);
                }
            }
        }
    }
    mesh
}

fn cuboid_mesh(half: DVec3) -> TriMesh {
    let points = (0..8).map(|i| half * DVec3::new(sign_bit(i, 0), sign_bit(i, 1), sign_bit(i, 2))).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { points, triangles }
}

fn sign_bit(i: u32, bit: u32) -> f64 {
    if i >> bit & 1 == 1 { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{mass_properties, repair};

    const ALL: [Primitive; 4] = [
        Primitive::Sphere { radius: 0.02 },
        Primitive::Cuboid { half: DVec3::new(0.04, 0.025, 0.02) },
        Primitive::Cylinder { radius: 0.0175, half_length: 0.03 },
        Primitive::Capsule { radius: 0.01, half_length: 0.02 },
    ];

    #[test]
    fn a_line_is_inside_where_its_distance_is_negative() {
        let shapes = [
            Primitive::Sphere { radius: 0.02 },
            Primitive::Cuboid { half: DVec3::new(0.01, 0.02, 0.03) },
            Primitive::Cylinder { radius: 0.01, half_length: 0.02 },
            Primitive::Capsule { radius: 0.01, half_length: 0.02 },
        ];
        for shape in shapes {
            for k in 0..200u32 {
                let unit = |m: u32| f64::from(k.wrapping_mul(m) % 1009) / 1009.0 - 0.5;
                let from = DVec3::new(unit(7919), unit(104_729), unit(15_485_863)) * 0.06;
                let ways = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(unit(31), unit(37), unit(41))];
                let way = ways[k as usize % 4];
                let found = shape.stretch_along(from, way);
                for n in -200..=200 {
                    let t = f64::from(n) * 1e-3;
                    let distance = shape.distance(from + way * t);
                    let inside = found.is_some_and(|[a, b]| a < t && t < b);
                    assert!(distance.abs() < 1e-9 || inside == (distance < 0.0), "{shape:?} {from} {way} {t}");
                }
            }
        }
    }

    #[test]
    fn distances_match_closed_forms() {
        assert_eq!(ALL[0].distance(DVec3::new(0.0, 0.0, 0.05)), 0.030000000000000002);
        assert!((ALL[1].distance(DVec3::new(0.043, 0.029, 0.0)) - 0.005).abs() < 1e-15);
        assert!((ALL[1].distance(DVec3::new(0.0, 0.0, 0.015)) + 0.005).abs() < 1e-15);
        assert!((ALL[2].distance(DVec3::new(0.0205, 0.0, 0.034)) - 0.005).abs() < 1e-15);
        assert!((ALL[3].distance(DVec3::new(0.0, 0.0, 0.032)) - 0.002).abs() < 1e-15);
    }

    #[test]
    fn gradients_are_the_slope_of_the_distance() {
        let step = 1e-7;
        for shape in ALL {
            for k in 0..200u32 {
                let p = DVec3::new(
                    f64::from(k * 7919 % 211) / 211.0 - 0.5,
                    f64::from(k * 104_729 % 223) / 223.0 - 0.5,
                    f64::from(k * 1_299_709 % 227) / 227.0 - 0.5,
                ) * 0.12;
                let slope =
                    DVec3::from_array([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                        (shape.distance(p + axis * step) - shape.distance(p - axis * step)) / (2.0 * step)
                    }));
                if (slope.length() - 1.0).abs() < 1e-4 {
                    assert!(slope.abs_diff_eq(shape.gradient(p), 2e-4), "{shape:?} at {p}");
                }
            }
        }
    }

    #[test]
    fn meshes_are_closed_and_agree_with_the_closed_forms() {
        for shape in ALL {
            let mesh = shape.tessellate();
            let repaired = repair(&mesh).expect("primitive meshes are sound");
            assert!(repaired.notes.is_empty(), "{shape:?}: {:?}", repaired.notes);
            let (exact, meshed) = (shape.mass_properties(), mass_properties(&mesh, 1.0));
            assert!((meshed.mass / exact.mass - 1.0).abs() < 0.01, "{shape:?}");
            for i in 0..3 {
                let ratio = meshed.inertia.col(i)[i] / exact.inertia.col(i)[i];
                assert!((ratio - 1.0).abs() < 0.015, "{shape:?} axis {i}: {ratio}");
            }
        }
    }
}
