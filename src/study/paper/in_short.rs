//! Sections of the manual and the README on recognition in short, from the stored results of the studies.

use super::{grasps, models, recognition};
use crate::frame::{GeneratedSection, ListedStudy, ShownStudy, StudyReport, StudyTable, markdown_table};
use crate::shipped::shipped_text;
use palpate_learn::METHODS;

/// Kinds of grasps of the comparison of methods, and of the study of successive grasps.
const CLEAN: &str = "virtual, balanced";
const NOISY: &str = "physical-like, balanced";
/// Grasps after which the paper's figure shows no change.
const SUCCESSIVE: [f64; 2] = [3.0, 5.0];

/// A table of the stored report of a study with the line on its origin; none where it has not been run in full.
fn stored_table(study: &dyn ListedStudy) -> Result<Option<(StudyTable, String)>, serde_json::Error> {
    let Some(ShownStudy { stored, .. }) = study.shipped()? else { return Ok(None) };
    let table = stored.result.table(study.card().key).map(|(_, table)| table.clone());
    Ok(table.map(|table| (table, stored.origin())))
}

/// The sections.
pub(crate) fn sections_in_short() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let none = "Not measured in full with this version.".to_owned();
    let beyond = recognition::Recognition.shipped()?.map(|shown| shown.stored);
    let (methods, grasps) = (stored_table(&models::Models)?, stored_table(&grasps::Grasps)?);
    let (text, short) = match (&methods, &grasps) {
        (Some(methods), Some(grasps)) => (scores(methods, grasps), best_in_short(&methods.0, &grasps.0)),
        _ => (none.clone(), shipped_text()),
    };
    let short = [short, beyond.as_ref().map_or_else(String::new, |own| unlabelled_in_short(&own.result))].concat();
    let beyond = beyond.map_or(none, |own| own.result.markdown(&own.origin()));
    Ok(vec![
        GeneratedSection { document: "assets/help/recognition.md", name: "scores", text },
        GeneratedSection { document: "assets/help/recognition.md", name: "beyond the paper", text: beyond },
        GeneratedSection { document: "README.md", name: "recognition in short", text: short },
    ])
}

/// A sentence on grippers without labelled grasps.
fn unlabelled_in_short(report: &StudyReport) -> String {
    let Some((_, table)) = report.table(recognition::Recognition.card().key) else { return String::new() };
    let Some(row) = table.rows_with(&[("grasps", recognition::UNLABELLED)]).first().copied() else {
        return String::new();
    };
    let [one, three] = ["one grasp", "three grasps"].map(|column| shown(table, Some(&row), column));
    format!(
        " On simulated grippers whose parts and mechanics were not in the training data, and without any labelled grasp, the \
         shipped model reaches {one} % after one grasp and {three} % after three (`palpate help recognition`)."
    )
}

/// F1 after one grasp, or after several put down anew, in percent.
fn shown(table: &StudyTable, row: Option<&usize>, column: &str) -> String {
    let unit = table.columns.iter().find(|own| own.name == column).map_or("", |own| own.unit.as_str());
    row.map_or_else(|| "-".to_owned(), |row| table.cell(*row, column).shown(unit))
}

fn scores(methods: &(StudyTable, String), grasps: &(StudyTable, String)) -> String {
    let table = &methods.0;
    let row = |kind: &str, key: &str| table.rows_with(&[("grasps", kind), ("model", key)]).first().copied();
    let lines = table.texts("model").into_iter().map(|key| {
        let [clean, noisy] = [CLEAN, NOISY].map(|kind| row(kind, key));
        let of_clean = |column: &str| shown(table, clean.as_ref(), column);
        let noisy = shown(table, noisy.as_ref(), "F1");
        vec![format!("`{key}`"), of_clean("F1"), noisy, of_clean("ECE"), of_clean("training"), of_clean("whole grasp")]
    });
    let header = ["method", "virtual", "physical-like", "ECE (virtual)", "training (CPU s)", "answer (ms)"];
    let by_method = markdown_table(&header, &lines.collect::<Vec<_>>());
    let (successive, origin) = grasps;
    let lines = successive.texts("sensors").into_iter().flat_map(|sensors| {
        successive.texts("model").into_iter().map(move |key| {
            let after = |count: f64| shown(successive, after(successive, sensors, key, count).as_ref(), "F1");
            [vec![sensors.to_owned(), format!("`{key}`"), after(1.0)], SUCCESSIVE.map(after).to_vec()].concat()
        })
    });
    let header = ["sensors", "method", "one grasp", "after three", "after five"];
    let by_grasps = markdown_table(&header, &lines.collect::<Vec<_>>());
    format!(
        "{by_method}\n\n{}.\n\nGrasps of an object that is put down anew, by product of experts:\n\n{by_grasps}\n\n{origin}.",
        methods.1
    )
}

/// Row of a method after some grasps of an object that is put down anew.
fn after(table: &StudyTable, sensors: &str, key: &str, count: f64) -> Option<usize> {
    let kind = [("sensors", sensors), ("model", key), ("object", grasps::ANEW), ("combined by", grasps::PRODUCT)];
    table.rows_with(&kind).into_iter().find(|row| table.cell(*row, "grasps").value() == Some(count))
}

fn best_in_short(methods: &StudyTable, successive: &StudyTable) -> String {
    let rows = methods.rows_with(&[("grasps", CLEAN)]);
    let f1 = |row: &usize| methods.cell(*row, "F1").value().unwrap_or(0.0);
    let noisy = |row: &usize| methods.rows_with(&[("grasps", NOISY), ("model", methods.text(*row, "model"))]);
    // Several are equal within their intervals with perfect sensors alone.
    let both = |row: &usize| f1(row) + noisy(row).first().map_or(0.0, f1);
    let Some(best) = rows.iter().max_by(|a, b| both(a).total_cmp(&both(b))) else { return String::new() };
    let key = methods.text(*best, "model");
    let three = after(successive, "virtual", key, SUCCESSIVE[0]);
    let three = three.map(|row| format!(", {} % after three", shown(successive, Some(&row), "F1")));
    let noisy = noisy(best);
    format!(
        "Of {} methods, each trained on 50 simulated grasps per object (objects on random faces, one curvature and one pressure \
         per finger), `{key}` has the highest sum of F1 after one grasp over two sensor models: {} % with perfect sensors{}, \
         {} % with realistic ones. `palpate help paper` has all studies.",
        rows.len().min(METHODS.len()),
        shown(methods, Some(best), "F1"),
        three.unwrap_or_default(),
        shown(methods, noisy.first(), "F1"),
    )
}
