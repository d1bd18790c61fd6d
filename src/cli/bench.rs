//! `palpate bench`: CPU time on this machine.

mod frame;
mod library;

use super::Failure;
use super::recognise::load_model;
use super::setup::within;
use super::snapshot::sides_from;
use super::terminal::{Column, Page, Report};
use palpate_geometry::units::three_digits;
use palpate_lab::datasets::{SensorView, sequence_of};
use palpate_lab::grasping::grasp;
use palpate_learn::Shipped;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_study::{
    CostRow, LiveCost, NetworkCost, StepSizes, answer_cost, bench_scenes, candle_step_cost, kernel_step_cost,
    live_step_cost, physics_cost, physics_truth,
};
use serde::Serialize;
use std::path::{Path, PathBuf};

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
    /// Print JSON instead of a table.
    #[arg(long, global = true)]
    json: bool,
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
    },
    /// Measure a training step of the macro-layer, with Palpate's kernel and with candle. tests/peers/lstm_step.py times
    /// PyTorch on the same sizes.
    Training {
        /// Steps per row; the median is printed.
        #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
    },
    /// Measure the trial library on a temporary store: opening, scrolling, search, filters, order, bulk edits.
    Library {
        /// Trials in the store.
        #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1000..=1_000_000))]
        trials: u32,
        /// Runs per row; median and 95th percentile are printed.
        #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
    },
    /// Measure frames of the whole window without a display: CPU time outside the rasteriser while grasps run and while
    /// nothing moves, frames per second with it, and the time from the start to the first frame.
    Frame {
        /// Width and height (pixels).
        #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = sides_from(320))]
        size: [u32; 2],
        /// Seconds of grasps.
        #[arg(long, default_value_t = 20.0, value_parser = within(1.0..=600.0))]
        seconds: f64,
    },
    /// Measure live answers: a step of the macro-layer, and the answers of a model during a simulated grasp.
    Live {
        /// Model; default: the shipped one.
        #[arg(long, value_name = "FILE")]
        model: Option<PathBuf>,
        /// Sequences per row; median and 95th percentile are printed.
        #[arg(long, default_value_t = 101, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
    },
}

/// Tolerances in the table, beside the named accuracies.
const TOLERANCES: [f64; 2] = [3e-4, 1e-5];

/// Channels of C1, and of a layout with a pressure sensor on every joint.
const FEW_AND_MANY: [usize; 2] = [4, 22];

/// Measurements as a table: its columns, and remarks below it. As JSON, the rows.
#[derive(Serialize)]
#[serde(transparent)]
struct Costs<R: 'static> {
    rows: Vec<R>,
    #[serde(skip)]
    columns: &'static [Column<R>],
    #[serde(skip)]
    remarks: Vec<String>,
}

impl<R: Serialize> Report for Costs<R> {
    fn text(&self, page: &mut Page) {
        page.columns(self.columns, &self.rows);
        self.remarks.iter().for_each(|remark| page.line(remark));
    }
}

pub(super) fn run(arguments: &BenchArguments) -> Result<(), Failure> {
    let json = arguments.json;
    match &arguments.benchmark {
        Benchmark::Frame { size, seconds } => frame::measure(*size, *seconds)?.print(json),
        Benchmark::Library { trials, runs } => library::measure(*trials, usize::from(*runs))?.print(json),
        Benchmark::Physics { runs, reference } => physics(*runs, *reference)?.print(json),
        Benchmark::Training { runs } => {
            let mut rows = Vec::new();
            for sizes in FEW_AND_MANY.map(StepSizes::usual) {
                rows.push(kernel_step_cost(sizes, usize::from(*runs)));
                rows.push(candle_step_cost(sizes, usize::from(*runs))?);
            }
            let remark = "CPU time of one thread. PyTorch: python tests/peers/lstm_step.py";
            Costs { rows, columns: NETWORK, remarks: vec![remark.to_owned()] }.print(json)
        }
        Benchmark::Live { model, runs } => live(model.as_deref(), usize::from(*runs))?.print(json),
    }
}

const NETWORK: &[Column<NetworkCost>] = &[
    ("kernel", |row| row.what.to_owned()),
    ("channels", |row| row.sizes.channels.to_string()),
    ("CPU ms", |row| format!("{:.4}", row.cpu_ms_median)),
    ("minimum ms", |row| format!("{:.4}", row.cpu_ms_least)),
];

const LIVE: &[Column<LiveCost>] = &[
    ("operation", |row| row.what.clone()),
    ("channels", |row| row.channels.to_string()),
    ("CPU ms", |row| format!("{:.4}", row.cpu_ms_median)),
    ("95 % ms", |row| format!("{:.4}", row.cpu_ms_p95)),
];

const PHYSICS: &[Column<CostRow>] = &[
    ("scene", |row| row.scene.to_owned()),
    ("accuracy", |row| row.accuracy.clone()),
    ("step ms", |row| format!("{:.3}", row.step_s * 1e3)),
    ("CPU ms", |row| format!("{:.2}", row.cpu_ms_median)),
    ("us/step", |row| format!("{:.2}", row.us_per_step)),
    ("Newton", |row| format!("{:.2}", row.newton_mean)),
    ("max", |row| row.newton_max.to_string()),
    ("unconverged", |row| row.unconverged_steps.to_string()),
    ("x real time", |row| format!("{:.0}", row.times_real_time)),
    ("error 1/m", |row| row.error.map_or(String::new(), |error| three_digits(error.curvature_per_m))),
    ("error mN", |row| row.error.map_or(String::new(), |error| three_digits(error.force_n * 1e3))),
];

fn live(path: Option<&Path>, runs: usize) -> Result<Costs<LiveCost>, Failure> {
    let model = load_model(path, Shipped::PerfectSensors)?;
    let mut scene = Scene::default();
    scene.object.source = "tomato".to_owned();
    let trial = grasp(&scene, scene.load_object()?.as_ref(), 1);
    let readings = sequence_of(&SensorView::of_model(&model.card).signals(&trial)?);
    let mut rows = FEW_AND_MANY.map(|channels| live_step_cost(StepSizes::usual(channels), runs)).to_vec();
    rows.push(answer_cost(format!("answer of {}", model.card.method), &model, &readings, runs));
    Ok(Costs { rows, columns: LIVE, remarks: vec!["CPU time of one thread; the grasp is of a tomato.".to_owned()] })
}

fn physics(runs: u16, reference: bool) -> Result<Costs<CostRow>, Failure> {
    let mut rows = Vec::new();
    let accuracies = Accuracy::NAMED.into_iter().filter(|accuracy| *accuracy != Accuracy::Reference || reference);
    let accuracies: Vec<Accuracy> = accuracies.chain(TOLERANCES.map(Accuracy::Tolerance)).collect();
    for scene in &bench_scenes()? {
        let truth = physics_truth(scene);
        rows.extend(accuracies.iter().map(|accuracy| physics_cost(scene, *accuracy, usize::from(runs), Some(&truth))));
    }
    let errors = "Newton: iterations per solve, mean and maximum. Errors: RMS of curvature and force against a tolerance \
                  of 1e-7.";
    let remarks =
        vec![format!("One 4 s grasp each, CPU time of one thread, median of {runs} runs."), errors.to_owned()];
    Ok(Costs { rows, columns: PHYSICS, remarks })
}
