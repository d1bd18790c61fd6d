//! `palpate study sensor-faults`: sensors that fail in the middle of a grasp.

use super::super::prelude::*;
use super::output::StudyOutput;
use palpate_study::sensor_fault_study;

/// Arguments of `palpate study sensor-faults`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Cost: about 10 CPU minutes, with --quick less than one. Ctrl+C stops; the same command resumes.

Examples:
  palpate study sensor-faults --quick
  palpate study sensor-faults --out studies/

See also: palpate help gripper"
)]
pub(super) struct SensorFaultArguments {
    /// One gripper and few objects.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    output: StudyOutput,
}

pub(super) fn run(arguments: &SensorFaultArguments) -> Result<(), Failure> {
    let SensorFaultArguments { quick, output } = arguments;
    let stored = output.run(&sensor_fault_study(*quick), *quick)?;
    stored.filter(|_| output.json).map_or(Ok(()), |stored| say_json(&stored))
}
