//! `palpate snapshot`: draws a scene or a stored trial to a PNG file, without a window.

use super::Failure;
use super::setup::{SceneArguments, read_store};
use super::terminal::say;
use glam::Vec2;
use palpate_geometry::drawing::{Camera, DrawList, StandardView};
use palpate_geometry::palette::Theme;
use palpate_lab::grasping::prepare;
use palpate_lab::picture::{PictureView, Stage};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
use palpate_sim::frame::Frame;
use palpate_tactile::trial::TrialId;
use std::path::{Path, PathBuf};

/// Arguments of `palpate snapshot`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate snapshot cube --view front --theme light --out cube.png
  palpate snapshot --trial 1 --at 2.9 --out held.png
  palpate snapshot ball --ghost --bare --out both.png")]
pub(super) struct SnapshotArguments {
    /// Built-in name, a URDF, OBJ or STL file, or `empty` (default: that of the scene).
    object: Option<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Draw this stored trial instead of simulating.
    #[arg(long, value_name = "ID", conflicts_with_all = ["object", "scene"])]
    trial: Option<TrialId>,
    /// Time to draw, from the start (s).
    #[arg(long, value_name = "SECONDS", default_value_t = 2.9)]
    at: f64,
    /// View: home, front, back, left, right, top or bottom.
    #[arg(long, value_name = "NAME", default_value = "home", value_parser = parse_view)]
    view: StandardView,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = parse_size)]
    size: [u32; 2],
    /// Theme: dark or light.
    #[arg(long, value_name = "NAME", default_value = "dark", value_parser = parse_theme)]
    theme: Theme,
    /// Overlay fingers and object as the other engine computes them, translucent.
    #[arg(long, conflicts_with = "trial")]
    ghost: bool,
    /// Leave out force arrows.
    #[arg(long)]
    no_forces: bool,
    /// Leave out axis gizmo, scale bar and legend.
    #[arg(long)]
    bare: bool,
    /// PNG file to write.
    #[arg(long, value_name = "FILE.png")]
    out: PathBuf,
}

fn parse_view(text: &str) -> Result<StandardView, String> {
    let found = StandardView::ALL.into_iter().find(|view| view.name() == text);
    found.ok_or_else(|| "choose home, front, back, left, right, top or bottom".to_owned())
}

fn parse_theme(text: &str) -> Result<Theme, String> {
    Theme::ALL.into_iter().find(|theme| theme.name() == text).ok_or_else(|| "choose dark or light".to_owned())
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = || {
        let (width, height) = text.split_once('x')?;
        Some([width.parse::<u32>().ok()?, height.parse::<u32>().ok()?])
    };
    match parsed() {
        Some(size) if size.iter().all(|s| (16..=2048).contains(s)) => Ok(size),
        _ => Err("write WIDTHxHEIGHT, each from 16 to 2048, as in 1280x800".to_owned()),
    }
}

pub(super) fn run(arguments: &SnapshotArguments, store: Option<&Path>) -> Result<(), Failure> {
    let (stage, frame, badge) = match arguments.trial {
        Some(id) => stored(arguments, store, id)?,
        None => simulated(arguments, Engine::Own)?,
    };
    let ghost = if arguments.ghost { Some(simulated(arguments, Engine::Other)?.1) } else { None };
    let view = PictureView {
        camera: Camera::default().turned_to(arguments.view),
        theme: arguments.theme,
        size: Vec2::new(arguments.size[0] as f32, arguments.size[1] as f32),
        forces: !arguments.no_forces,
        annotations: !arguments.bare,
        badge: Some(badge).filter(|_| !arguments.bare),
        ..PictureView::default()
    };
    let (centre, radius) = stage.bounds();
    let view = PictureView { camera: view.camera.framing(centre, radius), ..view };
    let mut list = stage.draw(&frame, &view);
    if let Some(ghost) = &ghost {
        list.ghosts = stage.ghosts(ghost, view.theme);
    }
    draw(&list, arguments.size, &arguments.out)?;
    say(arguments.out.display())
}

/// Draws a list off-screen and writes it.
fn draw(list: &DrawList, size: [u32; 2], out: &Path) -> Result<(), Failure> {
    let gpu = Gpu::headless(DriverChoice::Any)?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
    Picture::draw(&gpu, &mut renderer, list, size, 1.0)?.save(out)?;
    Ok(())
}

/// Engine to simulate with: that of the scene, or the other one.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Engine {
    Own,
    Other,
}

/// Simulates up to the time to draw.
fn simulated(arguments: &SnapshotArguments, engine: Engine) -> Result<(Stage, Frame, String), Failure> {
    let mut scene = arguments.scene.scene(arguments.object.as_deref())?;
    if engine == Engine::Other {
        scene.solver.engine = scene.solver.engine.other();
    }
    let object = scene.load_object()?;
    let mut run = prepare(&scene, object.as_ref(), 0);
    let stage = Stage::new(&scene, object.as_ref(), run.begun().data.world_from_gripper);
    let mut frame = run.gripper_mut().run_mut().first_look();
    while frame.t < arguments.at {
        match run.next_frame() {
            Some(next) => frame = next.clone(),
            None => break,
        }
    }
    Ok((stage, frame, "SIMULATED".to_owned()))
}

fn stored(arguments: &SnapshotArguments, store: Option<&Path>, id: TrialId) -> Result<(Stage, Frame, String), Failure> {
    let store = read_store(store)?;
    let Some(trial) = store.load(id)?.into_simulated() else {
        let text = format!(
            "trial {id} was not simulated, so there are no poses to draw. Use `palpate trials show {id}`, `palpate trials \
             export {id} --out FILE.csv` or `palpate recognise {id}`"
        );
        return Err(text.into());
    };
    let scene = &trial.header.scene;
    let object = scene.load_object()?;
    let stage = Stage::new(scene, object.as_ref(), trial.data.world_from_gripper);
    let frames = trial.frames();
    let frame = frames.iter().rfind(|f| f.t <= arguments.at).or(frames.first());
    let frame = frame.cloned().ok_or_else(|| format!("trial {id} has no samples"))?;
    Ok((stage, frame, format!("TRIAL {id}, SIMULATED")))
}
