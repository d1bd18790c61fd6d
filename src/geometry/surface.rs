//! Meshes to draw: single precision, a normal, a colour and a finish at every corner.

use super::{ColouredPart, Finish, TriMesh};
use crate::palette::Rgb;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// One corner of a drawn mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct SurfaceVertex {
    /// Position (m).
    pub position: [f32; 3],
    /// Unit normal, outward.
    pub normal: [f32; 3],
    /// sRGB colour, 0-255, and the number of its [`Finish`].
    pub colour: [u8; 4],
}

/// A mesh ready to be drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Corners.
    pub vertices: Vec<SurfaceVertex>,
    /// Three per triangle.
    pub indices: Vec<u32>,
}

/// Edges sharper than this stay sharp when normals are averaged: cos(40°) keeps a 32-gon round and a box boxy.
const CREASE_COSINE: f64 = 0.766;

impl SurfaceMesh {
    /// Smooths normals across edges blunter than the crease angle and colours each part.
    pub fn from_parts(parts: &[ColouredPart], default_colour: Rgb) -> Self {
        let mut surface = Self::default();
        for part in parts {
            surface.add(&part.mesh, part.colour.unwrap_or(default_colour), part.finish);
        }
        surface
    }

    /// Adds a mesh in one colour and finish.
    pub fn add(&mut self, mesh: &TriMesh, colour: Rgb, finish: Finish) {
        let normals = face_normals(mesh);
        let faces_at = faces_by_place(mesh);
        // Corners that are alike are one: each is moved and projected several times per picture.
        let mut known: FxHashMap<SurfaceKey, u32> = FxHashMap::default();
        for (face, t) in mesh.triangles.iter().enumerate() {
            for corner in t {
                let place = place_key(mesh.points[*corner as usize]);
                let normal = smoothed_normal(face, &faces_at[&place], &normals);
                let position = mesh.points[*corner as usize].as_vec3().to_array();
                let normal = normal.as_vec3().to_array();
                let index = *known.entry([position, normal].map(|v| v.map(f32::to_bits))).or_insert_with(|| {
                    let colour = [colour.0, colour.1, colour.2, finish as u8];
                    self.vertices.push(SurfaceVertex { position, normal, colour });
                    self.vertices.len() as u32 - 1
                });
                self.indices.push(index);
            }
        }
    }
}

/// Bits of a corner's position and normal.
type SurfaceKey = [[u32; 3]; 2];

/// Area-weighted face normals; zero for a sliver.
fn face_normals(mesh: &TriMesh) -> Vec<DVec3> {
    mesh.triangles.iter().map(|t| mesh.corners(*t)).map(|[a, b, c]| (b - a).cross(c - a)).collect()
}

/// Corners at one place count as one, whatever their index: files repeat corners along seams.
fn place_key(p: DVec3) -> [u32; 3] {
    // Adding zero folds -0 into 0, so that both sides of a symmetry plane meet.
    p.as_vec3().to_array().map(|x| (x + 0.0).to_bits())
}

fn faces_by_place(mesh: &TriMesh) -> FxHashMap<[u32; 3], Vec<usize>> {
    let mut faces: FxHashMap<[u32; 3], Vec<usize>> = FxHashMap::default();
    for (face, t) in mesh.triangles.iter().enumerate() {
        for corner in t {
            faces.entry(place_key(mesh.points[*corner as usize])).or_default().push(face);
        }
    }
    faces
}

fn smoothed_normal(face: usize, around: &[usize], normals: &[DVec3]) -> DVec3 {
    let own = normals[face].normalize_or_zero();
    around
        .iter()
        .map(|other| normals[*other])
        .filter(|n| n.normalize_or_zero().dot(own) >= CREASE_COSINE)
        .sum::<DVec3>()
        .normalize_or(DVec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Primitive;

    #[test]
    fn a_ball_is_smooth_and_a_box_is_not() {
        let grey = Rgb(128, 128, 128);
        let mut ball = SurfaceMesh::default();
        ball.add(&Primitive::Sphere { radius: 1.0 }.tessellate(), grey, Finish::Plastic);
        // Smooth corners are shared.
        assert!(ball.vertices.len() < ball.indices.len() / 4, "{} corners", ball.vertices.len());
        for v in &ball.vertices {
            let along: f32 = (0..3).map(|i| v.position[i] * v.normal[i]).sum();
            assert!(along > 0.995, "{v:?}");
        }
        let mut cube = SurfaceMesh::default();
        cube.add(&Primitive::Cuboid { half: DVec3::ONE }.tessellate(), grey, Finish::Plastic);
        for v in &cube.vertices {
            assert_eq!(v.normal.iter().filter(|n| n.abs() > 0.999).count(), 1, "{v:?}");
        }
    }
}
