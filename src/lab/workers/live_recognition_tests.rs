//! Recognition in the simulation thread, with a stub recogniser that returns preset probabilities.

use super::sim_tests::{Watched, ball, start_with};
use super::{Command, Notice, Snapshot};
use crate::datasets::labels_of_catalogue;
use palpate_learn::{
    Arrays, DataCard, LiveRecogniser, Model, ModelCard, Pmf, Recogniser, Sequence, Shipped, StopReason, StopRule,
    Verdict,
};
use palpate_sim::scene::{Between, Scene};
use palpate_store::Store;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Stub recogniser: preset probabilities of "ball" after the first grasp, the second and so on.
#[derive(Clone)]
struct Parrot {
    ball: Vec<f64>,
    /// Number of samples received.
    rows: Arc<AtomicUsize>,
}

/// Verdict with this probability for the ball, and the rest shared evenly by all other classes.
fn saying(ball: f64) -> Verdict {
    let labels = labels_of_catalogue();
    let others = (1.0 - ball) / (labels.classes.len() - 1) as f64;
    let at = labels.class("ball").expect("in the catalogue");
    Verdict {
        pmf: Pmf::from_weights((0..labels.classes.len()).map(|k| if k == at { ball } else { others })),
        properties: None,
    }
}

impl Parrot {
    /// Verdict after a grasp; the probability of the previous verdict gives the number of the grasp.
    fn after(&self, before: Option<&Pmf>) -> Verdict {
        let known = before.map(|pmf| pmf.top().1);
        let next = self.ball.iter().position(|p| known.is_some_and(|k| (k - p).abs() < 1e-9)).map_or(0, |k| k + 1);
        saying(self.ball[next.min(self.ball.len() - 1)])
    }

    fn model(ball: &[f64]) -> (Model, Arc<AtomicUsize>) {
        let rows = Arc::new(AtomicUsize::new(0));
        let parrot = Self { ball: ball.to_vec(), rows: Arc::clone(&rows) };
        let channels =
            ["curvature", "pressure", "force"].iter().flat_map(|q| ["left", "right"].map(|s| format!("{q}_{s}")));
        let card = ModelCard {
            method: "parrot".to_owned(),
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
        (Model { card, recogniser: Arc::new(parrot), signatures: None }, rows)
    }
}

impl Recogniser for Parrot {
    fn recognise(&self, _grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        self.after(before)
    }

    fn live(&self) -> Option<Box<dyn LiveRecogniser>> {
        Some(Box::new(LiveParrot { parrot: self.clone(), end: saying(0.1) }))
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

struct LiveParrot {
    parrot: Parrot,
    end: Verdict,
}

impl LiveRecogniser for LiveParrot {
    fn begin(&mut self, before: Option<&Pmf>) {
        self.end = self.parrot.after(before);
    }

    fn push(&mut self, _t: f32, _row: &[f32]) -> Option<Verdict> {
        self.parrot.rows.fetch_add(1, Ordering::Relaxed);
        Some(saying(0.1))
    }

    fn finish(&mut self) -> Option<Verdict> {
        Some(self.end.clone())
    }
}

fn watch(model: Option<Model>, folder: &tempfile::TempDir, grasps: u32) -> Watched {
    let watched = start_with(model, ball(), folder.path().join("trials.sqlite"), grasps);
    watched.send(Command::SetSpeed(64.0));
    watched
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn decision(snapshot: &Snapshot) -> Option<StopReason> {
    snapshot.identification.as_ref().and_then(|view| view.decision)
}

#[test]
fn a_round_ends_when_it_is_sure_and_the_next_one_starts_over() {
    let folder = folder();
    let watched = watch(Some(Parrot::model(&[0.6, 0.95]).0), &folder, 4);
    let end = watched.until(|s| s.status.finished);
    let view = end.identification.as_ref().expect("there is a model");
    assert_eq!((end.grasp, decision(&end), view.decided()), (2, Some(StopReason::Sure), Some("ball")));
    assert_eq!((view.beliefs.len(), view.listening, end.truth()), (2, false, "ball"));
    watched.send(Command::Play);
    let again = watched.until(|s| s.grasp == 3);
    assert!(decision(&again).is_none() && again.identification.as_ref().is_some_and(|view| view.beliefs.is_empty()));
}

#[test]
fn a_round_ends_at_the_limit_of_grasps_which_can_be_changed() {
    let folder = folder();
    let watched = watch(Some(Parrot::model(&[0.6]).0), &folder, 2);
    let end = watched.until(|s| s.status.finished);
    assert_eq!((end.grasp, decision(&end)), (2, Some(StopReason::GraspLimit)));
    watched.send(Command::SetGrasps(3));
    watched.send(Command::Play);
    let end = watched.until(|s| s.status.finished && s.grasp > 2);
    assert_eq!((end.grasp, end.identification.as_ref().map(|view| view.rule.most_grasps)), (5, Some(3)));
}

#[test]
fn the_threshold_can_be_changed_and_stays_within_reason() {
    let folder = folder();
    let watched = watch(Some(Parrot::model(&[0.6]).0), &folder, 4);
    for (asked, got) in [(0.1, 0.5), (2.0, 0.999), (0.55, 0.55)] {
        watched.send(Command::SetThreshold(asked));
        watched.until(|s| s.identification.as_ref().is_some_and(|view| view.rule.threshold == got));
    }
    watched.send(Command::SetThreshold(f64::NAN));
    watched.send(Command::Reset);
    watched.send(Command::Play);
    let end = watched.until(|s| s.status.finished);
    assert_eq!(decision(&end), Some(StopReason::Sure), "0.6 reaches 0.55");
    assert_eq!(end.status.grasp_of_round, 1);
}

#[test]
fn a_lower_threshold_between_two_grasps_ends_the_round() {
    let folder = folder();
    let model = Parrot::model(&[0.6]).0;
    let watched = start_with(Some(model), ball(), folder.path().join("trials.sqlite"), 4);
    // Stepped, so that the next grasp cannot begin before the command comes.
    watched.send(Command::Pause);
    let mut now = watched.until(|s| !s.status.playing);
    while now.last.is_none() {
        watched.send(Command::Step);
        now = watched.until(|s| s.frame.t > now.frame.t || s.last.is_some());
    }
    watched.send(Command::SetThreshold(0.55));
    let end = watched.until(|s| s.status.finished);
    assert_eq!((end.grasp, decision(&end)), (1, Some(StopReason::Sure)));
}

#[test]
fn another_object_starts_over() {
    let folder = folder();
    let watched = watch(Some(Parrot::model(&[0.6]).0), &folder, 4);
    watched.until(|s| s.identification.as_ref().is_some_and(|view| view.beliefs.len() == 1));
    watched.send(Command::SetSpeed(1.0));
    let mut other = ball();
    "cube".clone_into(&mut other.object.source);
    watched.send(Command::SetScene(Box::new(other)));
    let begun = watched.until(|s| s.truth() == "cube");
    assert!(begun.identification.as_ref().is_some_and(|view| view.beliefs.is_empty() && view.decision.is_none()));
    assert_eq!(begun.status.grasp_of_round, 1);
}

#[test]
fn frames_are_the_same_with_and_without_a_model() {
    let [with, without] = [Some(Parrot::model(&[0.6])), None].map(|model| {
        let folder = folder();
        let (model, rows) = model.map_or((None, None), |(model, rows)| (Some(model), Some(rows)));
        let watched = watch(model, &folder, 2);
        watched.until(|s| s.status.finished && s.grasp == 2);
        drop(watched);
        assert!(rows.is_none_or(|rows| rows.load(Ordering::Relaxed) > 100), "it has listened");
        let store = Store::open(&folder.path().join("trials.sqlite")).expect("opens");
        [1, 2].map(|id| store.load(id).expect("whole"))
    });
    // Only what the model thought of the grasp before is stored besides. A trial may or may not have been compared with
    // another run before the next grasp ended.
    assert_eq!(with[1].header.earlier.as_ref().map(|earlier| earlier.judged.len()), Some(1));
    let [with, without] = [with, without].map(|trials| {
        trials.map(|mut trial| {
            trial.header.earlier = None;
            if let palpate_tactile::trial::TrialData::Simulated(data) = &mut trial.data {
                data.quality.agrees = None;
            }
            trial
        })
    });
    assert!(with == without);
}

#[test]
fn a_model_that_reads_other_channels_says_so_once_for_each_scene() {
    let folder = folder();
    let (mut model, _) = Parrot::model(&[0.6]);
    model.card.channels = vec!["temperature".to_owned()];
    let watched = watch(Some(model), &folder, 2);
    let end = watched.until(|s| s.status.finished);
    assert_eq!(end.grasp, 2, "without recognition it makes as many grasps as were asked for");
    assert!(end.identification.is_none());
    assert!(end.recognition_off.as_ref().is_some_and(|why| why.contains("temperature")));
    watched.send(Command::SetScene(Box::new(ball())));
    watched.until(|s| s.status.finished && s.grasp == 4);
    let found =
        watched.worker.notices().filter(|n| matches!(n, Notice::Warning(w) if w.contains("temperature"))).count();
    assert_eq!(found, 2);
}

#[test]
fn the_model_that_comes_with_the_program_answers_while_the_first_grasp_goes_on() {
    let folder = folder();
    let watched = watch(palpate_learn::Shipped::PerfectSensors.model().ok(), &folder, 1);
    watched.send(Command::Pause);
    watched.until(|s| !s.status.playing);
    watched.send(Command::SetSpeed(1.0));
    watched.send(Command::Reset);
    watched.send(Command::Play);
    let early = watched.until(|s| s.identification.as_ref().is_some_and(|view| view.verdict.is_some()));
    assert!(early.frame.t < 0.5, "{} s", early.frame.t);
}

#[test]
fn a_guide_chooses_the_next_grasp_of_an_object_that_stays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut scene = ball();
    scene.timing.duration_s = Scene::default().timing.duration_s;
    scene.pose.between = Between::Guided;
    scene.set_object_fixed(true);
    let model = Shipped::PerfectSensors.model().expect("valid");
    let watched = start_with(Some(model), scene.clone(), folder.path().join("trials.sqlite"), 2);
    watched.send(Command::SetThreshold(0.999));
    watched.send(Command::SetSpeed(64.0));
    let first = watched.until(|s| s.status.grasp_of_round == 1);
    assert_eq!(first.status.guided, None);
    let second = watched.until(|s| s.status.grasp_of_round == 2 || s.status.finished);
    let by = second.status.guided.expect("chosen");
    assert_eq!(second.scene.object, first.scene.object);
    let moved = second.scene.gripper.mount.yaw_deg - first.scene.gripper.mount.yaw_deg;
    assert!((moved - by.turn_deg).rem_euclid(360.0) < 1e-9 && second.scene != first.scene, "{by:?}");
}
