//! Development only: makes what the repository ships. Run it at the root of the repository.
//!
//! | command | writes |
//! |---|---|
//! | `cargo run -p palpate-workshop -- thumbnails` | the thumbnails of the built-in objects below `assets/objects` |
//! | `cargo run --release -p palpate-workshop -- model [--any-gripper] --store FILE` | a recognition model below `models`, with its card |
//! | `cargo run --release -p palpate-workshop -- encoder [--any-gripper]` | a geometry encoder below `models` |
//! | `cargo run --release -p palpate-workshop -- sound` | what sound channels foretell, below `models` |
//! | `cargo run --release -p palpate-workshop -- touches [--any-gripper] --store FILE` | the grasps in known poses that guide the next grasp, below `models` |
//! | `cargo run --release -p palpate-workshop -- attack` | nothing; it kills, floods and damages stores, and fails where one loses a trial |
//! | `cargo run -p palpate-workshop -- tables` | tables of the manual and the README and the picture of the study of accuracy, from stored results in `assets/studies` |

mod attack;
mod encoder;
mod live_model;
mod thumbnails;

use clap::{Parser, Subcommand};
use palpate_geometry::palette::Theme;
use palpate_learn::Shipped;
use palpate_render::figure_svg;
use palpate_store::Store;
use palpate_study::accuracy::stored_accuracy;
use palpate_study::{generated_sections, sound_channels};
use std::path::{Path, PathBuf};

/// Any failure, as a sentence.
type Failure = Box<dyn std::error::Error>;

/// Makes what the repository ships.
#[derive(Debug, Parser)]
#[command(name = "palpate-workshop")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Draw the thumbnails of the built-in objects.
    Thumbnails {
        /// Output folder.
        #[arg(long, default_value = "assets/objects")]
        out: PathBuf,
    },
    /// Collect grasps and train a shipped recognition model.
    Model(ForModel),
    /// Collect the grasps in known poses that guide the next grasp.
    Touches(ForModel),
    /// Grasp random shapes, and train a shipped geometry encoder on them.
    Encoder {
        /// The one for real sensors on any gripper, instead of the one for perfect sensors.
        #[arg(long)]
        any_gripper: bool,
        /// Output folder.
        #[arg(long, default_value = "models")]
        out: PathBuf,
        /// Number of shapes.
        #[arg(long, default_value_t = 1000)]
        shapes: u64,
        /// Poses of each shape, grasped free and fixed.
        #[arg(long, default_value_t = 3)]
        poses: u64,
    },
    /// Grasp with emulated grippers, and fit what sound channels foretell of each other.
    Sound {
        /// Output folder.
        #[arg(long, default_value = "models")]
        out: PathBuf,
        /// Number of grippers.
        #[arg(long, default_value_t = 30)]
        grippers: u64,
    },
    /// Kill programs, flip bits and fill disks, and see that the store loses nothing.
    Attack {
        /// The program.
        #[arg(long, default_value = "target/release/palpate")]
        program: PathBuf,
        /// Times that each attack is made.
        #[arg(long, default_value_t = 30)]
        rounds: u32,
        /// Folder on a small disk that may become full, such as a tmpfs of 8 MiB.
        #[arg(long)]
        full: Option<PathBuf>,
    },
    /// Write the tables of the manual and the README, and the picture of the study of accuracy, from stored results.
    Tables,
}

/// Shipped model that is made, or that files are made for: the one for perfect sensors and free objects, or another.
#[derive(Debug, clap::Args)]
struct ForModel {
    /// The one for any gripper.
    #[arg(long)]
    any_gripper: bool,
    /// The one for fixed objects.
    #[arg(long, conflicts_with = "any_gripper")]
    fixed: bool,
    /// Output folder.
    #[arg(long, default_value = "models")]
    out: PathBuf,
    /// Trial store that receives the grasps; a second run reuses them.
    #[arg(long)]
    store: PathBuf,
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().command {
        Command::Thumbnails { out } => {
            let count = thumbnails::draw_all(&out)?;
            report(format_args!("{count} thumbnails in {}", out.display()));
        }
        Command::Model(ForModel { any_gripper, fixed, out, store }) => {
            live_model::make(shipped(any_gripper, fixed), &out, &mut Store::open(&store)?)?;
        }
        Command::Touches(ForModel { any_gripper, fixed, out, store }) => {
            live_model::make_touches(shipped(any_gripper, fixed), &out, &mut Store::open(&store)?)?;
        }
        Command::Encoder { any_gripper, out, shapes, poses } => {
            encoder::make(shipped(any_gripper, false), &out, shapes, poses)?;
        }
        Command::Sound { out, grippers } => {
            let path = out.join("sound.safetensors");
            std::fs::write(&path, sound_channels(grippers)?.to_bytes()?)?;
            report(format_args!("saved as {}", path.display()));
        }
        Command::Attack { program, rounds, full } => attack::run(&program, rounds, full.as_deref())?,
        Command::Tables => write_tables()?,
    }
    Ok(())
}

fn shipped(any_gripper: bool, fixed: bool) -> Shipped {
    if any_gripper { Shipped::AnyGripper } else { Shipped::simulated(fixed) }
}

fn write_tables() -> Result<(), Failure> {
    for section in generated_sections()? {
        let path = Path::new(section.document);
        let without = || format!("\"{}\" has no section \"{}\"", section.document, section.name);
        let text = section.put_into(&std::fs::read_to_string(path)?).ok_or_else(without)?;
        std::fs::write(path, text)?;
        report(format_args!("{} in {}", section.name, section.document));
    }
    let picture = "assets/studies/accuracy.svg";
    if let Some(stored) = stored_accuracy() {
        let linked = stored.result.figure().with_note(&stored.plain_origin());
        std::fs::write(picture, figure_svg(&linked.figure, Theme::Light, linked.size)?)?;
        report(format_args!("{picture}"));
    }
    Ok(())
}

#[expect(clippy::print_stdout, reason = "results of a headless command")]
fn report(line: std::fmt::Arguments<'_>) {
    println!("{line}");
}
