//! Variation of poses from grasp to grasp, and the presets A, M, B and C.

use super::Scene;
use serde::{Deserialize, Serialize};

/// Range of random poses about the scene's own. Shifts and turns move the gripper, not the resting object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PoseSpread {
    /// Largest shift of the gripper along each world axis (m).
    pub shift: [f64; 3],
    /// Largest turn of the gripper about the vertical (degrees).
    pub yaw_deg: f64,
    /// On which of its faces the object lies.
    pub faces: Faces,
    /// Pose of the object in the next of several grasps.
    pub between: Between,
    /// How much the build of the gripper varies from grasp to grasp: 0 not at all, 1 as among any grippers of its kind, or as
    /// far as a fit leaves it open. See [`crate::gripper::BUILD`] and [`crate::gripper::FittedRanges`].
    pub build: f64,
}

impl Default for PoseSpread {
    /// Preset M.
    fn default() -> Self {
        Self { shift: [0.005; 3], yaw_deg: 25.0, faces: Faces::Nominal, between: Between::Reposed, build: 0.0 }
    }
}

/// Treatment of the object between two grasps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Between {
    /// It is put down anew.
    #[default]
    Reposed,
    /// It stays as the fingers have left it; one that has fallen off its support is put down anew.
    AsReleased,
    /// The same, and the gripper comes from where most is expected to be learned about it; where nothing recognises objects,
    /// from anywhere.
    Guided,
}

impl Between {
    /// Name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reposed => "reposed",
            Self::AsReleased => "as-released",
            Self::Guided => "guided",
        }
    }

    /// True where the object stays as the fingers have left it.
    pub fn leaves_object(self) -> bool {
        match self {
            Self::Reposed => false,
            Self::AsReleased | Self::Guided => true,
        }
    }
}

/// On which of its faces an object lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Faces {
    /// The orientation set in the scene.
    #[default]
    Nominal,
    /// On any face it comes to rest on when it is dropped, as often as it does.
    Natural,
    /// Anyhow, where it is fixed; a free object lies on natural faces.
    Any,
}

/// A pose preset: its name and its scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PosePreset {
    /// A, M, B or C.
    pub name: &'static str,
    /// The scene file, embedded.
    pub text: &'static str,
}

/// All presets, from the easiest to the hardest.
pub const PRESETS: [PosePreset; 4] = [
    PosePreset { name: "A", text: include_str!("../../../assets/scenes/preset_a.toml") },
    PosePreset { name: "M", text: include_str!("../../../assets/scenes/preset_m.toml") },
    PosePreset { name: "B", text: include_str!("../../../assets/scenes/preset_b.toml") },
    PosePreset { name: "C", text: include_str!("../../../assets/scenes/preset_c.toml") },
];

impl PosePreset {
    /// A preset by its name, in either case.
    pub fn named(name: &str) -> Option<Self> {
        PRESETS.into_iter().find(|preset| preset.name.eq_ignore_ascii_case(name))
    }

    /// Its poses.
    pub fn poses(&self) -> PoseSpread {
        Scene::from_toml(self.text).expect("presets are embedded and tested").pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_scene_files_that_get_harder() {
        let spreads: Vec<PoseSpread> = PRESETS.iter().map(PosePreset::poses).collect();
        assert!(spreads.windows(2).all(|w| w[0].shift[0] < w[1].shift[0] && w[0].yaw_deg <= w[1].yaw_deg));
        assert_eq!(PosePreset::named("m").map(|preset| preset.poses()), Some(PoseSpread::default()));
        assert_eq!(PosePreset::named("z"), None);
    }
}
