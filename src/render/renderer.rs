//! Draws a list: the shadow map first, then every pass in order, then the resolve.

use super::frame::FrameBindings;
use super::passes::{self, Pass, PassSetup, Prepare};
use super::shadow::ShadowMap;
use super::targets::Targets;
use palpate_geometry::drawing::DrawList;
use wgpu::{CommandEncoder, Device, Queue, Texture, TextureView};

/// Long-lived pipelines and textures; what changes from picture to picture is uploaded by the passes.
pub struct Renderer {
    frame: FrameBindings,
    shadow: ShadowMap,
    passes: Vec<Box<dyn Pass>>,
    targets: Option<Targets>,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("size", &self.targets.as_ref().map(|t| t.size)).finish_non_exhaustive()
    }
}

/// Pictures are at least this large (pixels); a panel dragged shut would need less.
const SMALLEST: u32 = 1;

impl Renderer {
    /// Builds all pipelines.
    pub fn new(device: &Device, queue: &Queue) -> Self {
        let shadow = ShadowMap::new(device);
        let frame = FrameBindings::new(device, &shadow);
        let setup = PassSetup { device, queue, frame: &frame };
        let passes = passes::ALL.iter().map(|make| make(&setup)).collect();
        Self { frame, shadow, passes, targets: None }
    }

    /// Records the drawing of a list into a picture of `size` pixels, at `pixels_per_point`.
    pub fn render(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        list: &DrawList,
        size: [u32; 2],
        pixels_per_point: f32,
    ) {
        let most = device.limits().max_texture_dimension_2d;
        let size = size.map(|s| s.clamp(SMALLEST, most));
        self.frame.write(queue, list, size);
        let prepare = Prepare { device, queue, list, pixels_per_point };
        for pass in &mut self.passes {
            pass.prepare(&prepare);
        }
        self.draw_shadow(encoder);
        if self.targets.as_ref().map(|t| t.size) != Some(size) {
            self.targets = Some(Targets::new(device, size));
        }
        if let Some(targets) = &self.targets {
            self.draw_picture(encoder, targets);
        }
    }

    fn draw_shadow(&self, encoder: &mut CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.shadow.view,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, &self.frame.shadow, &[]);
        for each in &self.passes {
            each.draw_shadow(&mut pass);
        }
    }

    fn draw_picture(&self, encoder: &mut CommandEncoder, targets: &Targets) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.samples,
                resolve_target: Some(&targets.resolved_view),
                depth_slice: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, &self.frame.lit, &[]);
        for each in &self.passes {
            each.draw(&mut pass);
        }
    }

    /// The finished picture as a view that can be sampled; absent before the first drawing.
    pub fn picture_view(&self) -> Option<&TextureView> {
        self.targets.as_ref().map(|t| &t.resolved_view)
    }

    /// The finished picture and its size in pixels.
    pub(crate) fn picture_texture(&self) -> Option<(&Texture, [u32; 2])> {
        self.targets.as_ref().map(|t| (&t.resolved, t.size))
    }
}
