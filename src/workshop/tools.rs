//! Tools for modelling small things: turned parts, rounded boxes, stickers, ribbons, and paint.

use glam::{DVec2, DVec3};
use palpate_geometry::palette::Rgb;
use palpate_geometry::{ColouredPart, Finish, Pose, TriMesh};
use std::f64::consts::{PI, TAU};

/// Parts of an object as they are added, each with a material name.
#[derive(Default)]
pub(crate) struct Parts(pub(crate) Vec<(String, ColouredPart)>);

impl Parts {
    /// Adds a mesh in one colour. Parts of equal material share its name.
    pub(crate) fn add(&mut self, material: &str, colour: Rgb, mesh: TriMesh) {
        if let Some((_, part)) = self.0.iter_mut().find(|(name, _)| name == material) {
            part.mesh.append(&mesh);
        } else {
            let part = ColouredPart { mesh, colour: Some(colour), finish: Finish::of_material(material) };
            self.0.push((material.to_owned(), part));
        }
    }

    /// Splits a mesh by the material that `paint` chooses for the middle of each triangle.
    pub(crate) fn add_painted(&mut self, mesh: &TriMesh, materials: &[(&str, Rgb)], paint: impl Fn(DVec3) -> usize) {
        for (index, (name, colour)) in materials.iter().enumerate() {
            let chosen: Vec<[u32; 3]> = mesh
                .triangles
                .iter()
                .copied()
                .filter(|t| paint(mesh.corners(*t).iter().sum::<DVec3>() / 3.0) == index)
                .collect();
            if !chosen.is_empty() {
                self.add(name, *colour, compact(mesh, &chosen));
            }
        }
    }
}

/// Only the points that some triangles use.
fn compact(mesh: &TriMesh, triangles: &[[u32; 3]]) -> TriMesh {
    let mut new_index = vec![u32::MAX; mesh.points.len()];
    let mut out = TriMesh::default();
    for t in triangles {
        out.triangles.push(t.map(|i| {
            if new_index[i as usize] == u32::MAX {
                new_index[i as usize] = out.points.len() as u32;
                out.points.push(mesh.points[i as usize]);
            }
            new_index[i as usize]
        }));
    }
    out
}

/// A mesh moved to a place.
pub(crate) fn at(mut mesh: TriMesh, position: DVec3) -> TriMesh {
    mesh.transform(&Pose::from_position(position));
    mesh
}

/// A mesh turned so that its z points along y: lying across the closing direction.
pub(crate) fn lying(mut mesh: TriMesh) -> TriMesh {
    mesh.transform(&Pose::from_xyz_rpy(DVec3::ZERO, DVec3::new(-0.5 * PI, 0.0, 0.0)));
    mesh
}

/// A mesh turned so that its z points along `normal`, then moved.
pub(crate) fn facing(mut mesh: TriMesh, normal: DVec3, position: DVec3) -> TriMesh {
    mesh.transform(&Pose::new(position, glam::DQuat::from_rotation_arc(DVec3::Z, normal)));
    mesh
}

/// A turned profile in millimetres, (radius, height) from the axis at the bottom to the axis at the top.
pub(crate) fn turned(profile_mm: &[(f64, f64)]) -> TriMesh {
    let profile: Vec<DVec2> = profile_mm.iter().map(|(r, z)| DVec2::new(*r, *z) * 1e-3).collect();
    palpate_geometry::lathe(&profile)
}

/// A turned profile with every corner rounded by `radius` mm.
pub(crate) fn turned_soft(profile_mm: &[(f64, f64)], radius: f64) -> TriMesh {
    const STEPS: usize = 5;
    let p: Vec<DVec2> = profile_mm.iter().map(|(r, z)| DVec2::new(*r, *z)).collect();
    let mut soft = vec![p[0]];
    for w in p.windows(3) {
        let reach = |end: DVec2| (end - w[1]).normalize() * radius.min(0.45 * (end - w[1]).length());
        let (from, to) = (w[1] + reach(w[0]), w[1] + reach(w[2]));
        for k in 0..=STEPS {
            // A quadratic Bezier through the corner's control point is close enough to a fillet.
            let t = k as f64 / STEPS as f64;
            soft.push(from.lerp(w[1], t).lerp(w[1].lerp(to, t), t));
        }
    }
    soft.push(p[p.len() - 1]);
    let pairs: Vec<(f64, f64)> = soft.iter().map(|v| (v.x, v.y)).collect();
    turned(&pairs)
}

/// A flat rounded rectangle facing z, `half` (m), corners rounded by `radius` (m); a sheet, for drawing only.
pub(crate) fn sticker(half: DVec2, radius: f64) -> TriMesh {
    const ARC: u32 = 6;
    let mut outline = Vec::new();
    for corner in 0..4u32 {
        let (sx, sy) = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)][corner as usize];
        let centre = DVec2::new(sx * (half.x - radius), sy * (half.y - radius));
        for k in 0..=ARC {
            let angle = 0.25 * TAU * (f64::from(corner) + f64::from(k) / f64::from(ARC));
            outline.push(centre + DVec2::from_angle(angle) * radius);
        }
    }
    fan(&outline)
}

/// A disc facing z (m); a sheet, for drawing only.
pub(crate) fn disc(radius: f64) -> TriMesh {
    let outline: Vec<DVec2> = (0..32).map(|k| DVec2::from_angle(TAU * f64::from(k) / 32.0) * radius).collect();
    fan(&outline)
}

fn fan(outline: &[DVec2]) -> TriMesh {
    let n = outline.len() as u32;
    let mut points: Vec<DVec3> = outline.iter().map(|p| p.extend(0.0)).collect();
    points.push(outline.iter().sum::<DVec2>().extend(0.0) / f64::from(n));
    TriMesh { points, triangles: (0..n).map(|k| [k, (k + 1) % n, n]).collect() }
}

/// A closed ribbon on a ball of radius `radius` (m) along a curve of unit vectors, `width` (m) wide.
pub(crate) fn ribbon(curve: &[DVec3], radius: f64, width: f64) -> TriMesh {
    // Lanes narrow enough not to dip below the ball's own facets.
    let lanes = (width / 0.0008).ceil().max(1.0) as u32;
    let n = curve.len() as u32;
    let mut mesh = TriMesh::default();
    for k in 0..curve.len() {
        let before = curve[(k + curve.len() - 1) % curve.len()];
        let (here, after) = (curve[k], curve[(k + 1) % curve.len()]);
        let side = here.cross(after - before).normalize() * (0.5 * width / radius);
        for lane in 0..=lanes {
            let across = 2.0 * f64::from(lane) / f64::from(lanes) - 1.0;
            mesh.points.push((here + side * across).normalize() * radius);
        }
    }
    for k in 0..n {
        let (a, b) = ((lanes + 1) * k, (lanes + 1) * ((k + 1) % n));
        for lane in 0..lanes {
            mesh.triangles.push([a + lane, b + lane, b + lane + 1]);
            mesh.triangles.push([a + lane, b + lane + 1, a + lane + 1]);
        }
    }
    mesh
}
