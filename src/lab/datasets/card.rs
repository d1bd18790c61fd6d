//! Card of a data set: where its trials come from, and what was mixed without being asked for.

use super::origin::TrialOrigin;
use super::query::{DatasetQuery, SensorView};
use super::sampling::Cut;
use palpate_learn::DataCard;
use palpate_store::TrialRow;
use palpate_tactile::trial::TrialSource;
use std::collections::{BTreeMap, BTreeSet};

/// Card of a data set.
pub(super) fn card(
    query: &DatasetQuery,
    asked: &str,
    rows: &[&TrialRow],
    origins: &[TrialOrigin],
    view: &SensorView,
    left_out_for: BTreeMap<String, usize>,
) -> DataCard {
    let collections: Vec<Option<&String>> = rows.iter().map(|row| query.collection_of(row)).collect();
    let simulated: Vec<(Option<&'static str>, bool)> = origins.iter().filter_map(|origin| origin.simulated).collect();
    let sources: BTreeSet<&str> = rows.iter().map(|row| row.source.name()).collect();
    let presets: BTreeSet<Option<&str>> = simulated.iter().map(|(preset, _)| *preset).collect();
    let fixed: BTreeSet<bool> = simulated.iter().map(|(_, fixed)| *fixed).collect();
    let of_simulation = rows.iter().filter(|row| row.source == TrialSource::Simulated);
    let physics: BTreeSet<Option<u32>> = of_simulation.map(|row| row.physics).collect();
    let calibrations: BTreeSet<&[i64]> =
        origins.iter().map(|origin| &*origin.calibrations).filter(|ids| !ids.is_empty()).collect();
    let fingers: BTreeSet<&Option<String>> =
        origins.iter().filter(|origin| origin.simulated.is_some()).map(|origin| &origin.fingers).collect();
    let distinct: BTreeSet<Option<&String>> = collections.into_iter().collect();

    let mut mixed = Vec::new();
    let mut note = |which: Vec<String>, named: bool, what: &str, option: &str| {
        if which.len() > 1 && !named {
            mixed.push(format!("{} {what} ({}); {option} selects one", which.len(), which.join(", ")));
        }
    };
    let owned = |name: &Option<&String>| name.map_or_else(|| "none".to_owned(), Clone::clone);
    let named = |preset: &Option<&str>| preset.unwrap_or("others").to_owned();
    let version = |physics: &Option<u32>| physics.map_or_else(|| "unknown".to_owned(), |version| version.to_string());
    let ids = |ids: &&[i64]| ids.iter().map(i64::to_string).collect::<Vec<_>>().join("+");
    let support = |fixed: &bool| if *fixed { "fixed" } else { "free" }.to_owned();
    note(distinct.iter().map(owned).collect(), query.collection.is_some(), "collections", "--collection");
    note(sources.iter().map(|name| (*name).to_owned()).collect(), query.source.is_some(), "sources", "--source");
    note(presets.iter().map(named).collect(), query.preset.is_some(), "pose presets", "--preset");
    note(fixed.iter().map(support).collect(), false, "kinds of support", "--collection");
    note(physics.iter().map(version).collect(), query.physics.is_some(), "versions of the physics", "--physics");
    let recorded = rows.iter().filter(|row| row.source == TrialSource::Recorded);
    let kinds: BTreeSet<&str> = recorded.map(|row| if row.emulated { "emulated" } else { "real" }).collect();
    note(kinds.iter().map(|kind| (*kind).to_owned()).collect(), false, "kinds of gripper", "--store");
    let calibrated = calibrations.iter().map(ids).collect();
    note(calibrated, !query.calibrations.is_empty(), "sets of calibrations", "--calibration");

    let object = match (fixed.len(), fixed.contains(&true)) {
        (0, _) => "recorded",
        (1, true) => "fixed",
        (1, false) => "free",
        _ => "free and fixed",
    };
    let built = if origins.iter().any(|origin| origin.built) { ", any build of the gripper" } else { "" };
    let only =
        |set: &BTreeSet<Option<&str>>| set.first().copied().flatten().filter(|_| set.len() == 1).map(str::to_owned);
    let seen = !simulated.is_empty();
    DataCard {
        collections: distinct.into_iter().flatten().cloned().collect(),
        preset: only(&presets),
        object: format!("{object}{built}"),
        grasps: rows.len(),
        layout: seen
            .then(|| if view.gripper.is_some() { view.layout.clone() } else { view.layout.to_ascii_uppercase() }),
        gripper: view.gripper.and_then(|sensors| serde_json::to_string(&sensors).ok()),
        sensors: seen.then(|| view.sensors.name().to_owned()),
        draws: (seen && view.readers() > 1).then(|| view.readers()),
        signals: seen.then(|| view.signals.name().to_owned()),
        rate_hz: view.rate_hz,
        cut: (view.cut != Cut::default()).then(|| view.cut.to_string()),
        left_out: left_out_for.values().sum(),
        left_out_for,
        query: asked.to_owned(),
        emulated: kinds.contains("emulated"),
        fingers: if fingers.iter().any(|own| own.is_some()) {
            fingers.into_iter().cloned().collect()
        } else {
            Vec::new()
        },
        mixed,
        physics: physics.first().copied().flatten().filter(|_| physics.len() == 1),
        calibrations: calibrations.into_iter().flatten().copied().collect::<BTreeSet<i64>>().into_iter().collect(),
    }
}
