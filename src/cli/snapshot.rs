//! `palpate snapshot`: draws a scene or a stored trial to a PNG file, without a window.

use super::check::warn_unless_trusted;
use super::output::TemporaryFolder;
use super::prelude::*;
use super::setup::store_path;
use super::terminal::error;
use crate::app::{Mode, OffscreenWindow, window_picture};
use clap::Parser as _;
use glam::Vec2;
use palpate_geometry::drawing::{DrawList, StandardView};
use palpate_geometry::palette::Theme;
use palpate_lab::grasping::{grasp, prepare};
use palpate_lab::inspection::{Keep, OpenOptions, OpenTrial};
use palpate_lab::picture::{PictureView, Stage};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer, THRESHOLDS};
use palpate_sim::PHYSICS_VERSION;
use palpate_sim::frame::Frame;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::TrialSource;
use std::process::ExitCode;
use std::sync::Arc;

/// Arguments of `palpate snapshot`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate snapshot cube --view front --theme light --out cube.png
  palpate snapshot --trial 1 --at 2.9 --out held.png
  palpate snapshot lemon --view touch --out pad.png
  palpate snapshot ball --ghost --bare --out both.png
  palpate snapshot --panels lemon --at 2.9 --out window.png
  palpate snapshot --panels --trial 1 --out inspect.png
  palpate snapshot cube --compare golden/cube.png --bless
  palpate snapshot cube --out now.png --compare golden/cube.png --tolerance 2 --pixels 150
  palpate snapshot --list pictures.txt

Exit codes with --compare: 0 same, 1 differs, 2 wrong use, 3 not compared. With --list the greatest of its lines.

A picture says in its text chunks which program, physics and driver drew it, and of which scene: `exiftool cube.png`, or
`identify -verbose cube.png`.

See also: palpate help testing, palpate check --help")]
pub(super) struct SnapshotArguments {
    /// Built-in name, a URDF, OBJ or STL file, or `empty` (default: that of the scene).
    object: Option<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Draw this stored trial instead of simulating. Fingers of a real one are arcs of the curvature that was read.
    #[arg(long, value_name = "ID", conflicts_with_all = ["object", "scene"])]
    trial: Option<TrialId>,
    /// Time to draw, from the start (s; default: 2.9 s, or the end of a shorter grasp).
    #[arg(long, value_name = "SECONDS")]
    at: Option<f64>,
    /// Draw the whole window, with its panels.
    #[arg(long, conflicts_with_all = ["view", "ghost", "no_forces", "bare"])]
    panels: bool,
    /// Mode of the window: demo, inspect, label or study (default: inspect with --trial, else demo).
    #[arg(long, value_name = "NAME", requires = "panels", value_parser = one_of(MODES))]
    mode: Option<Mode>,
    /// View: hand, front, back, left, right, top or bottom; or touch, from nearby through the finger in front.
    #[arg(long, value_name = "NAME", default_value = "hand", value_parser = one_of(ShownPart::named()))]
    view: ShownPart,
    /// Width and height in pixels (default: 1280x800; a window 1280x820).
    #[arg(long, value_name = "WxH", value_parser = sides_from(16))]
    size: Option<[u32; 2]>,
    /// Theme: dark or light.
    #[arg(long, value_name = "NAME", default_value = "dark", value_parser = one_of(Theme::ALL.map(|theme| (theme.name(), theme))))]
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
    /// Driver: software (the same on every machine), gl, vulkan or any.
    #[arg(long, value_name = "NAME", default_value = "any", value_parser = one_of(DriverChoice::NAMED))]
    driver: DriverChoice,
    /// Draw many pictures: each line of this file holds the arguments of one, without `palpate snapshot` (# begins a
    /// remark).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["object", "scene", "trial", "at", "panels", "view", "out", "compare"])]
    list: Option<PathBuf>,
    /// PNG file to write.
    #[arg(long, value_name = "FILE.png", required_unless_present_any = ["compare", "list"], value_parser = file_of(&[FileKind::Png]))]
    out: Option<PathBuf>,
    /// Compare with this PNG file. With --out, a picture of the differences is beside it.
    #[arg(long, value_name = "GOLDEN.png", value_parser = file_of(&[FileKind::Png]))]
    compare: Option<PathBuf>,
    /// Make this picture the golden one of --compare.
    #[arg(long, requires = "compare", conflicts_with = "out")]
    bless: bool,
    /// Largest difference of a colour channel that does not count, 0 to 255.
    #[arg(long, value_name = "N", default_value_t = 2, requires = "compare")]
    tolerance: u8,
    /// Most pixels that may differ.
    #[arg(long, value_name = "M", default_value_t = 0, requires = "compare")]
    pixels: usize,
}

/// Time that is drawn where none is asked for (s): well within the hold.
const USUAL_S: f64 = 2.9;
/// Size of a window where none is asked for (pixels).
const WINDOW: [u32; 2] = [1280, 820];

const MODES: [(&str, Mode); 4] =
    [("demo", Mode::Demo), ("inspect", Mode::Inspect), ("label", Mode::Label), ("study", Mode::Study)];

/// What a picture shows.
#[derive(Clone, Copy, Debug)]
enum ShownPart {
    Hand(StandardView),
    Touch,
}

impl ShownPart {
    fn named() -> impl Iterator<Item = (&'static str, Self)> {
        StandardView::ALL.into_iter().map(|view| (view.name(), Self::Hand(view))).chain([("touch", Self::Touch)])
    }
}

/// Parser of width and height, of at least so many pixels or points.
pub(super) fn sides_from(least: u32) -> impl Fn(&str) -> Result<[u32; 2], String> + Clone {
    move |text| {
        let side = |text: &str| text.trim().parse().ok().filter(|side| (least..=4096).contains(side));
        let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
        sides.ok_or_else(|| format!("write WIDTHxHEIGHT, each from {least} to 4096, as in 1280x800"))
    }
}

pub(super) fn run(arguments: &SnapshotArguments, store: Option<&Path>) -> Result<ExitCode, Failure> {
    let mut drawers = Drawers::default();
    let code = match &arguments.list {
        Some(path) => list(path, store, &mut drawers)?,
        None => one(arguments, store, &mut drawers)?,
    };
    Ok(ExitCode::from(code))
}

/// Exit codes.
const SAME: u8 = 0;
const DIFFERS: u8 = 1;
const WRONG_USE: u8 = 2;
const NOT_COMPARED: u8 = 3;

/// A line of a list.
#[derive(Debug, clap::Parser)]
#[command(name = "palpate snapshot", disable_help_flag = true)]
struct ListedSnapshot {
    #[command(flatten)]
    snapshot: SnapshotArguments,
}

/// Largest list (bytes).
const LARGEST_LIST: u64 = 1 << 20;

/// Draws the pictures of a list one after the other; nothing is drawn where a line is wrong. Returns the greatest exit code.
fn list(path: &Path, store: Option<&Path>, drawers: &mut Drawers) -> Result<u8, Failure> {
    let unreadable = |cause: &dyn std::fmt::Display| format!("cannot read \"{}\": {cause}", path.display());
    let bytes = palpate_geometry::read_regular(path, LARGEST_LIST).map_err(|cause| unreadable(&cause))?;
    let text = String::from_utf8(bytes).map_err(|cause| unreadable(&cause))?;
    let mut pictures = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default();
        if line.trim().is_empty() {
            continue;
        }
        let words = std::iter::once("palpate snapshot").chain(line.split_whitespace());
        match ListedSnapshot::try_parse_from(words) {
            Ok(listed) if listed.snapshot.list.is_none() => pictures.push((number, listed.snapshot)),
            Ok(_) => {
                error(&format!("line {number} of {}: a list in a list", path.display()));
                return Ok(WRONG_USE);
            }
            Err(cause) => {
                let cause = cause.to_string();
                let cause = cause.lines().next().unwrap_or_default().trim_start_matches("error: ");
                error(&format!("line {number} of {}: {cause}", path.display()));
                return Ok(WRONG_USE);
            }
        }
    }
    let mut worst = SAME;
    for (number, snapshot) in &pictures {
        let code = one(snapshot, store, drawers).unwrap_or_else(|failure| {
            error(&format!("line {number}: {failure}"));
            DIFFERS
        });
        worst = worst.max(code);
    }
    note(&format!("{} pictures", pictures.len()));
    Ok(worst)
}

/// Draws a picture, and compares it.
fn one(arguments: &SnapshotArguments, store: Option<&Path>, drawers: &mut Drawers) -> Result<u8, Failure> {
    match (draw(arguments, store, drawers), &arguments.compare) {
        (Ok(is_same), _) => Ok(if is_same { SAME } else { DIFFERS }),
        (Err(failure), Some(_)) if !arguments.bless => {
            error(&format!("not compared: {failure}"));
            Ok(NOT_COMPARED)
        }
        (Err(failure), _) => Err(failure),
    }
}

/// A picture, and what its text chunks say of it.
struct DrawnPicture {
    picture: Picture,
    driver: String,
    /// Scene as TOML.
    scene: String,
}

/// Keys of the text chunks.
const PROGRAM: &str = "Software";
const PHYSICS: &str = "Physics";
const DRIVER: &str = "Driver";
const SCENE: &str = "Scene";

impl DrawnPicture {
    fn texts(&self) -> [(&'static str, String); 4] {
        [
            (PROGRAM, format!("Palpate {}", env!("CARGO_PKG_VERSION"))),
            (PHYSICS, PHYSICS_VERSION.to_string()),
            (DRIVER, self.driver.clone()),
            (SCENE, self.scene.clone()),
        ]
    }

    fn to_png(&self) -> Result<Vec<u8>, Failure> {
        Ok(self.picture.to_png_with(&self.texts())?)
    }

    /// What else is different in a golden picture, in sentences.
    fn against(&self, golden: &[u8]) -> Vec<String> {
        let mut said = Vec::new();
        for (key, own) in self.texts() {
            let Some(other) = Picture::text_of_png(golden, key) else {
                said.push(format!("The golden picture does not name its {}.", key.to_lowercase()));
                continue;
            };
            match key {
                SCENE => {
                    // The path of an object's file is another on every machine.
                    let lines = |text: &str| -> Vec<String> {
                        text.lines().filter(|line| !line.starts_with("source = ")).map(str::to_owned).collect()
                    };
                    let (own, other) = (lines(&own), lines(&other));
                    let changed: Vec<&String> = own.iter().filter(|line| !other.contains(line)).collect();
                    if own != other {
                        let named: Vec<&str> = changed.iter().take(3).map(|line| line.as_str()).collect();
                        said.push(format!("The scenes differ: {}.", named.join(", ")));
                    }
                }
                DRIVER if own == other => said.push(format!("Both were drawn by {own}.")),
                _ if own == other => {}
                _ => said.push(format!("{key}: {own} here, {other} in the golden picture.")),
            }
        }
        said
    }
}

/// Draws the picture, and compares it; false where it differs too much.
fn draw(arguments: &SnapshotArguments, store: Option<&Path>, drawers: &mut Drawers) -> Result<bool, Failure> {
    let blessed = arguments.compare.as_ref().filter(|_| arguments.bless);
    if let Some(out) = arguments.out.as_ref().or(blessed) {
        check_new(out, FileKind::Png)?;
    }
    // Read first: without another picture to write, a missing file is known before anything is drawn.
    let golden = arguments.compare.as_ref().filter(|_| !arguments.bless).map(|path| golden(path)).transpose();
    let golden = if arguments.out.is_some() { golden } else { Ok(golden?) };
    let drawn = if arguments.panels { window(arguments, store)? } else { scene_picture(arguments, store, drawers)? };
    if let Some(out) = arguments.out.as_ref().or(blessed) {
        write_new(out, FileKind::Png, &drawn.to_png()?)?;
    }
    if blessed.is_some() && arguments.trial.is_none() {
        let scene = arguments.scene.scene(arguments.object.as_deref())?;
        let object = load_object(&scene)?;
        warn_unless_trusted(&grasp(&scene, object.as_ref(), 0), object.as_ref());
    }
    let is_same = golden?.map_or(Ok(true), |golden| compare(arguments, &drawn, &golden))?;
    if let Some(out) = arguments.out.as_ref().or(blessed).filter(|_| is_same) {
        say(out.display())?;
    }
    Ok(is_same)
}

/// Largest picture to compare with (bytes).
const LARGEST_PICTURE: u64 = 256 << 20;

/// Bytes of the golden picture.
fn golden(path: &Path) -> Result<Vec<u8>, Failure> {
    palpate_geometry::read_regular(path, LARGEST_PICTURE).map_err(|cause| {
        let make = if path.exists() { "" } else { "; --bless makes it" };
        format!("cannot read \"{}\": {cause}{make}", path.display()).into()
    })
}

/// Prints how a picture differs from the golden one; false where it differs too much.
fn compare(arguments: &SnapshotArguments, drawn: &DrawnPicture, golden: &[u8]) -> Result<bool, Failure> {
    let difference = drawn.picture.difference(&Picture::from_png(golden)?, arguments.tolerance)?;
    let text = format!(
        "{} pixels differ by more than {}, the most by {}",
        difference.pixels, arguments.tolerance, difference.largest
    );
    if difference.pixels <= arguments.pixels {
        return say(text).map(|()| true);
    }
    let beside = match &arguments.out {
        Some(out) => {
            let path = out.with_extension("diff.png");
            write_new(&path, FileKind::Png, &difference.picture.to_png()?)?;
            format!(". See \"{}\"", path.display())
        }
        None => ". --out FILE.png writes the picture, and one of the differences beside it".to_owned(),
    };
    error(&format!("{text}; {} may{beside}", arguments.pixels));
    let counts = difference.above.iter().zip(THRESHOLDS).map(|(count, least)| format!("{count} by more than {least}"));
    note(&format!("Pixels that differ: {}", counts.collect::<Vec<_>>().join(", ")));
    drawn.against(golden).iter().for_each(|line| note(line));
    Ok(false)
}

/// The whole window. The store of the user is only opened where it is shown.
fn window(arguments: &SnapshotArguments, store: Option<&Path>) -> Result<DrawnPicture, Failure> {
    let inspect = if arguments.trial.is_some() { Mode::Inspect } else { Mode::Demo };
    let mode = arguments.mode.unwrap_or(inspect);
    if arguments.trial.is_some() && mode != Mode::Inspect {
        return Err("--trial opens in mode inspect; leave out --mode, or the trial".into());
    }
    let mut scene = arguments.scene.scene(arguments.object.as_deref())?;
    let mut at_s = arguments.at.unwrap_or(USUAL_S);
    match arguments.trial {
        Some(id) => {
            let trial = OpenTrial::open(&read_store(store)?, id, &OpenOptions::default())?;
            scene = trial.header.scene.clone();
            at_s = chosen_time(arguments.at, trial.span_s()[1], &format!("trial {id}"))?;
        }
        None if mode == Mode::Demo => {
            at_s = chosen_time(arguments.at, scene.timing.duration_s, "the grasp")?;
        }
        None => {}
    }
    // Panels must not leave a store behind, and the simulation nothing in one.
    let empty = TemporaryFolder::new()?;
    let path = store_path(store)?;
    let shown = if mode == Mode::Demo || !path.exists() { empty.path().join("trials.sqlite") } else { path };
    let size = arguments.size.unwrap_or(WINDOW);
    let (theme, trial, driver, text) = (arguments.theme, arguments.trial, arguments.driver, scene.to_toml());
    let window = OffscreenWindow { scene, store: shown, mode, theme, size, trial, at_s, driver };
    let (picture, driver) = window_picture(&window)?;
    Ok(DrawnPicture { picture, driver, scene: text })
}

/// Time to draw: the one asked for, which must be before the end, or the usual one.
fn chosen_time(asked: Option<f64>, end_s: f64, what: &str) -> Result<f64, Failure> {
    match asked {
        Some(at) if at > end_s + SAMPLE_S => {
            Err(format!("--at {at} is beyond the end: {what} lasts {end_s:.2} s").into())
        }
        Some(at) if at < 0.0 || at.is_nan() => {
            Err(format!("--at {at} is before the start; {what} lasts {end_s:.2} s").into())
        }
        Some(at) => Ok(at),
        None => Ok(USUAL_S.min(end_s)),
    }
}

/// About a sample: the last one is a little before the end.
const SAMPLE_S: f64 = 0.02;

/// The 3-D view alone.
fn scene_picture(
    arguments: &SnapshotArguments,
    store: Option<&Path>,
    drawers: &mut Drawers,
) -> Result<DrawnPicture, Failure> {
    let mut scene = arguments.scene.scene(arguments.object.as_deref())?;
    let (stage, frames, badge) = match arguments.trial {
        Some(id) => {
            let (stage, frames, badge, own) = stored(arguments, store, id)?;
            scene = own;
            (stage, frames, badge)
        }
        None => simulated(&scene, arguments.at)?,
    };
    let text = scene.to_toml();
    let frame = frames.last().ok_or("there is nothing to draw")?;
    scene.solver.engine = scene.solver.engine.other();
    let ghost = if arguments.ghost { simulated(&scene, arguments.at)?.1.pop() } else { None };
    let size = arguments.size.unwrap_or([1280, 800]);
    let view = PictureView {
        theme: arguments.theme,
        size: Vec2::new(size[0] as f32, size[1] as f32),
        forces: !arguments.no_forces,
        annotations: !arguments.bare,
        badge: Some(badge).filter(|_| !arguments.bare),
        full_scale: stage.full_scale_of(&frames),
        ..PictureView::default()
    };
    let mut list = match arguments.view {
        ShownPart::Hand(standard) => {
            let camera = stage.camera(standard, frame, &view);
            stage.draw(frame, &PictureView { camera, ..view.clone() })
        }
        ShownPart::Touch => {
            let nothing = || format!("nothing is touched at {:.2} s; choose another --at, or --view hand", frame.t);
            let camera = stage.touch_camera(frame).ok_or_else(nothing)?;
            stage.draw_touch(frame, &PictureView { camera, ..view.clone() })
        }
    };
    if let Some(ghost) = &ghost {
        list.ghosts.extend(stage.ghosts(ghost, view.theme));
    }
    let drawer = drawers.of(arguments.driver)?;
    Ok(DrawnPicture { picture: drawer.draw(&list, size)?, driver: drawer.gpu.driver.clone(), scene: text })
}

/// The drawer of one driver, for all pictures of a run.
#[derive(Default)]
struct Drawers(Option<(DriverChoice, Drawer)>);

impl Drawers {
    fn of(&mut self, choice: DriverChoice) -> Result<&mut Drawer, Failure> {
        let kept = self.0.take().filter(|(own, _)| *own == choice);
        let drawer = kept.map_or_else(|| Drawer::new(choice), |(_, drawer)| Ok(drawer))?;
        Ok(&mut self.0.insert((choice, drawer)).1)
    }
}

/// Draws pictures without a window.
pub(super) struct Drawer {
    gpu: Gpu,
    renderer: Renderer,
}

impl Drawer {
    pub(super) fn new(choice: DriverChoice) -> Result<Self, Failure> {
        let gpu = Gpu::headless(choice)?;
        Ok(Self { renderer: Renderer::new(&gpu.device, &gpu.queue), gpu })
    }

    /// Draws a picture of a size (pixels).
    pub(super) fn draw(&mut self, list: &DrawList, size: [u32; 2]) -> Result<Picture, Failure> {
        Ok(Picture::draw(&self.gpu, &mut self.renderer, list, size, 1.0)?)
    }
}

/// Simulates up to the time to draw; returns all frames until then.
fn simulated(scene: &Scene, at: Option<f64>) -> Result<(Stage, Vec<Frame>, String), Failure> {
    let at_s = chosen_time(at, scene.timing.duration_s, "the grasp")?;
    let object = load_object(scene)?;
    let mut run = prepare(scene, object.as_ref(), 0);
    let stage = Stage::new(scene, object.as_ref(), run.begun().data.world_from_gripper);
    let mut frames = vec![run.simulation_mut().first_look()];
    while frames.last().is_some_and(|last| last.t < at_s) {
        match run.next_frame() {
            Some(next) => frames.push(next.clone()),
            None => break,
        }
    }
    Ok((stage, frames, "SIMULATED".to_owned()))
}

/// A stored trial until the time to draw. The fingers of a trial that was not simulated are arcs.
fn stored(
    arguments: &SnapshotArguments,
    store: Option<&Path>,
    id: TrialId,
) -> Result<(Stage, Vec<Frame>, String, Scene), Failure> {
    let open = open_drawable(&read_store(store)?, id)?;
    let OpenDrawable { stage, trial } = &open;
    trial.remarks.iter().for_each(|remark| note(remark));
    let at_s = chosen_time(arguments.at, trial.frames.last().map_or(0.0, |frame| frame.t), &format!("trial {id}"))?;
    let now = trial.at(at_s).and_then(|now| now.frame).ok_or_else(|| format!("trial {id} has no samples"))?;
    let until = trial.frames.iter().filter(|frame| frame.t <= now.t);
    Ok((
        stage.as_ref().clone(),
        until.map(|frame| frame.as_ref().clone()).collect(),
        open.badge(),
        trial.header.scene.clone(),
    ))
}

/// A trial whose fingers can be drawn.
pub(super) struct OpenDrawable {
    pub(super) stage: Arc<Stage>,
    pub(super) trial: OpenTrial,
}

impl OpenDrawable {
    /// Caption of its pictures: the trial, where it is from, and whether the fingers were reconstructed.
    pub(super) fn badge(&self) -> String {
        let arcs = if self.trial.source == TrialSource::Simulated { "" } else { ", FINGERS AS ARCS" };
        format!("TRIAL {}, {}{arcs}", self.trial.id, self.trial.source_title().to_uppercase())
    }
}

/// Opens a trial to be drawn.
pub(super) fn open_drawable(store: &Store, id: TrialId) -> Result<OpenDrawable, Failure> {
    let trial = OpenTrial::open(store, id, &OpenOptions { keep: Keep::Scenery, ..OpenOptions::default() })?;
    match trial.stage.clone().filter(|_| !trial.frames.is_empty()) {
        Some(stage) => Ok(OpenDrawable { stage, trial }),
        None => {
            let text = format!(
                "trial {id} ({}) was not simulated, and no calibrated flex strip says how its fingers were bent, so there \
                 is nothing to draw. Use `palpate plot {id} --out FILE.svg`, `palpate trials show {id}` or `palpate trials \
                 export {id} --out FILE.csv`",
                trial.source_title()
            );
            Err(text.into())
        }
    }
}
