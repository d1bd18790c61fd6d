//! `palpate study promises`: whether answers keep their promise.

use super::super::prelude::*;
use super::output::StudyOutput;
use palpate_study::{PromiseStudy, StudySize};

/// Arguments of `palpate study promises`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study promises --quick
  palpate study promises --out studies/

See also: palpate help recognition")]
pub(super) struct PromisesArguments {
    /// Take two minutes instead of more than an hour: four objects, few rounds, small networks.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    output: StudyOutput,
}

pub(super) fn run(arguments: &PromisesArguments) -> Result<(), Failure> {
    let PromisesArguments { quick, output } = arguments;
    let size = if *quick { StudySize::Quick } else { StudySize::Full };
    let stored = output.run(&PromiseStudy::of_size(size), *quick)?;
    stored.filter(|_| output.json).map_or(Ok(()), |stored| say_json(&stored))
}
