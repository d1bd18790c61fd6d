//! `palpate trials`: the store from the terminal.

use super::Failure;
use super::setup::open_store;
use super::terminal::{file_name_of, say, say_json, table, warn};
use palpate_core::board::Gap;
use palpate_core::grasping::GraspSummary;
use palpate_core::recording::{
    BoardInfo, BoardTrial, Store, TrialId, TrialRow, contacts_path, read_trials_csv, write_board_csv,
    write_contacts_csv, write_signals_csv, write_trial_csv,
};
use palpate_core::scene::Scene;
use palpate_core::sensing::{PressureArea, SensorLayout, Sensors, Signals};
use palpate_core::trial::{Plan, Trial};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Arguments of `palpate trials`.
#[derive(Debug, clap::Args)]
pub(super) struct TrialsArguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// One line per trial, oldest first.
    List {
        /// Only trials of this object.
        #[arg(long)]
        object: Option<String>,
        /// Include deleted trials.
        #[arg(long)]
        deleted: bool,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// What is known of one trial.
    Show {
        /// Its number.
        id: TrialId,
        /// Print JSON instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Write trials as CSV, two files each.
    Export {
        /// Their numbers.
        #[arg(required = true)]
        ids: Vec<TrialId>,
        /// A folder, or for a single trial a file.
        #[arg(long, value_name = "PATH")]
        out: PathBuf,
        /// Sensor layout: C1 to C8, each also as C1+F.
        #[arg(long, value_name = "NAME", default_value = "C1+F")]
        layout: String,
        /// Divide force by the convex hull of the contacts, as the paper does.
        #[arg(long)]
        hull: bool,
        /// Write trials that did not stay finite or did not converge as well.
        #[arg(long)]
        unsound: bool,
    },
    /// Take in grasps that were recorded elsewhere, from CSV files with the columns trial, label, t_s and any channels.
    Import {
        /// The files. Columns `size` (tiny, large) and `shape` (cubic, cylindrical, spherical) teach stage one.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Copy the trials of other stores into this one; what is here already is not copied again.
    Merge {
        /// The other stores.
        #[arg(required = true, value_name = "FILE")]
        stores: Vec<PathBuf>,
    },
    /// Mark trials as deleted; `restore` takes it back.
    Delete {
        /// Their numbers.
        #[arg(required = true)]
        ids: Vec<TrialId>,
    },
    /// Bring deleted trials back.
    Restore {
        /// Their numbers.
        #[arg(required = true)]
        ids: Vec<TrialId>,
    },
    /// Remove all deleted trials for good.
    Purge,
}

pub(super) fn run(arguments: &TrialsArguments, store: Option<&Path>) -> Result<(), Failure> {
    let mut store = open_store(store)?;
    match &arguments.what {
        What::List { object, deleted, json } => list(&store, object.as_deref(), *deleted, *json),
        What::Show { id, json } => show(&store, *id, *json),
        What::Export { ids, out, layout, hull, unsound } => {
            let area = if *hull { PressureArea::Hull } else { PressureArea::Participation };
            let ids = if *unsound { ids.clone() } else { sound_ones(&store, ids)? };
            export(&store, &ids, out, &SensorLayout::named(layout)?, area)
        }
        What::Import { files } => {
            for file in files {
                import(&mut store, file)?;
            }
            Ok(())
        }
        What::Merge { stores } => {
            for other in stores {
                let merged = store.merge_from(other)?;
                let (added, known) = (merged.added, merged.known);
                say(format!("{}: {added} trial(s) added, {known} were here already", other.display()))?;
            }
            Ok(())
        }
        What::Delete { ids } => {
            store.delete(ids)?;
            say(format!("deleted {} trial(s); `palpate trials restore` brings them back", ids.len()))
        }
        What::Restore { ids } => {
            store.restore(ids)?;
            say(format!("restored {} trial(s)", ids.len()))
        }
        What::Purge => say(format!("removed {} trial(s) for good", store.purge()?)),
    }
}

fn import(store: &mut Store, file: &Path) -> Result<(), Failure> {
    let import = read_trials_csv(file)?;
    for warning in &import.warnings {
        warn(warning);
    }
    let collection = file.file_stem().map_or_else(|| "import".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let added = store.insert_imported(&collection, &import.trials)?;
    let known = import.trials.len() - added as usize;
    say(format!("{}: {added} trial(s) added as collection {collection}, {known} were here already", file.display()))
}

fn list(store: &Store, object: Option<&str>, deleted: bool, json: bool) -> Result<(), Failure> {
    let mut rows = store.list(deleted)?;
    rows.retain(|row| object.is_none_or(|object| row.object == object));
    if json {
        return say_json(&rows);
    }
    if rows.is_empty() {
        return say("no trials yet: `palpate grasp lemon` records one");
    }
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                row.id.to_string(),
                row.object.clone(),
                row.created.chars().take(19).collect::<String>().replace('T', " "),
                row.rig.clone(),
                row.samples.to_string(),
                row.seed.to_string(),
                remark(row),
            ]
        })
        .collect();
    table(&["id", "object", "recorded (UTC)", "from", "samples", "seed", ""], &cells)
}

fn remark(row: &TrialRow) -> String {
    let mut remarks = Vec::new();
    if row.deleted.is_some() {
        remarks.push("deleted".to_owned());
    }
    if row.state != "complete" {
        remarks.push("interrupted or still recording".to_owned());
    }
    if !row.sound {
        remarks.push("not sound: no data set takes it".to_owned());
    }
    if row.warnings > 0 {
        remarks.push(format!("{} warning(s)", row.warnings));
    }
    remarks.join(", ")
}

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

fn scene_of(trial: &Trial) -> Result<Scene, Failure> {
    Ok(Scene::from_toml(&trial.info.scene)?)
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
    };
    if json {
        return say_json(&shown);
    }
    for warning in &shown.warnings {
        warn(warning);
    }
    say(format!("trial {id}: {} (real gripper on {})", shown.object, shown.about.port))?;
    say(format!("{} samples over {:.2} s, recorded by Palpate {}", shown.samples, shown.duration_s, shown.version))?;
    say(format!("channels {}", shown.about.board.channels.join(", ")))?;
    if let Some(detected) = &shown.about.detected {
        say(format!("format {}: {}", detected.format.label(), detected.why))?;
    }
    let cadence = &shown.about.cadence;
    say(format!(
        "{:.2} Hz, jitter {:.2} ms, {} lost, {} bad lines, {} reconnects",
        cadence.rate_hz, cadence.jitter_p95_ms, cadence.lost, cadence.bad_lines, shown.about.reconnects
    ))?;
    for gap in &shown.gaps {
        let since = |t: f64| t - shown.about.began_s;
        let lost = gap.lost.map_or_else(|| "an unknown number of".to_owned(), |lost| lost.to_string());
        say(format!("gap {:.2} s to {:.2} s, {lost} readings: {}", since(gap.from_s), since(gap.to_s), gap.cause))?;
    }
    Ok(())
}

fn show(store: &Store, id: TrialId, json: bool) -> Result<(), Failure> {
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

/// Those of the trials that may be learned from: a CSV file says nothing of the others' flaws.
fn sound_ones(store: &Store, ids: &[TrialId]) -> Result<Vec<TrialId>, Failure> {
    let unsound: BTreeSet<TrialId> = store.list(false)?.iter().filter(|row| !row.sound).map(|row| row.id).collect();
    let (left_out, kept): (Vec<TrialId>, Vec<TrialId>) = ids.iter().partition(|id| unsound.contains(id));
    if left_out.is_empty() {
        return Ok(kept);
    }
    let list: Vec<String> = left_out.iter().map(ToString::to_string).collect();
    let text =
        format!("trial {} left out: it did not stay finite or did not converge (--unsound writes it)", list.join(", "));
    if kept.is_empty() {
        return Err(text.into());
    }
    warn(&text);
    Ok(kept)
}

fn export(
    store: &Store,
    ids: &[TrialId],
    out: &Path,
    layout: &SensorLayout,
    area: PressureArea,
) -> Result<(), Failure> {
    let as_file = out.extension().is_some_and(|e| e == "csv");
    if as_file && ids.len() > 1 {
        return Err("several trials need a folder: --out FOLDER".into());
    }
    for id in ids {
        let trial = store.load(*id)?;
        let path = if as_file {
            out.to_owned()
        } else {
            out.join(format!("trial_{id}_{}.csv", file_name_of(&trial.info.object)))
        };
        if let Some(board) = store.board_trial(*id)? {
            write_board_csv(&path, &board)?;
            std::fs::write(path.with_extension("bytes"), store.board_bytes(*id)?.unwrap_or_default())?;
            say(path.display())?;
            continue;
        }
        if let Some(signals) = store.readings(*id)? {
            write_signals_csv(&path, &signals)?;
            say(path.display())?;
            continue;
        }
        let scene = scene_of(&trial)?;
        let sensors = Sensors::new(layout, &scene.gripper, area)?;
        write_trial_csv(&path, &trial, &scene, &sensors)?;
        write_contacts_csv(&contacts_path(&path), &trial, &scene)?;
        say(path.display())?;
    }
    Ok(())
}
