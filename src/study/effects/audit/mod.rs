//! Audit of the rules of `auto`: in random scenes each effect is flipped, one at a time, and all are switched on at
//! once. What `auto` leaves out must not be seen by the sensors.
//!
//! A change is seen where curvature differs by more than [`SEEN`]'s or force by more than its, root mean square over the
//! trial and both fingers, and by more than twice the numerical noise: the change of the same scene at a tenth of the
//! tolerance, and after pushes of the gripper by 10 µm along each axis. Objects that slip or roll change that much by
//! themselves.
//!
//! `free-object` is left as it is: the scene says whether the object is held.

mod report;
mod scenes;

pub use report::{AuditReport, AuditRow};

use super::explanation::flipped;
use crate::frame::{
    Experiment, LinkedFigure, OWN_PHYSICS, PlainStudy, StudyCard, StudyCell, StudyCommand, StudyError, StudyReport,
    StudySize,
};
use palpate_lab::grasping::{ErrorNorms, timed_grasp};
use palpate_sim::frame::Plan;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{Effect, Scene, Setting};
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Sensors, SignalDefinition};
use scenes::{RandomScene, random_scene};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// An audit of random scenes.
pub struct EffectAudit {
    scenes: u32,
    seed: u64,
}

/// The study in the list.
pub(crate) const LISTED: PlainStudy<EffectAudit> = PlainStudy {
    card: StudyCard {
        key: "effects",
        title: "Effects that auto leaves off",
        about: "random scenes with each physical effect flipped: what the rules that switch effects on miss, and what effects cost",
        paper: OWN_PHYSICS,
    },
    of_size: |size| {
        let scenes = match size {
            StudySize::Full => EffectAudit::SCENES,
            StudySize::Quick => EffectAudit::QUICK_SCENES,
            StudySize::Sample { trials, .. } => trials as u32,
        };
        Ok(EffectAudit::new(scenes, 1))
    },
};

/// Difference of two trials: root mean squares over all samples of both fingers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectSize {
    /// Curvature (1/m).
    pub curvature_per_m: f64,
    /// Normal force (N).
    pub force_n: f64,
}

/// Differences above either of these are seen.
pub const SEEN: EffectSize = EffectSize { curvature_per_m: 0.1, force_n: 0.010 };
/// Factor on the noise.
const CLEAR_OF_NOISE: f64 = 2.0;
/// Push of the gripper that shows the noise (m).
const PUSH: f64 = 1e-5;

impl EffectSize {
    fn between(one: &SimulatedTrial, other: &SimulatedTrial, sensors: &Sensors) -> Self {
        let norms = ErrorNorms::between(one, other, sensors);
        Self { curvature_per_m: norms.curvature_per_m, force_n: norms.force_n }
    }

    fn larger(self, other: Self) -> Self {
        Self {
            curvature_per_m: self.curvature_per_m.max(other.curvature_per_m),
            force_n: self.force_n.max(other.force_n),
        }
    }

    /// Size as a multiple of a visible change.
    pub fn of_seen(&self) -> f64 {
        (self.curvature_per_m / SEEN.curvature_per_m).max(self.force_n / SEEN.force_n)
    }

    /// True where it is seen in a scene with this `noise`.
    pub fn is_seen(&self, noise: Self) -> bool {
        let clear = |size: f64, seen: f64, noise: f64| size > seen && size > CLEAR_OF_NOISE * noise;
        clear(self.curvature_per_m, SEEN.curvature_per_m, noise.curvature_per_m)
            || clear(self.force_n, SEEN.force_n, noise.force_n)
    }
}

/// A random scene with each effect flipped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AuditedScene {
    /// Settings that make it, for `--set`.
    pub settings: Vec<String>,
    /// Numerical noise.
    pub noise: EffectSize,
    /// Change with all effects on.
    pub all_on: EffectSize,
    /// Effects, in the order of [`Effect::ALL`].
    pub effects: Vec<AuditedEffect>,
}

/// An effect in a random scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AuditedEffect {
    pub name: String,
    /// Decision of `auto`.
    pub on: bool,
    /// Number of its rule.
    pub number: f64,
    /// Change when it is flipped.
    pub change: EffectSize,
    /// CPU time with it over that without it; absent where it is not possible.
    pub cost: Option<f64>,
}

/// A random scene by its number.
#[derive(Clone, Copy)]
pub struct SceneNumber(u32);

impl StudyCell for SceneNumber {
    fn name(&self) -> String {
        format!("scene {:04}", self.0)
    }
}

impl EffectAudit {
    /// Random scenes of the full form.
    pub const SCENES: u32 = 500;
    /// Scenes of the quick form.
    pub const QUICK_SCENES: u32 = 40;

    /// An audit of so many random scenes of a seed.
    pub fn new(scenes: u32, seed: u64) -> Self {
        Self { scenes, seed }
    }
}

impl Experiment for EffectAudit {
    type Cell = SceneNumber;
    type Found = AuditedScene;
    type Report = AuditReport;

    fn key(&self) -> &'static str {
        LISTED.card.key
    }

    /// More scenes of the same seed continue from fewer.
    fn header(&self) -> serde_json::Value {
        self.seed.into()
    }

    fn command(&self) -> StudyCommand {
        StudyCommand::new(self.key())
            .option("scenes", (self.scenes != Self::SCENES).then_some(self.scenes))
            .option("seed", (self.seed != 1).then_some(self.seed))
    }

    fn grid(&self) -> Vec<SceneNumber> {
        (0..self.scenes).map(SceneNumber).collect()
    }

    fn measure(&self, SceneNumber(number): &SceneNumber, stop: &AtomicBool) -> Result<AuditedScene, StudyError> {
        audit_one(&random_scene(self.seed, *number)?, stop).ok_or(StudyError::Stopped)
    }

    fn report(&self, found: Vec<(SceneNumber, AuditedScene)>) -> AuditReport {
        AuditReport::new(found.iter().map(|(_, scene)| scene))
    }

    fn shown(report: &AuditReport) -> StudyReport {
        report.shown()
    }

    fn figures(report: &AuditReport) -> Vec<LinkedFigure> {
        vec![report.figure()]
    }
}

fn audit_one(drawn: &RandomScene, cancelled: &AtomicBool) -> Option<AuditedScene> {
    let RandomScene { scene, object, settings } = drawn;
    let object = object.as_ref();
    let sensors = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Contact);
    let stopped = || cancelled.load(Ordering::Relaxed);
    let (base, cpu_s) = timed_grasp(scene, object, &stopped)?;
    let change = |other: &Scene, object: Option<&ObjectModel>| {
        let (trial, cpu_s) = timed_grasp(other, object, &stopped)?;
        Some((EffectSize::between(&trial, &base, &sensors), cpu_s))
    };
    let mut refined = scene.clone();
    refined.solver = scene.solver.refined();
    let mut noise = change(&refined, object)?.0;
    for axis in 0..3 {
        let mut pushed = scene.clone();
        pushed.gripper.mount.offset[axis] += PUSH;
        noise = noise.larger(change(&pushed, object)?.0);
    }
    let plan = &base.data.plan;
    let all_on = change(&everything_on(scene, plan), object)?.0;
    let flip = |effect: &Effect| {
        let planned = plan.effects.iter().find(|planned| planned.name == effect.name())?;
        let mut audited = AuditedEffect {
            name: planned.name.clone(),
            on: planned.on,
            number: planned.number,
            change: EffectSize::default(),
            cost: None,
        };
        // A number of zero: the effect has nothing to act on, and changes nothing.
        if *effect != Effect::FreeObject && planned.number > 0.0 {
            let (change, other_s) = change(&flipped(scene, plan, *effect), object)?;
            audited.change = change;
            audited.cost = Some(if planned.on { cpu_s / other_s } else { other_s / cpu_s });
        }
        Some(audited)
    };
    let effects = Effect::ALL.iter().map(flip).collect::<Option<Vec<_>>>()?;
    Some(AuditedScene { settings: settings.clone(), noise, all_on, effects })
}

/// Scene with every effect on that is possible.
fn everything_on(scene: &Scene, plan: &Plan) -> Scene {
    let mut scene = scene.clone();
    for effect in Effect::ALL.iter().filter(|effect| **effect != Effect::FreeObject && !plan.is_on(effect.name())) {
        scene.effects.set(*effect, Setting::On);
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    type TestResult = Result<(), Box<dyn std::error::Error>>;

    #[test]
    fn changes_count_where_they_are_seen_and_clear_of_noise() {
        let size = |curvature_per_m, force_n| EffectSize { curvature_per_m, force_n };
        let quiet = EffectSize::default();
        assert!(size(0.11, 0.0).is_seen(quiet) && size(0.0, 0.011).is_seen(quiet));
        assert!(!size(0.09, 0.009).is_seen(quiet));
        assert!(!size(0.5, 0.0).is_seen(size(0.3, 0.0)) && size(0.5, 0.02).is_seen(size(0.3, 0.0)));
        assert_eq!(size(0.05, 0.02).of_seen(), 2.0);
    }

    #[test]
    fn an_audit_repeats_and_flips_every_possible_effect() -> TestResult {
        let (audit, stop) = (EffectAudit::new(3, 5), AtomicBool::new(false));
        let audited = || audit.grid().iter().map(|cell| audit.measure(cell, &stop)).collect::<Result<Vec<_>, _>>();
        for (scene, again) in audited()?.iter().zip(&audited()?) {
            assert_eq!((scene.noise, scene.all_on), (again.noise, again.all_on));
            assert_eq!(scene.effects.len(), Effect::ALL.len());
            let flipped = scene.effects.iter().filter(|effect| effect.cost.is_some()).count();
            assert!(flipped >= 4, "{scene:?}");
            assert!(scene.effects.iter().all(|effect| effect.number > 0.0 || effect.change == EffectSize::default()));
            // The settings are what a user needs to see the scene.
            let made = Scene::default().with_settings(&scene.settings)?;
            assert!(made.load_object()?.is_none() || made.object.source != "empty");
        }
        Ok(())
    }
}
