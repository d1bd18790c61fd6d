//! Shapes, and the draw list of pictures.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers. Most are private; their items stand at the root of the crate.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | [`units`] | conversions to and from SI units |
//! | 0 | [`palette`] | colours, themes and colour maps |
//! | 0 | `circle`, `hull` | curvature of tracked points; area of a planar hull |
//! | 0 | `file` | files that people name: regular ones, up to a size |
//! | 0 | `finish` | looks of surfaces beside their colour |
//! | 0 | `pose` | position and orientation of a frame |
//! | 0 | `printable` | texts of others, as they may be shown |
//! | 1 | `mesh` | triangle meshes and bounds |
//! | 2 | `mesh_files` | OBJ and STL in |
//! | 2 | `modelling`, `repair`, `support_points`, `mass` | meshes made and repaired, extreme points, mass properties |
//! | 3 | `primitive`, `convex`, `surface` | closed-form solids, convex hulls, meshes to draw |
//! | 4 | `distance` | signed distance of solids |
//! | 4 | [`drawing`] | draw list, camera, two-dimensional overlay; figures with axes; heat maps |
//! | 5 | `bake`, `hollows` | distance grids of meshes, hollows filled |
//! | 6 | `grid_file`, `union` | grids kept in files; mass of what solids enclose together |
//!
//! # Example
//!
//! ```
//! use glam::DVec3;
//! use palpate_geometry::{Primitive, mass_properties, repair};
//!
//! let cube = Primitive::Cuboid { half: DVec3::splat(0.02) }.tessellate();
//! let sound = repair(&cube).expect("a closed mesh").mesh;
//! let mass = mass_properties(&sound, 500.0);
//! assert!((mass.mass - 0.032).abs() < 1e-6); // 64 cm³ at 500 kg/m³
//! ```
//!
//! SI units; poses are named `outer_from_inner`.

mod bake;
mod circle;
mod convex;
mod distance;
pub mod drawing;
mod file;
mod finish;
mod grid_file;
mod hollows;
mod hull;
mod mass;
mod mesh;
mod mesh_files;
mod modelling;
pub mod palette;
mod pose;
mod primitive;
mod printable;
mod repair;
mod support_points;
mod surface;
mod union;
pub mod units;

pub use bake::{BakeError, SolidPart, bake, choose_cell};
pub use circle::signed_curvature;
pub use convex::convex_hull;
pub use distance::{DistanceField, DistanceGrid};
pub use file::{open_regular, other_content, read_regular, read_text, text_of};
pub use finish::Finish;
pub use grid_file::bake_once;
pub use hull::convex_hull_area;
pub use mass::{MassProperties, mass_properties};
pub use mesh::{Bounds, TriMesh};
pub use mesh_files::{ColouredPart, MeshFileError, read_mesh};
pub use modelling::{cube_sphere, rounded_box};
pub use pose::Pose;
pub use primitive::{Primitive, lathe};
pub use printable::{is_invisible, one_line, printable_lines};
pub use repair::{MeshError, Repaired, repair};
pub use support_points::support_points;
pub use surface::{SurfaceMesh, SurfaceVertex};
pub use union::union_mass;
