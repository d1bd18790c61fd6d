//! The command line: every headless command, and the door to the window. Exit codes: 0 done, 1 failed, 2 wrong use.

mod bench;
mod demo;
mod grasp;
mod setup;
mod snapshot;
mod terminal;
mod trials;
mod workshop;

use crate::app::{WindowOptions, open_window};
use clap::{Parser, Subcommand};
use palpate_core::recording::Store;
use palpate_core::scene::Scene;
use std::path::{Path, PathBuf};
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
    /// Grasp an object in a few random poses, tell the story, write pictures; needs no display.
    Demo(demo::DemoArguments),
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

/// Opens the window on an object.
fn window(object: Option<&str>, store: Option<&Path>) -> Result<(), Failure> {
    let mut scene = Scene::default();
    if let Some(object) = object {
        if object.to_ascii_lowercase().ends_with(".toml") {
            scene = Scene::from_file(Path::new(object))?;
        } else {
            object.clone_into(&mut scene.object.source);
        }
    }
    let store = store.map_or_else(Store::default_path, Path::to_owned);
    Ok(open_window(WindowOptions { scene, store })?)
}

/// Runs the program as its arguments ask.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let store = arguments.store.as_deref();
    let outcome = match arguments.command {
        Some(Command::Grasp(grasp)) => grasp::run(&grasp, store),
        Some(Command::Demo(demo)) => demo::run(&demo, store),
        Some(Command::Snapshot(snapshot)) => snapshot::run(&snapshot, store),
        Some(Command::Trials(trials)) => trials::run(&trials, store),
        Some(Command::Bench(bench)) => bench::run(&bench),
        Some(Command::Workshop(workshop)) => workshop::run(&workshop),
        None => window(arguments.object.as_deref(), store),
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
