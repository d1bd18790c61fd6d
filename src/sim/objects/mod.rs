//! Objects to grasp: the sixteen built-in ones, random shapes, and whatever a URDF, OBJ or STL file holds.

mod assemble;
mod catalogue;
mod files;
mod load;
mod model;
mod options;
mod random_shape;
mod urdf;
mod xml;

pub use catalogue::{BuiltIn, catalogue, thumbnail};
pub use load::{EMPTY, anchored, capital_title, class_of, is_file, load, load_surface, object_title, titled};
pub use model::{ObjectClass, ObjectModel, Resting, RestingBall, ShapeClass, SizeClass};
pub use options::{CollisionShape, LoadOptions};
pub use random_shape::RandomShape;

use palpate_geometry::{MeshError, MeshFileError};

/// Reason why an object cannot be loaded, as a sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ObjectError(String);

impl ObjectError {
    /// A file that is not what it claims to be.
    fn malformed(name: &str, cause: &str) -> Self {
        Self(format!("\"{name}\" is malformed: {cause}"))
    }

    /// A mesh that is no solid.
    fn unsound(name: &str, cause: &MeshError) -> Self {
        Self(format!("\"{name}\" cannot be grasped: {cause}"))
    }
}

impl From<MeshFileError> for ObjectError {
    fn from(cause: MeshFileError) -> Self {
        Self(cause.to_string())
    }
}
