//! `palpate bench`: CPU time on this machine.

mod frame;
mod library;

use super::Failure;
use super::terminal::{say, say_json, table};
use palpate_geometry::units::three_digits;
use palpate_lab::study::{
    CostRow, NetworkCost, StepSizes, bench_scenes, candle_step_cost, kernel_step_cost, live_step_cost, physics_cost,
    physics_truth,
};
use palpate_sim::scene::Accuracy;

/// Arguments of `palpate bench`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate bench physics
  palpate bench physics --reference --json
  palpate bench live --runs 1000
  palpate bench library --trials 10000
  palpate bench frame --size 2560x1440")]
pub(super) struct BenchArguments {
    #[command(subcommand)]
    benchmark: Benchmark,
}

#[derive(Debug, clap::Subcommand)]
enum Benchmark {
    /// Measure one 4 s grasp of several scenes at several accuracies: cost, steps, error.
    Physics {
        /// Runs per scene; the median is printed.
        #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
        /// Include the reference accuracy, which costs some five times as much as standard.
        #[arg(long)]
        reference: bool,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Measure a training step of the macro-layer, with Palpate's kernel and with candle. tests/peers/lstm_step.py times
    /// PyTorch on the same sizes.
    Training {
        /// Steps per row; the median is printed.
        #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Measure the trial library on a temporary store: opening, scrolling, search, filters, order, bulk edits.
    Library {
        /// Trials in the store.
        #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1000..=1_000_000))]
        trials: u32,
        /// Runs per row; median and 95th percentile are printed.
        #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Measure frames of the whole window without a display: CPU time outside the rasteriser while grasps run and while
    /// nothing moves, frames per second with it, and the time from the start to the first frame.
    Frame {
        /// Width and height (pixels).
        #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = parse_window)]
        size: [u32; 2],
        /// Seconds of grasps.
        #[arg(long, default_value_t = 20.0, value_parser = parse_seconds)]
        seconds: f64,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Measure a live step of the macro-layer: a sample in, probabilities out.
    Live {
        /// Sequences per row; the median is printed.
        #[arg(long, default_value_t = 101, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
}

fn parse_window(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|side| (320..=4096).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or_else(|| "write WIDTHxHEIGHT, each from 320 to 4096, as in 1280x800".to_owned())
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (1.0..=600.0).contains(seconds));
    seconds.ok_or_else(|| "write 1 to 600 seconds".to_owned())
}

/// Tolerances in the table, beside the named accuracies.
const TOLERANCES: [f64; 2] = [3e-4, 1e-5];

/// Channels of C1, and of a layout with a pressure sensor on every joint.
const FEW_AND_MANY: [usize; 2] = [4, 22];

pub(super) fn run(arguments: &BenchArguments) -> Result<(), Failure> {
    match &arguments.benchmark {
        Benchmark::Frame { size, seconds, json } => frame::run(*size, *seconds, *json),
        Benchmark::Library { trials, runs, json } => library::run(*trials, *runs, *json),
        Benchmark::Physics { runs, reference, json } => physics(*runs, *reference, *json),
        Benchmark::Training { runs, json } => {
            let mut rows = Vec::new();
            for sizes in FEW_AND_MANY.map(StepSizes::usual) {
                rows.push(kernel_step_cost(sizes, usize::from(*runs)));
                rows.push(candle_step_cost(sizes, usize::from(*runs))?);
            }
            networks(&rows, *json)?;
            if *json { Ok(()) } else { say("CPU time of one thread. PyTorch: python tests/peers/lstm_step.py") }
        }
        Benchmark::Live { runs, json } => networks(
            &FEW_AND_MANY.map(|channels| live_step_cost(StepSizes::usual(channels), usize::from(*runs))),
            *json,
        ),
    }
}

fn networks(rows: &[NetworkCost], json: bool) -> Result<(), Failure> {
    if json {
        return say_json(&rows);
    }
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let times = [row.cpu_ms_median, row.cpu_ms_least].map(|ms| format!("{ms:.4}"));
            [vec![row.what.to_owned(), row.sizes.channels.to_string()], times.to_vec()].concat()
        })
        .collect();
    table(&["kernel", "channels", "CPU ms", "minimum ms"], &cells)
}

fn physics(runs: u16, reference: bool, json: bool) -> Result<(), Failure> {
    let mut rows: Vec<CostRow> = Vec::new();
    let accuracies = Accuracy::NAMED.into_iter().filter(|accuracy| *accuracy != Accuracy::Reference || reference);
    let accuracies: Vec<Accuracy> = accuracies.chain(TOLERANCES.map(Accuracy::Tolerance)).collect();
    for scene in &bench_scenes()? {
        let truth = physics_truth(scene);
        for accuracy in &accuracies {
            rows.push(physics_cost(scene, *accuracy, usize::from(runs), Some(&truth)));
        }
    }
    if json {
        return say_json(&rows);
    }
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                row.scene.to_owned(),
                row.accuracy.clone(),
                format!("{:.3}", row.step_s * 1e3),
                format!("{:.2}", row.cpu_ms_median),
                format!("{:.2}", row.us_per_step),
                format!("{:.2}", row.newton_mean),
                row.newton_max.to_string(),
                row.unconverged_steps.to_string(),
                format!("{:.0}", row.times_real_time),
                row.error.map_or(String::new(), |error| three_digits(error.curvature_per_m * 1e3)),
                row.error.map_or(String::new(), |error| three_digits(error.force_n * 1e3)),
            ]
        })
        .collect();
    let header = [
        "scene",
        "accuracy",
        "step ms",
        "CPU ms",
        "us/step",
        "Newton",
        "max",
        "unconverged",
        "x real time",
        "error 1/km",
        "error mN",
    ];
    table(&header, &cells)?;
    say(format!("One 4 s grasp each, CPU time of one thread, median of {runs} runs."))?;
    say(
        "Newton: iterations per solve, mean and maximum. Errors: RMS of curvature and force against a tolerance of 1e-7.",
    )
}
