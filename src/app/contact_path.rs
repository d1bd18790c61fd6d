//! The contact path as a mesh, grown frame by frame while the time that is shown moves on.

use crate::app::features::view::PathLayer;
use crate::app::shown_grasp::ShownGrasp;
use egui::mutex::Mutex;
use palpate_geometry::SurfaceMesh;
use palpate_lab::picture::{ContactPath, PathColour, Stage};
use palpate_sim::frame::Frame;
use std::sync::Arc;

/// Path as drawn last.
#[derive(Default)]
struct DrawnPath {
    path: ContactPath,
    /// Identity of the first frame.
    first: usize,
    colour: Option<PathColour>,
    mesh: Arc<SurfaceMesh>,
}

/// Colours of a layer, where it is drawn.
pub(super) fn path_colour(layer: PathLayer, grasp: &ShownGrasp<'_>) -> Option<PathColour> {
    match layer {
        PathLayer::Off => None,
        PathLayer::Time => Some(PathColour::Time(grasp.span_s.map(|t| t as f32))),
        PathLayer::Pressure => Some(PathColour::Pressure(grasp.full_scale)),
    }
}

/// Where the fingers touched the object until the time shown.
pub(super) fn path_mesh(
    ctx: &egui::Context,
    stage: &Stage,
    grasp: &ShownGrasp<'_>,
    colour: PathColour,
) -> Arc<SurfaceMesh> {
    let until = grasp.frames.partition_point(|frame| frame.t <= grasp.cursor_s + 1e-9);
    let frames = &grasp.frames[..until];
    let first = frames.first().map_or(0, |frame: &&Frame| std::ptr::from_ref(*frame) as usize);
    let drawn: Arc<Mutex<DrawnPath>> =
        ctx.data_mut(|data| Arc::clone(data.get_temp_mut_or_default(egui::Id::unique("contact path"))));
    let mut drawn = drawn.lock();
    if drawn.first != first || drawn.path.frames() > until {
        *drawn = DrawnPath { first, ..DrawnPath::default() };
    }
    if drawn.path.frames() < until || drawn.colour != Some(colour) {
        for frame in &frames[drawn.path.frames()..] {
            stage.extend_path(&mut drawn.path, frame);
        }
        drawn.colour = Some(colour);
        drawn.mesh = Arc::new(drawn.path.mesh(colour));
    }
    Arc::clone(&drawn.mesh)
}
