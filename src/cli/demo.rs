//! `palpate demo`: grasps an object in random poses until it is clear what it is, tells the story, and writes a picture
//! of each grasp. It needs no display, and shows what the window would.

use super::Failure;
use super::recognise::{StageOne, load_model, named};
use super::setup::{SceneArguments, open_store};
use super::terminal::{say, say_json, warn};
use glam::Vec2;
use palpate_geometry::drawing::Camera;
use palpate_lab::grasping::{GraspSummary, Identification, grasp};
use palpate_sim::poses::PoseSampler;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::{EMPTY, ObjectModel, catalogue};
use palpate_geometry::palette::Theme;
use palpate_lab::picture::{PictureView, Stage};
use palpate_learn::{StopReason, StopRule};
use palpate_store::file_name_of;
use palpate_tactile::trial::TrialId;
use palpate_sim::scene::{Between, Scene};
use palpate_tactile::trial::Trial;
use palpate_geometry::units::{mm, three_digits};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
use rand::RngExt;
use rand::SeedableRng;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments of `palpate demo`.
#[derive(Debug, clap::Args)]
pub(super) struct DemoArguments {
    /// A built-in name, or a URDF, OBJ or STL file; without it one of the sixteen is drawn at random.
    #[arg(long, value_name = "NAME|FILE")]
    object: Option<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Chooses object and poses; the same seed tells the same story.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Most grasps.
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=100))]
    grasps: u32,
    /// Probability from which on it is sure; 1 grasps on to the limit.
    #[arg(long, value_name = "P", default_value_t = StopRule::default().threshold, value_parser = parse_threshold)]
    threshold: f64,
    /// A saved model; the one that comes with Palpate where it is left out.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Leave the object as the fingers released it between grasps, instead of putting it down anew.
    #[arg(long)]
    as_released: bool,
    /// Where the pictures go.
    #[arg(long, value_name = "FOLDER", default_value = "palpate-demo")]
    out: PathBuf,
    /// Do not draw.
    #[arg(long)]
    no_pictures: bool,
    /// Do not keep the trials in the store.
    #[arg(long)]
    no_store: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn parse_threshold(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|p: &f64| (0.0..=1.0).contains(p));
    parsed.ok_or_else(|| "write a probability from 0 to 1, as in 0.9".to_owned())
}

#[derive(Serialize)]
struct Story {
    /// What was grasped.
    truth: String,
    /// The class it was taken for, or `unknown`.
    decided: String,
    /// `sure`, `grasp-limit` or `unknown`.
    stopped_because: &'static str,
    threshold: f64,
    /// What the last grasp said of size and shape.
    stage_one: Option<StageOne>,
    seed: u64,
    grasps: Vec<Told>,
}

#[derive(Serialize)]
struct Told {
    seed: u64,
    offset_mm: [f64; 3],
    yaw_deg: f64,
    picture: Option<PathBuf>,
    trial_id: Option<TrialId>,
    stage_one: Option<StageOne>,
    /// What is believed after this grasp and those before it.
    pmf: BTreeMap<String, f64>,
    #[serde(flatten)]
    summary: GraspSummary,
}

/// Pixels of a picture.
const SIZE: [u32; 2] = [1280, 800];

pub(super) fn run(arguments: &DemoArguments, store: Option<&Path>) -> Result<(), Failure> {
    let seed = arguments.seed.unwrap_or_else(|| rand::rng().random_range(0..1_000_000));
    let random = (arguments.object.is_none() && arguments.scene.scene.is_none()).then(|| random_object(seed));
    let mut nominal = arguments.scene.scene(arguments.object.as_deref().or(random.as_deref()))?;
    if arguments.as_released {
        nominal.pose.between = Between::AsReleased;
    }
    let object = nominal.load_object()?;
    let model = Arc::new(load_model(arguments.model.as_deref())?);
    let rule = StopRule { threshold: arguments.threshold, most_grasps: arguments.grasps as usize };
    let mut identification = Identification::new(Arc::clone(&model), rule);
    let mut store = if arguments.no_store { None } else { Some(open_store(store)?) };
    let mut painter = if arguments.no_pictures { None } else { Painter::find() };
    let truth = object.as_ref().map_or_else(|| EMPTY.to_owned(), |o| o.name.clone());
    if !arguments.json {
        introduce(&nominal.object.source, object.as_ref(), seed)?;
    }
    let sampler = PoseSampler::new(&nominal, object.as_ref());
    let mut grasps: Vec<Told> = Vec::new();
    let mut released = None;
    let stopped = loop {
        let pose_seed = seed.wrapping_add(grasps.len() as u64).wrapping_add(1);
        let (scene, _) = sampler.draw_after(object.as_ref(), pose_seed, released.as_ref());
        let trial = grasp(&scene, object.as_ref(), pose_seed);
        identification.begin_grasp(&scene)?;
        for frame in &trial.frames {
            identification.push(frame);
        }
        identification.end_grasp();
        let told = Told {
            stage_one: identification.verdict().and_then(|v| StageOne::of(v, &model.card.labels)),
            pmf: identification.belief().now().map(|pmf| named(&model, pmf)).unwrap_or_default(),
            ..tell_of(&trial, &scene, pose_seed)
        };
        let trial_id = store.as_mut().map(|store| store.insert(&trial)).transpose()?;
        let picture = match &mut painter {
            Some(painter) => {
                let number = grasps.len() + 1;
                let path = arguments.out.join(format!("{}_grasp_{number}.png", file_name_of(&trial.info.object)));
                painter.paint(&scene, object.as_ref(), &trial, &path)?;
                Some(path)
            }
            None => None,
        };
        let told = Told { picture, trial_id, ..told };
        if !arguments.json {
            tell(grasps.len() + 1, &told, object.as_ref().map_or(&[], |o| &o.warnings))?;
        }
        grasps.push(told);
        released = trial.frames.last().cloned();
        if let Some(reason) = identification.decision() {
            break reason;
        }
        if !arguments.json {
            say(format!("  Not sure yet: {:.0} % is asked for.", 100.0 * rule.threshold))?;
        }
    };
    let view = identification.view();
    let story = Story {
        truth,
        decided: view.decided().unwrap_or("unknown").to_owned(),
        stopped_because: stopped.name(),
        threshold: rule.threshold,
        stage_one: identification.verdict().and_then(|v| StageOne::of(v, &model.card.labels)),
        seed,
        grasps,
    };
    if arguments.json {
        say_json(&story)?;
    } else {
        conclude(&story, stopped)?;
    }
    if story.grasps.iter().all(|told| told.summary.finite) {
        Ok(())
    } else {
        Err("a grasp left the range of numbers; see the warnings".into())
    }
}

/// What is told of a grasp apart from what was recognised.
fn tell_of(trial: &Trial, scene: &Scene, seed: u64) -> Told {
    let mount = &scene.gripper.mount;
    Told {
        seed,
        offset_mm: mount.offset.map(|x| (x * 1e5).round() * 1e-2),
        yaw_deg: (mount.yaw_deg * 10.0).round() * 0.1,
        picture: None,
        trial_id: None,
        stage_one: None,
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
    let Some(object) = object else { return say("The hand stays empty.") };
    let title = catalogue().iter().find(|b| b.name == name).map_or(object.name.as_str(), |b| b.title.as_str());
    let size = object.bounds.size().to_array().map(|side| format!("{:.0}", mm(side)));
    let grams = three_digits(object.mass.mass * 1e3);
    say(format!("On the pedestal: {title} ({} mm, {grams} g). Seed {seed}.", size.join(" x ")))?;
    for warning in &object.warnings {
        warn(warning);
    }
    Ok(())
}

/// `known` has been said while loading.
fn tell(number: usize, told: &Told, known: &[String]) -> Result<(), Failure> {
    let [x, y, z] = told.offset_mm.map(|v| format!("{v:+.1}"));
    say("")?;
    say(format!("Grasp {number}, {x} {y} {z} mm off and turned by {:+.0} degrees.", told.yaw_deg))?;
    let summary = &told.summary;
    match summary.contact_onset_s {
        Some(onset) => say(format!("  The fingers close and touch it after {onset:.2} s."))?,
        None => say("  The fingers close and never touch it.")?,
    }
    if let Some(hold) = &summary.hold {
        let [left, right] = hold.curvature_per_m.map(three_digits);
        say(format!("  They bend to {left} and {right} 1/m,"))?;
        let [left, right] = hold.force_n.map(three_digits);
        let [low, high] = hold.pressure_pa.map(|p| three_digits(p * 1e-3));
        say(format!("  and hold it with {left} and {right} N, which is {low} and {high} kPa on the pads."))?;
        if summary.contact_onset_s.is_some() && hold.force_n == [0.0, 0.0] {
            say("  It has slipped out of their grasp.")?;
        }
    }
    if let Some(moved) = summary.object_moved_m.filter(|moved| *moved > 1e-4) {
        say(format!("  It has moved by {} mm to find its place between them.", three_digits(mm(moved))))?;
    }
    for warning in summary.warnings.iter().filter(|w| !known.contains(w)) {
        warn(warning);
    }
    if let Some(stage) = &told.stage_one {
        let percent = [stage.size_probability, stage.shape_probability].map(|p| format!("{:.0} %", 100.0 * p));
        say(format!("  It feels {} ({}) and {} ({}).", stage.size, percent[0], stage.shape, percent[1]))?;
    }
    let mut likely: Vec<(&String, &f64)> = told.pmf.iter().collect();
    likely.sort_by(|a, b| b.1.total_cmp(a.1));
    let first: Vec<String> = likely
        .iter()
        .take(3)
        .filter(|(_, p)| **p >= 0.005)
        .map(|(name, p)| format!("{name} {:.0} %", 100.0 * **p))
        .collect();
    say(format!("  Most likely: {}.", first.join(", ")))
}

fn conclude(story: &Story, stopped: StopReason) -> Result<(), Failure> {
    let count = story.grasps.len();
    let grasps = if count == 1 { "one grasp".to_owned() } else { format!("{count} grasps") };
    let right = if story.decided == story.truth { "which is right" } else { "which is wrong" };
    say("")?;
    match stopped {
        StopReason::Sure => say(format!("After {grasps} it is sure: {}, {right} ({}).", story.decided, story.truth))?,
        StopReason::GraspLimit => {
            say(format!(
                "After {grasps} it may not try again. Best guess: {}, {right} ({}).",
                story.decided, story.truth
            ))?;
        }
        StopReason::Unknown => {
            let known = story.grasps.last().is_some_and(|g| g.pmf.contains_key(&story.truth));
            let right = if known { "which is wrong" } else { "which is right: it has never felt one" };
            say(format!("After {grasps} it says: unknown, {right} ({}).", story.truth))?;
            say("The grasps agree on none of the objects it knows.")?;
        }
    }
    let pictures: Vec<String> =
        story.grasps.iter().filter_map(|g| Some(g.picture.as_ref()?.display().to_string())).collect();
    if !pictures.is_empty() {
        say(format!("Pictures: {}", pictures.join(", ")))?;
    }
    let trials: Vec<String> = story.grasps.iter().filter_map(|g| Some(g.trial_id?.to_string())).collect();
    if !trials.is_empty() {
        say(format!("Trials: {} (see `palpate trials list`)", trials.join(", ")))?;
    }
    Ok(())
}

/// Draws the end of the hold.
struct Painter {
    gpu: Gpu,
    renderer: Renderer,
}

impl Painter {
    /// A painter, or a warning where nothing can draw.
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
        trial: &Trial,
        path: &Path,
    ) -> Result<(), Failure> {
        let held = trial.frames.iter().rfind(|f| f.phase == Phase::Hold).or(trial.frames.last());
        let Some(frame) = held else { return Ok(()) };
        let stage = Stage::new(scene, object, trial.info.world_from_gripper);
        let (centre, radius) = stage.bounds();
        let view = PictureView {
            camera: Camera::default().framing(centre, radius),
            theme: Theme::Dark,
            size: Vec2::new(SIZE[0] as f32, SIZE[1] as f32),
            badge: Some("SIMULATED".to_owned()),
            ..PictureView::default()
        };
        let list = stage.draw(frame, &view);
        Picture::draw(&self.gpu, &mut self.renderer, &list, SIZE, 1.0)?.save(path)?;
        Ok(())
    }
}
