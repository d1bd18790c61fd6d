//! The command line: every headless command, and the door to the window. Exit codes: 0 done, 1 failed, 2 wrong use.

mod bench;
mod grasp;
mod setup;
mod snapshot;
mod terminal;
mod trials;
mod workshop;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// What went wrong, in a sentence for the user.
type Failure = Box<dyn std::error::Error>;

/// A workbench for soft grippers that recognise what they hold.
///
/// Without a command it opens the window, with OBJECT or the lemon on the pedestal. Everything the window does can
/// also be done here, without a display.
#[derive(Debug, Parser)]
#[command(name = "palpate", version, about, long_about, args_conflicts_with_subcommands = true)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// The object to begin with: a built-in name, or a URDF, OBJ or STL file.
    object: Option<String>,
    /// The SQLite file that holds the trials (default: the platform's data folder).
    #[arg(long, global = true, value_name = "FILE")]
    store: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Grasp an object once, print what happened, store the trial.
    Grasp(grasp::GraspArguments),
    /// Draw a scene or a stored trial into a PNG file, without a window.
    Snapshot(snapshot::SnapshotArguments),
    /// List, show, export, delete and restore recorded trials.
    Trials(trials::TrialsArguments),
    /// Measure what things cost on this machine, in CPU time.
    Bench(bench::BenchArguments),
    /// Write the built-in objects anew.
    #[command(hide = true)]
    Workshop(workshop::WorkshopArguments),
}

/// Runs the program as its arguments ask.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let store = arguments.store.as_deref();
    let outcome = match arguments.command {
        Some(Command::Grasp(grasp)) => grasp::run(&grasp, store),
        Some(Command::Snapshot(snapshot)) => snapshot::run(&snapshot, store),
        Some(Command::Trials(trials)) => trials::run(&trials, store),
        Some(Command::Bench(bench)) => bench::run(&bench),
        Some(Command::Workshop(workshop)) => workshop::run(&workshop),
        None => Err("the window is not built yet".into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads our output has heard enough: `palpate trials list | head`.
        Err(failure) if terminal::is_closed_pipe(failure.as_ref()) => ExitCode::SUCCESS,
        Err(failure) => {
            terminal::complain(&failure.to_string());
            ExitCode::FAILURE
        }
    }
}
