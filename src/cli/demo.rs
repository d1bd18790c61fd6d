//! `palpate demo`: grasps an object in random poses until it is recognised, describes each grasp, and writes a picture of
//! it. Needs no display. With a port, the same with the real gripper.

mod real;

use super::Failure;
use super::output::{file_or_folder, make_folder, write_new};
use super::recognise::{StageOne, load_model, named, warn_unless_learned};
use super::setup::{SceneArguments, open_store, within};
use super::terminal::{say, say_json, warn};
use glam::Vec2;
use palpate_geometry::drawing::StandardView;
use palpate_geometry::palette::Theme;
use palpate_geometry::units::{mm, three_digits};
use palpate_lab::grasping::{Advisor, FrameReader, GraspSummary, Identification, Recompute, SHAPES, grasp_soundly};
use palpate_lab::picture::{PictureView, Stage};
use palpate_learn::{Measure, OTHER, Shipped, StopReason, StopRule};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::{EMPTY, ObjectModel, catalogue, titled};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Between, Scene};
use palpate_store::{FileKind, Stored, file_name_of};
use palpate_tactile::Channel;
use palpate_tactile::trial::{SimulatedTrial, TrialId};
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments of `palpate demo`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate demo
  palpate demo --object tomato --out pictures/
  palpate demo --guided --object lemon
  palpate demo --seed 5 --threshold 0.99 --grasps 10 --no-pictures --json
  palpate demo --port /dev/ttyACM0
  palpate demo --port /dev/ttyACM0 --object lemon

See also: palpate help gripper")]
pub(super) struct DemoArguments {
    /// Built-in name, or a URDF, OBJ or STL file (default: a random one of the sixteen). With --port: what is in the hand, to
    /// check the answer.
    #[arg(long, value_name = "NAME|FILE")]
    object: Option<String>,
    /// Grasp with the real gripper on this port, after `palpate adapt`; trials are stored.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["as_released", "guided", "no_pictures", "no_store", "seed"])]
    port: Option<PathBuf>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Random seed of object and poses; the same seed repeats the run.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Grasp limit.
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=100))]
    grasps: u32,
    /// Probability at which to stop; 1 grasps up to the limit.
    #[arg(long, value_name = "P", default_value_t = StopRule::default().threshold, value_parser = within(0.0..=1.0))]
    threshold: f64,
    /// Recognition model (default: the shipped one for free or fixed objects; with --port, the one for any gripper).
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Leave the object as released between grasps instead of placing it anew.
    #[arg(long)]
    as_released: bool,
    /// The same, and choose each next grasp by what is expected to be learned from it instead of at random.
    #[arg(long, conflicts_with = "as_released")]
    guided: bool,
    /// Folder for the pictures.
    #[arg(long, value_name = "FOLDER", default_value = "palpate-demo", value_parser = file_or_folder(&[]))]
    out: PathBuf,
    /// Write no pictures.
    #[arg(long)]
    no_pictures: bool,
    /// Do not store the trials.
    #[arg(long)]
    no_store: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Report {
    /// Object in the hand.
    truth: String,
    /// Recognised class, or `unknown`.
    decided: String,
    /// `sure`, `grasp-limit` or `unknown`.
    stopped_because: &'static str,
    threshold: f64,
    /// Size and shape of the last grasp.
    stage_one: Option<StageOne>,
    seed: u64,
    grasps: Vec<GraspReport>,
}

/// One grasp.
#[derive(Serialize)]
struct GraspReport {
    seed: u64,
    offset_mm: [f64; 3],
    yaw_deg: f64,
    /// Move of the gripper by which a guided grasp was chosen.
    guided: Option<String>,
    picture: Option<PathBuf>,
    trial_id: Option<TrialId>,
    stage_one: Option<StageOne>,
    /// Estimated size of what was touched.
    touch: Option<Touched>,
    /// Belief after this grasp and those before it.
    pmf: BTreeMap<String, f64>,
    #[serde(flatten)]
    summary: GraspSummary,
}

/// Pixels of a picture.
const SIZE: [u32; 2] = [1280, 800];

pub(super) fn run(arguments: &DemoArguments, store: Option<&Path>) -> Result<(), Failure> {
    if let Some(port) = &arguments.port {
        return real::run(arguments, port, store);
    }
    let seed = arguments.seed.unwrap_or_else(|| RandomState::new().hash_one(0) % 1_000_000);
    let random = (arguments.object.is_none() && arguments.scene.scene.is_none()).then(|| random_object(seed));
    let mut nominal = arguments.scene.scene(arguments.object.as_deref().or(random.as_deref()))?;
    if arguments.as_released {
        nominal.pose.between = Between::AsReleased;
    }
    if arguments.guided {
        nominal.pose.between = Between::Guided;
    }
    let object = nominal.load_object()?;
    let model = Arc::new(load_model(arguments.model.as_deref(), Shipped::simulated(nominal.holds_object()))?);
    warn_unless_learned(&model, nominal.holds_object());
    let rule = StopRule { threshold: arguments.threshold, most_grasps: arguments.grasps as usize };
    let mut identification = Identification::new(Arc::clone(&model), rule);
    let mut painter = if arguments.no_pictures { None } else { Painter::find() };
    if painter.is_some() {
        make_folder(&arguments.out)?;
    }
    let mut store = if arguments.no_store { None } else { Some(open_store(store)?) };
    let truth = object.as_ref().map_or_else(|| EMPTY.to_owned(), |o| o.name.clone());
    if !arguments.json {
        introduce(&nominal.object.source, object.as_ref(), seed)?;
    }
    let sampler = PoseSampler::new(&nominal, object.as_ref());
    let mut grasps: Vec<GraspReport> = Vec::new();
    let mut before: Option<(Scene, Frame)> = None;
    let mut advisor = Advisor::default();
    let stopped = loop {
        let pose_seed = seed.wrapping_add(grasps.len() as u64).wrapping_add(1);
        let released = before.as_ref().map(|(_, released)| released);
        let (drawn, _) = sampler.draw_after(object.as_ref(), pose_seed, released);
        let guided = before
            .as_ref()
            .zip(identification.last())
            .and_then(|((last, _), grasp)| advisor.next(grasp, [last, &drawn], &sampler, object.as_ref()));
        let (guided, scene) = guided.map_or((None, drawn), |(by, scene)| (Some(by), scene));
        let trial = grasp_soundly(&scene, object.as_ref(), pose_seed, Recompute::Unsettled);
        let reader = FrameReader::of(identification.channels_on(&scene.gripper)?, &scene.gripper);
        identification.begin_grasp(reader.channels().iter().map(Channel::name).enumerate())?;
        for row in trial.frames().iter().map(|frame| reader.row(frame)) {
            identification.push(row.t_s, &row);
        }
        identification.end_grasp();
        let report = GraspReport {
            stage_one: identification.verdict().and_then(|v| StageOne::of(v, &model.card.labels)),
            touch: Touched::of(&identification),
            pmf: identification.belief().now().map(|pmf| named(&model, pmf)).unwrap_or_default(),
            ..motion_report(&trial, &scene, pose_seed)
        };
        let trial_id = store.as_mut().map(|store| store.insert(&trial)).transpose()?.map(Stored::id);
        let picture = match &mut painter {
            Some(painter) => {
                let number = grasps.len() + 1;
                let path = arguments.out.join(format!("{}_grasp_{number}.png", file_name_of(&trial.header.object)));
                painter.paint(&scene, object.as_ref(), &trial, &path)?;
                Some(path)
            }
            None => None,
        };
        let guided = guided.map(|by| by.to_string());
        let report = GraspReport { picture, trial_id, guided, ..report };
        if !arguments.json {
            print_grasp(grasps.len() + 1, &report, object.as_ref().map_or(&[], |o| &o.warnings))?;
        }
        grasps.push(report);
        before = trial.frames().last().map(|released| (scene, released.clone()));
        if let Some(reason) = identification.decision() {
            break reason;
        }
        if !arguments.json {
            say(format!("  Below the threshold of {:.0} %: grasping again.", 100.0 * rule.threshold))?;
        }
    };
    let view = identification.view();
    let report = Report {
        truth,
        decided: view.decided().unwrap_or("unknown").to_owned(),
        stopped_because: stopped.name(),
        threshold: rule.threshold,
        stage_one: identification.verdict().and_then(|v| StageOne::of(v, &model.card.labels)),
        seed,
        grasps,
    };
    if arguments.json {
        say_json(&report)?;
    } else {
        print_conclusion(&report, stopped)?;
    }
    if report.grasps.iter().all(|grasp| grasp.summary.finite) {
        Ok(())
    } else {
        Err("the simulation of a grasp diverged; see the warnings".into())
    }
}

/// The part of a report that does not depend on recognition.
fn motion_report(trial: &SimulatedTrial, scene: &Scene, seed: u64) -> GraspReport {
    let mount = &scene.gripper.mount;
    GraspReport {
        seed,
        offset_mm: mount.offset.map(|x| (x * 1e5).round() * 1e-2),
        yaw_deg: (mount.yaw_deg * 10.0).round() * 0.1,
        guided: None,
        picture: None,
        trial_id: None,
        stage_one: None,
        touch: None,
        pmf: BTreeMap::new(),
        summary: GraspSummary::new(trial, scene),
    }
}

fn random_object(seed: u64) -> String {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let all = catalogue();
    all[random.random_range(0..all.len())].name.clone()
}

fn introduce(name: &str, object: Option<&ObjectModel>, seed: u64) -> Result<(), Failure> {
    let Some(object) = object else { return say("Object: none, an empty hand.") };
    let built_in = catalogue().iter().any(|b| b.name == name);
    let title = if built_in { titled(name) } else { object.name.clone() };
    let size = object.bounds.size().to_array().map(|side| format!("{:.0}", mm(side)));
    let grams = three_digits(object.mass.mass * 1e3);
    say(format!("Object: {title} ({} mm, {grams} g). Seed {seed}.", size.join(" x ")))?;
    for warning in &object.warnings {
        warn(warning);
    }
    Ok(())
}

/// Prints a grasp; warnings in `known` were printed before.
fn print_grasp(number: usize, report: &GraspReport, known: &[String]) -> Result<(), Failure> {
    let [x, y, z] = report.offset_mm.map(|v| format!("{v:+.1}"));
    say("")?;
    say(format!("Grasp {number}: gripper shifted by {x} {y} {z} mm, turned by {:+.0} degrees.", report.yaw_deg))?;
    if let Some(by) = &report.guided {
        say(format!("  Chosen to learn most: gripper {by}."))?;
    }
    let summary = &report.summary;
    match summary.contact_onset_s {
        Some(onset) => say(format!("  First contact after {onset:.2} s."))?,
        None => say("  No contact.")?,
    }
    if let Some(hold) = &summary.hold {
        let [left, right] = hold.curvature_per_m.map(three_digits);
        say(format!("  Hold: curvature {left} and {right} 1/m,"))?;
        let [left, right] = hold.force_n.map(three_digits);
        let [low, high] = hold.pressure_pa.map(|p| three_digits(p * 1e-3));
        say(format!("  force {left} and {right} N, pressure {low} and {high} kPa."))?;
        if summary.contact_onset_s.is_some() && hold.force_n == [0.0, 0.0] {
            say("  The object slipped out of the grasp.")?;
        }
    }
    if let Some(moved) = summary.object_moved_m.filter(|moved| *moved > 1e-4) {
        say(format!("  The object moved by {} mm.", three_digits(mm(moved))))?;
    }
    for warning in summary.warnings.iter().filter(|w| !known.contains(w)) {
        warn(warning);
    }
    if let Some(stage) = &report.stage_one {
        let percent = [stage.size_probability, stage.shape_probability].map(|p| format!("{:.0} %", 100.0 * p));
        say(format!("  Stage one: {} ({}), {} ({}).", stage.size, percent[0], stage.shape, percent[1]))?;
    }
    if let Some(touch) = &report.touch {
        say(format!("  Felt: {touch}."))?;
    }
    say(format!("  Most likely: {}.", likely(&report.pmf)))
}

/// The most likely classes with their probabilities.
fn likely(pmf: &BTreeMap<String, f64>) -> String {
    let mut likely: Vec<(&String, &f64)> = pmf.iter().collect();
    likely.sort_by(|a, b| b.1.total_cmp(a.1));
    let shown = likely.iter().take(3).filter(|(_, p)| **p >= 0.005);
    shown.map(|(name, p)| format!("{} {:.0} %", titled(name), 100.0 * **p)).collect::<Vec<_>>().join(", ")
}

/// Estimated size and shape of the object, with the ranges that hold the true values in nine of ten grasps.
#[derive(Clone, Debug, Serialize)]
struct Touched {
    /// Extent between the fingers (mm): estimate, and ends of its range.
    width_mm: [f64; 3],
    /// Extent along the gripper's axis (mm).
    height_mm: [f64; 3],
    /// Likeliest shape.
    shape: &'static str,
    shape_probability: f64,
}

impl Touched {
    /// The newest estimate; none before the first contact.
    fn of(identification: &Identification) -> Option<Self> {
        let measured = identification.view().measured?;
        let of = |measure: Measure| {
            let estimate = measured.of(measure)?;
            let tenths = |metres: f64| (mm(metres) * 10.0).round() * 0.1;
            Some([estimate.value, estimate.range[0], estimate.range[1]].map(tenths))
        };
        let (shape, shape_probability) = measured.shape.top();
        let shape = SHAPES.get(shape)?.name();
        Some(Self { width_mm: of(Measure::Width)?, height_mm: of(Measure::Height)?, shape, shape_probability })
    }
}

impl std::fmt::Display for Touched {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let of = |[value, low, high]: [f64; 3]| format!("{value:.0} mm ({low:.0} to {high:.0})");
        let (width, height, shape) = (of(self.width_mm), of(self.height_mm), self.shape);
        write!(f, "{width} wide, {height} high, {shape} ({:.0} %)", 100.0 * self.shape_probability)
    }
}

/// `1 grasp`, `2 grasps`.
fn grasps_in_words(count: usize) -> String {
    if count == 1 { "1 grasp".to_owned() } else { format!("{count} grasps") }
}

fn print_conclusion(report: &Report, stopped: StopReason) -> Result<(), Failure> {
    let count = report.grasps.len();
    let grasps = grasps_in_words(count);
    let known = report.grasps.last().is_some_and(|grasp| grasp.pmf.contains_key(&report.truth));
    let is_right = if report.decided == OTHER { !known } else { report.decided == report.truth };
    let right = if is_right { "Correct" } else { "Wrong" };
    let [decided, true_object] = [&report.decided, &report.truth].map(|name| titled(name));
    say("")?;
    match stopped {
        StopReason::Sure if report.decided == OTHER => {
            say(format!("None of the known objects, after {grasps}. {right} (true object: {true_object})."))?;
        }
        StopReason::Sure => {
            say(format!("Recognised after {grasps}: {decided}. {right} (true object: {true_object})."))?;
        }
        StopReason::GraspLimit => {
            say(format!(
                "Grasp limit reached ({count}). Best guess: {decided}. {right} (true object: {true_object})."
            ))?;
        }
        StopReason::Unknown => {
            let right = if known { "Wrong" } else { "Correct: the model does not know this object" };
            say(format!("Unknown object after {grasps}. {right} (true object: {true_object})."))?;
            say("The grasps match none of the objects the model knows.")?;
        }
    }
    let pictures: Vec<String> =
        report.grasps.iter().filter_map(|g| Some(g.picture.as_ref()?.display().to_string())).collect();
    if !pictures.is_empty() {
        say(format!("Pictures: {}", pictures.join(", ")))?;
    }
    let trials: Vec<String> = report.grasps.iter().filter_map(|g| Some(g.trial_id?.to_string())).collect();
    if !trials.is_empty() {
        say(format!("Trials: {} (see `palpate trials list`)", trials.join(", ")))?;
    }
    Ok(())
}

/// Off-screen renderer of the end of the hold.
struct Painter {
    gpu: Gpu,
    renderer: Renderer,
}

impl Painter {
    /// Finds a graphics driver, or warns that there is none.
    fn find() -> Option<Self> {
        match Gpu::headless(DriverChoice::Any) {
            Ok(gpu) => {
                let renderer = Renderer::new(&gpu.device, &gpu.queue);
                Some(Self { gpu, renderer })
            }
            Err(error) => {
                warn(&format!("no pictures: {error}"));
                None
            }
        }
    }

    fn paint(
        &mut self,
        scene: &Scene,
        object: Option<&ObjectModel>,
        trial: &SimulatedTrial,
        path: &Path,
    ) -> Result<(), Failure> {
        let held = trial.frames().iter().rfind(|f| f.phase == Phase::Hold).or(trial.frames().last());
        let Some(frame) = held else { return Ok(()) };
        let stage = Stage::new(scene, object, trial.data.world_from_gripper);
        let view = PictureView {
            theme: Theme::Dark,
            size: Vec2::new(SIZE[0] as f32, SIZE[1] as f32),
            badge: Some("SIMULATED".to_owned()),
            ..PictureView::default()
        };
        let camera = stage.camera(StandardView::Home, frame, &view);
        let list = stage.draw(frame, &PictureView { camera, ..view });
        let picture = Picture::draw(&self.gpu, &mut self.renderer, &list, SIZE, 1.0)?;
        write_new(path, FileKind::Png, &picture.to_png()?)
    }
}
