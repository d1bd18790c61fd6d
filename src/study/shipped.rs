//! The shipped models in the manual.

use palpate_learn::Shipped;

/// Scores of the shipped models, as the command that trained them measured and wrote them.
pub(super) fn shipped_text() -> String {
    Shipped::ALL.map(sentence).join("\n")
}

fn sentence(kind: Shipped) -> String {
    let about = match kind {
        Shipped::PerfectSensors => "perfect sensors and free objects",
        Shipped::AnyGripper => "any gripper and free objects",
        Shipped::FixedObjects => "perfect sensors and fixed objects",
    };
    let path = format!("`models/{}`", kind.model_file().replace(".safetensors", ".json"));
    let Ok(model) = kind.model() else {
        return format!("- The model for {about} ({path}) cannot be read.");
    };
    let (data, metrics) = (&model.card.data, &model.card.metrics);
    let percent = |value: &serde_json::Value| value.as_f64().map_or("-".to_owned(), |f1| format!("{:.1}", 100.0 * f1));
    format!(
        "- The model for {about} ({path}) learned from {} grasps: {}. Its macro F1 is {} percent ({} to {}) after one grasp and \
         {} after three, measured on {}.",
        data.grasps,
        data.described(),
        percent(&metrics["f1_macro"]),
        percent(&metrics["ci95"][0]),
        percent(&metrics["ci95"][1]),
        percent(&metrics["f1_by_grasps"][2]),
        metrics["test"].as_str().unwrap_or("nothing")
    )
}
