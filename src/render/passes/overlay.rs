//! Flat shapes and text over the picture.

use super::build::{Depth, PictureShape, StreamBuffer, module, picture_pipeline, texel_entry};
use super::{Pass, PassSetup, Prepare};
use crate::text::{Glyphs, PlacedGlyph};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;
use palpate_geometry::drawing::Shape2;
use palpate_geometry::palette::Rgb;
use wgpu::{BindGroup, BufferUsages, RenderPass, RenderPipeline, VertexBufferLayout, VertexStepMode};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Vertex {
    /// Pixels from the top left.
    position: [f32; 2],
    /// Texel of the glyph atlas, or negative.
    glyph: [f32; 2],
    colour: [u8; 4],
}

const ATTRIBUTES: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32x2, 2 => Unorm8x4];
const NO_GLYPH: Vec2 = Vec2::splat(-1.0);

struct OverlayPass {
    pipeline: RenderPipeline,
    glyphs: Glyphs,
    group: BindGroup,
    vertices: StreamBuffer,
    count: u32,
}

pub(super) fn make(setup: &PassSetup<'_>) -> Box<dyn Pass> {
    let device = setup.device;
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("overlay"),
        entries: &[texel_entry(0)],
    });
    let shader = module(device, "overlay", crate::shaders::OVERLAY);
    let buffers = [Some(VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: VertexStepMode::Vertex,
        attributes: &ATTRIBUTES,
    })];
    let pipeline = picture_pipeline(
        setup,
        &PictureShape {
            label: "overlay",
            shader: &shader,
            vertex: "vertex",
            fragment: "fragment",
            buffers: &buffers,
            groups: &[&layout],
            topology: wgpu::PrimitiveTopology::TriangleList,
            depth: Depth::OnTop,
            blends: true,
            culled: None,
        },
    );
    let glyphs = Glyphs::new(device);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("overlay"),
        layout: &layout,
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::TextureView(glyphs.atlas_view()),
        }],
    });
    let vertices = StreamBuffer::new("overlay", BufferUsages::VERTEX);
    Box::new(OverlayPass { pipeline, glyphs, group, vertices, count: 0 })
}

/// Triangles collected so far, in pixels.
#[derive(Default)]
struct Triangles(Vec<Vertex>);

impl Triangles {
    fn quad(&mut self, corners: [Vec2; 4], glyph: [Vec2; 4], colours: [Rgb; 4], opacity: f32) {
        let alpha = (opacity.clamp(0.0, 1.0) * 255.0).round() as u8;
        let vertex = |i: usize| Vertex {
            position: corners[i].to_array(),
            glyph: glyph[i].to_array(),
            colour: [colours[i].0, colours[i].1, colours[i].2, alpha],
        };
        self.0.extend([0, 1, 2, 0, 2, 3].map(vertex));
    }

    fn line(&mut self, from: Vec2, to: Vec2, width: f32, colour: Rgb, opacity: f32) {
        let side = (to - from).normalize_or_zero().perp() * (0.5 * width);
        self.quad([from - side, to - side, to + side, from + side], [NO_GLYPH; 4], [colour; 4], opacity);
    }

    fn disc(&mut self, centre: Vec2, radius: f32, colour: Rgb) {
        const WEDGES: u32 = 12;
        let rim = |k: u32| centre + Vec2::from_angle(std::f32::consts::TAU * k as f32 / (2 * WEDGES) as f32) * radius;
        for k in 0..WEDGES {
            let corners = [centre, rim(2 * k), rim(2 * k + 1), rim(2 * k + 2)];
            self.quad(corners, [NO_GLYPH; 4], [colour; 4], 1.0);
        }
    }

    fn glyph(&mut self, glyph: &PlacedGlyph, colour: Rgb) {
        let corners =
            |min: Vec2, size: Vec2| [min, min + Vec2::new(size.x, 0.0), min + size, min + Vec2::new(0.0, size.y)];
        self.quad(corners(glyph.at, glyph.size), corners(glyph.texel, glyph.size), [colour; 4], 1.0);
    }
}

impl Pass for OverlayPass {
    fn prepare(&mut self, prepare: &Prepare<'_>) {
        let scale = prepare.pixels_per_point;
        let mut triangles = Triangles::default();
        for shape in &prepare.list.overlay.shapes {
            match shape {
                Shape2::Line { from, to, width, colour, opacity } => {
                    triangles.line(*from * scale, *to * scale, width * scale, *colour, *opacity);
                }
                Shape2::Rectangle { min, max, colours: [left, right], opacity } => {
                    let (min, max) = (*min * scale, *max * scale);
                    let corners = [min, Vec2::new(max.x, min.y), max, Vec2::new(min.x, max.y)];
                    triangles.quad(corners, [NO_GLYPH; 4], [*left, *right, *right, *left], *opacity);
                }
                Shape2::Disc { centre, radius, colour } => triangles.disc(*centre * scale, radius * scale, *colour),
                Shape2::Text { at, align, size, colour, text } => {
                    for glyph in self.glyphs.lay_out(*at * scale, *align, size * scale, text) {
                        triangles.glyph(&glyph, *colour);
                    }
                }
            }
        }
        self.glyphs.upload(prepare.queue);
        self.count = triangles.0.len() as u32;
        self.vertices.write(prepare.device, prepare.queue, bytemuck::cast_slice(&triangles.0));
    }

    fn draw(&self, pass: &mut RenderPass<'_>) {
        let Some(vertices) = self.vertices.get().filter(|_| self.count > 0) else {
            return;
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.draw(0..self.count, 0..1);
    }
}
