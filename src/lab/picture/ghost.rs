//! Skin of a bent finger as one mesh: for the ghost of another run of the same scene, and for models of other programs.

use glam::Mat4;
use palpate_geometry::drawing::{FingerFrame, Section, SoftFinger, Solid};
use palpate_geometry::palette::Rgb;
use palpate_geometry::{Finish, SurfaceMesh, TriMesh};
use std::sync::Arc;

/// Points across the crown of the pad.
const CROWN_POINTS: u32 = 7;
/// Frames between two of the finger's own, so that its skin is as smooth as the one it is compared with.
const BETWEEN: u32 = 3;

/// A finger in one colour.
pub(super) fn finger(finger: &SoftFinger, colour: Rgb) -> Solid {
    Solid { mesh: Arc::new(skin_mesh(finger, colour)), world_from_mesh: Mat4::IDENTITY, tint: Some(colour) }
}

/// The skin of a finger in one colour, swept along its axis and closed at both ends.
pub fn skin_mesh(finger: &SoftFinger, colour: Rgb) -> SurfaceMesh {
    let outline = outline(&finger.section);
    let mut mesh = TriMesh::default();
    for frame in refined(&finger.frames) {
        let across = frame.inward.cross(frame.along);
        mesh.points.extend(outline.iter().map(|[y, x]| {
            let offset = across * *y + frame.inward * *x;
            (frame.position + offset).as_dvec3()
        }));
    }
    let around = outline.len() as u32;
    let rings = mesh.points.len() as u32 / around;
    for ring in 1..rings {
        for a in 0..around {
            let (b, lower, upper) = ((a + 1) % around, (ring - 1) * around, ring * around);
            mesh.triangles.push([lower + a, lower + b, upper + b]);
            mesh.triangles.push([lower + a, upper + b, upper + a]);
        }
    }
    let last = rings.saturating_sub(1) * around;
    for k in 1..around.saturating_sub(1) {
        mesh.triangles.push([0, k + 1, k]);
        mesh.triangles.push([last, last + k, last + k + 1]);
    }
    if mesh.signed_volume() < 0.0 {
        for triangle in &mut mesh.triangles {
            triangle.swap(1, 2);
        }
    }
    let mut surface = SurfaceMesh::default();
    surface.add(&mesh, colour, Finish::Matt);
    surface
}

/// Corners of the cross-section, once around: across the finger and inward (m).
fn outline(section: &Section) -> Vec<[f32; 2]> {
    let half = 0.5 * section.width;
    let crown = (0..CROWN_POINTS).map(|k| {
        let across = half * (2.0 * k as f32 / (CROWN_POINTS - 1) as f32 - 1.0);
        [across, section.pad - across * across / (2.0 * section.crown_radius)]
    });
    crown.chain([[half, -section.back], [-half, -section.back]]).collect()
}

/// The frames with others between them, on the smooth curve through positions and directions (cubic Hermite).
fn refined(frames: &[FingerFrame]) -> Vec<FingerFrame> {
    let mut all: Vec<FingerFrame> = frames.iter().take(1).copied().collect();
    for pair in frames.windows(2) {
        let [from, to] = [&pair[0], &pair[1]];
        let reach = to.arc - from.arc;
        for k in 1..=BETWEEN + 1 {
            let t = k as f32 / (BETWEEN + 1) as f32;
            let (t2, t3) = (t * t, t * t * t);
            let position = from.position * (2.0 * t3 - 3.0 * t2 + 1.0)
                + from.along * (reach * (t3 - 2.0 * t2 + t))
                + to.position * (3.0 * t2 - 2.0 * t3)
                + to.along * (reach * (t3 - t2));
            all.push(FingerFrame {
                arc: from.arc + t * reach,
                position,
                along: from.along.lerp(to.along, t).normalize_or_zero(),
                inward: from.inward.lerp(to.inward, t).normalize_or_zero(),
            });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use palpate_geometry::drawing::{FingerSensors, TaxelField, Veil};

    #[test]
    fn a_straight_finger_has_its_volume_and_faces_outward() {
        let section = Section { width: 0.02, pad: 0.008, crown_radius: 0.02, back: 0.012 };
        let frame = |arc: f32| FingerFrame { arc, position: -Vec3::Z * arc, along: -Vec3::Z, inward: Vec3::X };
        let frames = vec![frame(0.0), frame(0.04), frame(0.1)];
        let soft = SoftFinger {
            frames,
            section,
            taxels: TaxelField::default(),
            full_scale: 1.0,
            veil: Veil::default(),
            sensors: FingerSensors::default(),
        };
        let surface = finger(&soft, Rgb(9, 9, 9)).mesh;
        let corner = |i: u32| Vec3::from(surface.vertices[i as usize].position).as_dvec3();
        let six: f64 = surface.indices.chunks(3).map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2])))).sum();
        // A box, less the segment that the crown leaves out: w^3 / 24 R of area, a little less for its chords.
        let area = 0.02 * 0.02 - 0.02f64.powi(3) / (24.0 * 0.02);
        assert!((six / 6.0 / (area * 0.1) - 1.0).abs() < 3e-3, "{}", six / 6.0);
    }
}
