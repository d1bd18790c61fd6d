//! The ground with its grid.

use super::build::{Depth, PictureShape, UnlitShape, distance_pipeline, module, picture_pipeline, uniform_layout};
use super::{Pass, PassSetup, Prepare};
use bytemuck::{Pod, Zeroable};
use wgpu::{BindGroup, Buffer, RenderPass, RenderPipeline};

/// Mirrors `Ground` in shaders/ground.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct GroundUniform {
    colour: [f32; 3],
    height: f32,
    grid: [f32; 3],
    radius: f32,
}

struct GroundPass {
    pipeline: RenderPipeline,
    distance: RenderPipeline,
    uniform: Buffer,
    group: BindGroup,
    visible: bool,
}

pub(super) fn make(setup: &PassSetup<'_>) -> Box<dyn Pass> {
    let device = setup.device;
    let layout = uniform_layout(device, "ground");
    let shader = module(device, "ground", crate::shaders::GROUND);
    let pipeline = picture_pipeline(
        setup,
        &PictureShape {
            label: "ground",
            shader: &shader,
            vertex: "vertex",
            fragment: "fragment",
            buffers: &[],
            groups: &[&layout],
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            depth: Depth::Veil,
            blends: true,
            culled: None,
        },
    );
    let distance = distance_pipeline(
        setup,
        &UnlitShape {
            label: "ground distance",
            shader: &shader,
            buffers: &[],
            groups: &[&layout],
            topology: wgpu::PrimitiveTopology::TriangleStrip,
        },
    );
    let uniform = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("ground"),
        size: size_of::<GroundUniform>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("ground"),
        layout: &layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
    });
    Box::new(GroundPass { pipeline, distance, uniform, group, visible: false })
}

impl Pass for GroundPass {
    fn prepare(&mut self, prepare: &Prepare<'_>) {
        self.visible = prepare.list.ground.is_some();
        if let Some(ground) = &prepare.list.ground {
            let uniform = GroundUniform {
                colour: ground.colour.to_linear(),
                height: ground.height,
                grid: ground.grid.to_linear(),
                radius: ground.radius,
            };
            prepare.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        }
    }

    fn draw_distance(&self, pass: &mut RenderPass<'_>) {
        self.draw_by(&self.distance, pass);
    }

    fn draw(&self, pass: &mut RenderPass<'_>) {
        self.draw_by(&self.pipeline, pass);
    }
}

impl GroundPass {
    fn draw_by(&self, pipeline: &RenderPipeline, pass: &mut RenderPass<'_>) {
        if self.visible {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, &self.group, &[]);
            pass.draw(0..4, 0..1);
        }
    }
}
