//! Ambient occlusion: distances from the eye at half the size of the picture and, computed from them, the openness: the
//! share of its surroundings that each place sees. A picture has four samples per pixel, whose depth cannot be read
//! everywhere, so distances are drawn on their own.

use super::frame::FrameBindings;
use super::screen::screen_pipeline;
use super::shaders;
use super::targets::DEPTH;
use wgpu::{
    BindGroup, BindGroupLayout, CommandEncoder, Device, RenderPass, RenderPipeline, TextureFormat, TextureView,
};

/// Distance from the eye along the direction of view, in 24 bits.
pub(crate) const DISTANCE: TextureFormat = TextureFormat::Rgba8Unorm;
/// Share of the surroundings that a place sees.
const OPENNESS: TextureFormat = TextureFormat::R8Unorm;

/// Pipelines.
#[derive(Debug)]
pub(crate) struct Ambient {
    layout: BindGroupLayout,
    rough: RenderPipeline,
    smooth: RenderPipeline,
}

/// Textures for pictures of one size.
#[derive(Debug)]
pub(crate) struct AmbientTargets {
    distance: TextureView,
    depth: TextureView,
    rough: TextureView,
    pub(crate) openness: TextureView,
    /// Distances alone, and with the rough openness.
    groups: [BindGroup; 2],
}

impl Ambient {
    pub(crate) fn new(device: &Device, frame: &FrameBindings) -> Self {
        let texture = |binding| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("ambient"),
            entries: &[texture(0), texture(1)],
        });
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("ambient"),
            source: wgpu::ShaderSource::Wgsl(shaders::AMBIENT.into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("ambient"),
            bind_group_layouts: &[Some(&frame.unlit_layout), Some(&layout)],
            immediate_size: 0,
        });
        let [rough, smooth] = ["fragment_rough", "fragment_smooth"]
            .map(|entry| screen_pipeline(device, &pipeline_layout, &shader, entry, OPENNESS));
        Self { rough, smooth, layout }
    }

    /// Textures for pictures of this size (pixels).
    pub(crate) fn targets(&self, device: &Device, size: [u32; 2]) -> AmbientTargets {
        let [width, height] = size.map(|side| side.div_ceil(2));
        let texture = |label, format, more| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | more,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let read = wgpu::TextureUsages::TEXTURE_BINDING;
        let distance = texture("distance", DISTANCE, read);
        let rough = texture("openness, rough", OPENNESS, read);
        let openness = texture("openness", OPENNESS, read);
        // While the rough openness is drawn it cannot be bound; nothing reads its place then.
        let groups = [&openness, &rough].map(|second| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("ambient"),
                layout: &self.layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&distance) },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(second) },
                ],
            })
        });
        let depth = texture("distance depth", DEPTH, wgpu::TextureUsages::empty());
        AmbientTargets { distance, depth, rough, openness, groups }
    }

    /// Draws distances by `draw`, and the openness from them.
    pub(crate) fn draw(
        &self,
        encoder: &mut CommandEncoder,
        frame: &FrameBindings,
        targets: &AmbientTargets,
        draw: impl FnOnce(&mut RenderPass<'_>),
    ) {
        {
            let depth = wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            };
            let mut pass = begin(encoder, "distance", &targets.distance, Some(depth));
            pass.set_bind_group(0, &frame.unlit, &[]);
            draw(&mut pass);
        }
        let steps =
            [(&self.rough, &targets.groups[0], &targets.rough), (&self.smooth, &targets.groups[1], &targets.openness)];
        for (pipeline, group, target) in steps {
            let mut pass = begin(encoder, "ambient", target, None);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &frame.unlit, &[]);
            pass.set_bind_group(1, group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

/// Begins a pass into a texture that is white, the farthest and the most open, where nothing is drawn.
fn begin<'a>(
    encoder: &'a mut CommandEncoder,
    label: &str,
    view: &TextureView,
    depth: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
) -> RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            resolve_target: None,
            depth_slice: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::WHITE), store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment: depth,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}
