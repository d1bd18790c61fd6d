//! `palpate study answers`: whether answers keep their promise.

use super::super::prelude::*;
use super::output::StudyOutput;
use palpate_study::{AnswerStudy, StudySize};

/// Arguments of `palpate study answers`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study answers --quick
  palpate study answers --out studies/

See also: palpate help recognition")]
pub(super) struct AnswersArguments {
    /// Take two minutes instead of more than an hour: four objects, few rounds, small networks.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    output: StudyOutput,
}

pub(super) fn run(arguments: &AnswersArguments) -> Result<(), Failure> {
    let AnswersArguments { quick, output } = arguments;
    let size = if *quick { StudySize::Quick } else { StudySize::Full };
    let stored = output.run(&AnswerStudy::of_size(size), *quick)?;
    stored.filter(|_| output.json).map_or(Ok(()), |stored| say_json(&stored))
}
