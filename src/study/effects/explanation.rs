//! Cost and influence of each effect, from whole trials with the effect on and off.
//!
//! Effects are flipped one at a time, as a user would: effects at `auto` are decided again, so that, for example, an
//! object that is no longer fixed has weight. Cost comes from pairs of runs, with and without the effect, one after the
//! other in one thread. The fastest of each kind counts, because other load on the machine only adds time. Differences
//! are taken over all samples and both fingers.

use crate::frame::Measuring;
use palpate_geometry::units::three_digits;
use palpate_lab::grasping::{ErrorNorms, GraspSummary, timed_grasp};
use palpate_sim::frame::{Plan, PlannedEffect};
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::effects::rule_of;
use palpate_sim::scene::{Effect, Scene, Setting};
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Sensors, SignalDefinition};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use serde::Serialize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Effects of a scene, with their cost and influence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// Name of the object.
    pub object: String,
    /// CPU time of the trial with the scene unchanged (ms).
    pub cpu_ms: f64,
    /// Time of first contact (s); null without contact.
    pub contact_onset_s: Option<f64>,
    /// Remarks on the trial.
    pub warnings: Vec<String>,
    /// All effects, in the order of [`Effect::ALL`].
    pub effects: Vec<ExplainedEffect>,
}

/// Decision, cost and influence of one effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExplainedEffect {
    /// Decision of the plan.
    #[serde(flatten)]
    pub planned: PlannedEffect,
    /// Description, one sentence.
    pub about: &'static str,
    /// Definition of its dimensionless number.
    pub number_is: &'static str,
    /// Cost if the effect is on, otherwise cost of switching it on, as a share of the trial's CPU time.
    pub cost_share: f64,
    /// Change of the trial when the effect is flipped.
    pub change: EffectChange,
}

/// Differences between two trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EffectChange {
    /// Differences of the sensor values.
    #[serde(flatten)]
    pub norms: ErrorNorms,
    /// Time of first contact in the other trial (s); null without contact.
    pub contact_onset_s: Option<f64>,
    /// Delay of first contact in the other trial (ms), in whole samples; null unless both have contact.
    pub onset_ms: Option<f64>,
}

impl ExplainedEffect {
    /// True where a grasp is cheaper with it.
    pub fn is_saving(&self) -> bool {
        self.cost_share <= -NOISE
    }

    /// Describes the cost.
    pub fn cost_in_words(&self) -> String {
        let costs = if self.planned.on { "costs" } else { "would cost" };
        let percent = 100.0 * self.cost_share;
        if self.cost_share.abs() < NOISE {
            format!("{costs} less than {:.0} % of the CPU time", 100.0 * NOISE)
        } else if percent > 0.0 {
            format!("{costs} {percent:.0} % of the CPU time")
        } else if self.planned.on {
            // Without friction, for example, an object rolls and needs more solver steps.
            format!("saves: without it a grasp takes {:.1} times the CPU time", 1.0 - self.cost_share)
        } else {
            format!("would save {:.0} % of the CPU time", -percent)
        }
    }

    /// Describes the change, given the time of first contact in this trial (s).
    pub fn change_in_words(&self, onset_here: Option<f64>) -> String {
        let change = &self.change;
        let how = if self.planned.on { "without it" } else { "with it" };
        if change.norms.curvature_per_m == 0.0 && change.norms.force_n == 0.0 && change.contact_onset_s == onset_here {
            return format!("no change {how}");
        }
        let part = |name: &str, value: f64, unit: &str, share: f64| {
            format!("{name} {} {unit} ({} %)", three_digits(value), three_digits(100.0 * share))
        };
        let onset = match (change.onset_ms, change.contact_onset_s) {
            (Some(ms), _) => format!("onset {ms:+.0} ms"),
            (None, Some(t)) => format!("onset at {t:.2} s"),
            (None, None) if onset_here.is_some() => "no contact".to_owned(),
            (None, None) => "no contact either way".to_owned(),
        };
        let curvature = part("curvature", change.norms.curvature_per_m, "1/m", change.norms.curvature_share);
        let pressure = part("contact pressure", change.norms.pressure_pa * 1e-3, "kPa", change.norms.pressure_share);
        let force = part("force", change.norms.force_n, "N", change.norms.force_share);
        format!("{how}: {curvature}, {pressure}, {force}, {onset}")
    }
}

/// Number of timed pairs of runs. Long trials are timed once, because they average over enough steps.
const PAIRS: usize = 5;
/// Share of CPU time below which a cost is noise on a busy machine.
const NOISE: f64 = 0.03;
/// Duration above which a trial counts as long (s).
const LONG: f64 = 10.0;

/// Explains every effect of a scene; `None` when cancelled.
pub fn explain_effects(scene: &Scene, object: Option<&ObjectModel>, how: &Measuring<'_>) -> Option<Explanation> {
    let stopped = || how.cancelled.load(Ordering::Relaxed);
    let (base, cpu_s) = timed_grasp(scene, object, &stopped)?;
    let base = GraspOutcome::new(scene, base);
    let done = AtomicUsize::new(0);
    how.measured(0, Effect::ALL.len());
    let one = |effect: &Effect| {
        let explained = explain_one(scene, object, &base, *effect, &stopped)?;
        how.measured(done.fetch_add(1, Ordering::Relaxed) + 1, Effect::ALL.len());
        Some(explained)
    };
    let all = || Effect::ALL.par_iter().map(one).collect::<Option<Vec<ExplainedEffect>>>();
    // Falls back to rayon's global pool if no threads can be started.
    let effects = match rayon::ThreadPoolBuilder::new().num_threads(how.threads.max(1)).build() {
        Ok(pool) => pool.install(all),
        Err(_none) => all(),
    }?;
    Some(Explanation {
        object: base.trial.header.object.clone(),
        cpu_ms: cpu_s * 1e3,
        contact_onset_s: base.onset_s,
        warnings: base.trial.header.warnings.clone(),
        effects,
    })
}

fn explain_one(
    scene: &Scene,
    object: Option<&ObjectModel>,
    base: &GraspOutcome,
    effect: Effect,
    stopped: &dyn Fn() -> bool,
) -> Option<ExplainedEffect> {
    let plan = &base.trial.data.plan;
    let planned = plan.effects.iter().find(|planned| planned.name == effect.name())?.clone();
    let other_scene = flipped(scene, plan, effect);
    let pairs = if scene.timing.duration_s > LONG { 1 } else { PAIRS };
    let (mut here, mut there) = (f64::INFINITY, f64::INFINITY);
    let mut other = None;
    for _ in 0..pairs {
        here = here.min(timed_grasp(scene, object, stopped)?.1);
        let (trial, seconds) = timed_grasp(&other_scene, object, stopped)?;
        there = there.min(seconds);
        other = Some(trial);
    }
    let sign = if planned.on { 1.0 } else { -1.0 };
    let rule = rule_of(effect);
    Some(ExplainedEffect {
        about: rule.about,
        number_is: rule.number,
        cost_share: sign * (here - there) / here,
        change: base.change_to(&GraspOutcome::new(&other_scene, other?), scene),
        planned,
    })
}

/// Scene with one effect flipped.
pub(super) fn flipped(scene: &Scene, plan: &Plan, effect: Effect) -> Scene {
    let mut scene = scene.clone();
    scene.effects.set(effect, if plan.is_on(effect.name()) { Setting::Off } else { Setting::On });
    scene
}

/// Trial with the time of its first contact (s).
struct GraspOutcome {
    trial: SimulatedTrial,
    onset_s: Option<f64>,
}

impl GraspOutcome {
    fn new(scene: &Scene, trial: SimulatedTrial) -> Self {
        Self { onset_s: GraspSummary::new(&trial, scene).contact_onset_s, trial }
    }

    /// Change from this trial to another, both read by the sensors of `scene`.
    fn change_to(&self, other: &Self, scene: &Scene) -> EffectChange {
        let sensors = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Contact);
        let both = self.onset_s.zip(other.onset_s);
        EffectChange {
            norms: ErrorNorms::between(&other.trial, &self.trial, &sensors),
            contact_onset_s: other.onset_s,
            onset_ms: both.map(|(here, there)| (there - here) * 1e3),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;
    use palpate_sim::scene::Accuracy;
    use std::sync::atomic::AtomicBool;

    fn explained(scene: &Scene, object: Option<&ObjectModel>) -> Explanation {
        let how = Measuring { threads: 2, cancelled: &AtomicBool::new(false), progress: &|_| {} };
        let explanation = explain_effects(scene, object, &how).expect("not cancelled");
        assert_eq!(explanation.effects.len(), Effect::ALL.len());
        explanation
    }

    fn ball(radius: f64, density: f64) -> ObjectModel {
        ObjectModel::from_primitive("ball", Primitive::Sphere { radius }, density, 0.6)
    }

    fn draft() -> Scene {
        let mut scene = Scene::default();
        scene.solver.accuracy = Accuracy::Draft;
        scene
    }

    impl Explanation {
        fn of(&self, effect: Effect) -> &ExplainedEffect {
            self.effects.iter().find(|e| e.planned.name == effect.name()).expect("all are explained")
        }

        fn names_on(&self) -> Vec<&str> {
            self.effects.iter().filter(|e| e.planned.on).map(|e| e.planned.name.as_str()).collect()
        }
    }

    #[test]
    fn a_fixed_sphere_calls_for_fingers_and_friction_alone() {
        let mut scene = draft();
        scene.object.fixed = true;
        let report = explained(&scene, Some(&ball(0.025, 400.0)));
        assert_eq!(report.names_on(), ["finger-gravity", "friction", "finger-inertia"]);
        assert!(report.of(Effect::FreeObject).planned.reason.contains("fixed"));
        for effect in [Effect::FingerGravity, Effect::Friction, Effect::FingerInertia] {
            assert!(report.of(effect).change.norms.curvature_per_m > 1e-3, "{effect:?} {:?}", report.of(effect).change);
        }
        // Effects that are off have no influence: no finger comes near the pedestal or the other finger.
        for effect in [Effect::ObjectGravity, Effect::Support, Effect::FingerContact, Effect::PneumaticLag] {
            assert_eq!(report.of(effect).change.norms.curvature_per_m, 0.0, "{effect:?}");
            assert_eq!(report.of(effect).change.norms.force_n, 0.0, "{effect:?}");
        }
    }

    #[test]
    fn support_and_friction_matter_to_a_light_free_ball_but_hardly_its_weight() {
        let report = explained(&draft(), Some(&ball(0.020, 0.2)));
        let on = ["free-object", "finger-gravity", "support", "friction", "finger-inertia"];
        assert_eq!(report.names_on(), on, "{:#?}", report.effects);
        let weight = report.of(Effect::ObjectGravity);
        assert!(
            weight.planned.number < weight.planned.threshold && weight.change.norms.curvature_share < 0.01,
            "{weight:?}"
        );
        assert!(report.of(Effect::Friction).change.norms.force_share > weight.change.norms.force_share);
        // Weight matters for a heavy object.
        let heavy = explained(&draft(), Some(&ball(0.020, 4000.0)));
        assert!(
            heavy.of(Effect::ObjectGravity).planned.on && heavy.of(Effect::ObjectGravity).change.norms.force_n > 1e-3
        );
    }

    #[test]
    fn an_empty_hand_calls_for_its_fingers_to_meet() {
        let report = explained(&draft(), None);
        assert_eq!(report.names_on(), ["finger-gravity", "friction", "finger-inertia", "finger-contact"]);
        let contact = report.of(Effect::FingerContact);
        assert!(
            contact.change.norms.curvature_share > 0.05 && contact.change.norms.force_share > 0.3,
            "{:?}",
            contact.change
        );
        assert!(report.contact_onset_s.is_some() && contact.change.contact_onset_s.is_none());
        assert_eq!(report.of(Effect::FreeObject).change.norms.curvature_per_m, 0.0);
    }

    #[test]
    fn a_long_hold_calls_for_creep() {
        let mut scene = draft();
        scene.object.fixed = true;
        (scene.programme.hold_ticks, scene.timing.duration_s) = (200, 23.0);
        scene.gripper.finger.creep_time = 5.0;
        let report = explained(&scene, Some(&ball(0.025, 400.0)));
        let creep = report.of(Effect::Creep);
        // A tenth of the stiffness, of which 21 s under load relax nearly all in 5 s.
        let relaxed = 0.1 * (1.0 - f64::exp(-21.0 / 5.0));
        assert!(creep.planned.on && (creep.planned.number - relaxed).abs() < 1e-12, "{:?}", creep.planned);
        assert!(
            creep.change.norms.force_share > 0.01 && creep.change.norms.curvature_share > 0.005,
            "{:?}",
            creep.change
        );
        let mut short = draft();
        short.object.fixed = true;
        let short = explained(&short, Some(&ball(0.025, 400.0)));
        let unnoticed = short.of(Effect::Creep);
        assert!(!unnoticed.planned.on && unnoticed.change.norms.force_share < 0.2 * creep.change.norms.force_share);
    }

    #[test]
    fn the_reported_change_is_that_of_switching_the_effect() {
        let (mut scene, ball) = (draft(), ball(0.020, 400.0));
        scene.object.fixed = true;
        let report = explained(&scene, Some(&ball));
        let free = GraspOutcome::new(&scene, palpate_lab::grasping::grasp(&draft(), Some(&ball), 0));
        let held = GraspOutcome::new(&scene, palpate_lab::grasping::grasp(&scene, Some(&ball), 0));
        // An object that is no longer fixed has weight, and comes to rest.
        let expected = held.change_to(&free, &scene);
        assert_eq!(report.of(Effect::FreeObject).change, expected);
        assert!(expected.norms.force_n > 1e-3);
    }

    #[test]
    fn cancelling_gives_no_result() {
        let how = Measuring { threads: 1, cancelled: &AtomicBool::new(true), progress: &|_| {} };
        assert_eq!(explain_effects(&draft(), None, &how), None);
    }
}
