//! The shipped model in a sentence of the manual.

/// Scores of the shipped model, as the command that trained it measured and wrote them.
pub(super) fn shipped_text() -> String {
    let Ok(model) = palpate_learn::Shipped::PerfectSensors.model() else {
        return "The shipped model cannot be read.".to_owned();
    };
    let (data, metrics) = (&model.card.data, &model.card.metrics);
    let percent = |value: &serde_json::Value| value.as_f64().map_or("-".to_owned(), |f1| format!("{:.1}", 100.0 * f1));
    format!(
        "The shipped model (`models/live.json`) learned from {} grasps: {}. Its macro F1 is {} percent ({} to {}) after one \
         grasp and {} after three, measured on {}.",
        data.grasps,
        data.described(),
        percent(&metrics["f1_macro"]),
        percent(&metrics["ci95"][0]),
        percent(&metrics["ci95"][1]),
        percent(&metrics["f1_by_grasps"][2]),
        metrics["test"].as_str().unwrap_or("nothing")
    )
}
