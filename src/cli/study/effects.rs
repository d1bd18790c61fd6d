//! `palpate study effects`: audit of the rules of `auto`.

use super::super::prelude::*;
use super::output::StudyOutput;
use palpate_study::EffectAudit;

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
}

pub(super) fn run(arguments: &EffectsArguments) -> Result<(), Failure> {
    let EffectsArguments { quick, scenes, seed, output } = arguments;
    let scenes = scenes.unwrap_or(if *quick { EffectAudit::QUICK_SCENES } else { EffectAudit::SCENES });
    let stored = output.run(&EffectAudit::new(scenes, *seed), *quick)?;
    stored.filter(|_| output.json).map_or(Ok(()), |stored| say_json(&stored))
}
