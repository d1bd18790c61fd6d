//! `palpate study`: experiments, one file each.

mod accuracy;
mod added_sensors;
mod answers;
mod effects;
mod merge;
mod output;
mod paper;
mod promises;
mod public;
mod sensor_faults;
mod stability;

use super::Failure;
use std::path::Path;

/// Arguments of `palpate study`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study models --quick
  palpate study all --quick
  palpate study accuracy --quick
  palpate study effects --quick
  palpate study effects --out studies/
  palpate study stability --quick
  palpate study answers --quick
  palpate study public --data icub.csv
  palpate study sensor-faults --quick
  palpate study added-sensors --quick
  palpate study promises
  palpate study stability --scenes 500 --seed 2 --json")]
pub(super) struct StudyArguments {
    #[command(subcommand)]
    study: Study,
}

#[derive(Debug, clap::Subcommand)]
enum Study {
    /// Measure what accuracy costs in time and what it is worth for recognition; resumes where it stopped.
    Accuracy(accuracy::AccuracyArguments),
    /// Audit what `auto` leaves out: random scenes with each effect flipped, and with all on.
    Effects(effects::EffectsArguments),
    /// Run hard cases at every accuracy, search holds for chatter, and count silently wrong random scenes; resumes.
    Stability(stability::StabilityArguments),
    /// Measure whether sets of classes and automatic stops keep their promise, on rounds of simulated grasps; resumes.
    Answers(answers::AnswersArguments),
    /// Compare the numbers behind the three promises with those of the version before: cost of accuracy, hard cases, effects.
    Promises(promises::PromisesArguments),
    /// Fit and test all methods on recordings of others, beside what can be told without touch; resumes.
    Public(public::PublicArguments),
    /// Let sensors of emulated grippers fail in the middle of a grasp: which are found, and what recognition loses; resumes.
    SensorFaults(sensor_faults::SensorFaultArguments),
    /// Measure what sensors beyond the paper's four are worth to recognition, in simulation; resumes.
    AddedSensors(added_sensors::AddedSensorArguments),
    /// Join the parts of a study that `--shard` measured on several machines.
    Merge(merge::MergeArguments),
    /// Studies of the paper.
    #[command(flatten)]
    Paper(paper::PaperCommand),
}

pub(super) fn run(arguments: &StudyArguments, store: Option<&Path>) -> Result<(), Failure> {
    match &arguments.study {
        Study::Accuracy(arguments) => accuracy::run(arguments),
        Study::Effects(arguments) => effects::run(arguments),
        Study::Stability(arguments) => stability::run(arguments),
        Study::Answers(arguments) => answers::run(arguments),
        Study::Promises(arguments) => promises::run(arguments),
        Study::Public(arguments) => public::run(arguments),
        Study::SensorFaults(arguments) => sensor_faults::run(arguments),
        Study::AddedSensors(arguments) => added_sensors::run(arguments),
        Study::Merge(arguments) => merge::run(arguments),
        Study::Paper(command) => paper::run(command, store),
    }
}
