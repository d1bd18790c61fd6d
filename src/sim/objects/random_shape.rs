//! Random shapes, named `random:SEED`: objects of no class. Recognisers learn dimensions from them, and what objects that
//! they do not know feel like.

use super::assemble::{Blueprint, ShapeSource};
use super::options::LoadOptions;
use super::{ObjectError, ObjectModel, ShapeClass};
use glam::DVec3;
use palpate_geometry::{ColouredPart, Finish, Pose, Primitive, TriMesh, bake, cube_sphere};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::RangeInclusive;

/// Beginning of the names of random shapes.
const PREFIX: &str = "random:";
/// Version of the shapes, part of their content: count it up whenever a seed gives another shape.
const REVISION: u32 = 1;

/// Extents of boxes, heights of cylinders (m).
const EXTENTS: RangeInclusive<f64> = 0.009..=0.1;
/// Widest part of the hand that a shape must fit through (m).
const WIDEST: f64 = 0.075;
/// Radii of round shapes (m).
const RADII: RangeInclusive<f64> = 0.005..=0.036;
/// Densities: cork to half a block of steel (kg/m³).
const DENSITIES: RangeInclusive<f64> = 150.0..=4000.0;
/// Masses (kg).
const MASSES: RangeInclusive<f64> = 0.003..=0.25;
/// Friction coefficients of the surface: polished steel to rubber.
const FRICTIONS: RangeInclusive<f64> = 0.35..=0.85;
/// Squares along each edge of the cube from which curved meshes are made.
const SQUARES: u32 = 9;

/// A random shape: a box, a cylinder, an ellipsoid, a capsule, a superquadric, or a union of two of them.
#[derive(Clone, Debug)]
pub struct RandomShape {
    /// Approximate shape; of the larger part of a union.
    pub class: ShapeClass,
    name: String,
    solids: Vec<(Solid, Pose)>,
    density: f64,
    friction: f64,
}

/// A convex solid, centred at its own origin.
#[derive(Clone, Debug)]
enum Solid {
    Primitive(Primitive),
    Superquadric {
        half: DVec3,
        /// Exponents along z and around it: 1 is round, towards 0 it has edges.
        exponents: [f64; 2],
    },
}

impl RandomShape {
    /// The shape with this name, `random:` and a number; `None` for other names.
    pub fn named(name: &str) -> Option<Self> {
        Self::seed_of(name).map(Self::new)
    }

    /// The number in the name of a random shape; `None` for other names.
    pub fn seed_of(name: &str) -> Option<u64> {
        name.strip_prefix(PREFIX)?.parse().ok()
    }

    /// The shape with this seed.
    pub fn new(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5ad_0b7ec7);
        let (mut class, solid) = drawn(&mut random);
        let mut solids = vec![(solid, Pose::IDENTITY)];
        // One in seven is a union, like a syringe, a push button or a bottle with its cap.
        if random.random::<f64>() < 1.0 / 7.0 {
            let (other, second) = drawn(&mut random);
            let (below, above) = (solids[0].0.half(), second.half());
            let share =
                random.random_range(0.35..0.9) * below.truncate().min_element() / above.truncate().max_element();
            let second = second.scaled(share.min(1.0));
            if second.volume() > solids[0].0.volume() {
                class = other;
            }
            // They overlap by a tenth, so that the union is one piece.
            let z = below.z + 0.8 * second.half().z;
            solids.push((second, Pose::from_position(DVec3::Z * z)));
            shrink_to_fit(&mut solids);
        }
        let density = log_uniform(&mut random, DENSITIES);
        let friction = random.random_range(FRICTIONS);
        Self { class, name: format!("{PREFIX}{seed}"), solids, density, friction }
    }

    /// Builds the object. Each is needed once, so its distances are not kept in a file.
    pub(super) fn build(&self, options: &LoadOptions) -> Result<ObjectModel, ObjectError> {
        let mut blueprint = Blueprint::new(&self.name);
        // Their masses were drawn so, and models have learned them.
        blueprint.overlap_is_denser = true;
        for (solid, place) in &self.solids {
            blueprint.add_visual(&solid.source(), place, None);
        }
        let volume: f64 = self.solids.iter().map(|(solid, _)| solid.volume()).sum();
        let mass = (volume * self.density).clamp(*MASSES.start(), *MASSES.end());
        let object = blueprint.build_with(&LoadOptions { mass: options.mass.or(Some(mass)), ..*options }, bake)?;
        let content = crate::fingerprint([self.name.as_bytes(), &REVISION.to_le_bytes()]);
        Ok(ObjectModel { friction: self.friction, content, ..object })
    }
}

impl Solid {
    /// Half the extents (m).
    fn half(&self) -> DVec3 {
        match self {
            Self::Primitive(shape) => 0.5 * shape.bounds().size(),
            Self::Superquadric { half, .. } => *half,
        }
    }

    fn scaled(self, factor: f64) -> Self {
        match self {
            Self::Primitive(shape) => Self::Primitive(shape.scaled(factor)),
            Self::Superquadric { half, exponents } => Self::Superquadric { half: half * factor, exponents },
        }
    }

    /// Volume (m³).
    fn volume(&self) -> f64 {
        match self {
            Self::Primitive(shape) => shape.mass_properties().mass,
            Self::Superquadric { .. } => self.mesh().signed_volume(),
        }
    }

    fn source(&self) -> ShapeSource {
        match self {
            Self::Primitive(shape) => ShapeSource::Primitive(*shape),
            Self::Superquadric { .. } => {
                ShapeSource::Mesh(vec![ColouredPart { mesh: self.mesh(), colour: None, finish: Finish::default() }])
            }
        }
    }

    fn mesh(&self) -> TriMesh {
        match self {
            Self::Primitive(shape) => shape.tessellate(),
            Self::Superquadric { half, exponents } => {
                let mut mesh = cube_sphere(SQUARES);
                mesh.points.iter_mut().for_each(|p| *p = on_superquadric(*p, *exponents));
                mesh.scale(*half);
                mesh
            }
        }
    }
}

/// The point of the unit superquadric in the direction of a unit vector.
fn on_superquadric(direction: DVec3, [along, around]: [f64; 2]) -> DVec3 {
    let p = direction.abs();
    let of_circle = p.x.powf(2.0 / around) + p.y.powf(2.0 / around);
    let inside = of_circle.powf(around / along) + p.z.powf(2.0 / along);
    direction * inside.powf(-0.5 * along)
}

/// Draws one solid and its approximate shape.
fn drawn(random: &mut ChaCha8Rng) -> (ShapeClass, Solid) {
    let share: f64 = random.random();
    let chance = |random: &mut ChaCha8Rng, share: f64| random.random::<f64>() < share;
    loop {
        let (class, solid) = if share < 0.28 {
            let mut half = DVec3::from_array(std::array::from_fn(|_| 0.5 * log_uniform(random, EXTENTS)));
            if chance(random, 0.15) {
                half.y = half.x;
            }
            if chance(random, 0.1) {
                half = DVec3::splat(half.x);
            }
            (ShapeClass::Cubic, Solid::Primitive(Primitive::Cuboid { half }))
        } else if share < 0.52 {
            let (radius, half_length) = (log_uniform(random, RADII), 0.5 * log_uniform(random, EXTENTS));
            (ShapeClass::Cylindrical, Solid::Primitive(Primitive::Cylinder { radius, half_length }))
        } else if share < 0.60 {
            (ShapeClass::Spherical, Solid::Primitive(Primitive::Sphere { radius: log_uniform(random, RADII) }))
        } else if share < 0.76 {
            let radius = log_uniform(random, RADII);
            let across = if chance(random, 0.7) { radius } else { radius * random.random_range(0.7..1.4) };
            let half = DVec3::new(radius, across, radius * random.random_range(0.55..1.7));
            (ShapeClass::Spherical, Solid::Superquadric { half, exponents: [1.0, 1.0] })
        } else if share < 0.84 {
            let (radius, half_length) = (log_uniform(random, RADII), 0.5 * log_uniform(random, EXTENTS));
            (ShapeClass::Cylindrical, Solid::Primitive(Primitive::Capsule { radius, half_length }))
        } else {
            let half = DVec3::from_array(std::array::from_fn(|_| 0.5 * log_uniform(random, EXTENTS)));
            let (edged, round) = (0.2..0.5, 0.75..1.0);
            match random.random_range(0..3) {
                0 => {
                    let exponents = [random.random_range(edged.clone()), random.random_range(edged)];
                    (ShapeClass::Cubic, Solid::Superquadric { half, exponents })
                }
                1 => {
                    let exponents = [random.random_range(edged), random.random_range(round)];
                    (ShapeClass::Cylindrical, Solid::Superquadric { half, exponents })
                }
                _ => {
                    let exponents = [random.random_range(round.clone()), random.random_range(round)];
                    (ShapeClass::Spherical, Solid::Superquadric { half, exponents })
                }
            }
        };
        let mut extents = (2.0 * solid.half()).to_array();
        extents.sort_by(f64::total_cmp);
        if extents[0] < 0.07 && extents[1] < WIDEST && extents[2] <= *EXTENTS.end() {
            return (class, solid);
        }
    }
}

/// Shrinks a union that is too long for the hand.
fn shrink_to_fit(solids: &mut [(Solid, Pose)]) {
    let top = solids.iter().map(|(solid, place)| place.position.z + solid.half().z).fold(0.0, f64::max);
    let bottom = solids.first().map_or(0.0, |(solid, _)| -solid.half().z);
    let factor = (EXTENTS.end() / (top - bottom)).min(1.0);
    for (solid, place) in solids {
        *solid = solid.clone().scaled(factor);
        place.position *= factor;
    }
}

fn log_uniform(random: &mut ChaCha8Rng, range: RangeInclusive<f64>) -> f64 {
    random.random_range(range.start().ln()..=range.end().ln()).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::objects::load;
    use std::f64::consts::PI;

    #[test]
    fn seeds_name_shapes_that_fit_the_hand() {
        let options = LoadOptions::default();
        let mut unions = 0;
        for seed in 0..60 {
            let name = format!("{PREFIX}{seed}");
            let (a, b) = (load(&name, &options), load(&name, &options));
            let (a, b) = (a.expect("builds").expect("an object"), b.expect("builds").expect("an object"));
            assert_eq!((a.content, a.mass.mass, a.bounds), (b.content, b.mass.mass, b.bounds), "{name}");
            assert_eq!((a.name.as_str(), a.class, a.warnings.len()), (name.as_str(), None, 0), "{:?}", a.warnings);
            let mut size = a.bounds.size().to_array();
            size.sort_by(f64::total_cmp);
            assert!(size[1] <= 0.077 && size[2] <= 0.102, "{name}: {size:?}");
            assert!(MASSES.contains(&a.mass.mass) && FRICTIONS.contains(&a.friction));
            unions += u32::from(a.parts.len() > 1);
        }
        assert!((3..20).contains(&unions), "{unions} unions of 60");
    }

    #[test]
    fn other_names_are_no_shapes() {
        assert!(
            ["random", "random:", "random:x", "random:-1", "lemon"].iter().all(|n| RandomShape::named(n).is_none())
        );
        assert!(load("random:x", &LoadOptions::default()).is_err());
    }

    #[test]
    fn superquadrics_reach_from_ellipsoid_to_box() {
        let corner = DVec3::ONE.normalize();
        assert!((on_superquadric(corner, [1.0, 1.0]) - corner).length() < 1e-12, "a ball");
        assert!((on_superquadric(corner, [0.05, 0.05]) - DVec3::ONE).abs().max_element() < 0.05, "nearly a cube");
        let solid = |e: f64| Solid::Superquadric { half: DVec3::new(0.01, 0.02, 0.03), exponents: [e, e] };
        let ball = 4.0 / 3.0 * PI * 6e-6;
        assert!((solid(1.0).volume() / ball - 1.0).abs() < 0.03);
        assert!(solid(0.3).volume() > 1.5 * ball && solid(0.3).volume() < 48e-6);
    }
}
