//! `palpate trials show`: what is known of one trial, simulated, imported, or of the real gripper.

use super::super::Failure;
use super::super::terminal::{say, say_json, warn};
use super::scene_of;
use palpate_lab::grasping::GraspSummary;
use palpate_sim::frame::Plan;
use palpate_store::labels::{LabelledTrial, cadence_line, shown_name};
use palpate_store::{BoardInfo, BoardTrial, Store};
use palpate_tactile::Signals;
use palpate_tactile::board::Gap;
use palpate_tactile::trial::TrialId;
use serde::Serialize;

/// What `trials show --json` prints.
#[derive(Serialize)]
struct Shown {
    id: TrialId,
    rig: String,
    seed: u64,
    version: String,
    samples: usize,
    #[serde(flatten)]
    summary: GraspSummary,
    plan: Plan,
    scene: String,
}

/// What `trials show --json` prints of a trial that was recorded elsewhere.
#[derive(Serialize)]
struct ShownImport {
    id: TrialId,
    rig: String,
    object: String,
    collection: Option<String>,
    samples: usize,
    duration_s: f64,
    channels: Vec<String>,
}

fn show_import(store: &Store, id: TrialId, signals: Signals, json: bool) -> Result<(), Failure> {
    let info = store.load(id)?.info;
    let shown = ShownImport {
        id,
        rig: info.rig,
        object: info.object,
        collection: info.collection,
        samples: signals.len(),
        duration_s: signals.t_s.last().copied().unwrap_or(0.0) - signals.t_s.first().copied().unwrap_or(0.0),
        channels: signals.channels,
    };
    if json {
        return say_json(&shown);
    }
    let from = shown.collection.as_deref().unwrap_or("nowhere");
    say(format!("trial {id}: {} (imported, collection {from})", shown.object))?;
    say(format!("{} samples over {:.2} s", shown.samples, shown.duration_s))?;
    say(format!("channels {}", shown.channels.join(", ")))
}

/// What `trials show --json` prints of a trial of a real gripper.
#[derive(Serialize)]
struct ShownBoard {
    id: TrialId,
    rig: String,
    object: String,
    version: String,
    samples: usize,
    duration_s: f64,
    #[serde(flatten)]
    about: BoardInfo,
    gaps: Vec<Gap>,
    warnings: Vec<String>,
    /// Its label and what goes with it.
    labels: LabelledTrial,
}

fn show_board(store: &Store, id: TrialId, trial: BoardTrial, json: bool) -> Result<(), Failure> {
    let info = store.load(id)?.info;
    let shown = ShownBoard {
        id,
        rig: info.rig,
        object: info.object,
        version: info.version,
        samples: trial.readings.len(),
        duration_s: trial.readings.last().map_or(0.0, |last| last.t_s - trial.about.began_s),
        about: trial.about,
        gaps: trial.gaps,
        warnings: info.warnings,
        labels: store.labels().trials()?.into_iter().find(|row| row.id == id).unwrap_or_default(),
    };
    if json {
        return say_json(&shown);
    }
    for warning in &shown.warnings {
        warn(warning);
    }
    say(format!("trial {id}: {} (real gripper on {})", shown_name(&shown.object), shown.about.port))?;
    say_labels(&shown.labels)?;
    say(format!("{} samples over {:.2} s, recorded by Palpate {}", shown.samples, shown.duration_s, shown.version))?;
    say(format!("channels {}", shown.about.board.channels.join(", ")))?;
    if let Some(detected) = &shown.about.detected {
        say(format!("format {}: {}", detected.format.label(), detected.why))?;
    }
    let (line, bad_lines) = (cadence_line(&shown.about.cadence), shown.about.cadence.bad_lines);
    say(format!("{line}, {bad_lines} bad lines, {} reconnects", shown.about.reconnects))?;
    for gap in &shown.gaps {
        let since = |t: f64| t - shown.about.began_s;
        let lost = gap.lost.map_or_else(|| "an unknown number of".to_owned(), |lost| lost.to_string());
        say(format!("gap {:.2} s to {:.2} s, {lost} readings: {}", since(gap.from_s), since(gap.to_s), gap.cause))?;
    }
    Ok(())
}

/// What somebody, or a model, has said of it.
fn say_labels(labels: &LabelledTrial) -> Result<(), Failure> {
    for found in &labels.flags {
        say(format!("flagged {}: {}", found.flag.label(), found.remark))?;
    }
    if labels.unsure {
        say("whoever gave the label was not sure")?;
    }
    if !labels.note.is_empty() {
        say(format!("note {}", labels.note))?;
    }
    if !labels.tags.is_empty() {
        say(format!("tags {}", labels.tags.join(", ")))?;
    }
    match &labels.guess {
        Some(guess) => say(format!("{} took it for {} ({:.0} %)", guess.model, guess.class, 100.0 * guess.p)),
        None => Ok(()),
    }
}

pub(super) fn show(store: &Store, id: TrialId, json: bool) -> Result<(), Failure> {
    if let Some(trial) = store.board_trial(id)? {
        return show_board(store, id, trial, json);
    }
    if let Some(signals) = store.readings(id)? {
        return show_import(store, id, signals, json);
    }
    show_simulated(store, id, json)
}

fn show_simulated(store: &Store, id: TrialId, json: bool) -> Result<(), Failure> {
    let trial = store.load(id)?;
    let summary = GraspSummary::new(&trial, &scene_of(&trial)?);
    let shown = Shown {
        id,
        rig: trial.info.rig,
        seed: trial.info.seed,
        version: trial.info.version,
        samples: trial.frames.len(),
        summary,
        plan: trial.info.plan,
        scene: trial.info.scene,
    };
    if json {
        return say_json(&shown);
    }
    for warning in &shown.summary.warnings {
        warn(warning);
    }
    say(format!("trial {id}: {} ({}, seed {})", shown.summary.object, shown.rig, shown.seed))?;
    say(format!("{} samples, recorded by Palpate {}", shown.samples, shown.version))?;
    match shown.summary.contact_onset_s {
        Some(onset) => say(format!("first contact at {onset:.3} s"))?,
        None => say("no contact")?,
    }
    if let Some(hold) = &shown.summary.hold {
        let [left, right] = hold.force_n;
        say(format!("hold force {left:.3} N left, {right:.3} N right"))?;
        let [left, right] = hold.curvature_per_m;
        say(format!("curvature {left:.2} 1/m left, {right:.2} 1/m right"))?;
        let [left, right] = hold.pressure_pa.map(|p| p * 1e-3);
        say(format!("pressure {left:.2} kPa left, {right:.2} kPa right"))?;
    }
    for effect in &shown.plan.effects {
        let state = if effect.on { "on" } else { "off" };
        say(format!("effect {} {state} ({}): {}", effect.name, effect.setting, effect.reason))?;
    }
    let quality = &shown.summary.quality;
    say(format!("{} steps, {:.2} Newton iterations each", quality.steps, quality.newton_mean))?;
    say(format!(
        "static residual at hold {:.1e}, friction residual {:.1e}",
        quality.static_residual, quality.friction_residual
    ))?;
    if !quality.is_sound() {
        say("not sound: no data set takes it")?;
    }
    say("its scene is in `palpate trials show --json`")
}
