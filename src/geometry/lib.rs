//! Shapes and what can be drawn: units, colours, meshes and their repair, hulls, distance grids, mass, the draw list
//! and its camera. SI units; poses are named `outer_from_inner`.

mod bake;
mod circle;
mod convex;
mod distance;
pub mod drawing;
mod hull;
mod mass;
mod mesh;
mod mesh_files;
mod modelling;
pub mod palette;
mod pose;
mod primitive;
mod repair;
mod support_points;
mod surface;
pub mod units;

pub use bake::{BakeError, SolidPart, bake, choose_cell};
pub use circle::signed_curvature;
pub use convex::convex_hull;
pub use distance::{DistanceField, DistanceGrid};
pub use hull::convex_hull_area;
pub use mass::{MassProperties, mass_properties};
pub use mesh::{Bounds, TriMesh};
pub use mesh_files::{ColouredPart, MeshFileError, read_mesh, write_obj};
pub use modelling::{cube_sphere, rounded_box};
pub use pose::Pose;
pub use primitive::{Primitive, lathe};
pub use repair::{MeshError, Repaired, repair};
pub use support_points::support_points;
pub use surface::{SurfaceMesh, SurfaceVertex};
