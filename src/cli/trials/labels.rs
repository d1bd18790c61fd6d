//! `palpate trials label`, `note`, `tag`, `undo`, `redo`, `journal` and `export --labelled`: what is said of trials, and who
//! changed what.

use super::super::Failure;
use super::super::terminal::{say, say_json, table, warn};
use palpate_store::labels::class_name;
use palpate_store::{JournalEntry, Store, export_labelled};
use palpate_tactile::trial::TrialId;
use std::collections::BTreeMap;
use std::path::Path;

/// The commands.
#[derive(Debug, clap::Subcommand)]
pub(super) enum Labelling {
    /// Say what a trial of the real gripper is of: its label, which recognisers learn.
    Label {
        /// Its number.
        id: TrialId,
        /// The label; `empty` for the empty hand.
        name: String,
        /// Mark the label as doubted.
        #[arg(long)]
        unsure: bool,
    },
    /// Note something on a trial; an empty text removes the note.
    Note {
        /// Its number.
        id: TrialId,
        /// The note.
        text: String,
    },
    /// Set the tags of a trial; without any they are removed.
    Tag {
        /// Its number.
        id: TrialId,
        /// The tags, which take the place of those it has.
        tags: Vec<String>,
    },
    /// Take back the last change of a label, note or tag, or the last deletion, one trial at a time; also after a restart.
    Undo,
    /// Do again what was taken back last.
    Redo,
    /// Who changed what: labels, notes, tags, deletions, guesses, the plan; newest first. Nothing is ever removed from it.
    Journal {
        /// How many entries.
        #[arg(long, value_name = "N", default_value_t = 30)]
        last: usize,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(what: &Labelling, store: &mut Store) -> Result<(), Failure> {
    match what {
        Labelling::Label { id, name, unsure } => label(store, *id, name, *unsure),
        Labelling::Note { id, text } => {
            store.labels().set_note(*id, text)?;
            say(if text.trim().is_empty() { format!("trial {id}: note removed") } else { format!("trial {id}: noted") })
        }
        Labelling::Tag { id, tags } => {
            store.labels().set_tags(*id, tags)?;
            say(format!("trial {id}: tags [{}]", tags.join(", ")))
        }
        Labelling::Undo => match store.journal().undo()? {
            Some(entry) => say(format!("taken back: {}", entry.sentence())),
            None => say("there is nothing to take back"),
        },
        Labelling::Redo => match store.journal().redo()? {
            Some(entry) => say(format!("no longer taken back: {}", entry.restored())),
            None => say("nothing was taken back since the last change"),
        },
        Labelling::Journal { last, json } => journal(&store.journal().entries(*last)?, *json),
    }
}

fn label(store: &mut Store, id: TrialId, name: &str, unsure: bool) -> Result<(), Failure> {
    let name = class_name(name)?;
    let planned = store.labels().plan()?.objects.iter().any(|object| object.name == name);
    let known = planned || store.labels().trials()?.iter().any(|row| row.object.as_deref() == Some(&name));
    store.labels().set_label(id, &name)?;
    store.labels().set_unsure(id, unsure)?;
    if !known && name != palpate_sim::objects::EMPTY {
        warn(&format!(
            "\"{name}\" is a new class: it is not in the plan and no trial has it (`trials undo` takes it back)"
        ));
    }
    say(format!("trial {id}: {name}{}", if unsure { ", unsure" } else { "" }))
}

fn journal(entries: &[JournalEntry], json: bool) -> Result<(), Failure> {
    if json {
        return say_json(&entries);
    }
    if entries.is_empty() {
        return say("nothing has been changed yet");
    }
    let cells: Vec<Vec<String>> = entries
        .iter()
        .map(|entry| {
            let when = entry.at.chars().take(19).collect::<String>().replace('T', " ");
            let from = if entry.merged { "merged" } else { "" };
            vec![entry.number.to_string(), entry.sentence(), when, from.to_owned()]
        })
        .collect();
    table(&["no", "what", "when (UTC)", ""], &cells)
}

/// Writes all labelled trials.
pub(super) fn export(store: &Store, out: &Path) -> Result<(), Failure> {
    let exported = export_labelled(store, out)?;
    // Hundreds of trials lack the same calibration: it is said once.
    let mut reasons: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (id, why) in &exported.left_out {
        reasons.entry(why).or_default().push(id.to_string());
    }
    for (why, ids) in reasons {
        let (named, all) = (ids.iter().take(5).cloned().collect::<Vec<_>>().join(", "), ids.len());
        let more = if all > 5 { format!(" and {} more", all - 5) } else { String::new() };
        warn(&format!("trial {named}{more} left out of signals.csv: {why}"));
    }
    let (trials, derived) = (exported.trials, exported.derived);
    say(format!(
        "{}: {trials} trial(s), {derived} of them with derived channels in signals.csv",
        exported.folder.display()
    ))
}
