//! `palpate study added-sensors`: what further sensors are worth.

use super::super::prelude::*;
use super::output::StudyOutput;
use palpate_study::added_sensor_study;
use palpate_tactile::board::SensorList;

/// Arguments of `palpate study added-sensors`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "The same simulated grasps are read through the paper's four sensors and through each list, and every method \
learns from each. Cost: about 10 CPU minutes, with --quick less than one. Ctrl+C stops; the same command resumes.

Examples:
  palpate study added-sensors --quick
  palpate study added-sensors --with mine.toml --out studies/

See also: palpate help sensors"
)]
pub(super) struct AddedSensorArguments {
    /// Also a gripper of your own, by its file (see palpate help sensors).
    #[arg(long, value_name = "FILE.toml")]
    with: Option<PathBuf>,
    /// Few grasps and one method.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    output: StudyOutput,
}

pub(super) fn run(arguments: &AddedSensorArguments) -> Result<(), Failure> {
    let AddedSensorArguments { with, quick, output } = arguments;
    let own = with.as_ref().map(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        SensorList::from_file(path).map(|list| (name, list))
    });
    let stored = output.run(&added_sensor_study(own.transpose()?, *quick), *quick)?;
    stored.filter(|_| output.json).map_or(Ok(()), |stored| say_json(&stored))
}
