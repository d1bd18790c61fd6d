//! `palpate trials label`, `note`, `tag`, `undo`, `redo`, `journal` and `export --labelled`.

use super::super::Failure;
use super::super::terminal::{say, say_json, table, warn};
use palpate_sim::objects::{EMPTY, class_of, titled};
use palpate_store::labels::class_name;
use palpate_store::{JournalEntry, Store, export_labelled};
use palpate_tactile::trial::TrialId;
use std::collections::BTreeMap;
use std::path::Path;

/// Subcommands that change or show labels.
#[derive(Debug, clap::Subcommand)]
pub(super) enum LabelCommand {
    /// Label a trial of the real gripper with its object.
    Label {
        /// Trial number.
        id: TrialId,
        /// Label; `empty` for the empty hand.
        name: String,
        /// Mark the label as unsure.
        #[arg(long)]
        unsure: bool,
    },
    /// Set the note of a trial; an empty text removes it.
    Note {
        /// Trial number.
        id: TrialId,
        /// Note.
        text: String,
    },
    /// Set the tags of a trial; no tags removes them.
    Tag {
        /// Trial number.
        id: TrialId,
        /// Tags, which replace the present ones.
        tags: Vec<String>,
    },
    /// Undo the last change of a label, note or tag, or the last deletion, one trial at a time.
    Undo,
    /// Redo the last undone change.
    Redo,
    /// Show the journal of all changes (labels, notes, tags, deletions, guesses, plan), newest first.
    Journal {
        /// Number of entries.
        #[arg(long, value_name = "N", default_value_t = 30)]
        last: usize,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(command: &LabelCommand, store: &mut Store) -> Result<(), Failure> {
    match command {
        LabelCommand::Label { id, name, unsure } => label(store, *id, name, *unsure),
        LabelCommand::Note { id, text } => {
            store.labels().set_note(*id, text)?;
            say(if text.trim().is_empty() {
                format!("trial {id}: note removed")
            } else {
                format!("trial {id}: note set")
            })
        }
        LabelCommand::Tag { id, tags } => {
            store.labels().set_tags(*id, tags)?;
            say(format!("trial {id}: tags [{}]", tags.join(", ")))
        }
        LabelCommand::Undo => match store.journal().undo()? {
            Some(entry) => say(format!("undone: {}", entry.sentence())),
            None => say("nothing to undo"),
        },
        LabelCommand::Redo => match store.journal().redo()? {
            Some(entry) => say(format!("redone: {}", entry.restored())),
            None => say("nothing to redo"),
        },
        LabelCommand::Journal { last, json } => journal(&store.journal().entries(*last)?, *json),
    }
}

fn label(store: &mut Store, id: TrialId, name: &str, unsure: bool) -> Result<(), Failure> {
    let name = class_name(class_of(name))?;
    let planned = store.labels().plan()?.objects.iter().any(|object| object.name == name);
    let known = planned || store.labels().trials()?.iter().any(|row| row.object.as_deref() == Some(&name));
    store.labels().set_label(id, &name)?;
    store.labels().set_unsure(id, unsure)?;
    if !known && name != EMPTY {
        warn(&format!("\"{name}\" is a new class: not in the plan, and no other trial has it (`palpate trials undo`)"));
    }
    say(format!("trial {id}: {}{}", titled(&name), if unsure { ", unsure" } else { "" }))
}

fn journal(entries: &[JournalEntry], json: bool) -> Result<(), Failure> {
    if json {
        return say_json(&entries);
    }
    if entries.is_empty() {
        return say("no changes yet");
    }
    let cells: Vec<Vec<String>> = entries
        .iter()
        .map(|entry| {
            let when = entry.at.chars().take(19).collect::<String>().replace('T', " ");
            let from = if entry.merged { "merged" } else { "" };
            vec![entry.number.to_string(), entry.sentence(), when, from.to_owned()]
        })
        .collect();
    table(&["no", "change", "at (UTC)", ""], &cells)
}

/// Exports all labelled trials.
pub(super) fn export(store: &Store, out: &Path) -> Result<(), Failure> {
    let exported = export_labelled(store, out)?;
    // Hundreds of trials may lack the same calibration: one warning.
    let mut reasons: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (id, why) in &exported.left_out {
        reasons.entry(why).or_default().push(id.to_string());
    }
    for (why, ids) in reasons {
        let (named, all) = (ids.iter().take(5).cloned().collect::<Vec<_>>().join(", "), ids.len());
        let more = if all > 5 { format!(" and {} more", all - 5) } else { String::new() };
        warn(&format!("trial {named}{more} missing in signals.csv: {why}"));
    }
    let (trials, derived) = (exported.trials, exported.derived);
    say(format!("{}: {trials} trial(s), {derived} of them in signals.csv", exported.folder.display()))
}
