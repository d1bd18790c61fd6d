//! Choice of the physics engine.

use serde::{Deserialize, Serialize};

/// Physics engine of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineKind {
    /// Palpate's own convex implicit step.
    #[default]
    Palpate,
    /// rapier3d, for comparison: rigid segments on springs.
    Rapier,
}

impl EngineKind {
    /// All of them, the default first.
    pub const ALL: [Self; 2] = [Self::Palpate, Self::Rapier];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Palpate => "palpate",
            Self::Rapier => "rapier",
        }
    }

    /// The one to compare with.
    pub fn other(self) -> Self {
        match self {
            Self::Palpate => Self::Rapier,
            Self::Rapier => Self::Palpate,
        }
    }
}
