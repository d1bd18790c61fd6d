//! The hard cases: one line each, with a measuring function in one of the submodules.

mod contact;
mod fingers;
mod holds;
mod motion;
mod program;

use super::{Case, CaseAccuracy, Settings};
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::{Drive, SteppedScene};
use palpate_sim::scene::{Scene, SupportKind};

/// Every accuracy, no further steps.
const EVERY: Settings = Settings::EveryAccuracyAnd(&[]);
/// Further step lengths of the hard-contact cases (s).
const WIDE: Settings = Settings::EveryAccuracyAnd(&[0.02, 2e-5]);

/// All hard cases.
pub const CASES: &[Case] = &[
    Case {
        name: "stiff joints",
        claim: "k x 1e3 .. 1e6 without damping: every joint bends by tau / k within 0.1 %",
        settings: Settings::EveryAccuracyAnd(&[0.1]),
        measure: fingers::stiff_joints,
    },
    Case {
        name: "twentyfold actuation",
        claim: "a step to 20 times the torque and back: joint limits hold",
        settings: Settings::EveryAccuracyAnd(&[0.05]),
        measure: fingers::twentyfold_actuation,
    },
    Case {
        name: "passive swing",
        claim: "bent and released without damping, against a ball: no energy is gained",
        settings: EVERY,
        measure: fingers::passive_swing,
    },
    Case {
        name: "plate edges",
        claim: "undamped fingertips swing against the edges of a thin plate: no energy is gained",
        settings: EVERY,
        measure: fingers::plate_edges,
    },
    Case {
        name: "clapping fingers",
        claim: "undamped fingers swing against each other: no energy is gained",
        settings: EVERY,
        measure: fingers::clapping,
    },
    Case {
        name: "dragged edge",
        claim: "an edge and a corner of a cube pass over an undamped fingertip: no energy is gained",
        settings: EVERY,
        measure: contact::dragged_edge,
    },
    Case {
        name: "explicit step",
        claim: "for comparison: diverges beyond 2 / omega_max, which is reported; the convex step does not",
        settings: Settings::Once,
        measure: fingers::explicit_step,
    },
    Case {
        name: "soft sideways",
        claim: "a hundredth of a solid finger's stiffness sideways and in twist, around 1 g .. 10 kg: no energy is gained, the \
                pad keeps its bottom",
        settings: EVERY,
        measure: contact::soft_sideways,
    },
    Case {
        name: "squeezed masses",
        claim: "0.1 g .. 100 kg squeezed and pulled at: no creep, no ejection, the pad keeps its bottom",
        settings: EVERY,
        measure: contact::squeezed_masses,
    },
    Case {
        name: "light, stiff and sticky",
        claim: "E x 1000, 1 g, mu = 5, one-step actuation: the same resting place at every step",
        settings: WIDE,
        measure: contact::light_stiff_sticky,
    },
    Case {
        name: "initial overlap",
        claim: "an object that starts 10 mm inside a finger leaves no faster than the stored energy allows",
        settings: WIDE,
        measure: contact::initial_overlap,
    },
    Case {
        name: "thrown object",
        claim: "a ball thrown at a finger, up to 60 mm per step: it is not passed through, and no energy is gained",
        settings: Settings::EveryAccuracyAnd(&[0.02]),
        measure: contact::thrown_object,
    },
    Case {
        name: "friction extremes",
        claim: "mu = 0: no friction; mu = 0.5 and 5: friction stays in its cone",
        settings: EVERY,
        measure: contact::friction_extremes,
    },
    Case {
        name: "thin things",
        claim: "a 1 mm plate, a card edge-on and needles are touched and not crossed",
        settings: Settings::EveryAccuracyAnd(&[0.02]),
        measure: contact::thin_things,
    },
    Case {
        name: "crushing torque",
        claim: "k and tau x 1000 against a fixed ball: the pad is not pushed through",
        settings: EVERY,
        measure: contact::crushing_torque,
    },
    Case {
        name: "resting masses",
        claim: "0.1 g .. 100 kg on the pedestal, pulled at as on a slope, sink as far as set in the scene and do not creep",
        settings: EVERY,
        measure: motion::resting_masses,
    },
    Case {
        name: "grazing holds",
        claim: "thin objects lying down, edges, corners, pedestal rim and fingertips met sideways: the hold comes to rest",
        settings: EVERY,
        measure: holds::grazing_holds,
    },
    Case {
        name: "long hold",
        claim: "ten minutes of hold: no drift, energy bounded",
        settings: EVERY,
        measure: motion::long_hold,
    },
    Case {
        name: "free flight",
        claim: "ten minutes of flight, spinning up to half a turn per step: momentum kept, spin bounded",
        settings: EVERY,
        measure: motion::free_flight,
    },
    Case {
        name: "same bytes",
        claim: "the same scene in one thread and in two, in either order: identical frames",
        settings: EVERY,
        measure: program::same_bytes,
    },
    Case {
        name: "invalid numbers",
        claim: "NaN and infinity are refused under every key of a scene, and the error names the key",
        settings: Settings::Once,
        measure: program::invalid_numbers,
    },
];

/// No gravity, no support.
fn bare(joints: usize) -> Scene {
    let mut scene = Scene::default();
    scene.world.gravity = 0.0;
    scene.support.kind = SupportKind::None;
    scene.gripper.finger.joints = joints;
    scene
}

fn torque(torque: f64) -> Drive {
    Drive { torque, ..Drive::default() }
}

/// Torque of the default finger at 1 bar (N m).
const FULL_TORQUE: f64 = 0.06;

/// A scene about to be stepped under the conditions of a case.
fn stepped(scene: &Scene, object: Option<&ObjectModel>, conditions: &super::Conditions) -> SteppedScene {
    match conditions.setting {
        CaseAccuracy::Accuracy(accuracy) => SteppedScene::at(scene, object, conditions.h(), accuracy),
        CaseAccuracy::Step(h) => SteppedScene::new(scene, object, h),
    }
}
