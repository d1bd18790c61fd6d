//! Physical effects: one file per effect, one line each in [`rule_of`].
//!
//! An effect that is left to `auto` is decided once, when the scene is built: it is on where it is possible at all and
//! one dimensionless number, defined by the effect's rule, lies above a threshold. The decision and
//! why is the [`Plan`], which is stored with the trial. A step reads only what the plan has made of the model; an
//! effect that is off costs it nothing and leaves no trace.
//!
//! To add an effect: its name in `scene/effects.rs`, its file here, its line below. What it does to a step it does from
//! its own file, with the step length h as it comes.

mod creep;
mod finger_contact;
mod finger_gravity;
mod finger_inertia;
mod free_object;
mod friction;
mod object_gravity;
mod out_of_plane;
mod pneumatic_lag;
mod shaking;
mod situation;
mod soft_object;
mod support;

pub(super) use creep::Relaxation;
pub(super) use finger_contact::FingerContact;
pub(super) use pneumatic_lag::{Chamber, continued};
pub(super) use shaking::{move_world, note_passing, work_of_motion};
use situation::Situation;
pub(super) use soft_object::Shell;

use super::placement::Placement;
use crate::frame::{Plan, PlannedEffect};
use crate::objects::ObjectModel;
use crate::scene::{Effect, Scene, Setting};

/// Rule that decides whether an effect is simulated.
pub struct Rule {
    /// Description, one sentence.
    pub about: &'static str,
    /// Definition of its number as a ratio.
    pub number: &'static str,
    /// `auto` means on where the number is above this.
    pub threshold: f64,
    /// Evaluation for a scene.
    ruling: fn(&Situation<'_>) -> Ruling,
}

/// Evaluation of an effect for a scene.
struct Ruling {
    /// True where the effect can occur at all.
    possible: bool,
    /// Dimensionless number that is compared with the threshold.
    number: f64,
    /// The facts, with numbers.
    facts: String,
}

/// The registry: one line per effect.
pub fn rule_of(effect: Effect) -> &'static Rule {
    match effect {
        Effect::FreeObject => &free_object::RULE,
        Effect::FingerGravity => &finger_gravity::RULE,
        Effect::ObjectGravity => &object_gravity::RULE,
        Effect::Support => &support::RULE,
        Effect::Friction => &friction::RULE,
        Effect::FingerInertia => &finger_inertia::RULE,
        Effect::FingerContact => &finger_contact::RULE,
        Effect::PneumaticLag => &pneumatic_lag::RULE,
        Effect::Creep => &creep::RULE,
        Effect::Shaking => &shaking::RULE,
        Effect::SoftObject => &soft_object::RULE,
        Effect::OutOfPlane => &out_of_plane::RULE,
    }
}

/// Decides which effects a scene calls for.
pub fn plan(scene: &Scene, object: Option<&ObjectModel>, placement: &Placement) -> Plan {
    plan_of(Effect::ALL, scene, object, placement)
}

/// A plan that knows only the given effects.
pub(super) fn plan_of(effects: &[Effect], scene: &Scene, object: Option<&ObjectModel>, placement: &Placement) -> Plan {
    let situation = Situation { scene, object, placement };
    Plan { effects: effects.iter().map(|effect| planned(*effect, &situation)).collect() }
}

fn planned(effect: Effect, situation: &Situation<'_>) -> PlannedEffect {
    let rule = rule_of(effect);
    let Ruling { possible, number, facts } = (rule.ruling)(situation);
    let called_for = possible && number > rule.threshold;
    let setting = situation.scene.effects.get(effect);
    let on = match setting {
        Setting::Off => false,
        Setting::Auto => called_for,
        Setting::On => true,
    };
    let reason = if setting == Setting::Auto || on == called_for {
        facts
    } else {
        format!("set to {} in the scene; {facts}", setting.name())
    };
    let (name, setting) = (effect.name().to_owned(), setting.name().to_owned());
    PlannedEffect { name, setting, on, number, threshold: rule.threshold, reason }
}

/// Upper bound of a ratio: a stored number has to be finite.
const LARGEST_NUMBER: f64 = 1e9;

/// a / b for two sizes that are not negative, finite whatever b is.
fn ratio(a: f64, b: f64) -> f64 {
    if a <= 0.0 { 0.0 } else { (a / b).min(LARGEST_NUMBER) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_finite() {
        assert_eq!((ratio(0.0, 0.0), ratio(1.0, 0.0), ratio(1.0, 4.0)), (0.0, LARGEST_NUMBER, 0.25));
    }

    #[test]
    fn the_setting_overrules_the_number_and_the_plan_gives_the_reason() {
        let mut scene = Scene::default();
        let made = |scene: &Scene| {
            let plan = plan(scene, None, &Placement::new(scene, None));
            assert_eq!(plan.effects.len(), Effect::ALL.len());
            plan.effects.into_iter().find(|e| e.name == "finger-gravity").expect("registered")
        };
        let auto = made(&scene);
        assert!(auto.on && auto.number > auto.threshold && !auto.reason.contains("set to"), "{auto:?}");
        scene.effects.set(Effect::FingerGravity, Setting::Off);
        let off = made(&scene);
        assert!(!off.on && off.number == auto.number && off.reason.contains("set to off"), "{off:?}");
        scene.effects.set(Effect::FingerGravity, Setting::On);
        assert_eq!(made(&scene).reason, auto.reason, "a setting that changes nothing is not mentioned");
    }

    #[test]
    fn every_effect_is_described_with_its_numbers() {
        for effect in Effect::ALL {
            let rule = rule_of(*effect);
            assert!(rule.about.ends_with('.') && rule.number.contains('/'), "{}", effect.name());
            assert!(rule.threshold >= 0.0 && rule.threshold.is_finite());
        }
        let scene = Scene::default();
        for effect in plan(&scene, None, &Placement::new(&scene, None)).effects {
            assert!(effect.number.is_finite() && effect.reason.len() > 10, "{effect:?}");
        }
    }
}
