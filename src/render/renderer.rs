//! Draws a [`DrawList`]: the shadow map and the ambient occlusion, then all passes in order, resolved from four samples
//! per pixel to one. An inset (a picture within the picture) is drawn beforehand into its own texture and copied in.

use super::ambient::{Ambient, AmbientTargets};
use super::frame::FrameBindings;
use super::passes::{self, Pass, PassSetup, Prepare};
use super::shadow::ShadowMap;
use super::targets::Targets;
use glam::Vec2;
use palpate_geometry::drawing::{Detail, DrawList};
use wgpu::{BindGroup, CommandEncoder, Device, Queue, Texture, TextureView};

/// Long-lived pipelines and textures. The passes upload what changes from picture to picture.
pub struct Renderer {
    frame: FrameBindings,
    /// Shadow maps for full and for fast detail.
    shadows: [ShadowMap; 2],
    ambient: Ambient,
    passes: Vec<Box<dyn Pass>>,
    /// The picture, and its inset.
    sized: [Option<SizeTargets>; 2],
    /// The earlier moment that the inset shows, its size and detail.
    past: Option<(u64, [u32; 2], Detail)>,
}

/// Textures and bindings for one picture size.
struct SizeTargets {
    targets: Targets,
    ambient: AmbientTargets,
    /// Bindings of the lit passes, one for each shadow map.
    lit: [BindGroup; 2],
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer")
            .field("size", &self.sized[PICTURE].as_ref().map(|sized| sized.targets.size))
            .finish_non_exhaustive()
    }
}

/// Places in [`Renderer::sized`].
const PICTURE: usize = 0;
const INSET: usize = 1;

/// A place in a picture, from points to whole pixels.
fn whole(place: Vec2, pixels_per_point: f32) -> [u32; 2] {
    (place * pixels_per_point).round().max(Vec2::ONE).as_uvec2().to_array()
}

/// Smallest width and height of a picture (pixels): a panel may be dragged shut.
const SMALLEST: u32 = 1;

impl Renderer {
    /// Builds all pipelines.
    pub fn new(device: &Device, queue: &Queue) -> Self {
        let shadows = [Detail::Full, Detail::Fast].map(|detail| ShadowMap::new(device, detail));
        let frame = FrameBindings::new(device);
        let ambient = Ambient::new(device, &frame);
        let setup = PassSetup { device, queue, frame: &frame };
        let passes = passes::ALL.iter().map(|make| make(&setup)).collect();
        Self { frame, shadows, ambient, passes, sized: [None, None], past: None }
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
        let prepare = Prepare { device, queue, list, pixels_per_point };
        let whole_inset = list.inset.as_ref().map(|inset| whole(inset.size, pixels_per_point).map(|s| s.min(most)));
        let past =
            list.inset.as_ref().zip(whole_inset).and_then(|(own, size)| Some((own.past?, size, own.list.detail)));
        let is_drawn = std::mem::replace(&mut self.past, past) == past && past.is_some();
        if let Some((inset, inner)) = list.inset.as_ref().zip(whole_inset).filter(|_| !is_drawn) {
            // The inset gets its own submission, because the passes can hold only one draw list at a time.
            let mut first = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.draw(&mut first, &Prepare { list: &inset.list, ..prepare }, inner, INSET);
            queue.submit([first.finish()]);
        }
        self.draw(encoder, &prepare, size, PICTURE);
        if let Some(inset) = &list.inset {
            self.copy_inset(encoder, whole(inset.corner, pixels_per_point));
        }
    }

    fn draw(&mut self, encoder: &mut CommandEncoder, prepare: &Prepare<'_>, size: [u32; 2], target: usize) {
        let Prepare { device, queue, list, .. } = *prepare;
        self.frame.write(queue, list, size);
        for pass in &mut self.passes {
            pass.prepare(prepare);
        }
        let which = usize::from(list.detail == Detail::Fast);
        // Picture and inset of one moment use the same shadow map. It is drawn with the inset's list, which comes first, so a
        // list that has an inset skips it.
        if list.inset.as_ref().is_none_or(|inset| inset.past.is_some()) {
            self.draw_shadow(encoder, &self.shadows[which]);
        }
        if self.sized[target].as_ref().map(|sized| sized.targets.size) != Some(size) {
            let ambient = self.ambient.targets(device, size);
            let lit = [0, 1].map(|k| self.frame.lit(device, &self.shadows[k], &ambient.openness));
            self.sized[target] = Some(SizeTargets { targets: Targets::new(device, size), ambient, lit });
        }
        if let Some(sized) = &self.sized[target] {
            self.ambient.draw(encoder, &self.frame, &sized.ambient, |pass| {
                self.passes.iter().for_each(|each| each.draw_distance(pass));
            });
            self.draw_picture(encoder, &sized.targets, &sized.lit[which]);
        }
    }

    /// Copies the inset into the picture.
    fn copy_inset(&self, encoder: &mut CommandEncoder, corner: [u32; 2]) {
        let [Some(picture), Some(inset)] = &self.sized else { return };
        let room = [0, 1].map(|k| inset.targets.size[k].min(picture.targets.size[k].saturating_sub(corner[k])));
        let mut place = picture.targets.resolved.as_image_copy();
        place.origin = wgpu::Origin3d { x: corner[0], y: corner[1], z: 0 };
        let extent = wgpu::Extent3d { width: room[0], height: room[1], depth_or_array_layers: 1 };
        encoder.copy_texture_to_texture(inset.targets.resolved.as_image_copy(), place, extent);
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
        self.sized[PICTURE].as_ref().map(|sized| &sized.targets.resolved_view)
    }

    /// The finished picture and its size in pixels.
    pub(crate) fn picture_texture(&self) -> Option<(&Texture, [u32; 2])> {
        self.sized[PICTURE].as_ref().map(|sized| (&sized.targets.resolved, sized.targets.size))
    }
}
