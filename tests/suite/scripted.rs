//! A recogniser that says what its script says, whatever it is given: the window can be tested without depending on
//! what a trained model happens to answer.

use palpate_lab::datasets::labels_of_catalogue;
use palpate_learn::{
    Arrays, DataCard, Dataset, Example, Fitting, Labels, LiveRecogniser, Model, ModelCard, Models, Pmf, Properties,
    Recogniser, Sequence, Shipped, Signatures, StopRule, Verdict, method,
};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Says lemon, a little surer with time and with each grasp: 61 % after the first one, 92 % after the second.
pub(crate) fn model() -> Arc<Model> {
    let channels =
        ["curvature", "pressure", "force"].iter().flat_map(|q| ["left", "right"].map(|s| format!("{q}_{s}")));
    let card = ModelCard {
        method: "scripted".to_owned(),
        channels: channels.collect(),
        labels: labels_of_catalogue(),
        data: DataCard { layout: Some("C1+F".to_owned()), ..DataCard::default() },
        learned: Default::default(),
        settings: serde_json::Value::Null,
        fingerprint: None,
        deviations: Vec::new(),
        stop: StopRule::default(),
        rejection: None,
        answer_sets: None,
        seed: 0,
        quick: true,
        parameters: 0,
        train_cpu_s: 0.0,
        metrics: serde_json::Value::Null,
        signature_grasps: None,
        taught: Vec::new(),
        taught_from: BTreeMap::new(),
        lessons: Vec::new(),
        version: String::new(),
    };
    Arc::new(Model { card, recogniser: Arc::new(Script), signatures: None })
}

/// A model that learned made-up grasps in the channels of the shipped one, with its card: what it answers does not matter.
pub(crate) fn made_up() -> Model {
    let shipped = Shipped::PerfectSensors.model().expect("is shipped").card;
    let labels = labels_of_catalogue();
    let width = shipped.channels.len();
    let example = |k: usize| {
        let class = k % labels.classes.len();
        let values = (0..60 * width).map(|at| (class * 7 + at * k) as f32 % 11.0).collect();
        let grasp = Arc::new(Sequence { t_s: (1..=60).map(|k| 0.05 * k as f32).collect(), values });
        Example { id: k as i64, class, content: grasp.content(), grasp, ..Example::default() }
    };
    let data = Dataset {
        channels: shipped.channels.clone(),
        examples: (0..4 * labels.classes.len()).map(example).collect(),
        labels: labels.clone(),
        about: shipped.data,
    };
    let stop = AtomicBool::new(false);
    let settings = serde_json::Map::new();
    let fitting = Fitting { seed: 1, quick: true, settings, second: None, progress: &|_| (), stop: &stop };
    method("knn").expect("is one").train(&data, &fitting).expect("fits")
}

/// This model for real grippers; the same as one that learned from perfect sensors for simulated grasps.
pub(crate) fn models(model: &Arc<Model>) -> Models {
    let mut perfect = Model::clone(model);
    perfect.card.data.sensors = Some("virtual".to_owned());
    Models::all(&Arc::new(perfect)).with_real(Some(Arc::clone(model)))
}

/// Knows lemon from tomato by the force on the left pad, and has signatures: nothing before contact, then 0.5 N and 0.1 N.
pub(crate) fn weighing() -> Arc<Model> {
    let scripted = model();
    let channels = scripted.card.channels.clone();
    let force = channels.iter().position(|name| name == "force_left").expect("a channel");
    let labels = scripted.card.labels.clone();
    let grasp = |newtons: f32| {
        let t_s: Vec<f32> = (0..60).map(|k| 0.05 * k as f32).collect();
        let row = |t: &f32| {
            let mut row = vec![0.0; channels.len()];
            row[force] = if *t < CONTACT { 0.0 } else { newtons };
            row
        };
        Arc::new(Sequence { values: t_s.iter().flat_map(row).collect(), t_s })
    };
    let levels = [("lemon", 0.5), ("tomato", 0.1)].into_iter().enumerate();
    let examples = levels.filter_map(|(k, (name, newtons))| {
        Some(Example { id: k as i64, class: labels.class(name)?, grasp: grasp(newtons), ..Example::default() })
    });
    let data = Dataset {
        channels: channels.clone(),
        labels: labels.clone(),
        examples: examples.collect(),
        ..Dataset::default()
    };
    let recogniser = Arc::new(Weighing { force, labels });
    Arc::new(Model { card: scripted.card.clone(), recogniser, signatures: None }.with_signatures(Signatures::of(&data)))
}

/// Says lemon, the surer the larger the mean force on the left pad.
struct Weighing {
    force: usize,
    labels: Labels,
}

impl Recogniser for Weighing {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let mean = grasp.rows().map(|(_, row)| f64::from(row[self.force])).sum::<f64>() / grasp.len().max(1) as f64;
        let pmf = Pmf::from_scores(self.labels.classes.iter().map(|class| match class.name.as_str() {
            "lemon" => 16.0 * mean,
            "tomato" => 4.0,
            _ => -2.0,
        }));
        Verdict { pmf: before.map_or(pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        Arrays::default()
    }

    fn parameters(&self) -> usize {
        1
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

struct Script;

/// From this time on the fingers feel something (s).
const CONTACT: f32 = 0.7;
/// At this time nothing new is felt any more (s).
const SETTLED: f32 = 2.4;

fn said(t: f32, before: Option<&Pmf>) -> Verdict {
    let share = f64::from(((t - CONTACT) / (SETTLED - CONTACT)).clamp(0.0, 1.0));
    let labels = labels_of_catalogue();
    let classes = labels.classes.len();
    let end = [("lemon", 0.61), ("tomato", 0.24), ("bigball", 0.08), ("ball", 0.03), ("cube", 0.02)];
    let others = 0.02 / (classes - end.len()) as f64;
    let first = labels.classes.iter().map(|class| {
        let at_end = end.iter().find(|(name, _)| *name == class.name).map_or(others, |(_, p)| *p);
        (1.0 - share) / classes as f64 + share * at_end
    });
    let pmf = Pmf::from_weights(first);
    let pmf = before.map_or_else(|| pmf.clone(), |before| before.times(&pmf).at_temperature(0.95));
    let properties = Properties {
        size: Pmf::from_weights([1.0 - 0.93 * share, 1.0 + 0.4 * share]),
        shape: Pmf::from_weights([1.0 - 0.95 * share, 1.0 - 0.9 * share, 1.0]),
    };
    Verdict { pmf, properties: Some(properties) }
}

impl Recogniser for Script {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        said(grasp.t_s.last().copied().unwrap_or_default(), before)
    }

    fn live(&self) -> Option<Box<dyn LiveRecogniser>> {
        Some(Box::new(LiveScript { before: None, t: 0.0 }))
    }

    fn has_stage_one(&self) -> bool {
        true
    }

    fn arrays(&self) -> Arrays {
        Arrays::default()
    }

    fn parameters(&self) -> usize {
        0
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

struct LiveScript {
    before: Option<Pmf>,
    t: f32,
}

impl LiveRecogniser for LiveScript {
    fn begin(&mut self, before: Option<&Pmf>) {
        self.before = before.cloned();
    }

    fn push(&mut self, t: f32, _row: &[f32]) -> Option<Verdict> {
        self.t = t;
        Some(said(t, self.before.as_ref()))
    }

    fn finish(&mut self) -> Option<Verdict> {
        Some(said(self.t, self.before.as_ref()))
    }
}
