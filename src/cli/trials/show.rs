//! `palpate trials show`: one trial, simulated, imported, or of the real gripper.

use super::super::grasp::summary_facts;
use super::super::prelude::*;
use palpate_geometry::units::percent;
use palpate_lab::grasping::GraspSummary;
use palpate_sim::frame::Plan;
use palpate_store::labels::{LabelledTrial, cadence_line, shown_title};
use palpate_store::{BoardInfo, TrialPlace};
use palpate_tactile::board::Gap;
use palpate_tactile::trial::{GraspOrigin, SimulatedTrial, Trial, TrialData, TrialSource};

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
    #[serde(skip)]
    other_physics: Option<String>,
    samples: usize,
    #[serde(flatten)]
    summary: GraspSummary,
    plan: Plan,
    scene: String,
    #[serde(skip)]
    accuracy: String,
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
    gaps: Vec<String>,
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

pub(super) fn show(store: &Store, id: TrialId, json: bool) -> Result<(), Failure> {
    let Trial { header, data } = store.load(id)?;
    match data {
        TrialData::Recorded(log) => BoardReport {
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
        }
        .print(json),
        TrialData::Imported(signals) => ImportReport {
            id,
            rig: TrialSource::Imported,
            object: header.object,
            collection: header.collection,
            samples: signals.len(),
            duration_s: signals.t_s.last().copied().unwrap_or(0.0) - signals.t_s.first().copied().unwrap_or(0.0),
            channels: signals.channels,
            gaps: header.warnings,
        }
        .print(json),
        TrialData::Simulated(data) => {
            let trial = SimulatedTrial { header, data };
            let summary = GraspSummary::new(&trial, &trial.header.scene);
            let SimulatedTrial { header, data } = trial;
            SimulatedReport {
                id,
                rig: TrialSource::Simulated,
                place: store.place(id)?,
                seed: header.seed,
                samples: data.frames.len(),
                version: header.version,
                physics: header.origin.as_ref().map(|origin| origin.physics),
                other_physics: header.origin.as_ref().and_then(GraspOrigin::other_physics),
                summary,
                plan: data.plan,
                scene: header.scene.to_toml(),
                accuracy: header.scene.solver.accuracy.to_string(),
            }
            .print(json)
        }
    }
}

impl Report for ImportReport {
    fn text(&self, page: &mut Page) {
        let from = self.collection.as_deref().unwrap_or("none");
        page.line(format!("trial {}: {} (imported, collection {from})", self.id, shown_title(&self.object)));
        page.line(format!("{} samples over {:.2} s", self.samples, self.duration_s));
        page.line(format!("channels {}", self.channels.join(", ")));
        self.gaps.iter().for_each(|gap| page.warn(gap));
    }
}

impl Report for BoardReport {
    fn text(&self, page: &mut Page) {
        let course = &self.about.course;
        self.warnings.iter().for_each(|warning| page.warn(warning));
        let object = shown_title(&self.object);
        let (gripper, port) = (if course.board.emulated { "emulated" } else { "real" }, &self.about.port);
        page.line(format!("trial {}: {object} ({gripper} gripper on {port})", self.id));
        labels_text(&self.labels, page);
        let (samples, duration_s, version) = (self.samples, self.duration_s, &self.version);
        page.line(format!("{samples} samples over {duration_s:.2} s, recorded by Palpate {version}"));
        page.line(format!("channels {}", course.board.channels.join(", ")));
        if let Some(detected) = &course.detected {
            page.line(format!("format {}: {}", detected.format.label(), detected.why));
        }
        let (line, bad_lines) = (cadence_line(&course.cadence), course.cadence.bad_lines);
        page.line(format!("{line}, {bad_lines} bad lines, {} reconnects", course.reconnects));
        for gap in &self.gaps {
            let [from, to] = [gap.from_s, gap.to_s].map(|t| t - course.began_s);
            let lost = gap.lost.map_or_else(|| "an unknown number of".to_owned(), |lost| lost.to_string());
            page.line(format!("gap {from:.2} s to {to:.2} s, {lost} readings: {}", gap.cause));
        }
    }
}

/// Flags, note, tags and the guess of a model.
fn labels_text(labels: &LabelledTrial, page: &mut Page) {
    labels.flags.iter().for_each(|found| page.line(format!("flagged {}: {}", found.flag.label(), found.remark)));
    if labels.unsure {
        page.line("the label is marked as unsure");
    }
    if !labels.note.is_empty() {
        page.line(format!("note {}", labels.note));
    }
    if !labels.tags.is_empty() {
        page.line(format!("tags {}", labels.tags.join(", ")));
    }
    if let Some(guess) = &labels.guess {
        page.line(format!("{} guessed {} ({})", guess.model, shown_title(&guess.class), percent(guess.p)));
    }
}

impl Report for SimulatedReport {
    fn text(&self, page: &mut Page) {
        let (id, summary, quality) = (self.id, &self.summary, &self.summary.quality);
        summary.warnings.iter().chain(&self.other_physics).for_each(|warning| page.warn(warning));
        page.line(format!("trial {id}: {} ({}, seed {})", shown_title(&summary.object), self.rig, self.seed));
        let physics = self.physics.map_or_else(|| "unknown".to_owned(), |version| version.to_string());
        page.line(format!("{} samples, recorded by Palpate {}, physics {physics}", self.samples, self.version));
        if self.place == TrialPlace::DemoLog {
            page.line(format!(
                "in the demo log: data sets exclude it; `palpate trials keep {id}` moves it to the store"
            ));
        }
        summary_facts(summary, page);
        let (rest, friction) = (quality.static_residual, quality.friction_residual);
        page.fact("residuals", format!("static residual at hold {rest:.1e}, friction residual {friction:.1e}"));
        let recomputed = quality.recomputed.map(|recomputed| format!("at accuracy {}: {recomputed}", self.accuracy));
        page.fact("recomputed", recomputed);
        let (trust, reason) = quality.trust();
        page.fact("trust", format!("{}: {reason}", trust.name()));
        page.fact("unsound", (!quality.is_sound()).then(|| "data sets exclude it".to_owned()));
        for effect in &self.plan.effects {
            let state = if effect.on { "on" } else { "off" };
            page.line(format!("effect {} {state} ({}): {}", effect.name, effect.setting, effect.reason));
        }
        page.line("`--json` also prints its scene");
    }
}
