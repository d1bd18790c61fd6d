//! Draws egui's output without any graphics driver: textured triangles, blended one after the other in sRGB as egui's
//! own renderers blend them. Paint callbacks (the 3-D view) stay empty.

use egui::epaint::{ColorImage, ImageData, Mesh, Primitive, TextureId, Vertex};
use egui::{FullOutput, TexturesDelta};
use egui_kittest::TestRenderer;
use image::{Rgba, RgbaImage};
use std::collections::BTreeMap;

/// The textures that egui has handed over.
#[derive(Default)]
pub(crate) struct CpuRenderer {
    textures: BTreeMap<TextureId, ColorImage>,
}

impl TestRenderer for CpuRenderer {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        #[expect(clippy::iter_over_hash_type, reason = "textures are independent of each other")]
        for (id, updates) in delta.set.drain() {
            for update in updates {
                let ImageData::Color(part) = &update.image;
                match update.pos {
                    None => drop(self.textures.insert(id, (**part).clone())),
                    Some(corner) => copy_into(self.textures.get_mut(&id).expect("made before"), part, corner),
                }
            }
        }
        #[expect(clippy::iter_over_hash_type, reason = "textures are independent of each other")]
        for id in delta.free.drain() {
            self.textures.remove(&id);
        }
    }

    fn render(&mut self, ctx: &egui::Context, output: &FullOutput) -> Result<RgbaImage, String> {
        let scale = ctx.pixels_per_point();
        let size = ctx.content_rect().size() * scale;
        let mut canvas = Canvas::new(size.x.round() as usize, size.y.round() as usize);
        for clipped in ctx.tessellate(output.shapes.clone(), scale) {
            let clip = clipped.clip_rect * scale;
            if let Primitive::Mesh(mesh) = &clipped.primitive
                && let Some(texture) = self.textures.get(&mesh.texture_id)
            {
                canvas.draw(mesh, texture, scale, clip);
            }
        }
        Ok(canvas.picture())
    }
}

fn copy_into(texture: &mut ColorImage, part: &ColorImage, [left, top]: [usize; 2]) {
    let [width, _] = texture.size;
    for (row, pixels) in part.pixels.chunks_exact(part.size[0].max(1)).enumerate() {
        let from = (top + row) * width + left;
        texture.pixels[from..from + pixels.len()].copy_from_slice(pixels);
    }
}

/// Colours with premultiplied opacity, 0 to 1.
struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 4]>,
}

/// Twice the area of the triangle a, b, p: positive on the inner side of an edge.
fn edge(a: egui::Pos2, b: egui::Pos2, p: egui::Pos2) -> f32 {
    (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[0.0; 4]; width * height] }
    }

    fn draw(&mut self, mesh: &Mesh, texture: &ColorImage, scale: f32, clip: egui::Rect) {
        for triangle in mesh.indices.chunks_exact(3) {
            let corners = [0, 1, 2].map(|k| mesh.vertices[triangle[k] as usize]);
            self.draw_triangle(corners, texture, scale, clip);
        }
    }

    fn draw_triangle(&mut self, mut corners: [Vertex; 3], texture: &ColorImage, scale: f32, clip: egui::Rect) {
        let mut at = corners.map(|v| (v.pos.to_vec2() * scale).to_pos2());
        let mut area = edge(at[0], at[1], at[2]);
        if area < 0.0 {
            corners.swap(1, 2);
            at.swap(1, 2);
            area = -area;
        }
        if area == 0.0 {
            return;
        }
        // A pixel on an edge between two triangles belongs to exactly one of them.
        let owns_edge = |a: egui::Pos2, b: egui::Pos2| (a.y == b.y && b.x > a.x) || b.y < a.y;
        let owned = [owns_edge(at[1], at[2]), owns_edge(at[2], at[0]), owns_edge(at[0], at[1])];
        let bounds = egui::Rect::from_points(&at);
        let from = |low: f32, clip: f32| low.floor().max(clip.round()).max(0.0) as usize;
        let to = |high: f32, clip: f32, end: usize| (high.ceil().min(clip.round()).max(0.0) as usize).min(end);
        for y in from(bounds.min.y, clip.min.y)..to(bounds.max.y, clip.max.y, self.height) {
            for x in from(bounds.min.x, clip.min.x)..to(bounds.max.x, clip.max.x, self.width) {
                let p = egui::pos2(x as f32 + 0.5, y as f32 + 0.5);
                let edges = [edge(at[1], at[2], p), edge(at[2], at[0], p), edge(at[0], at[1], p)];
                if (0..3).all(|k| edges[k] > 0.0 || (edges[k] == 0.0 && owned[k])) {
                    let source = colour_at(&corners, edges.map(|e| e / area), texture);
                    blend(&mut self.pixels[y * self.width + x], source);
                }
            }
        }
    }

    fn picture(&self) -> RgbaImage {
        let byte = |share: f32| (share.clamp(0.0, 1.0) * 255.0).round() as u8;
        RgbaImage::from_fn(self.width as u32, self.height as u32, |x, y| {
            Rgba(self.pixels[y as usize * self.width + x as usize].map(byte))
        })
    }
}

/// Vertex colour times texture at barycentric coordinates.
fn colour_at(corners: &[Vertex; 3], weights: [f32; 3], texture: &ColorImage) -> [f32; 4] {
    let mean = |value: &dyn Fn(&Vertex) -> f32| (0..3).map(|k| weights[k] * value(&corners[k])).sum::<f32>();
    let texel = sample(texture, mean(&|v| v.uv.x), mean(&|v| v.uv.y));
    std::array::from_fn(|channel| texel[channel] * mean(&|v| f32::from(v.color[channel])) / 255.0)
}

/// Bilinear, clamped at the rim.
fn sample(texture: &ColorImage, u: f32, v: f32) -> [f32; 4] {
    let [width, height] = texture.size.map(|n| n as i32);
    let (x, y) = (u * width as f32 - 0.5, v * height as f32 - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let (right_share, low_share) = (x - left, y - top);
    let texel = |dx: i32, dy: i32| {
        let (x, y) = ((left as i32 + dx).clamp(0, width - 1), (top as i32 + dy).clamp(0, height - 1));
        texture.pixels[(y * width + x) as usize].to_array().map(f32::from)
    };
    let rows = [0, 1].map(|dy| {
        let (a, b) = (texel(0, dy), texel(1, dy));
        std::array::from_fn::<f32, 4, _>(|k| a[k] + (b[k] - a[k]) * right_share)
    });
    std::array::from_fn(|k| (rows[0][k] + (rows[1][k] - rows[0][k]) * low_share) / 255.0)
}

/// Premultiplied source over target, rounded to what a byte holds as a frame buffer would.
fn blend(target: &mut [f32; 4], source: [f32; 4]) {
    for k in 0..4 {
        let mixed = source[k] + target[k] * (1.0 - source[3]);
        target[k] = (mixed * 255.0).round() / 255.0;
    }
}
