//! Tables of the manual, written from the stored result.

use super::plan::SettingFamily;
use super::report::{AccuracyStudy, GroupCost, SceneGroup};
use crate::study::stored_study::{StoredStudy, markdown_table};
use palpate_geometry::units::three_digits;
use palpate_learn::method;

/// Tables of cost and error for free and fixed objects and by kind of object, and of recognition, in Markdown.
pub fn accuracy_tables(stored: &StoredStudy<AccuracyStudy>) -> String {
    let study = &stored.result;
    let mut parts = vec![format!(
        "Medians over {} shapes ({}) in {} poses each: CPU time of a grasp, error of curvature and force (RMS over the \
         grasp), and the share of grasps that fail: they report a fault, or the object ends more than 5 mm away. * marks \
         the front: nothing cheaper is as accurate. From {}.",
        study.objects.len(),
        study.objects.join(", "),
        study.poses,
        stored.origin()
    )];
    for group in [SceneGroup::Free, SceneGroup::Fixed] {
        parts.push(format!("## Cost and error, {} objects", group.title()));
        parts.push(settings_table(study, group));
    }
    parts.push("## Tolerances by kind of object".to_owned());
    parts.push(kinds_table(study));
    if !study.recognition.is_empty() {
        parts.push("## What it is worth: recognition".to_owned());
        parts.push(recognition_text(study));
        parts.push(recognition_table(study));
    }
    parts.join("\n\n")
}

fn numbers(cost: &GroupCost) -> [String; 4] {
    let failed = 100.0 * cost.failed as f64 / cost.grasps.max(1) as f64;
    [
        three_digits(cost.cpu_ms.median),
        three_digits(1e3 * cost.curvature_per_m.median),
        three_digits(1e3 * cost.force_n.median),
        if cost.failed == 0 { "0".to_owned() } else { format!("{failed:.1}") },
    ]
}

fn settings_table(study: &AccuracyStudy, group: SceneGroup) -> String {
    let front: Vec<_> = study.front(group).into_iter().map(|(setting, _)| setting).collect();
    let rows: Vec<Vec<String>> = SettingFamily::ALL
        .into_iter()
        .flat_map(|family| study.family(family, group))
        .map(|(setting, cost)| {
            let star = if front.contains(&setting) { " *" } else { "" };
            let default = if setting.is_default() { ", default" } else { "" };
            let name = format!("{}{default}{star}", setting.name);
            [vec![setting.family.title().to_owned(), name], numbers(cost).to_vec()].concat()
        })
        .collect();
    markdown_table(&["family", "setting", "CPU ms", "curvature 1/km", "force mN", "failed %"], &rows)
}

fn kinds_table(study: &AccuracyStudy) -> String {
    let groups =
        [SceneGroup::FreePrimitives, SceneGroup::FreeMeshes, SceneGroup::FixedPrimitives, SceneGroup::FixedMeshes];
    let rows: Vec<Vec<String>> = groups
        .into_iter()
        .flat_map(|group| study.family(SettingFamily::Tolerance, group).map(move |row| (group, row)))
        .map(|(group, (setting, cost))| {
            let quartiles = [cost.curvature_per_m.low, cost.curvature_per_m.high].map(|q| three_digits(1e3 * q));
            let [cpu, curvature, force, failed] = numbers(cost);
            let curvature = format!("{curvature} ({})", quartiles.join(" to "));
            vec![group.title().to_owned(), setting.name.clone(), cpu, curvature, force, failed]
        })
        .collect();
    markdown_table(&["kind", "tolerance", "CPU ms", "curvature 1/km (quartiles)", "force mN", "failed %"], &rows)
}

fn recognition_text(study: &AccuracyStudy) -> String {
    let knee = match study.knee() {
        Some(row) => format!("The knee is {} ({}).", row.setting.name, row.setting.family.title()),
        None => "No setting is as good as the reference for every method.".to_owned(),
    };
    format!(
        "Models are trained on grasps of each setting and tested on reference grasps of other poses, through \
         physical-like sensors. Macro F1 (%) after one grasp; in brackets the difference from training on \
         reference grasps, with its 95 % interval. {knee}"
    )
}

fn recognition_table(study: &AccuracyStudy) -> String {
    let keys: Vec<&str> =
        study.recognition.first().map(|row| row.scores.iter().map(|s| s.method.as_str()).collect()).unwrap_or_default();
    let mut header = vec!["family", "setting", "CPU ms", "left out"];
    header.extend(keys.iter().map(|key| method(key).map_or(*key, |method| method.title)));
    let rows: Vec<Vec<String>> = study
        .recognition
        .iter()
        .map(|row| {
            let mut cells = vec![
                row.setting.family.title().to_owned(),
                row.setting.name.clone(),
                three_digits(row.cpu_ms),
                row.left_out.to_string(),
            ];
            cells.extend(keys.iter().map(|key| {
                let percent = |share: f64| format!("{:+.1}", 100.0 * share);
                row.scores.iter().find(|score| score.method == *key).map_or(String::new(), |score| {
                    let (f1, gain) = (100.0 * score.f1.estimate, score.gain);
                    format!("{f1:.1} ({}, {} to {})", percent(gain.estimate), percent(gain.low), percent(gain.high))
                })
            }));
            cells
        })
        .collect();
    markdown_table(&header, &rows)
}
