//! What is asked: grasps, sensors, models and targets of each row.

use super::super::plan::{DataWanted, POSES, StudyPlan};
use palpate_learn::Shipped;
use palpate_tactile::SignalDefinition;
use palpate_tactile::model::SensorModel;

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
pub(in crate::study::paper) enum Learns {
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
pub(in crate::study::paper) enum Reads {
    /// Through sensors of a gripper of this build: 0 that of the scene, 1 any.
    Sensors { sensors: SensorModel, build: f64 },
    /// Through the contact pressure, which only simulations have.
    Contact,
    /// By emulated grippers.
    Emulated,
}

/// A row of the table.
pub(in crate::study::paper) struct Question {
    pub(super) name: &'static str,
    pub(super) preset: &'static str,
    pub(super) fixed: bool,
    pub(super) learns: Learns,
    pub(super) reads: Reads,
    /// Methods; that of the shipped model where it is judged.
    pub(super) methods: &'static [&'static str],
    /// F1 to reach after one grasp and after three, and beyond that.
    pub(super) targets: [[Option<f64>; 2]; 2],
}

const TREES: &[&str] = &["extra-trees", "geometry-trees"];
const ALL: &[&str] = &["extra-trees", "geometry-trees", "geometry-network"];
const VIRTUAL: Reads = Reads::Sensors { sensors: SensorModel::Virtual, build: 0.0 };
const PHYSICAL: Reads = Reads::Sensors { sensors: SensorModel::PhysicalLike, build: 0.0 };
const NOISY: Reads = Reads::Sensors { sensors: SensorModel::Noisy, build: 0.0 };
const ADAPTED: Reads = Reads::Sensors { sensors: SensorModel::Adapted, build: 0.0 };
const UNKNOWN: Reads = Reads::Sensors { sensors: SensorModel::Drawn, build: 1.0 };
const FIFTY: Learns = Learns::Like { of_each: 50, draws: DRAWS };

/// Grasps of grippers that are unknown in all respects.
pub(in crate::study::paper) const UNLABELLED: &str = "no labels, unknown mechanics too, B";

/// All rows.
pub(super) const QUESTIONS: [Question; 17] = [
    Question {
        name: "B free, 50 of each",
        preset: "B",
        fixed: false,
        learns: FIFTY,
        reads: VIRTUAL,
        methods: ALL,
        targets: [[Some(0.84), Some(0.97)], [Some(0.87), Some(0.98)]],
    },
    Question {
        name: "B fixed, 50 of each",
        preset: "B",
        fixed: true,
        learns: FIFTY,
        reads: VIRTUAL,
        methods: ALL,
        targets: [[Some(0.58), Some(0.83)], [Some(0.60), Some(0.85)]],
    },
    Question {
        name: "B fixed, 400 of each",
        preset: "B",
        fixed: true,
        learns: Learns::Like { of_each: LEARNED, draws: 1 },
        reads: VIRTUAL,
        methods: &["geometry-trees", "geometry-network"],
        targets: [[Some(0.72), Some(0.94)], [Some(0.76), None]],
    },
    Question {
        name: "A free, physical-like, 50 of each",
        preset: "A",
        fixed: false,
        learns: FIFTY,
        reads: PHYSICAL,
        methods: TREES,
        targets: [[Some(0.95), None], [Some(0.96), None]],
    },
    Question {
        name: "A fixed, physical-like, 50 of each",
        preset: "A",
        fixed: true,
        learns: FIFTY,
        reads: PHYSICAL,
        methods: TREES,
        targets: [[Some(0.85), None], [Some(0.88), None]],
    },
    Question {
        name: "shipped model, B free",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::PerfectSensors),
        reads: VIRTUAL,
        methods: &["geometry-network"],
        targets: [[Some(0.95), Some(0.995)], [Some(0.97), None]],
    },
    Question {
        name: "shipped model, B free, mild noise",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::PerfectSensors),
        reads: NOISY,
        methods: &["geometry-network"],
        targets: [[Some(0.90), None], [Some(0.93), None]],
    },
    Question {
        name: "shipped model, B fixed",
        preset: "B",
        fixed: true,
        learns: Learns::Shipped(Shipped::FixedObjects),
        reads: VIRTUAL,
        methods: &["geometry-network"],
        targets: [[None; 2]; 2],
    },
    Question {
        name: "no labels, physical-like B",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: ADAPTED,
        methods: &["geometry-network"],
        targets: [[Some(0.68), Some(0.90)], [Some(0.72), Some(0.93)]],
    },
    Question {
        name: "no labels, physical-like A",
        preset: "A",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: ADAPTED,
        methods: &["geometry-network"],
        targets: [[None; 2]; 2],
    },
    Question {
        name: "no labels, physical-like A, trained on A",
        preset: "A",
        fixed: false,
        learns: Learns::Drawn { of_each: 150 },
        reads: ADAPTED,
        methods: &["geometry-network"],
        targets: [[Some(0.90), None], [Some(0.93), None]],
    },
    Question {
        name: UNLABELLED,
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: UNKNOWN,
        methods: &["geometry-network"],
        targets: [[Some(0.60), Some(0.85)], [Some(0.68), Some(0.90)]],
    },
    Question {
        name: "no labels, emulated gripper, B",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: Reads::Emulated,
        methods: &["geometry-network"],
        targets: [[Some(0.70), Some(0.93)], [Some(0.75), Some(0.95)]],
    },
    Question {
        name: "control: shuffled labels, B free",
        preset: "B",
        fixed: false,
        learns: Learns::Shuffled { of_each: 50 },
        reads: VIRTUAL,
        methods: &["geometry-trees"],
        targets: [[None; 2]; 2],
    },
    Question {
        name: "control: true size and shape given, B free",
        preset: "B",
        fixed: false,
        learns: Learns::Given { of_each: 50 },
        reads: VIRTUAL,
        methods: &["geometry-trees"],
        targets: [[None; 2]; 2],
    },
    Question {
        name: "contact pressure, B free, 50 of each",
        preset: "B",
        fixed: false,
        learns: FIFTY,
        reads: Reads::Contact,
        methods: &["extra-trees"],
        targets: [[None; 2]; 2],
    },
    Question {
        name: "contact pressure, B fixed, 50 of each",
        preset: "B",
        fixed: true,
        learns: FIFTY,
        reads: Reads::Contact,
        methods: &["extra-trees"],
        targets: [[None; 2]; 2],
    },
];

/// Rows of new objects: each object in turn is taught to a model of the others; F1 of its class.
pub(super) const NEW_OBJECTS: [Question; 2] = [
    Question {
        name: "new object by its file, B free",
        preset: "B",
        fixed: false,
        learns: FIFTY,
        reads: VIRTUAL,
        methods: &["geometry-network"],
        targets: [[Some(0.80), None], [Some(0.90), None]],
    },
    Question {
        name: "new object by its file, unknown gripper",
        preset: "B",
        fixed: false,
        learns: FIFTY,
        reads: UNKNOWN,
        methods: &["geometry-network"],
        targets: [[Some(0.60), None], [Some(0.70), None]],
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
