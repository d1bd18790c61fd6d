//! `palpate study effects`: audit of the rules of `auto`.

use super::super::Failure;
use super::super::terminal::{say, say_json, table};
use super::files::{StudyOutput, note_stopped};
use palpate_lab::study::{AuditPlan, AuditReport, ResultFile, StoredStudy, StudyCommand, audit_effects, audit_figure};

/// Arguments of `palpate study effects`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study effects --quick
  palpate study effects --out effects/
  palpate study effects --scenes 100 --seed 2 --json

See also: palpate help effects")]
pub(super) struct EffectsArguments {
    /// Take seconds instead of minutes: few scenes.
    #[arg(long)]
    quick: bool,
    /// Number of random scenes (default: 500, with --quick 40).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    scenes: Option<u32>,
    /// Random seed of the scenes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    output: StudyOutput,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

const SCENES: u32 = 500;
const QUICK_SCENES: u32 = 40;
const NAME: &str = "effects";

pub(super) fn run(arguments: &EffectsArguments) -> Result<(), Failure> {
    let scenes = arguments.scenes.unwrap_or(if arguments.quick { QUICK_SCENES } else { SCENES });
    let plan = AuditPlan { scenes, seed: arguments.seed };
    let folder = arguments.output.folder(NAME, arguments.quick);
    // More scenes of the same seed continue from fewer.
    let mut results = ResultFile::open(&folder.units(NAME), NAME, &plan.seed)?;
    if !arguments.output.run(|how| audit_effects(plan, &mut results, how))?? {
        note_stopped(&format!("{} of {scenes} scenes", results.units().len()));
        return Ok(());
    }
    let report = AuditReport::new(results.units().values().take(scenes as usize));
    let command = StudyCommand::new(NAME)
        .option("scenes", (scenes != SCENES).then_some(scenes))
        .option("seed", (plan.seed != 1).then_some(plan.seed));
    let stored = StoredStudy::new(command.text(), results.cpu_hours(), report);
    let written = folder.write(NAME, &stored, &audit_figure(&stored))?;
    if arguments.json {
        say_json(&stored)
    } else {
        print(&stored)?;
        say(written)
    }
}

fn print(stored: &StoredStudy<AuditReport>) -> Result<(), Failure> {
    let report = &stored.result;
    let rows: Vec<Vec<String>> = report
        .effects
        .iter()
        .filter(|row| row.on + row.off > 0)
        .map(|row| {
            let counts = [row.on, row.needless, row.off, row.missed, row.within_noise].map(|count| count.to_string());
            let cost = row.cost.map_or("-".to_owned(), |cost| format!("{cost:.2}"));
            [vec![row.name.clone(), row.threshold.to_string()], counts.to_vec(), vec![cost]].concat()
        })
        .collect();
    table(&["effect", "threshold", "on", "not seen", "off", "missed", "in noise", "CPU time"], &rows)?;
    say("")?;
    let AuditReport { scenes, missed, within_noise, .. } = report;
    say(format!("all effects on: seen in {missed} of {scenes} scenes, within noise in {within_noise}"))?;
    say(
        "seen: curvature changes by more than 0.1 1/m or force by more than 10 mN (RMS), and by more than twice what a",
    )?;
    say("tenth of the tolerance or a push of 10 um changes")?;
    say(stored.plain_origin())
}
