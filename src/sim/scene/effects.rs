//! `[effects]`: settings of the physical effects. Each is `off`, `auto` or `on`; `auto` is decided in
//! [`crate::physics::effects`], from the rest of the scene.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Setting of an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Setting {
    /// Never.
    Off,
    /// On where the scene calls for it.
    #[default]
    Auto,
    /// Always.
    On,
}

impl Setting {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Off, Self::Auto, Self::On];

    /// The name used in files and on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Auto => "auto",
            Self::On => "on",
        }
    }
}

/// Makes the list below into an enum, its names and their order.
macro_rules! effects {
    ($($(#[$doc:meta])* $effect:ident = $name:literal,)*) => {
        /// An effect that can be left out.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum Effect {
            $($(#[$doc])* #[serde(rename = $name)] $effect,)*
        }

        impl Effect {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$effect,)*];

            /// The name used in files and on screen.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$effect => $name,)*
                }
            }
        }
    };
}

// The one list of names. The compiler asks for the rest of a new one: its file in physics/effects, and its line there.
effects! {
    /// The object moves, instead of being held in place.
    FreeObject = "free-object",
    /// Weight of the fingers.
    FingerGravity = "finger-gravity",
    /// Weight of the object.
    ObjectGravity = "object-gravity",
    /// Table and pedestal, against fingers and object.
    Support = "support",
    /// Friction wherever things touch.
    Friction = "friction",
    /// Inertia of the fingers; without it they move from balance to balance.
    FingerInertia = "finger-inertia",
    /// The fingers against each other.
    FingerContact = "finger-contact",
    /// Chambers that take time to fill.
    PneumaticLag = "pneumatic-lag",
    /// Joints that yield slowly under load.
    Creep = "creep",
    /// A hand that lifts and shakes what it holds.
    Shaking = "shaking",
    /// An object whose surface gives way.
    SoftObject = "soft-object",
    /// Fingers that bend sideways and twist.
    OutOfPlane = "out-of-plane",
}

/// The setting of every effect; all `auto` by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "BTreeMap<Effect, Setting>", into = "BTreeMap<Effect, Setting>")]
pub struct EffectSettings([Setting; Effect::ALL.len()]);

impl EffectSettings {
    /// The setting of one effect.
    pub fn get(&self, effect: Effect) -> Setting {
        self.0[effect as usize]
    }

    /// Sets one effect.
    pub fn set(&mut self, effect: Effect, setting: Setting) {
        self.0[effect as usize] = setting;
    }
}

impl From<BTreeMap<Effect, Setting>> for EffectSettings {
    fn from(written: BTreeMap<Effect, Setting>) -> Self {
        let mut settings = Self::default();
        for (effect, setting) in written {
            settings.set(effect, setting);
        }
        settings
    }
}

impl From<EffectSettings> for BTreeMap<Effect, Setting> {
    fn from(settings: EffectSettings) -> Self {
        Effect::ALL.iter().map(|effect| (*effect, settings.get(*effect))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn every_effect_is_written_out_and_can_be_set_by_its_name() {
        let scene = Scene::default();
        for effect in Effect::ALL {
            let name = effect.name();
            assert!(scene.to_toml().contains(&format!("{name} = \"auto\"")), "{name}");
            for setting in Setting::ALL {
                let changed = scene.with_settings(&[format!("effects.{name}={}", setting.name())]).expect("known");
                assert_eq!(changed.effects.get(*effect), setting);
                assert_eq!(Scene::from_toml(&changed.to_toml()), Ok(changed));
            }
        }
    }

    #[test]
    fn unknown_effects_and_settings_are_refused() {
        let message = |text: &str| Scene::from_toml(text).expect_err("refused").to_string();
        let text = message("[effects]\ncrep = \"on\"\n");
        assert!(text.contains("effects.crep") && text.contains("\"effects.creep\""), "{text}");
        let text = message("[effects]\ncreep = \"maybe\"\n");
        assert!(text.contains("maybe") && text.contains("auto"), "{text}");
        message("[effects]\ncreep = true\n");
        message("effects = \"on\"\n");
    }

    #[test]
    fn a_scene_from_before_there_were_effects_leaves_them_all_to_palpate() {
        let old = Scene::from_toml("[object]\nsource = \"ball\"\n").expect("valid");
        assert_eq!(old.effects, EffectSettings::default());
    }
}
