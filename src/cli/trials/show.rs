//! `palpate trials show`: one trial, simulated, imported, or of the real gripper.

use super::super::Failure;
use super::super::terminal::{say, say_json, warn};
use palpate_lab::grasping::GraspSummary;
use palpate_sim::frame::Plan;
use palpate_store::labels::{LabelledTrial, cadence_line, shown_title};
use palpate_store::{BoardInfo, Store, TrialPlace};
use palpate_tactile::Signals;
use palpate_tactile::board::Gap;
use palpate_tactile::trial::{BoardLog, SimulatedTrial, Trial, TrialData, TrialHeader, TrialId, TrialSource};
use serde::Serialize;

/// Output of `trials show --json` for a simulated trial.
#[derive(Serialize)]
struct SimulatedReport {
    id: TrialId,
    rig: TrialSource,
    place: TrialPlace,
    seed: u64,
    version: String,
    /// Version of the physics; null for trials of early versions.
    physics: Option<u32>,
    samples: usize,
    #[serde(flatten)]
    summary: GraspSummary,
    plan: Plan,
    scene: String,
}

/// Output of `trials show --json` for an imported trial.
#[derive(Serialize)]
struct ImportReport {
    id: TrialId,
    rig: TrialSource,
    object: String,
    collection: Option<String>,
    samples: usize,
    duration_s: f64,
    channels: Vec<String>,
}

fn show_import(id: TrialId, header: TrialHeader, signals: Signals, json: bool) -> Result<(), Failure> {
    let report = ImportReport {
        id,
        rig: TrialSource::Imported,
        object: header.object,
        collection: header.collection,
        samples: signals.len(),
        duration_s: signals.t_s.last().copied().unwrap_or(0.0) - signals.t_s.first().copied().unwrap_or(0.0),
        channels: signals.channels,
    };
    if json {
        return say_json(&report);
    }
    let from = report.collection.as_deref().unwrap_or("none");
    say(format!("trial {id}: {} (imported, collection {from})", shown_title(&report.object)))?;
    say(format!("{} samples over {:.2} s", report.samples, report.duration_s))?;
    say(format!("channels {}", report.channels.join(", ")))
}

/// Output of `trials show --json` for a trial of the real gripper.
#[derive(Serialize)]
struct BoardReport {
    id: TrialId,
    rig: TrialSource,
    object: String,
    version: String,
    samples: usize,
    duration_s: f64,
    #[serde(flatten)]
    about: BoardInfo,
    gaps: Vec<Gap>,
    warnings: Vec<String>,
    /// Label, note, tags, flags and guess.
    labels: LabelledTrial,
}

fn show_board(store: &Store, id: TrialId, header: TrialHeader, log: BoardLog, json: bool) -> Result<(), Failure> {
    let report = BoardReport {
        id,
        rig: TrialSource::Recorded,
        object: header.object,
        version: header.version,
        samples: log.readings.len(),
        duration_s: log.readings.last().map_or(0.0, |last| last.t_s - log.course.began_s),
        about: store.board_info(id)?.unwrap_or_default(),
        gaps: log.gaps,
        warnings: header.warnings,
        labels: store.labels().trials()?.into_iter().find(|row| row.id == id).unwrap_or_default(),
    };
    if json {
        return say_json(&report);
    }
    for warning in &report.warnings {
        warn(warning);
    }
    say(format!("trial {id}: {} (real gripper on {})", shown_title(&report.object), report.about.port))?;
    print_labels(&report.labels)?;
    say(format!("{} samples over {:.2} s, recorded by Palpate {}", report.samples, report.duration_s, report.version))?;
    say(format!("channels {}", report.about.course.board.channels.join(", ")))?;
    if let Some(detected) = &report.about.course.detected {
        say(format!("format {}: {}", detected.format.label(), detected.why))?;
    }
    let (line, bad_lines) = (cadence_line(&report.about.course.cadence), report.about.course.cadence.bad_lines);
    say(format!("{line}, {bad_lines} bad lines, {} reconnects", report.about.course.reconnects))?;
    for gap in &report.gaps {
        let since = |t: f64| t - report.about.course.began_s;
        let lost = gap.lost.map_or_else(|| "an unknown number of".to_owned(), |lost| lost.to_string());
        say(format!("gap {:.2} s to {:.2} s, {lost} readings: {}", since(gap.from_s), since(gap.to_s), gap.cause))?;
    }
    Ok(())
}

/// Prints flags, note, tags and the guess of a model.
fn print_labels(labels: &LabelledTrial) -> Result<(), Failure> {
    for found in &labels.flags {
        say(format!("flagged {}: {}", found.flag.label(), found.remark))?;
    }
    if labels.unsure {
        say("the label is marked as unsure")?;
    }
    if !labels.note.is_empty() {
        say(format!("note {}", labels.note))?;
    }
    if !labels.tags.is_empty() {
        say(format!("tags {}", labels.tags.join(", ")))?;
    }
    match &labels.guess {
        Some(guess) => say(format!("{} guessed {} ({:.0} %)", guess.model, shown_title(&guess.class), 100.0 * guess.p)),
        None => Ok(()),
    }
}

pub(super) fn show(store: &Store, id: TrialId, json: bool) -> Result<(), Failure> {
    let Trial { header, data } = store.load(id)?;
    match data {
        TrialData::Recorded(log) => show_board(store, id, header, log, json),
        TrialData::Imported(signals) => show_import(id, header, signals, json),
        TrialData::Simulated(data) => show_simulated(id, store.place(id)?, SimulatedTrial { header, data }, json),
    }
}

fn show_simulated(id: TrialId, place: TrialPlace, trial: SimulatedTrial, json: bool) -> Result<(), Failure> {
    let summary = GraspSummary::new(&trial, &trial.header.scene);
    let report = SimulatedReport {
        id,
        rig: TrialSource::Simulated,
        place,
        seed: trial.header.seed,
        samples: trial.frames().len(),
        version: trial.header.version,
        physics: trial.header.origin.as_ref().map(|origin| origin.physics),
        summary,
        plan: trial.data.plan,
        scene: trial.header.scene.to_toml(),
    };
    if json {
        return say_json(&report);
    }
    for warning in &report.summary.warnings {
        warn(warning);
    }
    say(format!("trial {id}: {} ({}, seed {})", shown_title(&report.summary.object), report.rig, report.seed))?;
    let physics = report.physics.map_or_else(|| "unknown".to_owned(), |version| version.to_string());
    say(format!("{} samples, recorded by Palpate {}, physics {physics}", report.samples, report.version))?;
    if report.place == TrialPlace::DemoLog {
        say(format!("in the demo log: data sets exclude it; `palpate trials keep {id}` moves it to the store"))?;
    }
    match report.summary.contact_onset_s {
        Some(onset) => say(format!("first contact at {onset:.3} s"))?,
        None => say("no contact")?,
    }
    if let Some(hold) = &report.summary.hold {
        let [left, right] = hold.force_n;
        say(format!("hold force {left:.3} N left, {right:.3} N right"))?;
        let [left, right] = hold.curvature_per_m;
        say(format!("curvature {left:.2} 1/m left, {right:.2} 1/m right"))?;
        let [left, right] = hold.pressure_pa.map(|p| p * 1e-3);
        say(format!("pressure {left:.2} kPa left, {right:.2} kPa right"))?;
    }
    for effect in &report.plan.effects {
        let state = if effect.on { "on" } else { "off" };
        say(format!("effect {} {state} ({}): {}", effect.name, effect.setting, effect.reason))?;
    }
    let quality = &report.summary.quality;
    say(format!("{} steps, {:.2} Newton iterations each", quality.steps, quality.newton_mean))?;
    say(format!(
        "static residual at hold {:.1e}, friction residual {:.1e}",
        quality.static_residual, quality.friction_residual
    ))?;
    if let Some(recomputed) = quality.recomputed {
        say(format!("recomputed at accuracy {}: {recomputed}", trial.header.scene.solver.accuracy))?;
    }
    let (trust, reason) = quality.trust();
    say(format!("trust {}: {reason}", trust.name()))?;
    if !quality.is_sound() {
        say("unsound: data sets exclude it")?;
    }
    say("`--json` also prints its scene")
}
