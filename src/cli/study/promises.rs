//! `palpate study promises`: the numbers behind the three promises, beside those of the version before.

use super::super::prelude::*;
use super::output::print_table;
use palpate_study::{Promises, StudyFolder};

/// Arguments of `palpate study promises`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "The numbers are those of the full studies `accuracy`, `stability` and `effects` that come with this
version. Exit code 1: a number is worse than before.

Examples:
  palpate study promises
  palpate study promises --from studies/          # results measured on this machine
  palpate study promises --json > promises.json   # what the next version is compared with

See also: palpate help promises"
)]
pub(super) struct PromisesArguments {
    /// Folder with results of the three studies (accuracy.json, stability.json, effects.json), in place of those that come
    /// with the program.
    #[arg(long, value_name = "DIR", value_parser = file_or_folder(&[]))]
    from: Option<PathBuf>,
    /// Print the numbers of this version as a JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &PromisesArguments) -> Result<(), Failure> {
    let now = Promises::now(arguments.from.clone().map(StudyFolder::new).as_ref())?;
    if arguments.json {
        return say_json(&now);
    }
    let before = Promises::before()?;
    say(format!("Before: {}. Now: {}.", before.program, now.program))?;
    print_table(&now.table(&before))?;
    now.reasons(&before).iter().try_for_each(say)?;
    let worse = now.broken(&before);
    if worse.is_empty() { Ok(()) } else { Err(format!("worse than before: {}", worse.join("; ")).into()) }
}
