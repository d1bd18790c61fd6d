//! `palpate plan`: trials wanted and done per object, and the next one to record.

use super::prelude::*;
use palpate_sim::objects::{class_of, titled};
use palpate_store::labels::{LabelPlan, LabelledTrial, NextTrial, ObjectProgress};

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
struct PlanReport {
    done: u32,
    wanted: u32,
    unlabelled: usize,
    objects: Vec<ObjectProgress>,
    next: Option<NextTrial>,
}

pub(super) fn run(arguments: &PlanArguments, store: Option<&Path>) -> Result<(), Failure> {
    let store = match &arguments.command {
        None | Some(PlanCommand::Show) => existing_store(store)?,
        Some(_) => Some(open_store(store)?),
    };
    let Some(store) = store else { return PlanReport::new(&LabelPlan::default(), &[]).print(arguments.json) };
    let mut plan = store.labels().plan()?;
    match &arguments.command {
        None | Some(PlanCommand::Show) => {}
        Some(PlanCommand::Set { name, wanted }) => plan.set(class_of(name), *wanted)?,
        Some(PlanCommand::Remove { name }) => plan.remove(class_of(name))?,
    }
    if !matches!(arguments.command, None | Some(PlanCommand::Show)) {
        store.labels().set_plan(&plan)?;
    }
    PlanReport::new(&plan, &store.labels().trials()?).print(arguments.json)
}

impl PlanReport {
    fn new(plan: &LabelPlan, rows: &[LabelledTrial]) -> Self {
        let progress = plan.progress(rows);
        let last = rows.iter().rev().find(|row| row.counts()).and_then(|row| row.object.as_deref());
        Self {
            done: progress.done(),
            wanted: progress.wanted(),
            unlabelled: rows.iter().filter(|row| row.complete && !row.discarded && row.object.is_none()).count(),
            next: progress.next(last),
            objects: progress.objects,
        }
    }
}

impl Report for PlanReport {
    fn text(&self, page: &mut Page) {
        let row = |ObjectProgress { name, wanted, done, flagged }: &ObjectProgress| {
            let wanted = if *wanted == 0 { "not planned".to_owned() } else { wanted.to_string() };
            [titled(name), done.to_string(), wanted, flagged.to_string()]
        };
        page.table(&["object", "done", "wanted", "flagged"], self.objects.iter().map(row));
        page.line(format!("{} of {} trials", self.done, self.wanted));
        if self.unlabelled > 0 {
            page.line(format!("{} trial(s) without a label: `palpate trials label ID NAME`", self.unlabelled));
        }
        let Some(NextTrial { object, number, cue, .. }) = &self.next else { return page.line("the plan is complete") };
        page.line(format!("next: {} (trial {number}): {}", titled(object), cue.words()));
    }
}
