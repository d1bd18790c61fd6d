//! Bodies of known shape and width, grasped centred, and the settings of the gripper that are varied with them.

use super::super::prelude::*;
use super::course::{GraspCurves, Grasped, Signature, median, rank_correlation};
use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_lab::datasets::{SensorView, sequence_of};
use palpate_lab::grasping::grasp;
use palpate_sim::gripper::TorquePoint;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{NamedScene, Scene};
use palpate_tactile::SignalDefinition;

/// Words of tables for the shape of a body where the fingers touch it.
pub(super) const ROUND: &str = "round";
pub(super) const FLAT: &str = "flat";

/// Kinds of bodies: name and shape in the plane in which the fingers bend.
const KINDS: [(&str, &str); 4] = [("ball", ROUND), ("lying cylinder", ROUND), ("cube", FLAT), ("tall block", FLAT)];
/// Widths (mm).
pub(super) const WIDTHS: [f64; 5] = [20.0, 30.0, 40.0, 50.0, 65.0];

/// Bodies: kind, shape and width (mm).
pub(super) fn bodies(widths: &[f64]) -> Vec<(&'static str, &'static str, f64)> {
    KINDS.iter().flat_map(|(kind, shape)| widths.iter().map(|width| (*kind, *shape, *width))).collect()
}

fn body(kind: &str, width_mm: f64) -> (ObjectModel, [f64; 3]) {
    let (half, long) = (0.5e-3 * width_mm, 0.03);
    let (shape, rotation_deg) = match kind {
        "ball" => (Primitive::Sphere { radius: half }, [0.0; 3]),
        "lying cylinder" => (Primitive::Cylinder { radius: half, half_length: long }, [90.0, 0.0, 0.0]),
        "cube" => (Primitive::Cuboid { half: DVec3::splat(half) }, [0.0; 3]),
        _ => (Primitive::Cuboid { half: DVec3::new(half, long, 0.035) }, [0.0; 3]),
    };
    (ObjectModel::from_primitive(kind, shape, 500.0, 0.5), rotation_deg)
}

/// Quantities of the paper's simulation: circle through the joints, pressure over the area of contact.
pub(super) fn papers_view() -> SensorView {
    SensorView::default().with_signals(SignalDefinition::Contact)
}

/// Curves of a grasp of a body.
fn grasp_body(scene: &Scene, (kind, _, width_mm): (&str, &str, f64)) -> Option<GraspCurves> {
    let (object, rotation_deg) = body(kind, width_mm);
    let mut scene = scene.clone();
    scene.object.rotation_deg = rotation_deg;
    let trial = grasp(&scene, Some(&object), 0);
    let signals = papers_view().signals(&trial).ok()?;
    GraspCurves::of(&signals.channels, &sequence_of(&signals))
}

/// Signatures of bodies in a scene.
pub(super) fn signatures(scene: &Scene, widths: &[f64]) -> Vec<Signature> {
    let signature = |body: (&str, &str, f64)| {
        let (kind, shape, width) = body;
        let (object, shape) = (format!("{kind} {width:.0} mm"), shape.to_owned());
        grasp_body(scene, body)?.signature(Grasped { object, shape, width_mm: Some(width), trial: None })
    };
    bodies(widths).into_iter().filter_map(signature).collect()
}

/// What the paper's sentences come to over many grasps: medians and rank correlations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Summary {
    pub(super) grasps: usize,
    /// Rank correlation of bending with time before contact, and pressure then as a share of the hold's.
    pub(super) rises: Option<f64>,
    pub(super) before: Option<f64>,
    /// Rate of bending after contact, of round and of flat objects, and how straight it is for flat ones.
    pub(super) round_rate: Option<f64>,
    pub(super) flat_rate: Option<f64>,
    pub(super) flat_line: Option<f64>,
    /// Shares of the hold's bending after contact.
    pub(super) round_share: Option<f64>,
    pub(super) flat_share: Option<f64>,
    /// Rank correlation of the hold's bending with the curvature of round objects.
    pub(super) curvature: Option<f64>,
    /// Time to 90 % of the pressure (s).
    pub(super) rise_s: Option<f64>,
    /// Rank correlation of onset with width.
    pub(super) size: Option<f64>,
}

/// Median of a number of the signatures of one shape, or of all.
fn median_of(all: &[&Signature], shape: Option<&str>, number: impl Fn(&Signature) -> Option<f64>) -> Option<f64> {
    median(all.iter().filter(|own| shape.is_none_or(|shape| own.of.shape == shape)).filter_map(|own| number(own)))
}

/// Rank correlation of a number with the width, for signatures of one shape or all.
fn with_width(all: &[&Signature], shape: Option<&str>, number: impl Fn(&Signature) -> f64) -> Option<f64> {
    let kept = all.iter().filter(|own| shape.is_none_or(|shape| own.of.shape == shape));
    let (widths, numbers): (Vec<f64>, Vec<f64>) = kept.filter_map(|own| Some((own.of.width_mm?, number(own)))).unzip();
    rank_correlation(&widths, &numbers)
}

/// A number over many grasps.
pub(super) type Statistic = fn(&[&Signature]) -> Option<f64>;

/// The numbers of a [`Summary`], in its order: heading, unit, number.
pub(super) const STATISTICS: [(&str, &str, Statistic); 10] = [
    ("bending with time before contact, rank correlation", "", |all| median_of(all, None, |own| own.rises)),
    ("pressure before contact", PERCENT, |all| median_of(all, None, |own| Some(own.before))),
    ("rate after contact, round", PERCENT, |all| median_of(all, Some(ROUND), |own| own.rate)),
    ("rate after contact, flat", PERCENT, |all| median_of(all, Some(FLAT), |own| own.rate)),
    ("line after contact, flat (R²)", "", |all| median_of(all, Some(FLAT), |own| own.line)),
    ("bending after contact, round", PERCENT, |all| median_of(all, Some(ROUND), |own| Some(own.share))),
    ("bending after contact, flat", PERCENT, |all| median_of(all, Some(FLAT), |own| Some(own.share))),
    ("bending with curvature of round objects, rank correlation", "", |all| {
        with_width(all, Some(ROUND), |own| own.bend).map(|falls| -falls)
    }),
    ("time to 90 % of pressure", "s", |all| median_of(all, None, |own| Some(own.rise_s))),
    ("onset with width, rank correlation", "", |all| with_width(all, None, |own| own.onset_s)),
];

impl Summary {
    pub(super) fn of<'a>(signatures: impl IntoIterator<Item = &'a Signature>) -> Self {
        let all: Vec<&Signature> = signatures.into_iter().collect();
        let numbers = STATISTICS.map(|(.., statistic)| statistic(&all));
        let [rises, before, round_rate, flat_rate, flat_line, round_share, flat_share, curvature, rise_s, size] =
            numbers;
        Self {
            grasps: all.len(),
            rises,
            before,
            round_rate,
            flat_rate,
            flat_line,
            round_share,
            flat_share,
            curvature,
            rise_s,
            size,
        }
    }
}

/// A setting that is varied.
pub(super) struct Varied {
    /// Name in tables.
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    /// Values in its unit, the default and that of the paper's scene among them.
    pub(super) values: &'static [f64],
    set: fn(&mut Scene, f64),
    get: fn(&Scene) -> f64,
}

impl Varied {
    /// The paper's scene with another value.
    pub(super) fn scene(&self, value: f64) -> Scene {
        let mut scene = papers_scene();
        (self.set)(&mut scene, value);
        scene
    }

    /// Value of the default scene and of the paper's.
    pub(super) fn known(&self) -> [f64; 2] {
        [Scene::default(), papers_scene()].map(|scene| (self.get)(&scene))
    }
}

pub(super) fn papers_scene() -> Scene {
    NamedScene::named("paper").map(|named| named.scene()).unwrap_or_default()
}

/// Settings varied about the paper's scene.
pub(super) static VARIED: [Varied; 6] = [
    Varied {
        name: "torque at 1 bar",
        unit: "mN m",
        values: &[60.0, 80.0, 120.0, 160.0, 200.0],
        set: |scene, value| {
            let point = |bar: f64| TorquePoint { bar, torque: 1e-3 * value * bar };
            scene.gripper.actuation.curve = vec![point(0.0), point(1.5)];
        },
        get: |scene| 1e3 * scene.gripper.actuation.torque(1.0),
    },
    Varied {
        name: "relaxation time of the finger",
        unit: "s",
        values: &[0.02, 0.1, 0.2, 0.4, 0.8],
        set: |scene, value| scene.gripper.finger.damping_time = value,
        get: |scene| scene.gripper.finger.damping_time,
    },
    Varied {
        name: "time of closing",
        unit: "s",
        values: &[0.1, 0.2, 0.5, 1.0, 2.0],
        set: |scene, value| {
            let ticks = (value * f64::from(scene.timing.actuation_hz)).round().max(1.0);
            // The hold takes what is left of the time.
            let whole = scene.programme.close_ticks() + scene.programme.hold_ticks;
            scene.programme.close_bar_per_tick = scene.programme.peak_bar / ticks;
            scene.programme.hold_ticks = whole.saturating_sub(ticks as u32);
        },
        get: |scene| f64::from(scene.programme.close_ticks()) / f64::from(scene.timing.actuation_hz.max(1)),
    },
    Varied {
        name: "palm above the object's middle",
        unit: "mm",
        values: &[62.0, 66.0, 70.0, 74.0, 80.0, 86.0],
        set: |scene, value| scene.gripper.mount.grasp_depth = 1e-3 * value,
        get: |scene| 1e3 * scene.gripper.mount.grasp_depth,
    },
    Varied {
        name: "modulus of the pad",
        unit: "kPa",
        values: &[50.0, 100.0, 200.0, 400.0, 1000.0],
        set: |scene, value| scene.gripper.pad.modulus = 1e3 * value,
        get: |scene| 1e-3 * scene.gripper.pad.modulus,
    },
    Varied {
        name: "friction of the pad",
        unit: "",
        values: &[0.25, 0.5, 1.0, 2.0],
        set: |scene, value| scene.gripper.pad.friction = value,
        get: |scene| scene.gripper.pad.friction,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_varies_about_the_default_and_the_papers_scene() {
        for varied in &VARIED {
            for value in varied.known() {
                let close = |own: &f64| (own - value).abs() < 1e-9 * value.abs();
                assert!(varied.values.iter().any(close), "{}: {value}", varied.name);
            }
            let known = varied.known()[1];
            for value in varied.values {
                let scene = varied.scene(*value);
                scene.check().expect(varied.name);
                assert!(((varied.get)(&scene) - value).abs() < 0.06 * value, "{} {value}", varied.name);
            }
            assert_eq!((varied.get)(&varied.scene(known)), known, "{}", varied.name);
        }
    }
}
