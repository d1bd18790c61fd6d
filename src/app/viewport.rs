//! The renderer inside egui: it draws into a texture of its own before egui's pass begins, and copies that texture
//! into the window during it.

use egui_wgpu::{CallbackResources, CallbackTrait, RenderState, ScreenDescriptor};
use palpate_geometry::drawing::DrawList;
use palpate_lab::picture::PictureView;
use palpate_render::wgpu;
use palpate_render::{Blit, Renderer};
use std::sync::Arc;

/// Renderer and blit, kept by egui between frames.
#[derive(Debug)]
pub struct Viewport {
    renderer: Renderer,
    blit: Blit,
    shown: Option<PictureKey>,
}

impl Viewport {
    /// Builds the pipelines and hands them to egui.
    pub fn install(state: &RenderState) {
        let viewport = Self {
            renderer: Renderer::new(&state.device, &state.queue),
            blit: Blit::new(&state.device, state.target_format),
            shown: None,
        };
        state.renderer.write().callback_resources.insert(viewport);
    }
}

/// Requests no more of the graphics driver than the renderer needs; of all interfaces where none is named.
pub(super) fn wgpu_options(backends: Option<wgpu::Backends>) -> egui_wgpu::WgpuConfiguration {
    let mut setup = egui_wgpu::WgpuSetupCreateNew::without_display_handle();
    if let Some(backends) = backends {
        setup.instance_descriptor.backends = backends;
    }
    setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("palpate window"),
        required_limits: palpate_render::wanted_limits(adapter),
        ..Default::default()
    });
    egui_wgpu::WgpuConfiguration { wgpu_setup: setup.into(), ..Default::default() }
}

/// Contents of a picture; while they stay the same nothing is drawn again.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PictureKey {
    pub(super) grasp: u64,
    pub(super) sample: f64,
    /// Time of the ghost's frame, where one is drawn (s).
    pub(super) ghost: Option<f64>,
    /// Curvature of the real fingers, where they are drawn (1/m).
    pub(super) real: Option<[Option<f64>; 2]>,
    pub(super) view: PictureView,
    pub(super) pixels: [u32; 2],
    pub(super) pixels_per_point: f32,
}

/// Draws one list.
pub(super) struct Paint {
    pub(super) key: PictureKey,
    pub(super) list: DrawList,
}

impl CallbackTrait for Paint {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(viewport) = resources.get_mut::<Viewport>()
            && viewport.shown.as_ref() != Some(&self.key)
        {
            let PictureKey { pixels, pixels_per_point, .. } = &self.key;
            viewport.renderer.render(device, queue, encoder, &self.list, *pixels, *pixels_per_point);
            if let Some(picture) = viewport.renderer.picture_view() {
                viewport.blit.set_source(device, picture);
            }
            viewport.shown = Some(self.key.clone());
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        if let Some(viewport) = resources.get::<Viewport>() {
            viewport.blit.draw(pass);
        }
    }
}
