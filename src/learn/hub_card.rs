//! Card of a model as hubs expect it: YAML, then text, from what its own card says.

use super::model::ModelCard;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

impl ModelCard {
    /// First bytes of a card for hubs.
    pub const HUB_BEGIN: &str = "---\nlibrary_name: palpate\n";

    /// Path of the card for hubs beside a model: `mine.md` for `mine.safetensors`. A hub wants it as `README.md`.
    pub fn hub_path_beside(model: &Path) -> PathBuf {
        model.with_extension("md")
    }

    /// Card for hubs, in Markdown. The licence of what a user trains is unknown.
    pub fn hub_text(&self) -> String {
        let classes: Vec<&str> = self.labels.classes.iter().map(|class| class.name.as_str()).collect();
        let (data, metrics) = (&self.data, &self.metrics);
        let f1 = metrics["f1_macro"].as_f64();
        let mut text = format!("{}license: unknown\ntags:\n- tactile\n- soft-gripper\n- robotics\n", Self::HUB_BEGIN);
        let mut line = |line: &str| {
            // Writing to a text cannot fail.
            let _written = writeln!(text, "{line}");
        };
        if let Some(f1) = f1 {
            line("model-index:\n- name: palpate\n  results:\n  - task:\n      type: tactile-recognition");
            line("    dataset:\n      name: test grasps\n      type: palpate");
            line(&format!("    metrics:\n    - type: f1\n      name: macro F1 after one grasp\n      value: {f1:.4}"));
        }
        line(&format!("---\n\n# Which object a soft gripper holds ({})\n", self.method));
        line(&format!(
            "Written by Palpate {}: `palpate recognise --model FILE` runs it. {} parameters. The licence is unknown: name one \
             before you publish it.\n",
            self.version, self.parameters
        ));
        line(&format!("- Sensors: {}", self.channels.join(", ")));
        line(&format!("- Classes: {}", classes.join(", ")));
        line("\n## Trained on\n");
        line(&format!("- {} grasps: {}", data.grasps, data.described()));
        line(&format!("- Preset of poses: {}", data.preset.as_deref().unwrap_or("none, or several")));
        for (name, value) in [
            ("Physics", data.physics.map(|physics| physics.to_string())),
            ("Query", Some(data.query.clone()).filter(|query| !query.is_empty())),
            ("Learned later", Some(self.taught.join(", ")).filter(|taught| !taught.is_empty())),
        ] {
            value.iter().for_each(|value| line(&format!("- {name}: {value}")));
        }
        line("\n## How it was measured\n");
        match f1 {
            Some(f1) => {
                let percent = |value: &serde_json::Value| 100.0 * value.as_f64().unwrap_or(f64::NAN);
                let ends = [0, 1].map(|end| percent(&metrics["ci95"][end]));
                let test = metrics["test"].as_str().unwrap_or("test grasps");
                line(&format!(
                    "Macro F1 after one grasp {:.1} % (95 % interval {:.1} to {:.1} %), of {test}.",
                    100.0 * f1,
                    ends[0],
                    ends[1]
                ));
            }
            None => line("Not measured: `palpate evaluate --models FILE` does."),
        }
        line("\n## Limits\n");
        let told = [
            (
                self.learned_from_perfect_sensors(),
                "Learned through perfect sensors: on a real gripper most answers are wrong.",
            ),
            (self.only_simulated(), "Reads contact pressure, which only simulations have."),
            (self.rejection.is_none(), "No threshold for unknown objects: it takes them for known ones."),
            (self.quick, "Quickly fitted: a full fit is better."),
        ];
        told.iter().filter(|(is, _)| *is).for_each(|(_, limit)| line(&format!("- {limit}")));
        data.mixed.iter().chain(&self.deviations).for_each(|limit| line(&format!("- {limit}")));
        line("- It knows only the objects, poses and gripper that it was trained on.");
        text
    }
}

#[cfg(test)]
mod tests {
    use crate::{Models, Shipped};

    #[test]
    fn the_card_for_hubs_says_what_the_models_own_card_says() {
        let models = Models::shipped().expect("shipped");
        let card = &models.of(Shipped::PerfectSensors).expect("shipped").card;
        let text = card.hub_text();
        for wanted in [
            "license: unknown",
            "value: 0.9386",
            "curvature_left, curvature_right",
            "ball, bigball",
            "preset B",
            "93.9 % (95 % interval 92.8 to 94.9 %)",
            "1599 further grasps",
            "most answers are wrong",
        ] {
            assert!(text.contains(wanted), "{wanted}: {text}");
        }
        assert!(text.starts_with(super::ModelCard::HUB_BEGIN) && text.matches("---\n").count() == 2, "{text}");
    }
}
