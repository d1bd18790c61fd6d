//! Draws a list: the shadow map and the openness first, then every pass in order, then the resolve.

use super::ambient::{Ambient, AmbientTargets};
use super::frame::FrameBindings;
use super::passes::{self, Pass, PassSetup, Prepare};
use super::shadow::ShadowMap;
use super::targets::Targets;
use palpate_geometry::drawing::{Detail, DrawList};
use wgpu::{BindGroup, CommandEncoder, Device, Queue, Texture, TextureView};

/// Long-lived pipelines and textures; what changes from picture to picture is uploaded by the passes.
pub struct Renderer {
    frame: FrameBindings,
    /// For pictures of full detail, and for fast ones.
    shadows: [ShadowMap; 2],
    ambient: Ambient,
    passes: Vec<Box<dyn Pass>>,
    sized: Option<Sized>,
}

/// What pictures of one size are drawn with.
struct Sized {
    targets: Targets,
    ambient: AmbientTargets,
    /// The frame for passes that are lit, with either shadow map.
    lit: [BindGroup; 2],
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer")
            .field("size", &self.sized.as_ref().map(|sized| sized.targets.size))
            .finish_non_exhaustive()
    }
}

/// Pictures are at least this large (pixels); a panel dragged shut would need less.
const SMALLEST: u32 = 1;

impl Renderer {
    /// Builds all pipelines.
    pub fn new(device: &Device, queue: &Queue) -> Self {
        let shadows = [Detail::Full, Detail::Fast].map(|detail| ShadowMap::new(device, detail));
        let frame = FrameBindings::new(device);
        let ambient = Ambient::new(device, &frame);
        let setup = PassSetup { device, queue, frame: &frame };
        let passes = passes::ALL.iter().map(|make| make(&setup)).collect();
        Self { frame, shadows, ambient, passes, sized: None }
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
        let which = usize::from(list.detail == Detail::Fast);
        self.draw_shadow(encoder, &self.shadows[which]);
        if self.sized.as_ref().map(|sized| sized.targets.size) != Some(size) {
            let ambient = self.ambient.targets(device, size);
            let lit = [0, 1].map(|k| self.frame.lit(device, &self.shadows[k], &ambient.openness));
            self.sized = Some(Sized { targets: Targets::new(device, size), ambient, lit });
        }
        if let Some(sized) = &self.sized {
            self.ambient.draw(encoder, &self.frame, &sized.ambient, |pass| {
                self.passes.iter().for_each(|each| each.draw_distance(pass));
            });
            self.draw_picture(encoder, &sized.targets, &sized.lit[which]);
        }
    }

    fn draw_shadow(&self, encoder: &mut CommandEncoder, map: &ShadowMap) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &map.view,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, &self.frame.unlit, &[]);
        for each in &self.passes {
            each.draw_shadow(&mut pass);
        }
    }

    fn draw_picture(&self, encoder: &mut CommandEncoder, targets: &Targets, lit: &BindGroup) {
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
        pass.set_bind_group(0, lit, &[]);
        for each in &self.passes {
            each.draw(&mut pass);
        }
    }

    /// The finished picture as a view that can be sampled; absent before the first drawing.
    pub fn picture_view(&self) -> Option<&TextureView> {
        self.sized.as_ref().map(|sized| &sized.targets.resolved_view)
    }

    /// The finished picture and its size in pixels.
    pub(crate) fn picture_texture(&self) -> Option<(&Texture, [u32; 2])> {
        self.sized.as_ref().map(|sized| (&sized.targets.resolved, sized.targets.size))
    }
}
