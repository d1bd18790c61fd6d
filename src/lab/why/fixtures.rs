//! A linear recogniser made by hand, for tests.

use palpate_learn::{
    Arrays, Class, DataCard, Dataset, Example, Labels, Model, ModelCard, Pmf, Recogniser, Sequence, Signatures,
    StopRule, Verdict,
};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Scores class 0 by a weighted sum of the channels' means over time; class 1 is the other.
struct Linear {
    weights: Vec<f64>,
    calls: Arc<AtomicUsize>,
}

impl Linear {
    fn score(&self, grasp: &Sequence) -> f64 {
        let sum = |c: usize| grasp.rows().map(|(_, row)| f64::from(row[c])).sum::<f64>() / grasp.len() as f64;
        self.weights.iter().enumerate().map(|(c, w)| w * sum(c)).sum()
    }
}

impl Recogniser for Linear {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        self.calls.fetch_add(1, Ordering::Relaxed);
        let pmf = Pmf::from_scores([self.score(grasp), 0.0]);
        Verdict { pmf: before.map_or(pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        Arrays::default()
    }

    fn parameters(&self) -> usize {
        self.weights.len()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

/// A grasp at constant levels of the channels: 4 s, hold from 2 s on.
pub(crate) fn grasp(levels: [f32; 3]) -> Sequence {
    let t_s: Vec<f32> = (0..40).map(|k| 0.1 * k as f32).collect();
    Sequence { values: t_s.iter().flat_map(|_| levels).collect(), t_s }
}

/// Two classes whose means average to 1, 2 and 3, and a linear recogniser of them.
pub(crate) fn linear(weights: [f64; 3]) -> (Arc<Model>, Arc<AtomicUsize>) {
    let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
    let labels = Labels { classes: ["lemon", "tomato"].map(class).to_vec(), ..Labels::default() };
    let channels: Vec<String> = ["curvature_left", "grip", "bend"].map(str::to_owned).to_vec();
    let examples = [(0, [0.0, 2.0, 2.0]), (1, [2.0, 2.0, 4.0])];
    let examples =
        examples.map(|(class, levels)| Example { id: 0, class, grasp: Arc::new(grasp(levels)), ..Example::default() });
    let data = Dataset {
        channels: channels.clone(),
        labels: labels.clone(),
        examples: examples.to_vec(),
        ..Dataset::default()
    };
    let card = ModelCard {
        method: "linear".to_owned(),
        channels,
        labels,
        data: DataCard::default(),
        learned: Default::default(),
        settings: serde_json::Value::Null,
        fingerprint: None,
        deviations: Vec::new(),
        stop: StopRule::default(),
        rejection: None,
        answer_sets: None,
        seed: 0,
        quick: true,
        parameters: 3,
        train_cpu_s: 0.0,
        metrics: serde_json::Value::Null,
        signature_grasps: None,
        taught: Vec::new(),
        taught_from: BTreeMap::new(),
        lessons: Vec::new(),
        version: String::new(),
    };
    let calls = Arc::new(AtomicUsize::new(0));
    let recogniser = Arc::new(Linear { weights: weights.to_vec(), calls: Arc::clone(&calls) });
    let model = Model { card, recogniser, signatures: None };
    (Arc::new(model.with_signatures(Signatures::of(&data))), calls)
}
