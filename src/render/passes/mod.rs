//! Drawing passes: one file for each kind of item, beside the shader of the same name. Adding one is adding a file, its
//! shader, and a line in [`ALL`].

mod arrow;
mod backdrop;
mod build;
mod ground;
mod overlay;
mod skin;
mod solid;

use super::frame::FrameBindings;
use palpate_geometry::drawing::DrawList;
use wgpu::{Device, Queue, RenderPass};

/// Inputs of creating a pass.
pub(crate) struct PassSetup<'a> {
    pub(crate) device: &'a Device,
    pub(crate) queue: &'a Queue,
    pub(crate) frame: &'a FrameBindings,
}

/// Inputs of preparing a pass for one picture.
#[derive(Clone, Copy)]
pub(crate) struct Prepare<'a> {
    pub(crate) device: &'a Device,
    pub(crate) queue: &'a Queue,
    pub(crate) list: &'a DrawList,
    pub(crate) pixels_per_point: f32,
}

/// Pass that draws one kind of item. Bind group 0 is the frame's and is set already.
pub(crate) trait Pass: Send + Sync {
    /// Uploads what the list holds of this kind.
    fn prepare(&mut self, prepare: &Prepare<'_>);

    /// Draws into the shadow map, where this kind casts a shadow.
    fn draw_shadow(&self, _pass: &mut RenderPass<'_>) {}

    /// Draws its distance from the eye, where this kind takes light from its surroundings.
    fn draw_distance(&self, _pass: &mut RenderPass<'_>) {}

    /// Draws into the picture.
    fn draw(&self, pass: &mut RenderPass<'_>);
}

/// Makes a pass.
pub(crate) type MakePass = fn(&PassSetup<'_>) -> Box<dyn Pass>;

/// All passes in the order in which they are drawn.
pub(crate) const ALL: [MakePass; 7] =
    [backdrop::make, ground::make, solid::make, skin::make, solid::make_ghosts, arrow::make, overlay::make];
