//! Options that choose trials by their origin, for `trials` and for commands that learn.

use palpate_sim::scene::PRESETS;
use palpate_store::Day;
use palpate_tactile::trial::TrialSource;

/// Origin of trials: source, pose preset, collection, tag and days.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct OriginFilters {
    /// Origin: sim, serial or import.
    #[arg(long, visible_alias = "rig", value_name = "NAME")]
    pub(super) source: Option<TrialSource>,
    /// Preset of poses of simulated trials: A, M, B or C.
    #[arg(long, value_name = "A|M|B|C", value_parser = PRESETS.map(|preset| preset.name), ignore_case = true)]
    pub(super) preset: Option<String>,
    /// Collection that they belong to; for learning, the beginning of its name is enough.
    #[arg(long, value_name = "NAME")]
    pub(super) collection: Option<String>,
    /// With this tag.
    #[arg(long, value_name = "TAG")]
    pub(super) tag: Option<String>,
    /// From this day on: today, yesterday, days ago as 7d, or a date as 2026-11-21.
    #[arg(long, value_name = "DAY")]
    pub(super) since: Option<Day>,
    /// Up to and with this day.
    #[arg(long, value_name = "DAY")]
    pub(super) until: Option<Day>,
}
