//! What is asked: grasps, sensors, models and targets of each row.

use super::super::plan::POSES;
use super::super::prelude::*;
use palpate_learn::Shipped;
use palpate_tactile::SignalDefinition;

/// Seed of the poses of grasps that judge.
pub(super) const JUDGED: u64 = 8;
/// Grasps of each object that judge.
pub(super) const TESTED: usize = 100;
/// Training grasps of each fixed object where there are many.
pub(super) const LEARNED: usize = 400;
/// Drawn grippers that read each training grasp, as for the shipped model for any gripper.
pub(super) const READINGS: u32 = 6;
/// Training draws.
const DRAWS: usize = 5;

/// What a model learns from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::paper) enum Learns {
    /// So many grasps of each object like those that it is judged on.
    Like { of_each: usize, draws: usize },
    /// So many simulated grasps of each object as any gripper reads them.
    Drawn { of_each: usize },
    /// The same as [`Self::Like`] with labels in random order, a control.
    Shuffled { of_each: usize },
    /// The same, with the true size and shape of each test grasp known: an upper bound for what estimates them.
    Given { of_each: usize },
    /// It comes with the program.
    Shipped(Shipped),
}

/// How the grasps that judge are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::paper) enum Reads {
    /// Through sensors of a gripper of this build: 0 that of the scene, 1 any.
    Sensors { sensors: SensorModel, build: f64 },
    /// Through the contact pressure, which only simulations have.
    Contact,
    /// By emulated grippers.
    Emulated,
}

/// A row of the table.
#[derive(PartialEq)]
pub(in crate::paper) struct Question {
    pub(super) name: &'static str,
    pub(super) preset: &'static str,
    pub(super) fixed: bool,
    pub(super) learns: Learns,
    pub(super) reads: Reads,
    /// Methods; that of the shipped model where it is judged.
    pub(super) methods: &'static [&'static str],
    /// F1 to reach after one grasp and after three, and beyond that.
    pub(super) targets: Targets,
}

/// F1 to reach after one grasp and after three, and beyond that.
pub(super) type Targets = [[Option<f64>; 2]; 2];

const NETWORK: &[&str] = &["geometry-network"];
const TREES: &[&str] = &["extra-trees", "geometry-trees"];
const ALL: &[&str] = &["extra-trees", "geometry-trees", "geometry-network"];
const VIRTUAL: Reads = Reads::Sensors { sensors: SensorModel::Virtual, build: 0.0 };
const PHYSICAL: Reads = Reads::Sensors { sensors: SensorModel::PhysicalLike, build: 0.0 };
const NOISY: Reads = Reads::Sensors { sensors: SensorModel::Noisy, build: 0.0 };
const ADAPTED: Reads = Reads::Sensors { sensors: SensorModel::Adapted, build: 0.0 };
const UNKNOWN: Reads = Reads::Sensors { sensors: SensorModel::Drawn, build: 1.0 };
const FIFTY: Learns = Learns::Like { of_each: 50, draws: DRAWS };

/// Grasps of grippers that are unknown in all respects.
pub(in crate::paper) const UNLABELLED: &str = "no labels, unknown mechanics too, B";

/// What most rows have in common.
const USUAL: Question = Question {
    name: "",
    preset: "B",
    fixed: false,
    learns: FIFTY,
    reads: VIRTUAL,
    methods: NETWORK,
    targets: [[None; 2]; 2],
};

/// Targets after one grasp alone: to reach, and beyond.
const fn after_one(reach: f64, beyond: f64) -> Targets {
    [[Some(reach), None], [Some(beyond), None]]
}

/// Targets after one grasp and after three: to reach, and beyond.
const fn after_both(reach: [f64; 2], beyond: [f64; 2]) -> Targets {
    [[Some(reach[0]), Some(reach[1])], [Some(beyond[0]), Some(beyond[1])]]
}

/// All rows.
pub(super) static QUESTIONS: [Question; 17] = [
    Question { name: "B free, 50 of each", methods: ALL, targets: after_both([0.84, 0.97], [0.87, 0.98]), ..USUAL },
    Question {
        name: "B fixed, 50 of each",
        fixed: true,
        methods: ALL,
        targets: after_both([0.58, 0.83], [0.60, 0.85]),
        ..USUAL
    },
    Question {
        name: "B fixed, 400 of each",
        fixed: true,
        learns: Learns::Like { of_each: LEARNED, draws: 1 },
        methods: &["geometry-trees", "geometry-network"],
        targets: [[Some(0.72), Some(0.94)], [Some(0.76), None]],
        ..USUAL
    },
    Question {
        name: "A free, physical-like, 50 of each",
        preset: "A",
        reads: PHYSICAL,
        methods: TREES,
        targets: after_one(0.95, 0.96),
        ..USUAL
    },
    Question {
        name: "A fixed, physical-like, 50 of each",
        preset: "A",
        fixed: true,
        reads: PHYSICAL,
        methods: TREES,
        targets: after_one(0.85, 0.88),
        ..USUAL
    },
    Question {
        name: "shipped model, B free",
        learns: Learns::Shipped(Shipped::PerfectSensors),
        targets: [[Some(0.95), Some(0.995)], [Some(0.97), None]],
        ..USUAL
    },
    Question {
        name: "shipped model, B free, mild noise",
        learns: Learns::Shipped(Shipped::PerfectSensors),
        reads: NOISY,
        targets: after_one(0.90, 0.93),
        ..USUAL
    },
    Question { name: "shipped model, B fixed", fixed: true, learns: Learns::Shipped(Shipped::FixedObjects), ..USUAL },
    Question {
        name: "no labels, physical-like B",
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: ADAPTED,
        targets: after_both([0.68, 0.90], [0.72, 0.93]),
        ..USUAL
    },
    Question {
        name: "no labels, physical-like A",
        preset: "A",
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: ADAPTED,
        ..USUAL
    },
    Question {
        name: "no labels, physical-like A, trained on A",
        preset: "A",
        learns: Learns::Drawn { of_each: 150 },
        reads: ADAPTED,
        targets: after_one(0.90, 0.93),
        ..USUAL
    },
    Question {
        name: UNLABELLED,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: UNKNOWN,
        targets: after_both([0.60, 0.85], [0.68, 0.90]),
        ..USUAL
    },
    Question {
        name: "no labels, emulated gripper, B",
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: Reads::Emulated,
        targets: after_both([0.70, 0.93], [0.75, 0.95]),
        ..USUAL
    },
    Question {
        name: "control: shuffled labels, B free",
        learns: Learns::Shuffled { of_each: 50 },
        methods: &["geometry-trees"],
        ..USUAL
    },
    Question {
        name: "control: true size and shape given, B free",
        learns: Learns::Given { of_each: 50 },
        methods: &["geometry-trees"],
        ..USUAL
    },
    Question {
        name: "contact pressure, B free, 50 of each",
        reads: Reads::Contact,
        methods: &["extra-trees"],
        ..USUAL
    },
    Question {
        name: "contact pressure, B fixed, 50 of each",
        fixed: true,
        reads: Reads::Contact,
        methods: &["extra-trees"],
        ..USUAL
    },
];

/// Rows of new objects: each object in turn is taught to a model of the others; F1 of its class.
pub(super) static NEW_OBJECTS: [Question; 2] = [
    Question { name: "new object by its file, B free", targets: after_one(0.80, 0.90), ..USUAL },
    Question {
        name: "new object by its file, unknown gripper",
        reads: UNKNOWN,
        targets: after_one(0.60, 0.70),
        ..USUAL
    },
];

impl Question {
    /// Training grasps of each object that one draw takes, and number of draws.
    pub(super) fn draws(&self, plan: &StudyPlan) -> (usize, usize) {
        match self.learns {
            Learns::Like { of_each, draws } => (plan.grasps(of_each, 20), plan.pick(draws, 1, 1)),
            Learns::Shuffled { of_each } | Learns::Given { of_each } | Learns::Drawn { of_each } => {
                (plan.grasps(of_each, 20), 1)
            }
            Learns::Shipped(_) => (0, 1),
        }
    }

    /// Grasps that a model learns from.
    pub(super) fn learned(&self, plan: &StudyPlan) -> DataWanted {
        let (of_each, draws) = self.draws(plan);
        let mut wanted = self.wanted(plan, of_each * draws, POSES);
        if matches!(self.learns, Learns::Drawn { .. }) {
            (wanted.view.sensors, wanted.view.draws) = (SensorModel::Drawn, plan.pick(READINGS, 2, 1));
        }
        wanted
    }

    /// Grasps that judge, or a draw of those that a model learns from.
    pub(super) fn wanted(&self, plan: &StudyPlan, grasps: usize, poses: u64) -> DataWanted {
        let (sensors, build) = match self.reads {
            Reads::Sensors { sensors, build } => (sensors, build),
            Reads::Contact | Reads::Emulated => (SensorModel::Virtual, 0.0),
        };
        let usual = plan.wanted(grasps, sensors);
        let mut view = usual.view.clone();
        if self.reads == Reads::Contact {
            view = view.with_signals(SignalDefinition::Contact);
        }
        DataWanted { preset: self.preset.to_owned(), fixed: self.fixed, build, poses, view, ..usual }
    }
}
