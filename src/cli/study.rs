//! `palpate study`: experiments. One line here, and a file beside, for each.

mod stability;

use super::Failure;

/// Arguments of `palpate study`.
#[derive(Debug, clap::Args)]
pub(super) struct StudyArguments {
    #[command(subcommand)]
    which: Which,
}

#[derive(Debug, clap::Subcommand)]
enum Which {
    /// Hard cases at every accuracy, and random scenes computed twice: what fails, and what is wrong without a word.
    Stability(stability::StabilityArguments),
}

pub(super) fn run(arguments: &StudyArguments) -> Result<(), Failure> {
    match &arguments.which {
        Which::Stability(arguments) => stability::run(arguments),
    }
}
