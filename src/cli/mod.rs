//! The command line: parses arguments, opens the window or runs a command. Exit codes: 0 done, 1 failed, 2 wrong use.

mod adapt;
mod bench;
mod calibrate;
mod check;
mod collect;
mod demo;
mod doctor;
mod emulate;
mod evaluate;
mod fit;
mod gap;
mod grasp;
mod help;
mod interrupt;
mod learning;
mod link;
#[cfg(test)]
mod manual_tests;
mod movie;
mod origin;
mod output;
mod plan;
mod plot;
mod prelude;
mod promise;
mod recognise;
mod record;
mod replay;
mod scene;
mod serve;
mod setup;
mod snapshot;
mod study;
mod teach;
mod terminal;
mod train;
mod trials;
mod version;

use crate::app::{OnStop, WindowOptions, open_window};
use crate::manual::TOPICS;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use palpate_learn::Model;
use palpate_sim::objects::{EMPTY, RandomShape, anchored, catalogue, class_of};
use palpate_sim::scene::Scene;
use palpate_tactile::board::SensorList;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// An error with a message for the user.
type Failure = Box<dyn std::error::Error>;

/// A workbench for soft grippers that recognise what they hold.
///
/// Without a command it opens the window, with OBJECT or the lemon on the pedestal. Commands need no display.
#[derive(Debug, Parser)]
#[command(
    name = "palpate",
    version,
    long_version = version::LONG.as_str(),
    about,
    long_about,
    disable_help_subcommand = true,
    after_help = after_help()
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// Object or scene to open: a built-in name, a URDF, OBJ or STL file, or a scene file (.toml).
    object: Option<String>,
    /// Port of the real gripper to connect the window to, or a file of captured bytes.
    #[arg(long, value_name = "PORT")]
    port: Option<PathBuf>,
    /// Recognition model for the real gripper in the window (.safetensors); remembered.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Let other programs control the real gripper beside the window, over this TCP port (default: 4747; `palpate help control`).
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "4747")]
    serve: Option<u16>,
    /// File of the token for them; made where there is none (default: a new token, printed at the start).
    #[arg(long, value_name = "FILE", requires = "serve")]
    token: Option<PathBuf>,
    /// Store of trials, an SQLite file (default: in the platform's data folder).
    #[arg(long, global = true, value_name = "FILE")]
    store: Option<PathBuf>,
    /// Sensors of the real gripper, a TOML file; the store remembers them (default: as remembered, else two strips and two
    /// pads).
    #[arg(long, global = true, value_name = "FILE.toml")]
    gripper: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Grasp an object once, print a summary, store the trial.
    Grasp(grasp::GraspArguments),
    /// Grasp an object in random poses until it is recognised, with a picture of each grasp.
    Demo(demo::DemoArguments),
    /// Collect a simulated data set in parallel; resumes where it stopped.
    Collect(collect::CollectArguments),
    /// Train a recogniser on stored trials and save it.
    Train(train::TrainArguments),
    /// Calibrate a model, so that its answers are wrong no more often than promised.
    Promise(promise::PromiseArguments),
    /// Teach a model new objects in seconds, from their files or from recorded grasps.
    Teach(teach::TeachArguments),
    /// Evaluate recognisers on held-back trials: F1, calibration, successive grasps, cost.
    Evaluate(evaluate::EvaluateArguments),
    /// Recognise the objects of stored trials.
    Recognise(recognise::RecogniseArguments),
    /// Record a trial of the real gripper.
    Record(record::RecordArguments),
    /// Replay a stored trial or captured bytes as the live gripper: rows and recognition.
    Replay(replay::ReplayArguments),
    /// Draw a scene, a stored trial or the whole window to a PNG file, or compare it with a golden one.
    Snapshot(snapshot::SnapshotArguments),
    /// Compare the signals and verdicts of a grasp with golden ones, within the stated accuracy.
    Check(check::CheckArguments),
    /// Draw curves or heat maps of stored trials to an SVG or PNG file.
    Plot(plot::PlotArguments),
    /// Write a stored trial as a movie (animated PNG, GIF, MP4, pictures) or an animated 3-D model (.glb).
    Movie(movie::MovieArguments),
    /// Explain which effects a scene calls for, and what each costs and changes.
    Scene(scene::SceneCommandArguments),
    /// Show or change the labelling plan: trials wanted and done, and the next one.
    Plan(plan::PlanArguments),
    /// List, show, label, export, import, merge, delete and restore trials; undo and redo.
    Trials(trials::TrialsArguments),
    /// Adapt to a real gripper without labels, by one close of its empty hand.
    Adapt(adapt::AdaptArguments),
    /// Calibrate the strips and pads of the real gripper, and manage calibrations.
    Calibrate(calibrate::CalibrateArguments),
    /// Fit the simulated finger to recorded grasps of the real one.
    Fit(fit::FitArguments),
    /// Measure how far simulation and recordings are apart, per channel, and which constant would close most of it.
    Gap(gap::GapArguments),
    /// Diagnose the connection to the real gripper: what is wrong, why, and what to do.
    Doctor(doctor::DoctorArguments),
    /// Let other programs control the gripper: JSON lines over TCP on this computer, or over standard input and output.
    Serve(serve::ServeArguments),
    /// Emulate the gripper on a serial port, with random sensors and optional faults (Unix).
    Emulate(emulate::EmulateArguments),
    /// Measure CPU time on this machine.
    Bench(bench::BenchArguments),
    /// Run an experiment and print its results.
    Study(study::StudyArguments),
    /// List topics and commands, or print one.
    Help(help::HelpArguments),
}

/// Topics of the manual, and the exit codes.
fn after_help() -> String {
    let topics: Vec<&str> = TOPICS.iter().map(|topic| topic.name).collect();
    format!(
        "Topics of `palpate help`: {}\n\nExit codes: 0 done, 1 failed, 2 wrong use\n\nExamples:\n  palpate lemon\n  \
         palpate help start\n  palpate grasp lemon\n  palpate grasp --help",
        topics.join(", ")
    )
}

/// Opens the window on an object.
fn window(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { object, port, model, store, serve, token, .. } = arguments;
    let mut scene = Scene::default();
    if let Some(object) = object {
        if object.to_ascii_lowercase().ends_with(".toml") {
            scene = Scene::from_file(Path::new(object))?;
        } else {
            refuse_unknown_word(object);
            (scene.object.source, scene.object.name) = (anchored(object), None);
        }
        // Errors in the file belong to the terminal, before a window opens.
        setup::load_object(&scene)?;
    }
    if let Some(path) = model {
        Model::load(path)?;
    }
    // The path is remembered; the working folder may differ next time.
    let model = model.as_ref().map(std::path::absolute).transpose()?;
    let store = setup::store_path(store.as_deref())?;
    let serve = serve.map(|listen| serve::beside_window(listen, token.as_deref(), &store)).transpose()?;
    // What was learned and set is stored as if the window had been closed.
    let on_stop: OnStop = Box::new(|close| _ = interrupt::on_request(close));
    Ok(open_window(WindowOptions { scene, store, port: port.clone(), model, serve, on_stop })?)
}

/// Refuses a misspelt command or object, with the nearest of those there are.
fn refuse_unknown_word(object: &str) {
    let is_random = RandomShape::seed_of(object).is_some();
    let known = object == EMPTY
        || is_random
        || class_of(object) != object
        || catalogue().iter().any(|b| b.name == object)
        || Path::new(object).exists();
    if !known && Path::new(object).extension().is_none() {
        let program = Arguments::command();
        let commands = program.get_subcommands().filter(|c| !c.is_hide_set()).map(clap::Command::get_name);
        let objects = catalogue().iter().map(|built_in| built_in.name.as_str()).chain([EMPTY]);
        help::refuse("palpate", "OBJECT|COMMAND", object, commands.chain(objects));
    }
}

/// First argument of the command line that is neither an option nor the value of one.
fn first_word() -> Option<String> {
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--store" | "--port" | "--model" | "--gripper" | "--token" => drop(words.next()),
            option if option.starts_with('-') => {}
            _ => return Some(word),
        }
    }
    None
}

/// Runs the program with the arguments of the command line.
pub fn run() -> ExitCode {
    let arguments = Arguments::try_parse().unwrap_or_else(|error| {
        // A misspelt command is taken for an object, and what follows it for the mistake.
        if matches!(error.kind(), ErrorKind::InvalidSubcommand | ErrorKind::UnknownArgument)
            && let Some(word) = first_word()
        {
            let is_command = |command: &clap::Command| command.get_name() == word;
            if !Arguments::command().get_subcommands().any(is_command) {
                refuse_unknown_word(&word);
            }
        }
        error.exit()
    });
    let of_window = arguments.port.is_some() || arguments.model.is_some() || arguments.serve.is_some();
    if of_window && arguments.command.is_some() {
        let text = "--port, --model and --serve before a command apply to the window only; put them after the command";
        Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, text).exit();
    }
    if let (Some(object), Some(_)) = (&arguments.object, &arguments.command) {
        let text = format!("'{object}' is before the command; name the object after it, as in palpate grasp {object}");
        Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, text).exit();
    }
    terminal::show_log();
    terminal::report_panics();
    // The hook has reported a panic by now.
    let outcome = std::panic::catch_unwind(|| dispatch(&arguments)).unwrap_or(Ok(ExitCode::FAILURE));
    match outcome {
        Ok(code) => code,
        // The reader of our output has gone: `palpate trials list | head`.
        Err(failure) if terminal::is_closed_pipe(failure.as_ref()) => ExitCode::SUCCESS,
        Err(failure) => {
            terminal::error(&failure.to_string());
            ExitCode::FAILURE
        }
    }
}

fn dispatch(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let own = match &arguments.command {
        Some(Command::Serve(serve)) => serve.own_store(),
        _ => None,
    };
    let store = arguments.store.as_deref().or(own.as_deref());
    // The emulator and the doctor take the file as it is; all others work with a store.
    let direct = matches!(arguments.command, Some(Command::Doctor(_) | Command::Emulate(_)));
    let named = arguments.gripper.as_deref().map(SensorList::from_file).transpose()?;
    if let Some(sensors) = named.filter(|_| !direct) {
        setup::open_store(store)?.calibrations().set_sensors(sensors)?;
    }
    let sensors = || named.map_or_else(|| setup::sensors(store), Ok);
    match &arguments.command {
        Some(Command::Grasp(grasp)) => grasp::run(grasp, store)?,
        Some(Command::Demo(demo)) => demo::run(demo, store)?,
        Some(Command::Collect(collect)) => collect::run(collect, store)?,
        Some(Command::Train(train)) => train::run(train, store)?,
        Some(Command::Promise(promise)) => promise::run(promise)?,
        Some(Command::Teach(teach)) => teach::run(teach, store)?,
        Some(Command::Evaluate(evaluate)) => evaluate::run(evaluate, store)?,
        Some(Command::Recognise(recognise)) => recognise::run(recognise, store)?,
        Some(Command::Record(record)) => record::run(record, store)?,
        Some(Command::Replay(replay)) => replay::run(replay, store)?,
        Some(Command::Snapshot(snapshot)) => return snapshot::run(snapshot, store),
        Some(Command::Check(check)) => return check::run(check),
        Some(Command::Plot(plot)) => plot::run(plot, store)?,
        Some(Command::Movie(movie)) => movie::run(movie, store)?,
        Some(Command::Scene(scene)) => scene::run(scene)?,
        Some(Command::Plan(plan)) => plan::run(plan, store)?,
        Some(Command::Trials(trials)) => trials::run(trials, store)?,
        Some(Command::Adapt(adapt)) => adapt::run(adapt, store)?,
        Some(Command::Calibrate(calibrate)) => calibrate::run(calibrate, store)?,
        Some(Command::Fit(fit)) => fit::run(fit, store)?,
        Some(Command::Gap(gap)) => gap::run(gap, store)?,
        Some(Command::Doctor(doctor)) => return doctor::run(doctor, sensors()?),
        Some(Command::Serve(serve)) => serve::run(serve, store)?,
        Some(Command::Emulate(emulate)) => emulate::run(emulate, sensors()?)?,
        Some(Command::Bench(bench)) => bench::run(bench)?,
        Some(Command::Study(study)) => study::run(study, store)?,
        Some(Command::Help(help)) => help::run(help)?,
        None => window(arguments)?,
    }
    Ok(ExitCode::SUCCESS)
}
