//! `palpate study accuracy`: what accuracy costs, and what it is worth.

use super::super::prelude::*;
use super::output::StudyOutput;
use palpate_study::accuracy::{AccuracyExperiment, AccuracyPlan};

/// Arguments of `palpate study accuracy`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study accuracy --quick
  palpate study accuracy --out accuracy/
  palpate study accuracy --poses 8 --json")]
pub(super) struct AccuracyArguments {
    /// Take less than a minute: two poses, fewer settings and methods.
    #[arg(long)]
    quick: bool,
    /// Poses of each object, free and fixed (default: 32, with --quick 2).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    poses: Option<u64>,
    #[command(flatten)]
    output: StudyOutput,
}

pub(super) fn run(arguments: &AccuracyArguments) -> Result<(), Failure> {
    let AccuracyArguments { quick, poses, output } = arguments;
    let usual = if *quick { AccuracyPlan::quick() } else { AccuracyPlan::full() };
    let plan = AccuracyPlan { poses: poses.unwrap_or(usual.poses), ..usual };
    let stored = output.run(&AccuracyExperiment::new(plan)?, *quick)?;
    stored.filter(|_| output.json).map_or(Ok(()), |stored| say_json(&stored))
}
