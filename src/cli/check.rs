//! `palpate check`: signals of a grasp against golden ones, within tolerances that follow from the stated accuracy.

use super::prelude::*;
use super::terminal::error;
use palpate_lab::grasping::{CONTACT_FORCE, EndState, GraspSummary, HoldSummary, Identification, Row, grasp};
use palpate_learn::{Shipped, StopRule};
use palpate_sim::PHYSICS_VERSION;
use palpate_sim::frame::TrustLevel;
use palpate_sim::gripper::Side;
use palpate_sim::objects::ObjectModel;
use palpate_sim::poses::jittered;
use palpate_sim::scene::Scene;
use palpate_study::accuracy::{StatedError, stated_error};
use palpate_tactile::electronics::PadPart;
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Channel, Sensors};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::process::ExitCode;

/// Arguments of `palpate check`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate check golden/mug.json parts/mug.urdf --scene gripper.toml --bless
  palpate check golden/mug.json parts/mug.urdf --scene gripper.toml
  palpate check golden/lemon.json lemon --seed 7 --json

The file holds, with its tolerance, each finger's contact time, its force, curvature and pressure in the hold and its greatest \
force, and the verdicts: touched, held, sound, and the class that the shipped model recognises. Tolerances are twice the error of \
the scene's accuracy: that of the accuracy study, or the difference from a finer run of this grasp where that is larger. Edit \
them as you like.

Exit codes: 0 same, 1 differs, 2 wrong use, 3 not compared

See also: palpate help testing, palpate snapshot --help")]
pub(super) struct CheckArguments {
    /// Golden file.
    #[arg(value_name = "GOLDEN.json", value_parser = file_of(&[FileKind::Json]))]
    golden: PathBuf,
    /// Built-in name, a URDF, OBJ or STL file, or `empty` (default: that of the scene).
    object: Option<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Random pose of this seed.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Make the signals of this grasp the golden ones.
    #[arg(long)]
    bless: bool,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// A golden file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Golden {
    /// Version of the program, and of its physics.
    palpate: String,
    physics: u32,
    /// Object, for people.
    object: String,
    /// Origin of the tolerances.
    tolerances: String,
    signals: BTreeMap<String, GoldenSignal>,
    verdicts: BTreeMap<String, String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GoldenSignal {
    /// Value; null where the grasp has none.
    value: Option<f64>,
    tolerance: f64,
    unit: String,
}

/// A signal or a verdict beside its golden one.
#[derive(Debug, Serialize)]
struct ComparedSignal {
    name: String,
    found: String,
    golden: String,
    same: bool,
}

#[derive(Debug, Serialize)]
struct CheckReport {
    same: bool,
    rows: Vec<ComparedSignal>,
}

/// Exit code where nothing was compared.
const NOT_COMPARED: u8 = 3;
/// Two results that are each within the stated error are at most twice as far apart.
const ERRORS: f64 = 2.0;
/// Likelihood from which a class is a verdict.
const LIKELY: f64 = 0.5;
/// Largest golden file (bytes).
const LARGEST: u64 = 1 << 20;

pub(super) fn run(arguments: &CheckArguments) -> Result<ExitCode, Failure> {
    if arguments.bless {
        return bless(arguments).map(|()| ExitCode::SUCCESS);
    }
    let compared = read(&arguments.golden).and_then(|golden| Ok((measured(arguments)?, golden)));
    match compared {
        Ok((found, golden)) => {
            let report = compare(&found, &golden);
            report.print(arguments.json)?;
            if !report.same && (found.physics, &found.palpate) != (golden.physics, &golden.palpate) {
                let Golden { palpate, physics, .. } = golden;
                note(&format!(
                    "The golden file is from Palpate {palpate}, physics {physics}; this is {}, {}.",
                    found.palpate, found.physics
                ));
            }
            Ok(if report.same { ExitCode::SUCCESS } else { ExitCode::FAILURE })
        }
        Err(failure) => {
            error(&format!("not compared: {failure}"));
            Ok(ExitCode::from(NOT_COMPARED))
        }
    }
}

fn bless(arguments: &CheckArguments) -> Result<(), Failure> {
    check_new(&arguments.golden, FileKind::Json)?;
    if arguments.golden.exists() {
        // A JSON file of something else stays.
        read(&arguments.golden)?;
    }
    let text = serde_json::to_string_pretty(&measured(arguments)?)? + "\n";
    write_new(&arguments.golden, FileKind::Json, text.as_bytes())?;
    say(arguments.golden.display())
}

fn read(path: &Path) -> Result<Golden, Failure> {
    let bytes = palpate_geometry::read_regular(path, LARGEST).map_err(|cause| {
        let make = if path.exists() { "" } else { "; --bless makes it" };
        format!("cannot read \"{}\": {cause}{make}", path.display())
    })?;
    let golden = serde_json::from_slice(&bytes);
    Ok(golden.map_err(|cause| format!("\"{}\" is no golden file of palpate check: {cause}", path.display()))?)
}

/// Grasps, and reads signals and verdicts with their tolerances.
fn measured(arguments: &CheckArguments) -> Result<Golden, Failure> {
    let nominal = arguments.scene.scene(arguments.object.as_deref())?;
    let object = load_object(&nominal)?;
    let scene = match arguments.seed {
        Some(seed) => jittered(&nominal, object.as_ref(), seed).0,
        None => nominal,
    };
    let seed = arguments.seed.unwrap_or(0);
    let trial = grasp(&scene, object.as_ref(), seed);
    if arguments.bless {
        warn_unless_trusted(&trial, object.as_ref());
    } else if let Some(cause) = trial.data.quality.misses() {
        warn(&cause);
    }
    let finer = scene.solver.finer().filter(|_| arguments.bless).map(|solver| {
        let finer = Scene { solver, ..scene.clone() };
        signals(&grasp(&finer, object.as_ref(), seed), &finer)
    });
    let stated = stated_error(&scene);
    let error_of = |signal: &Signal, finer: Option<&Signal>| {
        let own = signal.value.zip(finer.and_then(|finer| finer.value)).map_or(0.0, |(a, b)| (a - b).abs());
        let stated = stated.as_ref().map_or(0.0, |stated| match signal.unit {
            "N" => stated.force_n,
            "Pa" => stated.force_n / PadPart::ACTIVE_AREA,
            "1/m" => stated.curvature_per_m,
            // A time is known to a sample, and the next one may be the first.
            _ => 0.75 / f64::from(scene.timing.sample_hz),
        });
        own.max(stated)
    };
    // Six digits: far finer than any tolerance.
    let digits = |value: f64| format!("{value:.5e}").parse().unwrap_or(value);
    let own = signals(&trial, &scene);
    let golden = own.iter().map(|(name, signal)| {
        let error = error_of(signal, finer.as_ref().and_then(|finer| finer.get(name)));
        let (value, tolerance) = (signal.value.map(digits), digits(ERRORS * error));
        (name.clone(), GoldenSignal { value, tolerance, unit: signal.unit.to_owned() })
    });
    let summary = GraspSummary::new(&trial, &scene);
    let mut verdicts = BTreeMap::from([
        ("touched".to_owned(), yes_or_no(summary.contact_onset_s.is_some())),
        ("sound".to_owned(), yes_or_no(trial.data.quality.is_sound())),
    ]);
    verdicts.extend(summary.shaken.map(|shaken| ("held".to_owned(), yes_or_no(shaken.held))));
    verdicts.extend(recognised(&scene, &trial)?.map(|class| ("class".to_owned(), class)));
    Ok(Golden {
        palpate: env!("CARGO_PKG_VERSION").to_owned(),
        physics: PHYSICS_VERSION,
        object: summary.object,
        tolerances: origin(stated.as_ref(), finer.is_some()),
        signals: golden.collect(),
        verdicts,
    })
}

/// Warns about a grasp that becomes golden and is not to be trusted, in the words of `palpate grasp`.
pub(super) fn warn_unless_trusted(trial: &SimulatedTrial, object: Option<&ObjectModel>) {
    let (scene, mut quality) = (&trial.header.scene, trial.data.quality.clone());
    if quality.is_sound()
        && let Some(found) = palpate_lab::grasping::compare(
            scene,
            object,
            trial.header.seed,
            EndState::of(trial.frames()).as_ref(),
            &|| false,
        )
    {
        found.note(&mut quality);
    }
    if let (TrustLevel::Red, cause) = quality.trust() {
        warn(&format!("trust red: {cause}; written all the same"));
    }
}

fn yes_or_no(is_so: bool) -> String {
    if is_so { "yes" } else { "no" }.to_owned()
}

/// Value of a signal; none where the grasp has none.
struct Signal {
    value: Option<f64>,
    unit: &'static str,
}

/// Signals of a grasp, by their names.
fn signals(trial: &SimulatedTrial, scene: &Scene) -> BTreeMap<String, Signal> {
    let hold = GraspSummary::new(trial, scene).hold;
    let taxels = scene.gripper.taxels().count();
    let mut signals = BTreeMap::new();
    for side in Side::BOTH {
        let mut add = |what: &str, value: Option<f64>, unit: &'static str| {
            signals.insert(format!("{what}_{}", side.name()), Signal { value, unit });
        };
        let forces = || trial.frames().iter().map(|frame| (frame.t, frame.normal_force(side, taxels)));
        add("contact", forces().find(|(_, force)| *force > CONTACT_FORCE).map(|(t, _)| t), "s");
        add("greatest_force", forces().map(|(_, force)| force).reduce(f64::max), "N");
        let value = |of: fn(&HoldSummary) -> [f64; 2]| hold.as_ref().map(|hold| of(hold)[side.index()]);
        add("hold_force", value(|hold| hold.force_n), "N");
        add("hold_curvature", value(|hold| hold.curvature_per_m), "1/m");
        add("hold_pressure", value(|hold| hold.pressure_pa), "Pa");
    }
    signals
}

/// Origin of the tolerances, in words.
fn origin(stated: Option<&StatedError>, is_compared: bool) -> String {
    let own = "the difference of this signal from that of a finer run";
    match stated {
        Some(StatedError { curvature_per_m, force_n, accuracy }) => {
            let own = if is_compared { format!(", or {own} where that is larger") } else { String::new() };
            format!(
                "twice the error of accuracy {accuracy}, {force_n} N and {curvature_per_m} 1/m: three of four grasps of the \
                 accuracy study stay below{own}"
            )
        }
        None if is_compared => format!("twice {own}; the accuracy study has not measured this accuracy"),
        None => "none: the accuracy study has not measured this accuracy".to_owned(),
    }
}

/// Class that the shipped model finds likely after this grasp.
fn recognised(scene: &Scene, trial: &SimulatedTrial) -> Result<Option<String>, Failure> {
    let model = Shipped::simulated(scene.holds_object()).model()?;
    let mut identification = Identification::new(std::sync::Arc::new(model), StopRule::default());
    let Ok(channels) = identification.channels_on(&scene.gripper) else { return Ok(None) };
    let reader = Sensors::of(channels, &scene.gripper);
    identification.begin_grasp(reader.channels().iter().map(Channel::name).enumerate())?;
    for row in trial.frames().iter().map(|frame| Row::of_frame(frame, &reader)) {
        identification.push(row.t_s, &row);
    }
    identification.end_grasp();
    let view = identification.view();
    let top = view.beliefs.last().map(|belief| belief.top()).filter(|(_, share)| *share >= LIKELY);
    Ok(top.map(|(class, _)| view.labels.classes[class].name.clone()))
}

fn compare(found: &Golden, golden: &Golden) -> CheckReport {
    let shown = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |value| format!("{value}"));
    let mut rows = Vec::new();
    for (name, wanted) in &golden.signals {
        let own = found.signals.get(name);
        let value = own.and_then(|own| own.value);
        let near = match (value, wanted.value) {
            (Some(own), Some(wanted_value)) => (own - wanted_value).abs() <= wanted.tolerance,
            (own, wanted) => own == wanted,
        };
        rows.push(ComparedSignal {
            name: name.clone(),
            found: format!("{} {}", shown(value), wanted.unit),
            golden: format!("{} ± {}", shown(wanted.value), wanted.tolerance),
            same: near && own.is_some_and(|own| own.unit == wanted.unit),
        });
    }
    for (name, wanted) in &golden.verdicts {
        let own = found.verdicts.get(name).map_or("none", String::as_str);
        let (found, golden) = (own.to_owned(), wanted.clone());
        rows.push(ComparedSignal { name: name.clone(), same: found == golden, found, golden });
    }
    CheckReport { same: rows.iter().all(|row| row.same), rows }
}

impl Report for CheckReport {
    fn text(&self, page: &mut Page) {
        let rows = self.rows.iter().map(|row| {
            let verdict = if row.same { "same" } else { "DIFFERS" };
            [row.name.clone(), row.found.clone(), row.golden.clone(), verdict.to_owned()]
        });
        page.table(&["signal", "found", "golden", ""], rows);
    }
}
