//! Draws a stored trial at a time: `cargo run --release -p palpate-render --example draw_trial -- trials.sqlite 1 2.9`.

#![expect(clippy::print_stdout, reason = "an example that says what it did")]

use glam::Vec2;
use palpate_geometry::drawing::StandardView;
use palpate_lab::picture::{PictureView, Stage};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
use palpate_store::Store;
use palpate_tactile::trial::TrialData;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let path = PathBuf::from(arguments.next().ok_or("name a store")?);
    let id = arguments.next().and_then(|id| id.to_str()?.parse().ok()).ok_or("name a trial by its number")?;
    let at_s = arguments.next().and_then(|at| at.to_str()?.parse().ok()).unwrap_or(2.9);
    let trial = Store::open(&path)?.load(id)?;
    let TrialData::Simulated(data) = &trial.data else { return Err("only simulated trials have frames".into()) };
    let scene = &trial.header.scene;
    let stage = Stage::new(scene, scene.load_object()?.as_ref(), data.world_from_gripper);
    let shown = data.frames.partition_point(|frame| frame.t < at_s).min(data.frames.len().saturating_sub(1));
    let frame = data.frames.get(shown).ok_or("the trial has no samples")?;
    let size = [1280, 800];
    let view = PictureView {
        size: Vec2::new(size[0] as f32, size[1] as f32),
        full_scale: stage.full_scale_of(&data.frames),
        ..PictureView::default()
    };
    let camera = stage.camera(StandardView::Home, frame, &view);
    let list = stage.draw(frame, &PictureView { camera, ..view });
    let gpu = Gpu::headless(DriverChoice::Any)?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
    std::fs::write("trial.png", Picture::draw(&gpu, &mut renderer, &list, size, 1.0)?.to_png()?)?;
    println!("trial.png");
    Ok(())
}
