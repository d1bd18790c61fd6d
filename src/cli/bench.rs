//! `palpate bench`: what things cost on this machine.

use super::Failure;
use super::terminal::{say, say_json, table};
use palpate_core::scene::Accuracy;
use palpate_core::study::{CostRow, bench_scenes, physics_cost};

/// Arguments of `palpate bench`.
#[derive(Debug, clap::Args)]
pub(super) struct BenchArguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// CPU time of one 4 s grasp for several scenes, on one thread.
    Physics {
        /// Runs per scene; the median counts.
        #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u16).range(1..=1000))]
        runs: u16,
        /// Include the reference accuracy, which takes 32 times as long.
        #[arg(long)]
        reference: bool,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(arguments: &BenchArguments) -> Result<(), Failure> {
    let What::Physics { runs, reference, json } = &arguments.what;
    let mut rows: Vec<CostRow> = Vec::new();
    for scene in &bench_scenes()? {
        for accuracy in Accuracy::ALL {
            if accuracy != Accuracy::Reference || *reference {
                rows.push(physics_cost(scene, accuracy, usize::from(*runs)));
            }
        }
    }
    if *json {
        return say_json(&rows);
    }
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                row.scene.to_owned(),
                row.accuracy.to_owned(),
                format!("{:.3}", row.step_s * 1e3),
                format!("{:.2}", row.cpu_ms_median),
                format!("{:.2}", row.us_per_step),
                format!("{:.2}", row.newton_mean),
                row.newton_max.to_string(),
                row.unconverged_steps.to_string(),
                format!("{:.0}", row.times_real_time),
            ]
        })
        .collect();
    let header = ["scene", "accuracy", "step ms", "CPU ms", "us/step", "Newton", "most", "missed", "x real time"];
    table(&header, &cells)?;
    say(format!("one 4 s grasp each; median of {runs} runs, CPU time of one thread"))
}
