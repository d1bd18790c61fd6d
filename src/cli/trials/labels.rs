//! `palpate trials label`, `note`, `tag`, `undo`, `redo`, `journal` and `export --labelled`.

use super::super::output::names_folder;
use super::super::prelude::*;
use super::selection::{ChosenTrials, Filters, Numbers, chosen};
use palpate_exchange::export_labelled;
use palpate_sim::objects::{EMPTY, class_of, titled};
use palpate_store::labels::{TrialEdit, class_name, compared};
use palpate_store::{JournalEntry, Shown};
use std::collections::BTreeMap;

/// Subcommands that change or show labels.
#[derive(Debug, clap::Subcommand)]
pub(super) enum LabelCommand {
    /// Label trials of the real gripper with their object.
    Label {
        /// Trial number; also 3,7-9, or `matching` with filters.
        #[arg(value_name = "TRIALS")]
        ids: Numbers,
        /// Label; `empty` for the empty hand.
        name: String,
        /// Mark the label as unsure.
        #[arg(long)]
        unsure: bool,
        #[command(flatten)]
        filters: Filters,
    },
    /// Set the note of a trial; an empty text removes it.
    Note {
        /// Trial number; also 3,7-9, or `matching` with filters.
        #[arg(value_name = "TRIALS")]
        ids: Numbers,
        /// Note.
        text: String,
        #[command(flatten)]
        filters: Filters,
    },
    /// Set the tags of a trial; no tags removes them.
    Tag {
        /// Trial number; also 3,7-9, or `matching` with filters.
        #[arg(value_name = "TRIALS")]
        ids: Numbers,
        /// Tags, which replace the present ones.
        tags: Vec<String>,
        /// Add the tags to the present ones.
        #[arg(long)]
        add: bool,
        /// Remove these tags and keep the others.
        #[arg(long, conflicts_with = "add")]
        remove: bool,
        #[command(flatten)]
        filters: Filters,
    },
    /// Move trials from the demo log to the store, where newer grasps do not push them out.
    Keep(ChosenTrials),
    /// Undo the last change of a label, note or tag, the last deletion, or the last `keep`; what was changed together is undone together.
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
        LabelCommand::Label { ids, name, unsure, filters } => label(store, &of(store, ids, filters)?, name, *unsure),
        LabelCommand::Note { ids, text, filters } => {
            let removed = text.trim().is_empty();
            let done = if removed { "note removed" } else { "note set" };
            edit(store, &of(store, ids, filters)?, &TrialEdit::Note(text.clone()), done)
        }
        LabelCommand::Tag { ids, tags, add, remove, filters } => {
            let list = tags.clone();
            let (change, what) = match (add, remove) {
                (true, _) => (TrialEdit::Tag(list), "added tags"),
                (_, true) => (TrialEdit::Untag(list), "removed tags"),
                _ => (TrialEdit::Tags(list), "tags"),
            };
            edit(store, &of(store, ids, filters)?, &change, &format!("{what} [{}]", tags.join(", ")))
        }
        LabelCommand::Keep(trials) => {
            let ids = trials.of(store, Shown::Kept)?;
            say(store.labels().edit(&ids, &TrialEdit::Keep)?.sentence(&TrialEdit::Keep))
        }
        LabelCommand::Undo => match store.journal().undo()? {
            Some(entry) => say(format!("Undone: {}", entry.sentence())),
            None => say("nothing to undo"),
        },
        LabelCommand::Redo => match store.journal().redo()? {
            Some(entry) => say(format!("Redone: {}", entry.restored())),
            None => say("nothing to redo"),
        },
        LabelCommand::Journal { last, json } => JournalReport(store.journal().entries(*last)?).print(*json),
    }
}

/// Trials that are meant.
fn of(store: &Store, numbers: &Numbers, filters: &Filters) -> Result<Vec<TrialId>, Failure> {
    chosen(store, std::slice::from_ref(numbers), filters, Shown::Kept)
}

/// Changes trials and says so: of one trial in the words `done`.
fn edit(store: &Store, ids: &[TrialId], change: &TrialEdit, done: &str) -> Result<(), Failure> {
    let edited = store.labels().edit(ids, change)?;
    match ids {
        [id] => say(format!("trial {id}: {done}")),
        _ => say(edited.sentence(change)),
    }
}

fn label(store: &Store, ids: &[TrialId], name: &str, unsure: bool) -> Result<(), Failure> {
    let name = class_name(class_of(name))?;
    let recorded = store.labels().trials()?;
    let is_same = |other: &str| compared(other) == compared(&name);
    let planned = store.labels().plan()?.objects.iter().any(|object| is_same(&object.name));
    let known = planned || recorded.iter().any(|row| row.object.as_deref().is_some_and(is_same));
    edit(
        store,
        ids,
        &TrialEdit::Label(name.clone()),
        &format!("{}{}", titled(&name), if unsure { ", unsure" } else { "" }),
    )?;
    let labelled: Vec<TrialId> = recorded.iter().map(|row| row.id).filter(|id| ids.contains(id)).collect();
    store.labels().edit(&labelled, &TrialEdit::Unsure(unsure))?;
    if !known && name != EMPTY {
        warn(&format!("\"{name}\" is a new class: not in the plan, and no other trial has it (`palpate trials undo`)"));
    }
    Ok(())
}

/// Output of `journal --json`.
#[derive(Serialize)]
struct JournalReport(Vec<JournalEntry>);

impl Report for JournalReport {
    fn text(&self, page: &mut Page) {
        if self.0.is_empty() {
            return page.line("no changes yet");
        }
        let row = |entry: &JournalEntry| {
            let from = if entry.merged { "merged" } else { "" };
            [entry.number.to_string(), entry.sentence(), date(&entry.at), from.to_owned()]
        };
        page.table(&["no", "change", "at (UTC)", ""], self.0.iter().map(row));
    }
}

/// Exports all labelled trials.
pub(super) fn export(store: &Store, out: &Path) -> Result<(), Failure> {
    if !names_folder(out) {
        return Err(
            format!("all labelled trials need a folder, whose name has no ending, not \"{}\"", out.display()).into()
        );
    }
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
