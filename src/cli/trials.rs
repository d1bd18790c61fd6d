//! `palpate trials`: the store from the terminal.

mod labels;
mod show;

use super::Failure;
use super::setup::open_store;
use super::terminal::{say, say_json, table, warn};
use labels::Labelling;
use palpate_store::labels::shown_name;
use palpate_store::{Store, TrialRow, contacts_path, export_board_trial, file_name_of, read_trials_csv, write_contacts_csv, write_signals_csv, write_trial_csv};
use palpate_tactile::trial::TrialId;
use palpate_sim::scene::Scene;
use palpate_tactile::{PressureArea, SensorLayout, Sensors};
use palpate_tactile::trial::Trial;
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
    #[command(flatten)]
    Labels(Labelling),
    /// Write trials as CSV, two files each; or with --labelled all labelled trials of the real gripper as a data set.
    Export {
        /// Their numbers.
        #[arg(required_unless_present = "labelled")]
        ids: Vec<TrialId>,
        /// All labelled trials of the real gripper into a new folder: trials.csv lists them, signals.csv is what `palpate trials
        /// import` takes, raw/ has counts and bytes.
        #[arg(long, conflicts_with_all = ["ids", "layout", "hull", "unsound"])]
        labelled: bool,
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
    /// Mark trials as deleted: no list shows them and no data set takes them; `restore` or `undo` takes it back.
    #[command(visible_alias = "discard")]
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
        What::Show { id, json } => show::show(&store, *id, *json),
        What::Labels(labelling) => labels::run(labelling, &mut store),
        What::Export { labelled: true, out, .. } => labels::export(&store, out),
        What::Export { ids, out, layout, hull, unsound, .. } => {
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
                shown_name(&row.object).to_owned(),
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
    remarks.extend(row.flags.iter().map(|found| found.flag.label().to_owned()));
    if row.unsure {
        remarks.push("unsure".to_owned());
    }
    if !row.tags.is_empty() {
        remarks.push(format!("[{}]", row.tags.join(", ")));
    }
    if !row.note.is_empty() {
        remarks.push(format!("\"{}\"", row.note));
    }
    remarks.join(", ")
}

fn scene_of(trial: &Trial) -> Result<Scene, Failure> {
    Ok(Scene::from_toml(&trial.info.scene)?)
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
            out.join(format!("trial_{id}_{}.csv", file_name_of(shown_name(&trial.info.object))))
        };
        if export_board_trial(store, *id, &path)? {
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
