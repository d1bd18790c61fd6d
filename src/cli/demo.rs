//! `palpate demo`: grasps an object in random poses until it is recognised, describes each grasp, and writes a picture of
//! it. Needs no display. With a port, the same with the real gripper.

mod real;
mod simulated;

use super::prelude::*;
use super::recognise::{StageOne, left_in_words, named};
use palpate_geometry::units::{mm, percent, three_digits};
use palpate_lab::grasping::{GraspSummary, Identification, SHAPES};
use palpate_learn::{Measure, MeasureEstimate, Model, OTHER, StopReason, StopRule};
use palpate_sim::objects::titled;
use std::collections::BTreeMap;
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
    /// Probability at which to stop; 1 grasps up to the limit (default: that of the model).
    #[arg(long, value_name = "P", value_parser = within(0.0..=1.0))]
    threshold: Option<f64>,
    /// Recognition model (default: the shipped one for free or fixed objects; with --port, the one for any gripper).
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    #[command(flatten)]
    between: BetweenArguments,
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

/// Output of `--json`. What is optional is absent for a real gripper.
#[derive(Serialize)]
struct DemoReport {
    /// Object in the hand, where it is known.
    truth: Option<String>,
    /// Recognised class, or `unknown`.
    decided: String,
    stopped_because: StopReason,
    threshold: f64,
    /// Size and shape of the last grasp.
    #[serde(skip_serializing_if = "Option::is_none")]
    stage_one: Option<Option<StageOne>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seed: Option<u64>,
    grasps: Vec<GraspReport>,
    #[serde(skip)]
    is_right: Option<bool>,
}

/// One grasp.
#[derive(Default, Serialize)]
struct GraspReport {
    #[serde(flatten)]
    pose: Option<PoseReport>,
    trial_id: Option<TrialId>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stage_one: Option<Option<StageOne>>,
    /// Estimated size of what was touched.
    touch: Option<Touched>,
    /// Belief after this grasp and those before it.
    pmf: BTreeMap<String, f64>,
    /// Classes that are left, of a model whose answers are calibrated.
    #[serde(skip_serializing_if = "Option::is_none")]
    left: Option<Vec<String>>,
    #[serde(flatten)]
    summary: Option<GraspSummary>,
    #[serde(skip)]
    number: usize,
    #[serde(skip)]
    warnings: Vec<String>,
}

/// Pose of a simulated grasp.
#[derive(Serialize)]
struct PoseReport {
    seed: u64,
    offset_mm: [f64; 3],
    yaw_deg: f64,
    /// Move of the gripper by which a guided grasp was chosen.
    guided: Option<String>,
    picture: Option<PathBuf>,
}

/// A gripper that closes on an object again and again.
trait Hand {
    /// Grasps once, and lets the model read it; everything of the report but the recognition.
    fn grasp(&mut self, identification: &mut Identification) -> Result<GraspReport, Failure>;
}

pub(super) fn run(arguments: &DemoArguments, store: Option<&Path>) -> Result<(), Failure> {
    match &arguments.port {
        Some(port) => real::run(arguments, port, store),
        None => simulated::run(arguments, store),
    }
}

/// Grasps until the object is recognised. `truth` is its class where known, `seed` that of a simulation.
fn grasp_until_recognised(
    hand: &mut dyn Hand,
    model: &Arc<Model>,
    arguments: &DemoArguments,
    truth: Option<String>,
    (seed, between): (Option<u64>, Between),
) -> Result<(), Failure> {
    let threshold = arguments.threshold.unwrap_or(model.card.stop.threshold);
    let rule = StopRule { threshold, most_grasps: arguments.grasps as usize };
    let mut identification = Identification::new(Arc::clone(model), rule);
    let stage_one = |identification: &Identification| {
        seed.map(|_| identification.verdict().and_then(|v| StageOne::of(v, &model.card.labels)))
    };
    let mut grasps: Vec<GraspReport> = Vec::new();
    let stopped_because = loop {
        let mut grasp = hand.grasp(&mut identification)?;
        (grasp.number, grasp.stage_one) = (grasps.len() + 1, stage_one(&identification));
        grasp.touch = Touched::of(&identification);
        grasp.pmf = identification.belief().now().map(|pmf| named(model, pmf)).unwrap_or_default();
        grasp.left = model.card.left(identification.belief(), between.name());
        let decision = identification.decision();
        if !arguments.json {
            let mut page = Page::default();
            grasp.text(&mut page);
            if decision.is_none() {
                page.line(format!("  Below the threshold of {}: grasping again.", percent(rule.threshold)));
            }
            page.print()?;
        }
        grasps.push(grasp);
        if let Some(reason) = decision {
            break reason;
        }
    };
    let view = identification.view();
    let last = grasps.last().and_then(|grasp| grasp.summary.as_ref());
    let lost = last.is_some_and(GraspSummary::lost_object);
    let report = DemoReport {
        is_right: truth.as_ref().and_then(|truth| view.is_right(truth, lost)),
        truth,
        decided: view.decided().unwrap_or("unknown").to_owned(),
        stopped_because,
        threshold: rule.threshold,
        stage_one: stage_one(&identification),
        seed,
        grasps,
    };
    report.print(arguments.json)?;
    let diverged = report.grasps.iter().any(|grasp| grasp.summary.as_ref().is_some_and(|summary| !summary.finite));
    if diverged { Err("the simulation of a grasp diverged; see the warnings".into()) } else { Ok(()) }
}

impl Report for GraspReport {
    fn text(&self, page: &mut Page) {
        page.line("");
        match (&self.pose, self.trial_id) {
            (Some(pose), _) => {
                let [x, y, z] = pose.offset_mm.map(|v| format!("{v:+.1}"));
                let (number, turned) = (self.number, pose.yaw_deg);
                page.line(format!(
                    "Grasp {number}: gripper shifted by {x} {y} {z} mm, turned by {turned:+.0} degrees."
                ));
                pose.guided.iter().for_each(|by| page.line(format!("  Chosen to learn most: gripper {by}.")));
            }
            (None, id) => page.line(format!("Grasp {} (trial {}).", self.number, id.unwrap_or_default())),
        }
        if let Some(summary) = &self.summary {
            summary_text(summary, page);
        }
        self.warnings.iter().for_each(|warning| page.warn(warning));
        if let Some(Some(StageOne { size, size_probability, shape, shape_probability })) = &self.stage_one {
            let [sure, formed] = [size_probability, shape_probability].map(|p| percent(*p));
            page.line(format!("  Stage one: {size} ({sure}), {shape} ({formed})."));
        }
        self.touch.iter().for_each(|touch| page.line(format!("  Felt: {touch}.")));
        page.line(format!("  Most likely: {}.", likely(&self.pmf)));
        self.left.iter().for_each(|left| page.line(format!("  Left: {}.", left_in_words(left))));
    }
}

/// What a simulated grasp did.
fn summary_text(summary: &GraspSummary, page: &mut Page) {
    match summary.contact_onset_s {
        Some(onset) => page.line(format!("  First contact after {onset:.2} s.")),
        None => page.line("  No contact."),
    }
    if let Some(hold) = &summary.hold {
        let [left, right] = hold.curvature_per_m.map(three_digits);
        page.line(format!("  Hold: curvature {left} and {right} 1/m,"));
        let [left, right] = hold.force_n.map(three_digits);
        let [low, high] = hold.pressure_pa.map(|p| three_digits(p * 1e-3));
        page.line(format!("  force {left} and {right} N, pressure {low} and {high} kPa."));
        if summary.lost_object() && summary.contact_onset_s.is_some() {
            page.line("  The object slipped out of the grasp.");
        }
    }
    if let Some(moved) = summary.object_moved_m.filter(|moved| *moved > 1e-4) {
        page.line(format!("  The object moved by {} mm.", three_digits(mm(moved))));
    }
}

/// The most likely classes with their probabilities.
fn likely(pmf: &BTreeMap<String, f64>) -> String {
    let mut likely: Vec<(&String, &f64)> = pmf.iter().collect();
    likely.sort_by(|a, b| b.1.total_cmp(a.1));
    let shown = likely.iter().take(3).filter(|(_, p)| **p >= 0.005);
    shown.map(|(name, p)| format!("{} {}", titled(name), percent(**p))).collect::<Vec<_>>().join(", ")
}

/// Estimated size and shape of the object, with the ranges that hold the true values in nine of ten grasps.
#[derive(Clone, Debug, Serialize)]
struct Touched {
    /// Extent between the fingers (mm): estimate, and ends of its range.
    width_mm: [f64; 3],
    /// Extent along the gripper's axis (mm).
    height_mm: [f64; 3],
    /// Width and height in words.
    #[serde(skip)]
    words: String,
    /// Likeliest shape.
    shape: &'static str,
    shape_probability: f64,
}

impl Touched {
    /// The newest estimate; none before the first contact.
    fn of(identification: &Identification) -> Option<Self> {
        let measured = identification.view().measured?;
        let [width, height] = [measured.of(Measure::Width)?, measured.of(Measure::Height)?];
        let of = |estimate: &MeasureEstimate| {
            let tenths = |metres: f64| (mm(metres) * 10.0).round() * 0.1;
            [estimate.value, estimate.range[0], estimate.range[1]].map(tenths)
        };
        let (shape, shape_probability) = measured.shape.top();
        let shape = SHAPES.get(shape)?.name();
        let high = measured.felt(Measure::Height).map(|height| format!(", {} high", height.words(" to ")));
        let words = format!("{} wide{}", width.words(" to "), high.unwrap_or_default());
        Some(Self { width_mm: of(width), height_mm: of(height), words, shape, shape_probability })
    }
}

impl std::fmt::Display for Touched {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (words, shape) = (&self.words, self.shape);
        write!(f, "{words}, {shape} ({})", percent(self.shape_probability))
    }
}

impl Report for DemoReport {
    fn text(&self, page: &mut Page) {
        let count = self.grasps.len();
        let grasps = if count == 1 { "1 grasp".to_owned() } else { format!("{count} grasps") };
        let decided = titled(&self.decided);
        let found = match self.stopped_because {
            StopReason::Sure if self.decided == OTHER => format!("None of the known objects, after {grasps}."),
            StopReason::Sure => format!("Recognised after {grasps}: {decided}."),
            StopReason::GraspLimit => format!("Grasp limit reached ({count}). Best guess: {decided}."),
            StopReason::Unknown => format!("Unknown object after {grasps}."),
        };
        let verdict = match self.is_right {
            Some(true) if self.stopped_because == StopReason::Unknown => "Correct: the model does not know this object",
            Some(true) => "Correct",
            _ => "Wrong",
        };
        let truth = self.truth.as_ref().map(|truth| format!(" {verdict} (true object: {}).", titled(truth)));
        page.line(format!("\n{found}{}", truth.unwrap_or_default()));
        if self.stopped_because == StopReason::Unknown {
            page.line("The grasps match none of the objects the model knows.");
        }
        let poses = self.grasps.iter().filter_map(|grasp| grasp.pose.as_ref());
        let pictures: Vec<_> = poses.filter_map(|pose| Some(pose.picture.as_ref()?.display().to_string())).collect();
        if !pictures.is_empty() {
            page.line(format!("Pictures: {}", pictures.join(", ")));
        }
        let trials: Vec<_> = self.grasps.iter().filter_map(|grasp| Some(grasp.trial_id?.to_string())).collect();
        if !trials.is_empty() {
            page.line(format!("Trials: {} (see `palpate trials list`)", trials.join(", ")));
        }
    }
}
