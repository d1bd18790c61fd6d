//! An object ready for simulation and drawing, whatever file it came from.

use glam::{DVec2, DVec3};
use palpate_geometry::{Bounds, DistanceField, Finish, MassProperties, Pose, Primitive, SolidPart, SurfaceMesh};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The paper's two sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SizeClass {
    /// Closes within the fingertips.
    Tiny,
    /// Fills the hand.
    Large,
}

impl SizeClass {
    /// Its name in files and on the screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tiny => "tiny",
            Self::Large => "large",
        }
    }
}

/// The paper's three approximate shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeClass {
    /// Flat faces meet the fingers.
    Cubic,
    /// Curved in one direction.
    Cylindrical,
    /// Curved in both directions.
    Spherical,
}

impl ShapeClass {
    /// Its name in files and on the screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cubic => "cubic",
            Self::Cylindrical => "cylindrical",
            Self::Spherical => "spherical",
        }
    }
}

/// Size and shape class of an object, the answer of stage one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ObjectClass {
    /// Tiny or large.
    pub size: SizeClass,
    /// Cubic, cylindrical or spherical.
    pub shape: ShapeClass,
}

impl std::fmt::Display for ObjectClass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, {}", self.size.name(), self.shape.name())
    }
}

/// A round bump on which an object can rest: a corner where the radius is zero, the whole of a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestingBall {
    /// Centre in the object's frame (m).
    pub centre: DVec3,
    /// Radius (m).
    pub radius: f64,
}

/// Everything with which an object can touch a flat support.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Resting(pub Vec<RestingBall>);

impl Resting {
    /// Resting on corners (m).
    pub fn on_corners(corners: &[DVec3]) -> Self {
        Self(corners.iter().map(|p| RestingBall { centre: *p, radius: 0.0 }).collect())
    }

    /// A primitive placed in the object's frame.
    pub fn on_primitive(shape: &Primitive, object_from_shape: &Pose) -> Self {
        let ball = |z: f64, radius: f64| RestingBall { centre: object_from_shape.point(DVec3::Z * z), radius };
        match *shape {
            Primitive::Sphere { radius } => Self(vec![ball(0.0, radius)]),
            Primitive::Capsule { radius, half_length } => Self(evenly(half_length).map(|z| ball(z, radius)).collect()),
            Primitive::Cuboid { .. } => {
                let mut mesh = shape.tessellate();
                mesh.transform(object_from_shape);
                Self::on_corners(&mesh.points)
            }
            Primitive::Cylinder { radius, half_length } => {
                let mut mesh = shape.tessellate();
                mesh.points.retain(|p| p.truncate() != DVec2::ZERO);
                mesh.transform(object_from_shape);
                // The largest balls inside let it roll smoothly when it lies on its side.
                let mut resting = Self::on_corners(&mesh.points);
                if half_length > radius {
                    resting.0.extend(evenly(half_length - radius).map(|z| ball(z, radius)));
                }
                resting
            }
        }
    }

    /// Support function: reach of the object along a unit direction of its own frame (m).
    pub fn reach(&self, direction: DVec3) -> f64 {
        self.0.iter().map(|ball| ball.centre.dot(direction) + ball.radius).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Positions from -half to half, both included, at most 3 mm apart but never more than 65.
fn evenly(half: f64) -> impl Iterator<Item = f64> {
    let steps = (2.0 * half / 3e-3).ceil().clamp(1.0, 64.0) as u32;
    (0..=steps).map(move |i| half * (2.0 * f64::from(i) / f64::from(steps) - 1.0))
}

/// An object ready to be grasped. All geometry is in the object's own frame, z up as it is put down (m).
#[derive(Clone, Debug)]
pub struct ObjectModel {
    /// Short name: the built-in's, or the file's without its extension.
    pub name: String,
    /// Size and shape class, where known.
    pub class: Option<ObjectClass>,
    /// Mesh to draw.
    pub surface: Arc<SurfaceMesh>,
    /// Solids for contact.
    pub field: DistanceField,
    /// The same as single solids, for engines that need shapes instead of distances.
    pub parts: Arc<[SolidPart]>,
    /// With what it rests.
    pub resting: Resting,
    /// Mass, centre and inertia.
    pub mass: MassProperties,
    /// Friction coefficient of its surface.
    pub friction: f64,
    /// Young's modulus of its surface (Pa), where the file gives one; rigid otherwise.
    pub modulus: Option<f64>,
    /// Bounding box of the contact solids.
    pub bounds: Bounds,
    /// Warnings: values guessed and meshes repaired while loading.
    pub warnings: Vec<String>,
    /// Hash of its files: equal for equal objects, wherever they lie.
    pub content: u64,
}

impl ObjectModel {
    /// An object that is one primitive of even density (kg/m³), for tests and closed-form scenes.
    pub fn from_primitive(name: &str, shape: Primitive, density: f64, friction: f64) -> Self {
        let mut surface = SurfaceMesh::default();
        surface.add(&shape.tessellate(), palpate_geometry::palette::Rgb(180, 180, 180), Finish::default());
        let unit = shape.mass_properties();
        Self {
            name: name.to_owned(),
            class: None,
            surface: Arc::new(surface),
            field: DistanceField::primitive(shape, &Pose::IDENTITY),
            parts: Arc::from([SolidPart::Primitive(shape, Pose::IDENTITY)]),
            resting: Resting::on_primitive(&shape, &Pose::IDENTITY),
            mass: unit.with_mass(unit.mass * density),
            friction,
            modulus: None,
            bounds: shape.bounds(),
            warnings: Vec::new(),
            content: crate::fingerprint([format!("{shape:?} {density} {friction}").as_bytes()]),
        }
    }
}
