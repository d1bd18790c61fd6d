//! `palpate grasp`: simulates one grasp, prints a summary, stores the trial, writes it as CSV.

use super::prelude::*;
use super::setup::RecomputeArguments;
use palpate_exchange::{contacts_path, write_contacts_csv, write_trial_csv};
use palpate_geometry::units::{mm, three_digits};
use palpate_lab::grasping::{EndState, ErrorNorms, GraspSummary, compare, error_band, grasp_soundly};
use palpate_sim::frame::TrustLevel;
use palpate_sim::objects::titled;
use palpate_sim::poses::jittered;
use palpate_sim::run::SimRun;
use palpate_sim::scene::Scene;
use palpate_store::Stored;
use palpate_store::labels::class_name;
use palpate_tactile::{Sensors, SignalDefinition};

/// Arguments of `palpate grasp`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate grasp lemon
  palpate grasp my_part.urdf --fixed --json
  palpate grasp box --seed 7 --out box.csv --layout C6
  palpate grasp --scene scene.toml --set gripper.pad.friction=0.4
  palpate grasp ball --accuracy 1e-4 --error-band
  palpate grasp jenga --seed 3 --until-agreement

See also: palpate help scenes, palpate help sensors")]
pub(super) struct GraspArguments {
    /// Built-in name (lemon, ball, cube ..), a URDF, OBJ or STL file, or `empty` (default: that of the scene).
    object: Option<String>,
    /// Class of the object (default: the name in its file, or that of the file or its folder).
    #[arg(long, value_name = "NAME")]
    class: Option<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Random seed of the pose, which varies as `pose` of the scene or --preset says (default: no variation).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    seed: Option<u64>,
    /// CSV file to write; the contacts go to a second file, .contacts.csv.
    #[arg(long, value_name = "FILE.csv", value_parser = file_of(&[FileKind::Csv]))]
    out: Option<PathBuf>,
    #[command(flatten)]
    signals: SignalArguments,
    #[command(flatten)]
    recompute: RecomputeArguments,
    /// Estimate the numerical error from a second run with finer steps.
    #[arg(long)]
    error_band: bool,
    /// Do not store the trial.
    #[arg(long)]
    no_store: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Print the whole scene as TOML, then exit.
    #[arg(long)]
    print_scene: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct GraspReport {
    #[serde(flatten)]
    summary: GraspSummary,
    seed: u64,
    accuracy: String,
    /// CPU time of the simulation alone (ms).
    cpu_ms: f64,
    /// CPU time of the simulations it was compared with (ms).
    check_cpu_ms: f64,
    /// CPU time of loading the object (ms).
    load_cpu_ms: f64,
    /// How far the result can be trusted, and why.
    trust: TrustLevel,
    trust_reason: String,
    /// Half-widths of the numerical error band.
    #[serde(skip_serializing_if = "Option::is_none")]
    error_band: Option<ErrorNorms>,
    trial_id: Option<TrialId>,
    /// False where that trial held the same grasp already.
    newly_stored: bool,
    #[serde(skip)]
    scene: Scene,
    /// Files that were written.
    #[serde(skip)]
    written: Option<String>,
}

/// A start deeper inside something is no grasp, and takes minutes (m).
const DEEPEST_START: f64 = 0.1;

pub(super) fn run(arguments: &GraspArguments, store: Option<&Path>) -> Result<(), Failure> {
    let nominal = arguments.scene.scene(arguments.object.as_deref())?;
    if arguments.print_scene {
        return say(nominal.to_toml().trim_end());
    }
    let view = arguments.signals.view();
    let view = match existing_store(store)? {
        Some(store) => arguments.signals.of_store(view, &store)?,
        None => view,
    };
    let layout = view.shown()?;
    let sensors = Sensors::new(&layout, &nominal.gripper, arguments.signals.signals)?;
    if let Some(path) = &arguments.out {
        check_replaced(path, FileKind::Csv)?;
        check_replaced(&contacts_path(path), FileKind::Contacts)?;
    }
    let loading = cpu_time::ProcessTime::now();
    let mut object = load_object(&nominal)?;
    if let (Some(object), Some(class)) = (&mut object, &arguments.class) {
        object.name = class_name(class)?;
    }
    let load_cpu_ms = loading.elapsed().as_secs_f64() * 1e3;
    let scene = match arguments.seed {
        Some(seed) => jittered(&nominal, object.as_ref(), seed).0,
        None => nominal,
    };
    let overlap = SimRun::new(&scene, object.as_ref()).0.starting_overlap();
    if overlap > DEEPEST_START {
        let across = object.as_ref().map_or(0.0, |object| 1e3 * object.bounds.size().max_element());
        return Err(format!(
            "the open fingers start {:.0} mm inside something: check gripper.mount.offset, support.height, and the object, which \
             is {across:.0} mm across (object.scale=0.0254 if it is in inches, 0.01 if in centimetres)",
            1e3 * overlap
        )
        .into());
    }
    let seed = arguments.seed.unwrap_or(0);
    let start = cpu_time::ThreadTime::now();
    let mut trial = grasp_soundly(&scene, object.as_ref(), seed, arguments.recompute.chosen());
    let cpu_ms = start.elapsed().as_secs_f64() * 1e3;
    // That of the accuracy it was computed at.
    let scene = trial.header.scene.clone();
    let checking = cpu_time::ThreadTime::now();
    if trial.data.quality.agrees.is_none()
        && trial.data.quality.is_sound()
        && let Some(found) = compare(&scene, object.as_ref(), seed, EndState::of(trial.frames()).as_ref(), &|| false)
    {
        found.note(&mut trial.data.quality);
    }
    let check_cpu_ms = checking.elapsed().as_secs_f64() * 1e3;
    let error_band = arguments
        .error_band
        .then(|| Sensors::whole_fingers(&scene.gripper, SignalDefinition::Parts))
        .map(|sensors| error_band(&trial, &scene, object.as_ref(), &sensors).norms(&trial, &sensors));
    let stored = if arguments.no_store { None } else { Some(open_store(store)?.insert(&trial)?) };
    if let Some(path) = &arguments.out {
        write_trial_csv(path, &trial, &scene, &sensors)?;
        write_contacts_csv(&contacts_path(path), &trial, &scene)?;
    }
    let summary = GraspSummary::new(&trial, &scene);
    let (trust, trust_reason) = summary.quality.trust();
    let report = GraspReport {
        summary,
        seed,
        accuracy: scene.solver.accuracy.to_string(),
        cpu_ms,
        check_cpu_ms,
        load_cpu_ms,
        trust,
        trust_reason,
        error_band,
        trial_id: stored.map(Stored::id),
        newly_stored: stored.is_some_and(Stored::is_new),
        scene,
        written: arguments.out.as_ref().map(|path| format!("{} and {}", path.display(), contacts_path(path).display())),
    };
    report.print(arguments.json)?;
    if report.summary.finite { Ok(()) } else { Err("the simulation diverged; see the warnings".into()) }
}

impl Report for GraspReport {
    fn text(&self, page: &mut Page) {
        let (summary, accuracy) = (&self.summary, &self.accuracy);
        summary.warnings.iter().for_each(|warning| page.warn(warning));
        let held = if self.scene.holds_object() { "fixed" } else { "free" };
        page.fact("object", format!("{}, {held}", titled(&summary.object)));
        summary_facts(summary, page);
        let quality = &summary.quality;
        if self.scene.solver.accuracy.tolerance().is_some() {
            let (rejected, solves, least) = (quality.rejected_steps, quality.solves, quality.least_step_s * 1e3);
            let text = format!("{rejected} rejected steps, {solves} solves, shortest step {least:.3} ms");
            page.fact("error control", text);
        }
        self.error_band.iter().for_each(|error| error_facts(error, page));
        page.fact("recomputed", quality.recomputed.map(|recomputed| format!("at accuracy {accuracy}: {recomputed}")));
        page.fact("trust", format!("{}: {}", self.trust.name(), self.trust_reason));
        let duration = self.scene.timing.duration_s;
        page.fact(
            "cost",
            format!(
                "{:.1} ms CPU for {duration} s at accuracy {accuracy}, {:.1} ms for the comparison",
                self.cpu_ms, self.check_cpu_ms
            ),
        );
        page.fact(
            "stored",
            self.trial_id.map(|id| match self.newly_stored {
                true => format!("trial {id}"),
                false => format!("not again: trial {id} is the same grasp"),
            }),
        );
        page.fact("written", self.written.clone());
    }
}

/// Contact, hold and solver of a grasp.
pub(super) fn summary_facts(summary: &GraspSummary, page: &mut Page) {
    let onset = summary.contact_onset_s.map_or_else(|| "none".to_owned(), |onset| format!("{onset:.3} s"));
    page.fact("first contact", onset);
    let mut pair = |name: &str, values: Option<[f64; 2]>, unit: &str| {
        let text = values.map(|both| both.map(three_digits));
        page.fact(name, text.map(|[left, right]| format!("{left} left, {right} right [{unit}]")));
    };
    let hold = summary.hold.as_ref();
    pair("force on object", hold.map(|hold| hold.force_n), "N");
    pair("curvature", hold.map(|hold| hold.curvature_per_m), "1/m");
    pair("pad pressure", hold.map(|hold| hold.pressure_pa.map(|p| p * 1e-3)), "kPa");
    pair("contact pressure", hold.map(|hold| hold.contact_pressure_pa.map(|p| p * 1e-3)), "kPa");
    let shape = hold.and_then(|hold| hold.out_of_plane.as_ref());
    pair("tips sideways", shape.map(|shape| shape.tip_m.map(mm)), "mm");
    pair("tips twisted", shape.map(|shape| shape.twist_rad.map(f64::to_degrees)), "degrees");
    page.fact("object moved", summary.object_moved_m.map(|moved| format!("{} mm", three_digits(mm(moved)))));
    page.fact(
        "shaken",
        summary.shaken.map(|shaken| {
            let held = if shaken.held { "held" } else { "lost" };
            let slipped = shaken.slipped_m.map(|way| format!(", {} mm in the hand", three_digits(mm(way))));
            format!("{held}{}", slipped.unwrap_or_default())
        }),
    );
    let quality = &summary.quality;
    let (steps, mean, most) = (quality.steps, quality.newton_mean, quality.newton_max);
    let converged = if summary.converged { "all converged" } else { "not all converged" };
    let text = format!("{steps} steps, {mean:.2} Newton iterations per solve (at most {most}), {converged}");
    page.fact("solver", text);
}

fn error_facts(error: &ErrorNorms, page: &mut Page) {
    let mut part = |name: &str, size: f64, unit: &str, share: f64| {
        let (size, percent) = (three_digits(size), three_digits(share * 100.0));
        page.fact(name, format!("±{size} {unit}, {percent} % of the range [RMS numerical error]"));
    };
    part("curvature", error.curvature_per_m, "1/m", error.curvature_share);
    part("pressure", error.pressure_pa * 1e-3, "kPa", error.pressure_share);
    part("force", error.force_n, "N", error.force_share);
}
