//! `palpate plan`: trials wanted and done per object, and the next one to record.

use super::Failure;
use super::setup::{existing_store, open_store};
use super::terminal::{say, say_json, table};
use palpate_sim::objects::{class_of, titled};
use palpate_store::labels::{LabelPlan, LabelledTrial, NextTrial, ObjectProgress, Progress};
use serde::Serialize;
use std::path::Path;

/// Arguments of `palpate plan`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate plan
  palpate plan set mug 40
  palpate plan remove lemon
  palpate plan --json")]
pub(super) struct PlanArguments {
    #[command(subcommand)]
    command: Option<PlanCommand>,
    /// Print JSON instead of a table.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, clap::Subcommand)]
enum PlanCommand {
    /// Show progress and the next trial (the default).
    Show,
    /// Set the number of trials of an object; adds it to the plan.
    Set {
        /// Object, as in its label.
        name: String,
        /// Number of trials, 1 to 1000; the paper took 40 to 55 of each.
        wanted: u32,
    },
    /// Remove an object from the plan; its trials stay.
    Remove {
        /// Object.
        name: String,
    },
}

/// Output of `--json`.
#[derive(Serialize)]
struct Report {
    done: u32,
    wanted: u32,
    unlabelled: usize,
    objects: Vec<ObjectProgress>,
    next: Option<NextTrial>,
}

pub(super) fn run(arguments: &PlanArguments, store: Option<&Path>) -> Result<(), Failure> {
    let command = arguments.command.as_ref().unwrap_or(&PlanCommand::Show);
    if matches!(command, PlanCommand::Show) {
        return match existing_store(store)? {
            Some(store) => show(&store.labels().plan()?, &store.labels().trials()?, arguments.json),
            None => show(&LabelPlan::default(), &[], arguments.json),
        };
    }
    let store = open_store(store)?;
    let mut plan = store.labels().plan()?;
    match command {
        PlanCommand::Show => {}
        PlanCommand::Set { name, wanted } => plan.set(class_of(name), *wanted)?,
        PlanCommand::Remove { name } => plan.remove(class_of(name))?,
    }
    store.labels().set_plan(&plan)?;
    show(&plan, &store.labels().trials()?, arguments.json)
}

fn show(plan: &LabelPlan, rows: &[LabelledTrial], json: bool) -> Result<(), Failure> {
    let progress = plan.progress(rows);
    let last = rows.iter().rev().find(|row| row.counts()).and_then(|row| row.object.as_deref());
    let next = progress.next(last);
    let unlabelled = rows.iter().filter(|row| row.complete && !row.discarded && row.object.is_none()).count();
    let (done, wanted) = (progress.done(), progress.wanted());
    if json {
        return say_json(&Report { done, wanted, unlabelled, objects: progress.objects, next });
    }
    table(&["object", "done", "wanted", "flagged"], &cells(&progress))?;
    say(format!("{done} of {wanted} trials"))?;
    if unlabelled > 0 {
        say(format!("{unlabelled} trial(s) without a label: `palpate trials label ID NAME`"))?;
    }
    match next {
        Some(next) => {
            let [opening, across] = next.cue.shift_mm;
            say(format!(
                "next: {} (trial {}), turned by {:.0} degrees, shifted by {opening:.0} mm to the right and {across:.0} mm across",
                titled(&next.object),
                next.number,
                next.cue.turn_deg
            ))
        }
        None => say("the plan is complete"),
    }
}

fn cells(progress: &Progress) -> Vec<Vec<String>> {
    let row = |object: &ObjectProgress| {
        let ObjectProgress { name, wanted, done, flagged } = object;
        let wanted = if *wanted == 0 { "not planned".to_owned() } else { wanted.to_string() };
        vec![titled(name), done.to_string(), wanted, flagged.to_string()]
    };
    progress.objects.iter().map(row).collect()
}
