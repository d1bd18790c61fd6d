//! `palpate study`: experiments, one file each.

mod stability;

use super::Failure;

/// Arguments of `palpate study`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study stability --quick
  palpate study stability --steps 100000 --seed 2 --json")]
pub(super) struct StudyArguments {
    #[command(subcommand)]
    study: Study,
}

#[derive(Debug, clap::Subcommand)]
enum Study {
    /// Run hard cases at every accuracy, and random scenes twice: failures, and silently wrong results.
    Stability(stability::StabilityArguments),
}

pub(super) fn run(arguments: &StudyArguments) -> Result<(), Failure> {
    match &arguments.study {
        Study::Stability(arguments) => stability::run(arguments),
    }
}
