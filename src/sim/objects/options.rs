//! Choices of the user when an object is loaded.

use serde::{Deserialize, Serialize};

/// Shape used for contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CollisionShape {
    /// Collision shapes of the file; its visual shapes where it declares none.
    #[default]
    File,
    /// Visual shapes of the file.
    Visual,
    /// The convex hull, for meshes that cannot be repaired.
    Hull,
}

/// Options of loading an object; `None` is chosen automatically.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadOptions {
    /// Factor on all lengths; guessed with a warning where the size is implausible.
    pub scale: Option<f64>,
    /// Mass (kg); taken from the file, or from volume and density.
    pub mass: Option<f64>,
    /// Density where the file gives no usable mass (kg/m³).
    pub density: f64,
    /// Shape used for contact.
    pub collision: CollisionShape,
    /// Lattice spacing of baked distances (m); chosen by size.
    pub cell: Option<f64>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            scale: None,
            mass: None,
            density: 500.0, // wood and half-full containers; most graspable things float
            collision: CollisionShape::File,
            cell: None,
        }
    }
}
