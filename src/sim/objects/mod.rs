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
pub use load::{EMPTY, anchored, class_of, load, load_surface, object_title, titled};
pub use model::{ObjectClass, ObjectModel, Resting, RestingBall, ShapeClass, SizeClass};
pub use options::{CollisionShape, LoadOptions};
pub use random_shape::RandomShape;

use palpate_geometry::{BakeError, MeshError, MeshFileError};
use std::path::PathBuf;

/// Error of loading an object.
#[derive(Debug, thiserror::Error)]
pub enum ObjectError {
    /// Neither a built-in name nor a file.
    #[error("there is no object \"{name}\": {hint}")]
    Unknown {
        /// Name given.
        name: String,
        /// The nearest name, or all of them.
        hint: String,
    },
    /// A file of a type we do not read.
    #[error("\"{name}\" is a {kind} file; Palpate reads objects from .urdf, .obj and .stl")]
    Unsupported {
        /// The file.
        name: String,
        /// Its extension.
        kind: String,
    },
    /// The file could not be opened.
    #[error("cannot read \"{path}\": {cause}", path = path.display())]
    Unreadable {
        /// The path.
        path: PathBuf,
        /// Message of the operating system.
        cause: String,
    },
    /// The file is not what it claims to be.
    #[error("\"{name}\" is malformed: {cause}")]
    Malformed {
        /// The object.
        name: String,
        /// Cause.
        cause: String,
    },
    /// A shape of impossible size.
    #[error("link \"{link}\": {cause}")]
    BadShape {
        /// The link.
        link: String,
        /// Cause.
        cause: String,
    },
    /// A mesh file that cannot be used.
    #[error("{cause}")]
    Mesh {
        /// Cause.
        cause: MeshFileError,
    },
    /// Nothing to touch.
    #[error("\"{name}\" has no shape: no link has a visual or collision that can be used")]
    NoShape {
        /// The object.
        name: String,
    },
    /// A mesh that is no solid.
    #[error("\"{name}\" cannot be grasped: {cause}")]
    Unsound {
        /// The object.
        name: String,
        /// Fault of the mesh.
        cause: MeshError,
    },
    /// An absurd size.
    #[error("\"{name}\" is {metres:.3e} m across; set object.scale so that it fits a hand")]
    Size {
        /// The object.
        name: String,
        /// Its largest extent (m).
        metres: f64,
    },
    /// Distances could not be baked.
    #[error("\"{name}\": {cause}")]
    Bake {
        /// The object.
        name: String,
        /// Cause.
        cause: BakeError,
    },
}
