//! The command line: every headless command, and the door to the window. Exit codes: 0 done, 1 failed, 2 wrong use.

mod bench;
mod calibrate;
mod collect;
mod demo;
mod doctor;
mod emulate;
mod evaluate;
mod fit;
mod grasp;
mod interrupt;
mod learning;
mod link;
mod plan;
mod recognise;
mod record;
mod scene;
mod setup;
mod snapshot;
mod study;
mod terminal;
mod train;
mod trials;
mod workshop;

use crate::app::{WindowOptions, open_window};
use clap::{CommandFactory, Parser, Subcommand};
use palpate_sim::objects::{EMPTY, anchored, catalogue};
use palpate_learn::Model;
use palpate_store::Store;
use palpate_sim::scene::Scene;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What went wrong, in a sentence for the user.
type Failure = Box<dyn std::error::Error>;

/// A workbench for soft grippers that recognise what they hold.
///
/// Without a command it opens the window, with OBJECT or the lemon on the pedestal. Everything the window does can
/// also be done here, without a display.
#[derive(Debug, Parser)]
#[command(name = "palpate", version, about, long_about)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// What to begin with: a built-in object, a URDF, OBJ or STL file, or a scene file (.toml).
    object: Option<String>,
    /// Connect the window to the real gripper: a port, a link to one, or a file of captured bytes.
    #[arg(long, value_name = "PORT")]
    port: Option<PathBuf>,
    /// The model that listens to the real gripper in the window (.safetensors); remembered.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The SQLite file that holds the trials (default: the platform's data folder).
    #[arg(long, global = true, value_name = "FILE")]
    store: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Grasp an object once, print what happened, store the trial.
    Grasp(grasp::GraspArguments),
    /// Grasp an object in a few random poses, tell the story, write pictures; needs no display.
    Demo(demo::DemoArguments),
    /// Grasp many objects in many random poses, in parallel, into the store; taken up again where it was interrupted.
    Collect(collect::CollectArguments),
    /// Fit a recogniser to stored trials and save it.
    Train(train::TrainArguments),
    /// Judge recognisers on trials they have not seen: accuracy, calibration, stage one, several grasps, cost.
    Evaluate(evaluate::EvaluateArguments),
    /// Say what stored trials are grasps of.
    Recognise(recognise::RecogniseArguments),
    /// Record what the real gripper's board sends, as a trial in the store.
    Record(record::RecordArguments),
    /// Draw a scene or a stored trial into a PNG file, without a window.
    Snapshot(snapshot::SnapshotArguments),
    /// Which effects a scene calls for, why, what each costs and changes.
    Scene(scene::SceneCommandArguments),
    /// How many trials of each object are wanted, how many there are, and what to take next.
    Plan(plan::PlanArguments),
    /// List, show, label, export, delete and restore recorded trials; undo and redo.
    Trials(trials::TrialsArguments),
    /// Calibrate a flex strip or force pad of the real gripper, and manage what is known of its parts.
    Calibrate(calibrate::CalibrateArguments),
    /// Fit the simulated finger to recorded grasps of the real one.
    Fit(fit::FitArguments),
    /// Find out what is wrong between the gripper's board and this computer, and what to do about it.
    Doctor(doctor::DoctorArguments),
    /// Pretend to be a gripper on a serial port, with parts nobody knows and faults on request (Unix).
    Emulate(emulate::EmulateArguments),
    /// Measure what things cost on this machine, in CPU time.
    Bench(bench::BenchArguments),
    /// Run an experiment and print what came out.
    Study(study::StudyArguments),
    /// Write the built-in objects anew.
    #[command(hide = true)]
    Workshop(workshop::WorkshopArguments),
}

/// Opens the window on an object.
fn window(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { object, port, model, store, .. } = arguments;
    let mut scene = Scene::default();
    if let Some(object) = object {
        if object.to_ascii_lowercase().ends_with(".toml") {
            scene = Scene::from_file(Path::new(object))?;
        } else {
            refuse_typing_errors(object);
            scene.object.source = anchored(object);
        }
        // A file is tried before there is a window to complain in.
        scene.load_object()?;
    }
    if let Some(path) = model {
        Model::load(path)?;
    }
    // The folder may be another one by the next time.
    let model = model.as_ref().map(std::path::absolute).transpose()?;
    let store = store.clone().unwrap_or_else(Store::default_path);
    Ok(open_window(WindowOptions { scene, store, port: port.clone(), model })?)
}

/// A word that is neither a command nor an object would open a window with nothing in it.
fn refuse_typing_errors(object: &str) {
    let known = object == EMPTY || catalogue().iter().any(|b| b.name == object) || Path::new(object).exists();
    if !known && Path::new(object).extension().is_none() {
        let commands = Arguments::command();
        let names: Vec<&str> = commands.get_subcommands().filter(|c| !c.is_hide_set()).map(|c| c.get_name()).collect();
        let text = format!("'{object}' is neither a command ({}) nor an object", names.join(", "));
        Arguments::command().error(clap::error::ErrorKind::InvalidSubcommand, text).exit();
    }
}

/// Runs the program as its arguments ask.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    if (arguments.port.is_some() || arguments.model.is_some()) && arguments.command.is_some() {
        let text = "--port and --model belong to the window, or after the command";
        Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, text).exit();
    }
    if let (Some(object), Some(_)) = (&arguments.object, &arguments.command) {
        let text =
            format!("'{object}' stands before a command; name the object after it, as in palpate grasp {object}");
        Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, text).exit();
    }
    terminal::show_log();
    terminal::put_faults_into_words();
    // A fault has been told by the time it arrives here.
    let outcome = std::panic::catch_unwind(|| obey(&arguments)).unwrap_or(Ok(ExitCode::FAILURE));
    match outcome {
        Ok(code) => code,
        // Whoever reads our output has heard enough: `palpate trials list | head`.
        Err(failure) if terminal::is_closed_pipe(failure.as_ref()) => ExitCode::SUCCESS,
        Err(failure) => {
            terminal::complain(&failure.to_string());
            ExitCode::FAILURE
        }
    }
}

fn obey(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let store = arguments.store.as_deref();
    match &arguments.command {
        Some(Command::Grasp(grasp)) => grasp::run(grasp, store)?,
        Some(Command::Demo(demo)) => demo::run(demo, store)?,
        Some(Command::Collect(collect)) => collect::run(collect, store)?,
        Some(Command::Train(train)) => train::run(train, store)?,
        Some(Command::Evaluate(evaluate)) => evaluate::run(evaluate, store)?,
        Some(Command::Recognise(recognise)) => recognise::run(recognise, store)?,
        Some(Command::Record(record)) => record::run(record, store)?,
        Some(Command::Snapshot(snapshot)) => snapshot::run(snapshot, store)?,
        Some(Command::Scene(scene)) => scene::run(scene)?,
        Some(Command::Plan(plan)) => plan::run(plan, store)?,
        Some(Command::Trials(trials)) => trials::run(trials, store)?,
        Some(Command::Calibrate(calibrate)) => calibrate::run(calibrate, store)?,
        Some(Command::Fit(fit)) => fit::run(fit, store)?,
        Some(Command::Doctor(doctor)) => return doctor::run(doctor),
        Some(Command::Emulate(emulate)) => emulate::run(emulate)?,
        Some(Command::Bench(bench)) => bench::run(bench)?,
        Some(Command::Study(study)) => study::run(study)?,
        Some(Command::Workshop(workshop)) => workshop::run(workshop, store)?,
        None => window(arguments)?,
    }
    Ok(ExitCode::SUCCESS)
}
