//! Cards of data sets, as hubs expect them: YAML, then text. All of it comes from what is stored of the trials.

use crate::content::{TrialContent, channels_of};
use palpate_store::labels::{LabelledTrial, shown_name};
use palpate_tactile::trial::TrialSource;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Card of a LeRobot data set that `info.json` describes.
pub(crate) fn data_set_card(trials: &[TrialContent], info: &Value) -> String {
    let frames = info["total_frames"].as_u64().unwrap_or(0);
    let configs = "- config_name: default\n  data_files: data/*/*.parquet";
    let content = format!("{} grasps, {frames} frames at {} Hz", trials.len(), info["fps"]);
    let mut text = opening("\n- LeRobot", (configs, frames), "Grasps of a two-finger soft gripper", &content);
    text += "| task | episodes |\n|---|---|\n";
    let mut line = |line: &str| {
        // Writing to a text cannot fail.
        let _written = writeln!(text, "{line}");
    };
    let tasks = counts(trials.iter().map(|trial| shown_name(&trial.open.header.object).to_owned()));
    tasks.iter().for_each(|(task, count)| line(&format!("| {task} | {count} |")));
    line("\n## How they were measured\n");
    for (origin, count) in counts(trials.iter().map(origin_of)) {
        line(&format!("- {count}: {origin}"));
    }
    line("\n## Features\n\n| feature | shape | content |\n|---|---|---|");
    let units: BTreeMap<&str, &str> = channels_of(trials).into_iter().collect();
    for (name, feature) in info["features"].as_object().into_iter().flatten() {
        let channels: Vec<String> = feature["names"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_str)
            .map(|name| match units.get(name).filter(|unit| !unit.is_empty()) {
                Some(unit) => format!("`{name}` ({unit})"),
                None => format!("`{name}`"),
            })
            .collect();
        let content = match name.as_str() {
            "action" => "line pressure, as commanded (bar)".to_owned(),
            "observation.taxel_normal" => "force into each taxel (N): finger, row, column in line".to_owned(),
            "observation.taxel_shear" => {
                "shear on each taxel (N): finger, row, column, along and across in line".to_owned()
            }
            "timestamp" => "time from the beginning of the episode (s)".to_owned(),
            index if index.ends_with("index") => "number, from 0".to_owned(),
            _ => channels.join(", "),
        };
        line(&format!("| `{name}` | {} | {content} |", feature["shape"]));
    }
    line("\n## Limits\n");
    limits(trials).iter().for_each(|limit| line(&format!("- {limit}")));
    text
}

/// Card of a folder of labelled trials of the real gripper, with the names of its channels and the trials whose channels
/// could not be derived.
pub(crate) fn labelled_card(rows: &[&LabelledTrial], channels: &[String], left_out: usize) -> String {
    let samples = rows.iter().map(|row| row.samples).sum();
    let trials = rows.len();
    let configs = "- config_name: signals\n  data_files: signals.csv\n- config_name: trials\n  data_files: trials.csv";
    let content = format!("{trials} grasps, {samples} readings");
    let emulated = rows.iter().filter(|row| row.emulated).count();
    let title = match emulated {
        0 => "Labelled grasps of a soft gripper",
        all if all == trials => "Labelled grasps of an emulated soft gripper",
        _ => "Labelled grasps of a soft gripper, real and emulated",
    };
    let mut text = opening("", (configs, samples), title, &content);
    text += "| label | grasps |\n|---|---|\n";
    let mut line = |line: &str| {
        // Writing to a text cannot fail.
        let _written = writeln!(text, "{line}");
    };
    let labels = counts(rows.iter().map(|row| shown_name(row.object.as_deref().unwrap_or_default()).to_owned()));
    labels.iter().for_each(|(label, count)| line(&format!("| {label} | {count} |")));
    line("\n## How they were measured\n");
    for (gripper, is_emulated) in
        [("real gripper", false), ("emulated gripper: simulated readings, no real ones", true)]
    {
        let of_it = rows.iter().filter(|row| row.emulated == is_emulated);
        let days = counts(of_it.map(|row| row.created.chars().take(10).collect()));
        let days: Vec<String> = days.iter().map(|(day, count)| format!("{day} ({count})")).collect();
        if !days.is_empty() {
            line(&format!("- {gripper}, on {} (UTC)", days.join(", ")));
        }
    }
    line(&format!("- channels: {}", channels.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")));
    line("- `raw/` has the counts of each reading, and the bytes as the board sent them\n\n## Limits\n");
    let count = |is: fn(&LabelledTrial) -> bool| rows.iter().filter(|row| is(row)).count();
    let found = [
        (left_out, "have counts only: their channels could not be derived"),
        (count(|row| !row.flags.is_empty()), "are flagged as faulty"),
        (count(|row| row.unsure), "have a label that is marked as unsure"),
    ];
    found
        .iter()
        .filter(|(count, _)| *count > 0)
        .for_each(|(count, what)| line(&format!("- {count} of {trials} grasps {what}.")));
    line("- Grasps of one day share a tare and a mounting: test on other days than you train on.");
    text
}

/// YAML with further tags, the files of each configuration and the number of rows; then title and content, up to the table of
/// objects.
fn opening(tags: &str, (configs, rows): (&str, u64), title: &str, content: &str) -> String {
    let size = match rows {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        _ => "n>1M",
    };
    format!(
        "---\nlicense: unknown\ntask_categories:\n- robotics\ntags:{tags}\n- tactile\n- soft-gripper\nsize_categories:\n- {size}\n\
         configs:\n{configs}\n---\n\n# {title}\n\n{content}, written by Palpate {}. The licence is unknown: name one before you \
         publish them.\n\n## Objects\n\n",
        env!("CARGO_PKG_VERSION")
    )
}

/// How often each text occurs.
fn counts(texts: impl Iterator<Item = String>) -> BTreeMap<String, usize> {
    texts.fold(BTreeMap::new(), |mut counts, text| {
        *counts.entry(text).or_default() += 1;
        counts
    })
}

/// Where a trial comes from: physics, preset and sensors, or parts of a gripper.
fn origin_of(trial: &TrialContent) -> String {
    let (open, row) = (&trial.open, trial.row.as_ref());
    let parts = row.map(|row| row.sensors.as_str()).filter(|parts| !parts.is_empty()).unwrap_or("unknown");
    match open.source {
        TrialSource::Simulated => {
            let scene = &open.header.scene;
            let object = if scene.holds_object() { "fixed" } else { "free" };
            let preset = row.and_then(|row| row.preset).map_or("none".to_owned(), |preset| format!("\"{preset}\""));
            let physics = row.and_then(|row| row.physics).map_or("of an early version".to_owned(), |n| n.to_string());
            let (layout, sensors) = (&open.sensors.layout, open.sensors.sensors.name());
            format!(
                "simulated, physics {physics}, accuracy {}, {object} object, preset of poses {preset}, sensors {layout} \
                 ({sensors})",
                scene.solver.accuracy
            )
        }
        TrialSource::Recorded => format!("{}, its parts: {parts}", open.source_title()),
        TrialSource::Imported => format!("imported from another program, its channels: {parts}"),
    }
}

/// What the trials do not tell.
fn limits(trials: &[TrialContent]) -> Vec<String> {
    let count = |is: &dyn Fn(&TrialContent) -> bool| trials.iter().filter(|trial| is(trial)).count();
    let of_row = |is: fn(&palpate_store::TrialRow) -> bool| count(&|trial| trial.row.as_ref().is_some_and(is));
    let all = trials.len();
    let mut limits = vec![
        "A gap in the readings keeps the value before it; a pressure that is undefined, because nothing touches, is 0."
            .to_owned(),
        "Frames hold the last sample until their time. Statistics of quantiles are means over episodes.".to_owned(),
    ];
    if count(&|trial| trial.simulated().is_some()) > 0 {
        limits.push(
            "Forces of simulated grasps come from a model: pads are fields of springs with friction (`palpate help \
             stability` tells its measured errors)."
                .to_owned(),
        );
    }
    for (found, what) in [
        (of_row(|row| !row.sound), "did not converge, diverged or did not come to rest"),
        (of_row(|row| !row.flags.is_empty()), "are flagged as faulty"),
        (of_row(|row| row.unsure), "have a label that is marked as unsure"),
    ] {
        if found > 0 {
            limits.push(format!("{found} of {all} episodes {what}."));
        }
    }
    limits
}
