//! `palpate study stability`: hard cases, holds that chatter, and random scenes.

use super::super::prelude::*;
use super::output::StudyOutput;
use palpate_study::stability::{CaseRow, StabilityPlan, StabilityReport};

/// Arguments of `palpate study stability`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study stability --quick
  palpate study stability --out stability/
  palpate study stability --scenes 500 --grasps 200 --seed 2 --json

See also: palpate help stability")]
pub(super) struct StabilityArguments {
    /// Take a minute instead of hours: draft and standard only, short runs, few grasps and random scenes.
    #[arg(long)]
    quick: bool,
    /// Number of random scenes (default: 4000, with --quick 5).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    scenes: Option<u64>,
    /// Grasps of each preset at draft and at standard that are searched for chatter (default: 1000, with --quick 16).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    grasps: Option<u32>,
    /// Random seed of the scenes (default: 2, with --quick 1).
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    output: StudyOutput,
}

/// Output of `--json`.
#[derive(Serialize)]
struct StabilityJson<'a> {
    /// One row per hard case and setting.
    table: &'a [CaseRow],
    #[serde(flatten)]
    report: &'a StabilityReport,
    /// CPU time (h).
    cpu_hours: f64,
}

pub(super) fn run(arguments: &StabilityArguments) -> Result<(), Failure> {
    let StabilityArguments { quick, scenes, grasps, seed, output } = arguments;
    let usual = if *quick { StabilityPlan::QUICK } else { StabilityPlan::FULL };
    let grasps = grasps.map_or(usual.grasps, |grasps| grasps as usize);
    let plan =
        StabilityPlan { grasps, scenes: scenes.unwrap_or(usual.scenes), seed: seed.unwrap_or(usual.seed), ..usual };
    let Some(stored) = output.run(&plan, *quick)? else { return Ok(()) };
    let (report, cpu_hours) = (&stored.result, stored.cpu_hours);
    if output.json {
        say_json(&StabilityJson { table: &report.table, report, cpu_hours })?;
    }
    match report.table.iter().filter(|row| !row.holds).count() + report.random.non_finite {
        0 => Ok(()),
        failed => Err(format!("{failed} hard case(s) or random scene(s) failed").into()),
    }
}
