//! `palpate study merge`: joins the parts of a study.

use super::super::prelude::*;
use palpate_study::merged_units;

/// Arguments of `palpate study merge`.
#[derive(Debug, clap::Args)]
#[command(after_help = "The command of the study then goes on from the merged file, in its folder and under its name.

Examples:
  palpate study grasps --shard 3/8 --out studies/
  palpate study merge studies/grasps.*-of-8.jsonl --out studies/grasps.jsonl
  palpate study grasps --out studies/

See also: palpate help studies")]
pub(super) struct MergeArguments {
    /// Files of finished units (.jsonl), one of each part.
    #[arg(required = true, value_name = "FILE")]
    parts: Vec<PathBuf>,
    /// File for all units.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn run(arguments: &MergeArguments) -> Result<(), Failure> {
    let MergeArguments { parts, out } = arguments;
    check_new(out, FileKind::Json)?;
    let (text, units) = merged_units(parts)?;
    write_new(out, FileKind::Json, text.as_bytes())?;
    say(format!("{units} units in {}", out.display()))
}
