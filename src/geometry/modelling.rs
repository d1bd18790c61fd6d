//! Modelling: smooth closed meshes from a few numbers, for objects and for the gripper itself.

use super::TriMesh;
use glam::DVec3;
use std::f64::consts::PI;

/// A sphere of radius 1 from a subdivided cube: even triangles, no poles. `n` squares along each edge.
pub fn cube_sphere(n: u32) -> TriMesh {
    cube_grid(n, |p| {
        // The mapping of Everitt, which spreads squares evenly over the sphere.
        let q = p * p;
        DVec3::new(
            p.x * (1.0 - 0.5 * q.y - 0.5 * q.z + q.y * q.z / 3.0).sqrt(),
            p.y * (1.0 - 0.5 * q.z - 0.5 * q.x + q.z * q.x / 3.0).sqrt(),
            p.z * (1.0 - 0.5 * q.x - 0.5 * q.y + q.x * q.y / 3.0).sqrt(),
        )
    })
}

/// A box of half edges `half` (m) with edges rounded by `radius` (m).
pub fn rounded_box(half: DVec3, radius: f64) -> TriMesh {
    const ARC: u32 = 5;
    // Per axis: an arc, a flat, an arc. Coordinates in -1..1 outside of 0 belong to the arcs.
    let n = 2 * ARC + 1;
    let inner = half - DVec3::splat(radius);
    let lane = |i: u32| -> (f64, f64) {
        // (position along the arc in -1..1, side of the flat)
        let i = f64::from(i);
        let arc = f64::from(ARC);
        if i <= arc { (i / arc - 1.0, -1.0) } else { ((i - arc - 1.0) / arc, 1.0) }
    };
    grid_on_cube(n, |face, i, j| {
        let ((u, su), (v, sv)) = (lane(i), lane(j));
        // Equal steps of angle along the arcs.
        let tilt = |s: f64| (s * 0.25 * PI).tan();
        let (normal, side) = face.orient(1.0, tilt(u), tilt(v), su, sv);
        inner * side + normal.normalize() * radius
    })
}

/// One face of a cube: which axis it faces and the two axes in it.
#[derive(Clone, Copy)]
struct Face {
    out: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Face {
    fn all() -> [Self; 6] {
        let face = |out: DVec3, u: DVec3| Self { out, u, v: out.cross(u) };
        [
            face(DVec3::X, DVec3::Y),
            face(DVec3::NEG_X, DVec3::Z),
            face(DVec3::Y, DVec3::Z),
            face(DVec3::NEG_Y, DVec3::X),
            face(DVec3::Z, DVec3::X),
            face(DVec3::NEG_Z, DVec3::Y),
        ]
    }

    /// A direction and the corner of the inner box it belongs to.
    fn orient(&self, out: f64, u: f64, v: f64, side_u: f64, side_v: f64) -> (DVec3, DVec3) {
        let direction = self.out * out + self.u * u + self.v * v;
        let side = self.out + self.u * side_u + self.v * side_v;
        (direction, side)
    }
}

fn cube_grid(n: u32, place: impl Fn(DVec3) -> DVec3) -> TriMesh {
    grid_on_cube(n, |face, i, j| {
        let at = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
        place(face.out + face.u * at(i) + face.v * at(j))
    })
}

/// Six faces of n x n squares; corners that coincide are joined.
fn grid_on_cube(n: u32, place: impl Fn(&Face, u32, u32) -> DVec3) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut index_of = std::collections::HashMap::new();
    for face in Face::all() {
        let mut index = |i: u32, j: u32| -> u32 {
            let p = place(&face, i, j);
            let key = p.to_array().map(|x| (x * 1e9).round() as i64);
            *index_of.entry(key).or_insert_with(|| {
                mesh.points.push(p);
                mesh.points.len() as u32 - 1
            })
        };
        let mut quads = Vec::new();
        for i in 0..n {
            for j in 0..n {
                quads.push([index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)]);
            }
        }
        for [a, b, c, d] in quads {
            for t in [[a, b, c], [a, c, d]] {
                if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                    mesh.triangles.push(t);
                }
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repair;

    #[test]
    fn models_are_sound_and_have_the_right_volume() {
        let ball = cube_sphere(16);
        assert!(repair(&ball).expect("sound").notes.is_empty());
        assert!((ball.signed_volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 0.01);
        assert!(ball.points.iter().all(|p| (p.length() - 1.0).abs() < 1e-9));

        let (half, radius) = (DVec3::new(0.03, 0.02, 0.01), 0.002);
        let brick = rounded_box(half, radius);
        assert!(repair(&brick).expect("sound").notes.is_empty());
        let size = brick.bounds().size();
        assert!(size.abs_diff_eq(half * 2.0, 1e-12), "{size}");
        let sharp = 8.0 * half.x * half.y * half.z;
        assert!(brick.signed_volume() < sharp && brick.signed_volume() > 0.97 * sharp);
    }
}
