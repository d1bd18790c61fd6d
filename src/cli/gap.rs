//! `palpate gap`: how far simulation and recordings are apart.

use super::fit::RecordedArguments;
use super::prelude::*;
use palpate_geometry::units::three_digits;
use palpate_study::{FitWatch, SimulationGap, simulation_gap};

/// Arguments of `palpate gap`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate gap 12 13
  palpate gap 12 13 14 --scene fitted.toml --json

Each recording is simulated under its own line pressure, with the finger as the scene has it and as a fit to these recordings \
makes it. Then each constant is fitted alone: the best closes most of the difference by itself.

See also: palpate help gripper")]
pub(super) struct GapArguments {
    #[command(flatten)]
    recorded: RecordedArguments,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &GapArguments, store: Option<&Path>) -> Result<(), Failure> {
    let recorded = arguments.recorded.read(store)?;
    let (stop, bar) = (stop_flag()?, Progress::of_share("simulating"));
    let watch = FitWatch { progress: &|share| bar.share(share), stop: &stop };
    let gap = simulation_gap(&recorded.observations, &recorded.trust, &watch);
    drop(bar);
    gap?.print(arguments.json)
}

impl Report for SimulationGap {
    fn text(&self, page: &mut Page) {
        let pair = |[before, after]: [f64; 2]| format!("{} -> {}", three_digits(before), three_digits(after));
        let percent =
            |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let rows = self.channels.iter().map(|own| {
            let [before, after] = own.told_apart.map(percent);
            let lag = own.lag_s.map(|lag| format!("{:+.0}", 1e3 * lag)).join(" -> ");
            [own.name.clone(), own.unit.to_owned(), pair(own.bias), pair(own.rmse), lag, format!("{before} -> {after}")]
        });
        page.line("Simulated minus recorded, with the finger as it is -> fitted:");
        page.table(&["channel", "unit", "bias", "RMSE", "late (ms)", "told apart"], rows);
        page.line("");
        let constants = self.constants.iter().map(|own| [own.name.to_owned(), format!("{:.0} %", 100.0 * own.left)]);
        page.table(&["fitted alone", "squared difference left"], constants);
    }
}
