//! Whether answers keep their promise: sets of classes and automatic stops, calibrated on some rounds of grasps and tested on
//! others, for perfect sensors, real ones, and grippers that no model has met, and where a guide chooses the grasps; and how often
//! nothing is left of an object of no class.

use crate::frame::{
    Column, Experiment, Facets, LinkedFigure, OWN_METHODS, PERCENT, PlainStudy, StudyCard, StudyCell, StudyCommand,
    StudyError, StudyReport, StudySize, TableLine, TableRows,
};
use palpate_geometry::drawing::ReferenceLine;
use palpate_lab::datasets::{Cut, SensorView, labels_of_catalogue};
use palpate_lab::grasping::{GraspRounds, GraspedRound, PromiseError, random_shapes};
use palpate_learn::evaluation::{Stop, stops};
use palpate_learn::metrics::{Interval, largest_share};
use palpate_learn::{
    AnswerSets, DataCard, Dataset, Example, Fitting, Labels, Method, Model, Round, Shipped, StopReason, StopRule,
    method,
};
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{Between, PosePreset, Scene};
use palpate_tactile::model::SensorModel;
use palpate_tactile::{Channel, SignalDefinition, whole_fingers};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The study in the list.
pub(crate) const LISTED: PlainStudy<AnswerStudy> = PlainStudy {
    card: StudyCard {
        key: "answers",
        title: "Answers that keep their promise",
        about: "sets of classes and automatic stops calibrated for nine of ten rounds, tested on 1500 others: how often the true class is lost, how large sets are, how many stops are wrong",
        paper: OWN_METHODS,
    },
    of_size: |size| Ok(AnswerStudy::of_size(size)),
};

/// Promised share of rounds that may lose the true class.
const RISK: f64 = 0.1;
/// Grasps of a round.
const GRASPS: usize = 4;
/// Methods that learn the usual number of grasps; beside them the shipped model of such grasps.
const METHODS: [&str; 4] = ["ids-lstm", "paper-ids-lstm", "random-forest", "extra-trees"];
/// Name of the shipped model in tables.
const SHIPPED: &str = "shipped";
/// Seeds of the rounds to learn from, to calibrate on, to test with, and of objects of no class.
const SEEDS: [u64; 4] = [21, 22, 23, 24];
/// First of the random shapes that are no class; no model has learned them.
const STRANGERS: u64 = 50_000;

/// The study: rounds of each object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct AnswerStudy {
    /// Training grasps of each object.
    train: usize,
    /// Rounds of each object to calibrate on, and to test with.
    calibrate: usize,
    test: usize,
    /// Number of objects.
    objects: usize,
    /// Objects of no class, each in one round.
    strangers: usize,
    /// Small networks, whose results are not to be quoted.
    quick: bool,
}

impl From<PromiseError> for StudyError {
    fn from(cause: PromiseError) -> Self {
        match cause {
            PromiseError::Stopped => Self::Stopped,
            cause => Self::missing(cause),
        }
    }
}

impl AnswerStudy {
    /// The study in a size.
    pub fn of_size(size: StudySize) -> Self {
        match size {
            StudySize::Full => Self { train: 50, calibrate: 300, test: 94, objects: 16, strangers: 300, quick: false },
            StudySize::Quick | StudySize::Sample { .. } => {
                Self { train: 8, calibrate: 80, test: 8, objects: 4, strangers: 8, quick: true }
            }
        }
    }
}

/// Grippers and sensors of the rounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnswerCase {
    Perfect,
    PhysicalLike,
    /// Another gripper in each round.
    Unknown,
    /// Perfect sensors, and an object that stays and is grasped where a guide expects to learn most.
    Guided,
}

impl AnswerCase {
    const ALL: [Self; 4] = [Self::Perfect, Self::PhysicalLike, Self::Unknown, Self::Guided];

    fn sensors(self) -> SensorModel {
        match self {
            Self::Perfect | Self::Guided => SensorModel::Virtual,
            Self::PhysicalLike => SensorModel::PhysicalLike,
            Self::Unknown => SensorModel::Drawn,
        }
    }

    /// Sensors of the model that comes for such grasps: after `palpate adapt`, where they are real.
    fn shipped_sensors(self) -> SensorModel {
        if self == Self::PhysicalLike { SensorModel::Adapted } else { self.sensors() }
    }

    /// Methods that are judged beside the shipped model: none where grasps are guided, since each would be by its own answers.
    fn methods(self) -> &'static [&'static str] {
        if self == Self::Guided { &[] } else { &METHODS }
    }

    /// The model that comes for such grasps.
    fn shipped(self) -> Shipped {
        if matches!(self, Self::Perfect | Self::Guided) { Shipped::PerfectSensors } else { Shipped::AnyGripper }
    }
}

impl StudyCell for AnswerCase {
    fn name(&self) -> String {
        match self {
            Self::Perfect => "perfect sensors",
            Self::PhysicalLike => "physical-like sensors",
            Self::Unknown => "another gripper in each round",
            Self::Guided => "perfect sensors, guided",
        }
        .to_owned()
    }

    /// With the versions of all methods, and the contents of the shipped model.
    fn stored_name(&self) -> String {
        let versions: Vec<String> = self.methods().iter().filter_map(|key| Some(method(key)?.fingerprint())).collect();
        format!("{} ({}, {:08x})", self.name(), versions.join(", "), self.shipped().model_content())
    }
}

/// How a model kept its promise on the test rounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptPromise {
    model: String,
    /// Number of test rounds.
    rounds: usize,
    /// Rounds of objects of no class after which no known class is left, and all of them.
    strangers: [usize; 2],
    /// Rounds whose set lost the true class.
    lost: usize,
    /// The same of the class with the largest share: its rounds.
    worst: [usize; 2],
    /// Mean number of classes that are left after each grasp.
    sizes: Vec<f64>,
    /// Confidence of automatic stops; none where there are none.
    level: Option<f64>,
    /// Rounds that stopped by themselves, and wrong ones among them.
    stopped: [usize; 2],
    /// Wrong decisions of all rounds.
    wrong: usize,
    /// Mean number of grasps.
    grasps: f64,
    /// Stops at 90 %, as models without a promise do, and wrong ones among them.
    at_90: [usize; 2],
}

impl AnswerStudy {
    /// The scene of a case, without its object.
    fn scene(case: AnswerCase) -> Scene {
        let mut scene = Scene::default();
        if let Some(preset) = PosePreset::named(crate::paper::STUDY_PRESET) {
            scene.pose = preset.poses();
        }
        scene.pose.build = if case == AnswerCase::Unknown { 1.0 } else { 0.0 };
        if case == AnswerCase::Guided {
            scene.pose.between = Between::Guided;
        }
        scene
    }

    /// Classes of the objects: all, or some of a sample, spread over the catalogue.
    fn labels(self) -> Labels {
        let mut labels = labels_of_catalogue();
        labels.classes.retain(|class| class.name != EMPTY);
        let all = labels.classes.len();
        labels.classes = (0..self.objects.min(all)).map(|k| labels.classes[k * all / self.objects].clone()).collect();
        labels
    }

    /// A model that has learned from single grasps of each object.
    fn trained(
        self,
        key: &str,
        grasps: &[GraspedRound],
        case: AnswerCase,
        stop: &AtomicBool,
    ) -> Result<Model, StudyError> {
        let method = method(key).ok_or_else(|| StudyError::missing(key))?;
        let view = usize::from(method.is_strict());
        let example = |(k, round): (usize, &GraspedRound)| {
            let grasp = Arc::new(round.grasps[0][view].clone());
            Example { id: k as i64, class: round.class, content: grasp.content(), grasp, ..Example::default() }
        };
        let channels = whole_fingers(SignalDefinition::Parts)[..4].iter().map(Channel::name).collect();
        let about = DataCard {
            object: "free".to_owned(),
            sensors: Some(case.sensors().name().to_owned()),
            layout: Some("C1".to_owned()),
            ..DataCard::default()
        };
        let examples = grasps.iter().enumerate().map(example).collect();
        let data = Dataset { channels, labels: self.labels(), examples, about };
        let fitting = Fitting::new(1, self.quick, stop);
        method.train(&data, &fitting).map_err(|cause| StudyError::of_fit(key, cause))
    }
}

impl Experiment for AnswerStudy {
    type Cell = AnswerCase;
    type Found = Vec<KeptPromise>;
    type Report = StudyReport;

    fn key(&self) -> &'static str {
        LISTED.card.key
    }

    fn header(&self) -> serde_json::Value {
        serde_json::json!(self)
    }

    fn command(&self) -> StudyCommand {
        StudyCommand::new(self.key()).flag("quick", self.quick)
    }

    fn grid(&self) -> Vec<AnswerCase> {
        AnswerCase::ALL.to_vec()
    }

    fn measure(&self, case: &AnswerCase, stop: &AtomicBool) -> Result<Vec<KeptPromise>, StudyError> {
        let labels = self.labels();
        let named = labels.classes.iter().map(|class| class.name.clone());
        let known: Vec<(usize, String)> = named.enumerate().collect();
        let strangers = random_shapes(STRANGERS..STRANGERS + self.strangers as u64);
        let strangers: Vec<(usize, String)> = strangers.into_iter().enumerate().collect();
        let shipped = Arc::new(case.shipped().model().map_err(StudyError::missing)?);
        let guide = (*case == AnswerCase::Guided).then_some(&shipped);
        let view = |sensors: SensorModel| SensorView { sensors, ..SensorView::default() };
        let own = view(case.sensors());
        let views = [own.clone(), SensorView { cut: Cut::Whole, ..own }, view(case.shipped_sensors())];
        let simulated = |objects: &[(usize, String)], rounds: usize, grasps: usize, seed: u64| {
            let rounds = GraspRounds { rounds, grasps, seed, progress: &|_, _| (), stop };
            rounds.simulated(&Self::scene(*case), &views, objects, guide).map_err(StudyError::from)
        };
        let learned = if case.methods().is_empty() { 0 } else { self.train };
        let train = simulated(&known, learned, 1, SEEDS[0])?;
        let calibrate = simulated(&known, self.calibrate, GRASPS, SEEDS[1])?;
        let test = simulated(&known, self.test, GRASPS, SEEDS[2])?;
        let strange = simulated(&strangers, 1, GRASPS, SEEDS[3])?;
        let mut kept = Vec::new();
        for key in [&[SHIPPED][..], case.methods()].concat() {
            let model = match key {
                SHIPPED => Arc::clone(&shipped),
                key => Arc::new(self.trained(key, &train, *case, stop)?),
            };
            let view = match key {
                SHIPPED => 2,
                key => usize::from(method(key).is_some_and(Method::is_strict)),
            };
            let judged = |rounds: &[GraspedRound]| -> Vec<Round> {
                let number = |class: usize| model.card.labels.class(&labels.classes[class].name).unwrap_or(class);
                let judged = rounds.iter().map(|round| round.judged(&model, view));
                judged.map(|round| Round { truth: number(round.truth), ..round }).collect()
            };
            let rejection = model.card.rejection.as_ref();
            let sets = AnswerSets::calibrate(&model.card.labels, &judged(&calibrate), rejection, RISK, 1);
            let sets = sets.ok_or_else(|| StudyError::missing("rounds to calibrate on"))?;
            let strangers: Vec<Round> = strange.iter().map(|round| round.judged(&model, view)).collect();
            kept.push(KeptPromise::of(key, &model, &sets, &judged(&test), &strangers));
        }
        Ok(kept)
    }

    fn report(&self, found: Vec<(AnswerCase, Vec<KeptPromise>)>) -> StudyReport {
        let rows: Vec<(AnswerCase, KeptPromise)> =
            found.into_iter().flat_map(|(case, kept)| kept.into_iter().map(move |own| (case, own))).collect();
        let cases = rows.len().max(1) as f64;
        type Kept = (AnswerCase, KeptPromise);
        let share = |count: usize, of: usize| (of > 0).then(|| Interval::of_share(count, of));
        let title = format!(
            "Promise: the true class is left in {:.0} % of rounds; automatic stops are wrong in {:.0} % at most",
            100.0 * (1.0 - RISK),
            100.0 * RISK
        );
        let table = TableRows::new(LISTED.card.key, title, &rows).columns(&[
            Column("rounds", "", &|(case, _): &Kept| case.name().into()),
            Column("model", "", &|(_, own)| own.model.as_str().into()),
            Column("left", PERCENT, &|(_, own)| share(own.rounds - own.lost, own.rounds).into()),
            Column("kept", "", &|(_, own)| own.verdict(0.05 / cases).into()),
            Column("worst class", PERCENT, &|(_, own)| {
                let [lost, rounds] = own.worst;
                share(rounds - lost, rounds).map(|own| own.estimate).into()
            }),
            Column("left after one grasp", "classes", &|(_, own)| own.sizes.first().copied().into()),
            Column("after four", "classes", &|(_, own)| own.sizes.last().copied().into()),
            Column("stops at", PERCENT, &|(_, own)| own.level.into()),
            Column("stopped", PERCENT, &|(_, own)| share(own.stopped[0], own.rounds).map(|own| own.estimate).into()),
            Column("wrong of stopped", PERCENT, &|(_, own)| share(own.stopped[1], own.stopped[0]).into()),
            Column("wrong of all", PERCENT, &|(_, own)| share(own.wrong, own.rounds).into()),
            Column("grasps", "", &|(_, own)| Some(own.grasps).into()),
            Column("wrong of stops at 90 %", PERCENT, &|(_, own)| share(own.at_90[1], own.at_90[0]).into()),
            Column("none left of unknown objects", PERCENT, &|(_, own)| {
                share(own.strangers[0], own.strangers[1]).into()
            }),
            Column("tested", "rounds", &|(_, own)| own.rounds.into()),
        ]);
        let data = format!(
            "preset B, object free and put down anew for each of {GRASPS} grasps (guided: left as released); {} objects; {} rounds of \
             each to calibrate on, {} to test with, and a round of each of {} random shapes that are no class; trained models learned \
             {} grasps of each, shipped ones read physical-like sensors after `palpate adapt`",
            self.objects, self.calibrate, self.test, self.strangers, self.train
        );
        StudyReport::new(vec![data], vec![table], Vec::new())
    }

    fn shown(report: &StudyReport) -> StudyReport {
        report.clone()
    }

    fn figures(report: &StudyReport) -> Vec<LinkedFigure> {
        let promise = |_: &str| {
            let at = 100.0 * (1.0 - RISK);
            Some(ReferenceLine { horizontal: false, at, text: "promised".to_owned() })
        };
        let facets = Facets {
            plot: &|line: TableLine<'_>| line.text("rounds").to_owned(),
            value: ("left", "rounds whose true class is left (%)"),
            reference: &promise,
            columns: 3,
            note: "With 95 % intervals (Wilson).",
            ..Facets::USUAL
        };
        facets.figure(report, LISTED.card.key).into_iter().collect()
    }
}

impl KeptPromise {
    fn of(key: &str, model: &Model, sets: &AnswerSets, test: &[Round], strangers: &[Round]) -> Self {
        let recogniser = model.recogniser.as_ref();
        let ends = |threshold: f64| stops(recogniser, test, StopRule { threshold, most_grasps: GRASPS });
        let sure = |ends: &[Stop]| {
            let sure = || ends.iter().filter(|end| end.reason == StopReason::Sure);
            [sure().count(), sure().filter(|end| !end.correct).count()]
        };
        let own = ends(sets.stop.level.unwrap_or(1.0));
        let is_lost: Vec<bool> = test.iter().map(|round| !sets.left(&round.belief)[round.truth]).collect();
        let of_class = |class: usize| {
            let own = test.iter().zip(&is_lost).filter(move |(round, _)| round.truth == class);
            [own.clone().filter(|(_, lost)| **lost).count(), own.count()]
        };
        let other = model.card.labels.other();
        let is_noticed = |round: &&Round| {
            let left = sets.left(&round.belief);
            (0..left.len()).all(|class| !left[class] || Some(class) == other)
        };
        let share = |[lost, rounds]: &[usize; 2]| *lost as f64 / *rounds as f64;
        let classes = (0..model.card.labels.classes.len()).map(of_class).filter(|[_, rounds]| *rounds > 0);
        let size = |grasps: usize| {
            let all = test.iter().map(|round| sets.left(&round.belief.first(grasps)));
            all.map(|left| left.iter().filter(|own| **own).count()).sum::<usize>() as f64 / test.len().max(1) as f64
        };
        Self {
            model: key.to_owned(),
            rounds: test.len(),
            strangers: [strangers.iter().filter(is_noticed).count(), strangers.len()],
            lost: is_lost.iter().filter(|lost| **lost).count(),
            worst: classes.max_by(|a, b| share(a).total_cmp(&share(b))).unwrap_or_default(),
            sizes: (1..=GRASPS).map(size).collect(),
            level: sets.stop.level,
            stopped: sure(&own),
            wrong: own.iter().filter(|end| !end.correct || end.reason == StopReason::Unknown).count(),
            grasps: own.iter().map(|end| end.grasps).sum::<usize>() as f64 / own.len().max(1) as f64,
            at_90: sure(&ends(StopRule::default().threshold)),
        }
    }

    /// Whether the promise was kept: broken only where more rounds lost the true class than chance explains at this error rate.
    fn verdict(&self, error: f64) -> &'static str {
        let surely_lost = 1.0 - largest_share(self.rounds - self.lost, self.rounds, error);
        if surely_lost > RISK { "no" } else { "yes" }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_promise_is_broken_only_by_more_than_chance_explains() {
        let kept = |lost: usize| KeptPromise {
            model: String::new(),
            rounds: 1504,
            strangers: [0; 2],
            lost,
            worst: [0; 2],
            sizes: Vec::new(),
            level: None,
            stopped: [0; 2],
            wrong: 0,
            grasps: 4.0,
            at_90: [0; 2],
        };
        // 0.05 / 15 is 2.7 standard deviations of 11.6 rounds.
        let verdicts = [0, 150, 175, 190, 1504].map(|lost| kept(lost).verdict(0.05 / 15.0));
        assert_eq!(verdicts, ["yes", "yes", "yes", "no", "no"]);
    }

    #[test]
    fn a_sample_has_objects_of_all_shapes() {
        let labels = AnswerStudy::of_size(StudySize::Quick).labels();
        let shapes: std::collections::BTreeSet<_> = labels.classes.iter().filter_map(|class| class.shape).collect();
        assert_eq!((labels.classes.len(), shapes.len()), (4, 3));
        assert_eq!(AnswerStudy::of_size(StudySize::Full).labels().classes.len(), 16);
    }
}
