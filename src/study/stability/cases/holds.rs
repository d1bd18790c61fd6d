//! Whole grasps whose hold must come to rest.

use super::super::{CaseAccuracy, Conditions, Findings, Measurement};
use palpate_sim::gripper::{Phase, Side};
use palpate_sim::physics::NotFinite;
use palpate_sim::poses::PoseSampler;
use palpate_sim::run::SimRun;
use palpate_sim::scene::{PosePreset, Scene};

/// Built-in object, pose preset, and seed of a grasp in which contact springs meet something sideways. Each kept a
/// model whose springs give way along their axis alone from coming to rest, at draft or at standard.
type Graze = (&'static str, &'static str, u64);

/// The first few graze in different ways.
const GRAZES: [Graze; 14] = [
    ("syringe", "B", 14),     // fingertip at the pedestal's rim
    ("smallbutton", "A", 12), // thin, between the tips
    ("labello", "A", 24),     // its end
    ("button", "B", 67),      // lying, its edge
    ("case", "M", 100),       // a corner, and the other finger
    ("syringe", "B", 62),
    ("syringe", "A", 46),
    ("smallbutton", "A", 76),
    ("smallbutton", "M", 108),
    ("button", "B", 195),
    ("button", "M", 51),
    ("button", "M", 163),
    ("labello", "M", 168),
    ("smallbutton", "M", 140),
];

/// Changes of force in the settled hold, and the torque that nothing balances at its end.
pub(super) fn grazing_holds(conditions: &Conditions) -> Findings {
    let mut findings = Vec::new();
    for (name, preset, seed) in conditions.some_of(&GRAZES, 5) {
        let mut scene = Scene::default();
        (*name).clone_into(&mut scene.object.source);
        scene.pose = PosePreset::named(preset).map(|preset| preset.poses()).unwrap_or_default();
        let object = scene.load_object().ok().flatten();
        let (mut scene, _) = PoseSampler::new(&scene, object.as_ref()).draw(object.as_ref(), *seed);
        if let CaseAccuracy::Accuracy(accuracy) = conditions.setting {
            scene.solver.accuracy = accuracy;
        }
        let (mut run, _) = SimRun::new(&scene, object.as_ref());
        let frames = run.run_programme(&scene.programme).map_err(|error| NotFinite { body: error.cause.body })?;
        let taxels = scene.gripper.taxels().count();
        let felt = |side: &Side| frames.iter().any(|f| f.phase == Phase::Hold && f.normal_force(*side, taxels) > 0.01);
        let quality = run.quality();
        let what = |what: &str| format!("{name} in preset {preset}, seed {seed}: {what}");
        let touched = f64::from(u8::from(Side::BOTH.iter().any(felt)));
        findings.push(Measurement::at_least(what("touched (1 or 0)"), touched, 1.0));
        findings.push(Measurement::at_most(what("changes of force"), f64::from(quality.hold_changes), 4.0));
        findings.push(Measurement::at_most(what("static residual"), quality.static_residual, 0.1));
    }
    Ok(findings)
}
