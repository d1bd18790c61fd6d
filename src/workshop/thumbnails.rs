//! Small pictures of the built-in objects for the window's list: `palpate-workshop thumbnails`.

use super::Failure;
use glam::Mat4;
use palpate_geometry::drawing::{Detail, DrawList, Ground, Overlay, Solid};
use palpate_geometry::palette::Rgb;
use palpate_lab::picture::{PORTRAIT_BACKDROP, portrait_camera};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
use palpate_sim::objects::{ObjectModel, catalogue};
use palpate_sim::scene::Scene;
use std::path::Path;
use std::sync::Arc;

/// Side of a thumbnail (pixels): shown at 40 points, so that it is sharp on fine screens too.
const SIDE: u32 = 96;
const GROUND: Rgb = Rgb(104, 112, 122);

/// Draws all of them into their folders.
pub(crate) fn draw_all(folder: &Path) -> Result<usize, Failure> {
    // OpenGL's software rasteriser is on most machines and draws alike on all of them.
    let gpu = Gpu::headless(DriverChoice::OpenGl)?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
    for built_in in catalogue() {
        let mut scene = Scene::default();
        scene.object.source.clone_from(&built_in.name);
        if let Some(object) = scene.load_object()? {
            let list = portrait(&object);
            let path = folder.join(&built_in.name).join("thumbnail.png");
            let picture = Picture::draw(&gpu, &mut renderer, &list, [SIDE, SIDE], 1.0)?;
            std::fs::write(&path, picture.to_png()?)?;
        }
    }
    Ok(catalogue().len())
}

/// An object standing alone, filling the picture.
fn portrait(object: &ObjectModel) -> DrawList {
    let (centre, size) = (object.bounds.centre().as_vec3(), object.bounds.size().as_vec3());
    let radius = 0.5 * size.length();
    DrawList {
        camera: portrait_camera(centre, radius),
        backdrop: PORTRAIT_BACKDROP,
        shadow_bounds: (centre, 1.4 * radius),
        ground: Some(Ground { height: object.bounds.min.z as f32, colour: GROUND, grid: GROUND, radius: 6.0 * radius }),
        ghosts: Vec::new(),
        solids: vec![Solid { mesh: Arc::clone(&object.surface), world_from_mesh: Mat4::IDENTITY, tint: None }],
        fingers: Vec::new(),
        arrows: Vec::new(),
        overlay: Overlay::default(),
        detail: Detail::Full,
        inset: None,
    }
}
