//! Small picture of an object for lists, drawn without a graphics card. Meshes with holes show their inside.

use glam::{Vec2, Vec3};
use palpate_geometry::SurfaceMesh;
use palpate_geometry::drawing::{Camera, StandardView};
use palpate_geometry::palette::Rgb;

/// Backdrop from top to bottom; it suits both themes.
pub const PORTRAIT_BACKDROP: [Rgb; 2] = [Rgb(122, 131, 142), Rgb(84, 92, 102)];
/// Samples per pixel in each direction.
const SAMPLES: u32 = 2;
/// Radius to which objects are scaled (m), so that the camera fits large and small ones alike.
const RADIUS: f32 = 0.05;
/// Brightness that no light adds to, and that of a face towards the light.
const AMBIENT: f32 = 0.35;
const LIGHT: f32 = 0.75;

/// Camera that looks at an object standing alone and fills the picture with it: the centre and radius (m) of a ball
/// around it.
pub fn portrait_camera(centre: Vec3, radius: f32) -> Camera {
    Camera { pitch: 0.45, ..Camera::default().turned_to(StandardView::Home) }.framing(centre, 0.98 * radius)
}

/// Draws a surface into a square of `side` pixels: red, green, blue and opacity, row by row from the top. Nothing but the
/// backdrop for a surface without a finite extent.
pub fn portrait(surface: &SurfaceMesh, side: u32) -> Vec<u8> {
    let fine = side * SAMPLES;
    let mut canvas = Canvas::new(fine);
    let positions = || surface.vertices.iter().map(|vertex| Vec3::from(vertex.position));
    let low = positions().fold(Vec3::INFINITY, Vec3::min);
    let high = positions().fold(Vec3::NEG_INFINITY, Vec3::max);
    let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    if radius.is_finite() && radius > 0.0 && centre.is_finite() {
        let camera = portrait_camera(Vec3::ZERO, RADIUS);
        let [right, up, back] = camera.axes();
        let light = (0.9 * back + 0.7 * up - 0.5 * right).normalize();
        let clip_from_world = camera.clip_from_world(1.0);
        let corners: Vec<Corner> = surface
            .vertices
            .iter()
            .map(|vertex| {
                let place = (Vec3::from(vertex.position) - centre) * (RADIUS / radius);
                let clip = clip_from_world * place.extend(1.0);
                let normal = Vec3::from(vertex.normal);
                // A face seen from behind is the inside of a mesh with holes.
                let facing = normal.dot(camera.eye() - place).signum();
                let [r, g, b, _] = vertex.colour;
                Corner {
                    at: (Vec2::new(0.5, 0.5) + Vec2::new(0.5, -0.5) * clip.truncate().truncate() / clip.w)
                        * fine as f32,
                    nearness: 1.0 / clip.w,
                    colour: Vec3::from(Rgb(r, g, b).to_unit())
                        * (AMBIENT + LIGHT * (facing * normal).dot(light).max(0.0)),
                }
            })
            .collect();
        for triangle in surface.indices.chunks_exact(3) {
            if let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|k| corners.get(triangle[k] as usize)) {
                canvas.fill([a, b, c]);
            }
        }
    }
    canvas.averaged(side)
}

/// Corner of a triangle in the picture.
struct Corner {
    /// Place (fine pixels from the top left).
    at: Vec2,
    /// Inverse of the distance from the eye (1/m).
    nearness: f32,
    /// Shaded colour, 0..1.
    colour: Vec3,
}

/// Fine pixels with the nearness of what they show.
struct Canvas {
    side: u32,
    colours: Vec<Vec3>,
    nearness: Vec<f32>,
}

impl Canvas {
    fn new(side: u32) -> Self {
        let [top, bottom] = PORTRAIT_BACKDROP.map(|colour| Vec3::from(colour.to_unit()));
        let row = |y: u32| top.lerp(bottom, y as f32 / side as f32);
        let colours = (0..side).flat_map(|y| std::iter::repeat_n(row(y), side as usize)).collect();
        Self { side, colours, nearness: vec![0.0; (side * side) as usize] }
    }

    /// Fills a triangle where nothing nearer is.
    fn fill(&mut self, [a, b, c]: [&Corner; 3]) {
        let doubled_area = (b.at - a.at).perp_dot(c.at - a.at);
        if !doubled_area.is_finite() || doubled_area == 0.0 {
            return;
        }
        let last = self.side as f32 - 1.0;
        let low = a.at.min(b.at).min(c.at).floor().clamp(Vec2::ZERO, Vec2::splat(last));
        let high = a.at.max(b.at).max(c.at).ceil().clamp(Vec2::ZERO, Vec2::splat(last));
        for y in low.y as u32..=high.y as u32 {
            for x in low.x as u32..=high.x as u32 {
                let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let v = (at - a.at).perp_dot(c.at - a.at) / doubled_area;
                let w = (b.at - a.at).perp_dot(at - a.at) / doubled_area;
                let u = 1.0 - v - w;
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let nearness = u * a.nearness + v * b.nearness + w * c.nearness;
                let pixel = (y * self.side + x) as usize;
                if nearness > self.nearness[pixel] {
                    self.nearness[pixel] = nearness;
                    self.colours[pixel] = u * a.colour + v * b.colour + w * c.colour;
                }
            }
        }
    }

    /// The picture with several fine pixels in each pixel.
    fn averaged(&self, side: u32) -> Vec<u8> {
        let mut bytes = Vec::with_capacity((4 * side * side) as usize);
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let samples = (0..SAMPLES * SAMPLES).map(|k| {
                let [row, column] = [y * SAMPLES + k / SAMPLES, x * SAMPLES + k % SAMPLES];
                self.colours[(row * self.side + column) as usize]
            });
            let Rgb(r, g, b) = Rgb::from_unit((samples.sum::<Vec3>() / (SAMPLES * SAMPLES) as f32).to_array());
            bytes.extend([r, g, b, 255]);
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use palpate_geometry::{Finish, Primitive, TriMesh};

    /// Share of the pixels that differ from the backdrop, and the pixels.
    fn drawn(mesh: &TriMesh, colour: Rgb) -> (f64, Vec<u8>) {
        let mut surface = SurfaceMesh::default();
        surface.add(mesh, colour, Finish::Plastic);
        let [picture, backdrop] = [&surface, &SurfaceMesh::default()].map(|surface| portrait(surface, 32));
        let differ = picture.chunks(4).zip(backdrop.chunks(4)).filter(|(a, b)| a != b).count();
        (differ as f64 / 1024.0, picture)
    }

    #[test]
    fn an_object_fills_its_picture_at_any_size_with_or_without_holes() {
        let red = Rgb(200, 20, 20);
        let shares = [0.001, 0.03, 40.0].map(|half| {
            let cube = Primitive::Cuboid { half: DVec3::splat(half) }.tessellate();
            let (share, picture) = drawn(&cube, red);
            let centre = &picture[4 * (16 * 32 + 16)..][..3];
            assert!(centre[0] > 2 * centre[1] && centre[0] > 2 * centre[2], "{centre:?}");
            share
        });
        assert!((0.3..0.8).contains(&shares[0]), "{shares:?}");
        assert!(shares.iter().all(|share| (share - shares[0]).abs() < 0.02), "{shares:?}");
        // Without its upper side one looks into the box and sees the lower side from within.
        let mut open = Primitive::Cuboid { half: DVec3::splat(0.03) }.tessellate();
        let whole = drawn(&open, red);
        open.triangles.retain(|t| t.iter().any(|k| open.points[*k as usize].z < 0.0));
        let opened = drawn(&open, red);
        assert_ne!(opened.1, whole.1);
        assert!((opened.0 - whole.0).abs() < 0.05, "{} {}", opened.0, whole.0);
    }

    #[test]
    fn what_cannot_be_drawn_leaves_the_backdrop() {
        let point = TriMesh { points: vec![DVec3::ONE; 3], triangles: vec![[0, 1, 2]] };
        let endless = TriMesh { points: vec![DVec3::INFINITY, DVec3::ZERO, DVec3::ONE], triangles: vec![[0, 1, 2]] };
        assert_eq!([point, endless].map(|mesh| drawn(&mesh, Rgb(255, 0, 0)).0), [0.0, 0.0]);
    }
}
