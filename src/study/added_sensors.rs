//! What sensors that a gripper has beyond the paper's four are worth to recognition, in simulation: the same grasps read through
//! each list of sensors.

use crate::frame::{
    Along, Column, Experiment, Facets, LinkedFigure, OWN_METHODS, PERCENT, POINTS, PlainStudy, StudyCard, StudyCell,
    StudyCommand, StudyError, StudyReport, StudySize, TableLine, TableRows,
};
use crate::paper::{Pool, STUDY_PRESET, TestAnswers, judge};
use palpate_lab::datasets::{SensorView, labels_of_catalogue};
use palpate_lab::grasping::{GraspRounds, GraspedRound};
use palpate_learn::metrics::Interval;
use palpate_learn::{DataCard, Dataset, Example, Fitting, Labels, Method, method};
use palpate_sim::gripper::GripperModel;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_tactile::SensorLayout;
use palpate_tactile::board::SensorList;
use palpate_tactile::model::SensorModel;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

/// The study in the list.
pub(crate) const LISTED: PlainStudy<AddedSensorStudy> = PlainStudy {
    card: StudyCard {
        key: "added-sensors",
        title: "Sensors beyond the paper's four",
        about: "the same simulated grasps read through the paper's four sensors and through those of other grippers: what the added ones are worth to recognition",
        paper: OWN_METHODS,
    },
    of_size: |size| Ok(study(None, size != StudySize::Full)),
};

/// Methods that read whatever channels there are.
const METHODS: [&str; 4] = ["geometry-trees", "extra-trees", "random-forest", "convolution"];
/// Gripper files that come with the program, by what they add.
const SHIPPED: [(&str, &str); 2] = [
    ("two pads on each finger, chamber pressure", include_str!("../../assets/grippers/two_pads.toml")),
    ("distance from the palm", include_str!("../../assets/grippers/palm_distance.toml")),
];
/// The list that others are compared with.
const PAPER: &str = "none";
/// Seeds of grasps to learn from and to judge by.
const SEEDS: [u64; 2] = [41, 42];

/// The study in full, or in less than a minute. `own` is another gripper with its name.
pub fn added_sensor_study(own: Option<(String, SensorList)>, quick: bool) -> impl Experiment<Report = StudyReport> {
    study(own, quick)
}

fn study(own: Option<(String, SensorList)>, quick: bool) -> AddedSensorStudy {
    let (train, test, methods) = if quick { (10, 10, 1) } else { (150, 100, METHODS.len()) };
    AddedSensorStudy { own, train, test, methods, quick, data: Mutex::default() }
}

/// The study.
pub(crate) struct AddedSensorStudy {
    own: Option<(String, SensorList)>,
    /// Grasps of each object to learn from, and to judge by.
    train: usize,
    test: usize,
    /// Number of methods.
    methods: usize,
    quick: bool,
    /// Grasps to learn from and to judge by, through each list of sensors, once they are made.
    data: Mutex<Option<Arc<Vec<[Dataset; 2]>>>>,
}

impl StudyCell for &'static Method {
    fn name(&self) -> String {
        self.key.to_owned()
    }

    fn method(&self) -> Option<&'static Method> {
        Some(self)
    }
}

impl AddedSensorStudy {
    /// Lists of sensors by what they add.
    fn grippers(&self) -> Result<Vec<(String, SensorList)>, StudyError> {
        let mut all = vec![(PAPER.to_owned(), SensorList::default())];
        for (name, text) in SHIPPED {
            all.push((name.to_owned(), SensorList::parse(text).map_err(StudyError::missing)?));
        }
        all.extend(self.own.clone());
        Ok(all)
    }

    /// Simulated grasps, the same for all lists.
    fn data(&self, stop: &AtomicBool) -> Result<Arc<Vec<[Dataset; 2]>>, StudyError> {
        let mut data = self.data.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(data) = &*data {
            return Ok(Arc::clone(data));
        }
        let view = |(_, list): &(String, SensorList)| SensorView {
            layout: SensorLayout::OF_FILE.to_owned(),
            gripper: Some(*list),
            sensors: SensorModel::Adapted,
            ..SensorView::default()
        };
        let views: Vec<SensorView> = self.grippers()?.iter().map(view).collect();
        let preset =
            PosePreset::named(STUDY_PRESET).ok_or_else(|| StudyError::Unknown(format!("preset {STUDY_PRESET}")))?;
        let scene = Scene { pose: preset.poses(), ..Scene::default() };
        let mut labels = labels_of_catalogue();
        labels.classes.retain(|class| class.name != EMPTY);
        let sources: Vec<(usize, String)> =
            labels.classes.iter().enumerate().map(|(k, class)| (k, class.name.clone())).collect();
        let simulated = |rounds: usize, seed: u64| {
            let rounds = GraspRounds { rounds, grasps: 1, seed, progress: &|_, _| (), stop };
            rounds.simulated(&scene, &views, &sources, None)
        };
        let [train, test] = [simulated(self.train, SEEDS[0])?, simulated(self.test, SEEDS[1])?];
        let sets = views.iter().enumerate().map(|(number, view)| {
            let channels = view.sensor_layout()?.channels(&GripperModel::default(), view.signals)?;
            let names: Vec<String> = channels.iter().map(palpate_tactile::Channel::name).collect();
            Ok([&train, &test].map(|rounds| set_of(rounds, number, view, &names, &labels)))
        });
        let sets = sets.collect::<Result<Vec<_>, palpate_tactile::LayoutError>>().map_err(StudyError::missing)?;
        Ok(Arc::clone(data.insert(Arc::new(sets))))
    }
}

/// Grasps as read through one of the views.
fn set_of(rounds: &[GraspedRound], number: usize, view: &SensorView, names: &[String], labels: &Labels) -> Dataset {
    let example = |(k, round): (usize, &GraspedRound)| {
        let grasp = Arc::new(round.grasps[0][number].clone());
        Example { id: k as i64, class: round.class, content: grasp.content(), grasp, ..Example::default() }
    };
    let about = DataCard {
        preset: Some(STUDY_PRESET.to_owned()),
        object: "free".to_owned(),
        sensors: Some(view.sensors.name().to_owned()),
        grasps: rounds.len(),
        ..DataCard::default()
    };
    let examples = rounds.iter().enumerate().map(example).collect();
    Dataset { channels: names.to_vec(), labels: labels.clone(), examples, about }
}

/// A method with one list of sensors.
struct SensorRow {
    method: &'static str,
    added: String,
    pool: Pool,
    /// Difference to the paper's four.
    gain: Option<Interval>,
}

impl Experiment for AddedSensorStudy {
    type Cell = &'static Method;
    /// Answers by list of sensors.
    type Found = Vec<TestAnswers>;
    type Report = StudyReport;

    fn key(&self) -> &'static str {
        LISTED.card.key
    }

    fn header(&self) -> serde_json::Value {
        let grippers = self.grippers().unwrap_or_default();
        serde_json::json!({ "train": self.train, "test": self.test, "quick": self.quick, "grippers": grippers })
    }

    fn command(&self) -> StudyCommand {
        let own = self.own.as_ref().map(|(name, _)| name);
        StudyCommand::new(LISTED.card.key).option("with", own).flag("quick", self.quick)
    }

    fn grid(&self) -> Vec<&'static Method> {
        METHODS.into_iter().take(self.methods).filter_map(method).collect()
    }

    fn measure(&self, method: &&'static Method, stop: &AtomicBool) -> Result<Vec<TestAnswers>, StudyError> {
        let sets = self.data(stop)?;
        let judged = |[train, test]: &[Dataset; 2]| {
            let fitting = Fitting::new(1, self.quick, stop);
            let model = method.train(train, &fitting).map_err(|cause| StudyError::of_fit(method.key, cause))?;
            Ok(TestAnswers::Answers(judge(&model, test)))
        };
        sets.iter().map(judged).collect()
    }

    fn report(&self, found: Vec<(&'static Method, Vec<TestAnswers>)>) -> StudyReport {
        let grippers = self.grippers().unwrap_or_default();
        let mut rows = Vec::new();
        for (method, answers) in &found {
            let pools: Vec<Pool> = answers.iter().map(|own| Pool::of_parts(std::slice::from_ref(own))).collect();
            for (k, ((added, _), pool)) in grippers.iter().zip(&pools).enumerate() {
                let gain = pool.against(&pools[0]).filter(|_| k > 0).map(|own| own.f1);
                rows.push(SensorRow { method: method.key, added: added.clone(), pool: pool.clone(), gain });
            }
        }
        let table = TableRows::new(LISTED.card.key, "Recognition after one grasp, by sensors", &rows).columns(&[
            Column("method", "", &|row: &SensorRow| row.method.into()),
            Column("added", "", &|row| row.added.as_str().into()),
            Column("F1", PERCENT, &|row| row.pool.f1().into()),
            Column("F1 against the paper's four", POINTS, &|row| row.gain.into()),
            Column("tested", "grasps", &|row| row.pool.len().into()),
        ]);
        let line = format!(
            "the sixteen objects, preset {STUDY_PRESET}, free; sensors after `palpate adapt`, raw ones without noise; {} grasps of \
             each to learn from, {} to judge by, the same for all sensors",
            self.train, self.test
        );
        StudyReport::new(vec![line], vec![table], Vec::new())
    }

    fn shown(report: &StudyReport) -> StudyReport {
        report.clone()
    }

    fn figures(report: &StudyReport) -> Vec<LinkedFigure> {
        let added = |line: TableLine<'_>| line.text("added").to_owned();
        let facets = Facets {
            plot: &|line: TableLine<'_>| line.text("method").to_owned(),
            series: &added,
            along: Along::Rows(&added),
            ..Facets::USUAL
        };
        facets.figure(report, LISTED.card.key).into_iter().collect()
    }
}
