//! Force arrows: one unit mesh, an instance for each.

use super::build::{Depth, PictureShape, StreamBuffer, fixed_buffer, module, picture_pipeline};
use super::{Pass, PassSetup, Prepare};
use bytemuck::{Pod, Zeroable};
use std::f32::consts::TAU;
use wgpu::{Buffer, BufferUsages, RenderPass, RenderPipeline, VertexBufferLayout, VertexStepMode};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
}

/// Mirrors `Instance` in shaders/arrow.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Instance {
    origin: [f32; 3],
    radius: f32,
    reach: [f32; 4],
    colour: [f32; 4],
}

struct ArrowPass {
    visible: RenderPipeline,
    hidden: RenderPipeline,
    vertices: Buffer,
    vertex_count: u32,
    instances: StreamBuffer,
    count: u32,
}

const ATTRIBUTES: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
const INSTANCE_ATTRIBUTES: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![2 => Float32x4, 3 => Float32x4, 4 => Float32x4];

pub(super) fn make(setup: &PassSetup<'_>) -> Box<dyn Pass> {
    let shader = module(setup.device, "arrow", crate::shaders::ARROW);
    let buffers = [
        Some(VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: VertexStepMode::Vertex,
            attributes: &ATTRIBUTES,
        }),
        Some(VertexBufferLayout {
            array_stride: size_of::<Instance>() as u64,
            step_mode: VertexStepMode::Instance,
            attributes: &INSTANCE_ATTRIBUTES,
        }),
    ];
    let pipeline = |label, fragment, depth, blends| {
        let shape = PictureShape {
            label,
            shader: &shader,
            vertex: "vertex",
            fragment,
            buffers: &buffers,
            groups: &[],
            topology: wgpu::PrimitiveTopology::TriangleList,
            depth,
            blends,
            culled: None,
        };
        picture_pipeline(setup, &shape)
    };
    let mesh = unit_arrow();
    Box::new(ArrowPass {
        visible: pipeline("arrow", "fragment", Depth::Solid, false),
        hidden: pipeline("arrow, hidden part", "fragment_hidden", Depth::Hidden, true),
        vertices: fixed_buffer(setup.device, setup.queue, "arrow", BufferUsages::VERTEX, bytemuck::cast_slice(&mesh)),
        vertex_count: mesh.len() as u32,
        instances: StreamBuffer::new("arrow instances", BufferUsages::VERTEX),
        count: 0,
    })
}

/// Radius of the head in units of the shaft's.
const HEAD: f32 = 2.6;

/// A shaft over z 0..1 with radius 1, and a head over z 1..2 that ends in a point.
fn unit_arrow() -> Vec<Vertex> {
    const AROUND: u32 = 16;
    let rim = |k: u32| {
        let (sin, cos) = (TAU * k as f32 / AROUND as f32).sin_cos();
        [cos, sin]
    };
    let at = |[x, y]: [f32; 2], radius: f32, z: f32, tilt: f32| {
        // The normal leans towards the point by `tilt`.
        let flat = (1.0 - tilt * tilt).sqrt();
        Vertex { position: [x * radius, y * radius, z], normal: [x * flat, y * flat, tilt] }
    };
    let mut mesh = Vec::new();
    for k in 0..AROUND {
        let (a, b) = (rim(k), rim(k + 1));
        let mut quad = |lower: (f32, f32), upper: (f32, f32), tilt: f32| {
            let corner = |side, (radius, z): (f32, f32)| at(side, radius, z, tilt);
            let corners = [corner(a, lower), corner(b, lower), corner(b, upper), corner(a, upper)];
            mesh.extend([0, 1, 2, 0, 2, 3].map(|i: usize| corners[i]));
        };
        quad((0.0, 0.0), (1.0, 0.0), -1.0);
        quad((1.0, 0.0), (1.0, 1.0), 0.0);
        quad((1.0, 1.0), (HEAD, 1.0), -1.0);
        quad((HEAD, 1.0), (0.0, 2.0), 0.4);
    }
    mesh
}

impl Pass for ArrowPass {
    fn prepare(&mut self, prepare: &Prepare<'_>) {
        let instances: Vec<Instance> = prepare
            .list
            .arrows
            .iter()
            .map(|arrow| {
                let [r, g, b] = arrow.colour.to_linear();
                Instance {
                    origin: arrow.from.to_array(),
                    radius: arrow.radius,
                    reach: (arrow.to - arrow.from).extend(0.0).to_array(),
                    colour: [r, g, b, 1.0],
                }
            })
            .collect();
        self.count = instances.len() as u32;
        self.instances.write(prepare.device, prepare.queue, bytemuck::cast_slice(&instances));
    }

    fn draw(&self, pass: &mut RenderPass<'_>) {
        let Some(instances) = self.instances.get().filter(|_| self.count > 0) else {
            return;
        };
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_vertex_buffer(1, instances.slice(..));
        for pipeline in [&self.hidden, &self.visible] {
            pass.set_pipeline(pipeline);
            pass.draw(0..self.vertex_count, 0..self.count);
        }
    }
}
