//! Sensor layouts: which stretches of each finger carry a curvature and which a pressure sensor.
//!
//! The paper varies both (section IV-A1) and numbers its patterns C1 to C6 without saying which is which, but for C1,
//! the simplest. Our numbering: C1 to C4 read whole-finger curvature with pressure over the whole finger, over halves,
//! over pairs of joints, at every joint; C5 to C8 the same with the curvature of both halves. `+F` adds force as a
//! channel of its own beside each pressure.

use palpate_sim::gripper::{GripperModel, Side};
use std::borrow::Cow;

/// A stretch of a finger, as shares of its length from the palm.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    from: f64,
    to: f64,
    /// Name; empty for the whole finger.
    name: Cow<'static, str>,
}

impl Span {
    /// The whole finger.
    pub const WHOLE: Self = Self::fixed("", 0.0, 1.0);
    /// The half next to the palm.
    pub const PROXIMAL: Self = Self::fixed("proximal", 0.0, 0.5);
    /// The half with the tip.
    pub const DISTAL: Self = Self::fixed("distal", 0.5, 1.0);

    const fn fixed(name: &'static str, from: f64, to: f64) -> Self {
        Self { from, to, name: Cow::Borrowed(name) }
    }

    /// True when the stretch holds a point at a share of the finger's length; its end belongs to the next stretch.
    pub fn holds(&self, share: f64) -> bool {
        // The margin lets a joint or taxel on a boundary fall to one side whatever its rounding.
        let margin = 1e-9;
        share >= self.from - margin && (share < self.to - margin || self.to >= 1.0)
    }

    /// Its length as a share of the finger's.
    pub fn share(&self) -> f64 {
        self.to - self.from
    }

    /// Start and end, as shares of the finger's length.
    pub fn ends(&self) -> (f64, f64) {
        (self.from, self.to)
    }
}

/// Division of a finger into curvature sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurvatureSplit {
    /// One sensor over the whole finger.
    Whole,
    /// One on each half.
    Halves,
}

/// Division of a finger into pressure sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PressureSplit {
    /// One sensor over the whole finger.
    Whole,
    /// One on each half.
    Halves,
    /// One for every two joints.
    Pairs,
    /// One for every joint.
    Joints,
}

/// A row of the catalogue, with or without force channels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorLayout {
    /// `C1` to `C8`.
    pub name: &'static str,
    /// Curvature sensors on each finger.
    pub curvature: CurvatureSplit,
    /// Pressure sensors on each finger.
    pub pressure: PressureSplit,
    /// True where force is a channel beside each pressure (`+F`).
    pub force: bool,
}

const fn row(name: &'static str, curvature: CurvatureSplit, pressure: PressureSplit) -> SensorLayout {
    SensorLayout { name, curvature, pressure, force: false }
}

/// All layouts; adding one is adding a row.
pub const CATALOGUE: [SensorLayout; 8] = [
    row("C1", CurvatureSplit::Whole, PressureSplit::Whole),
    row("C2", CurvatureSplit::Whole, PressureSplit::Halves),
    row("C3", CurvatureSplit::Whole, PressureSplit::Pairs),
    row("C4", CurvatureSplit::Whole, PressureSplit::Joints),
    row("C5", CurvatureSplit::Halves, PressureSplit::Whole),
    row("C6", CurvatureSplit::Halves, PressureSplit::Halves),
    row("C7", CurvatureSplit::Halves, PressureSplit::Pairs),
    row("C8", CurvatureSplit::Halves, PressureSplit::Joints),
];

/// Measured quantity of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Curvature (1/m).
    Curvature,
    /// Pressure (Pa).
    Pressure,
    /// Normal force (N).
    Force,
}

impl Quantity {
    /// The name used in files and on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Curvature => "curvature",
            Self::Pressure => "pressure",
            Self::Force => "force",
        }
    }

    /// The unit of its values.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Curvature => "1/m",
            Self::Pressure => "Pa",
            Self::Force => "N",
        }
    }
}

/// One sensor of a layout on one finger.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Measured quantity.
    pub quantity: Quantity,
    /// On which finger.
    pub side: Side,
    /// Over which stretch of it.
    pub span: Span,
}

impl Channel {
    /// Its name in files: `pressure_left_distal`.
    pub fn name(&self) -> String {
        let (quantity, side) = (self.quantity.name(), self.side.name());
        if self.span.name.is_empty() {
            format!("{quantity}_{side}")
        } else {
            format!("{quantity}_{side}_{}", self.span.name)
        }
    }
}

/// Error of a sensor layout.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayoutError {
    /// The name is not in the catalogue.
    #[error("unknown sensor layout \"{name}\"; choose C1 to C8, or with force C1+F to C8+F")]
    Unknown {
        /// The name given.
        name: String,
    },
    /// A pressure sensor would cover no taxel.
    #[error(
        "layout {layout} has {sensors} pressure sensors per finger, but the pad has only {rows} rows of taxels: \
         raise gripper.pad.rows or choose a coarser layout"
    )]
    EmptySpan {
        /// The layout.
        layout: String,
        /// Sensors per finger.
        sensors: usize,
        /// Taxel rows.
        rows: usize,
    },
}

/// The channels of layout C1+F, which are the same on any gripper.
pub fn whole_fingers() -> Vec<Channel> {
    let pair = |quantity| Side::BOTH.map(|side| Channel { quantity, side, span: Span::WHOLE });
    [Quantity::Curvature, Quantity::Pressure, Quantity::Force].map(pair).concat()
}

impl SensorLayout {
    /// A layout by its name: `C1` .. `C8`, with `+F` for force channels.
    pub fn named(name: &str) -> Result<Self, LayoutError> {
        let upper = name.trim().to_ascii_uppercase();
        let (base, force) = match upper.strip_suffix("+F") {
            Some(base) => (base, true),
            None => (upper.as_str(), false),
        };
        match CATALOGUE.iter().find(|layout| layout.name == base) {
            Some(layout) => Ok(Self { force, ..layout.clone() }),
            None => Err(LayoutError::Unknown { name: name.to_owned() }),
        }
    }

    /// The name with which [`SensorLayout::named`] finds it again.
    pub fn full_name(&self) -> String {
        format!("{}{}", self.name, if self.force { "+F" } else { "" })
    }

    /// The channels on a gripper: curvature left and right, then pressure, then force, each from palm to tip.
    pub fn channels(&self, gripper: &GripperModel) -> Result<Vec<Channel>, LayoutError> {
        let pressure = self.pressure_spans(gripper.finger.joints);
        let grid = gripper.taxels();
        let covered = |span: &Span| (0..grid.rows).any(|r| span.holds((r as f64 + 0.5) / grid.rows as f64));
        if !pressure.iter().all(covered) {
            return Err(LayoutError::EmptySpan { layout: self.full_name(), sensors: pressure.len(), rows: grid.rows });
        }
        let mut channels = Vec::new();
        let mut add = |quantity: Quantity, spans: &[Span]| {
            for side in Side::BOTH {
                channels.extend(spans.iter().map(|span| Channel { quantity, side, span: span.clone() }));
            }
        };
        add(Quantity::Curvature, &self.curvature_spans());
        add(Quantity::Pressure, &pressure);
        if self.force {
            add(Quantity::Force, &pressure);
        }
        Ok(channels)
    }

    fn curvature_spans(&self) -> Vec<Span> {
        match self.curvature {
            CurvatureSplit::Whole => vec![Span::WHOLE],
            CurvatureSplit::Halves => vec![Span::PROXIMAL, Span::DISTAL],
        }
    }

    fn pressure_spans(&self, joints: usize) -> Vec<Span> {
        let evenly = |count: usize, name: &dyn Fn(usize) -> String| -> Vec<Span> {
            let step = 1.0 / count as f64;
            (0..count)
                .map(|i| Span {
                    from: i as f64 * step,
                    to: if i + 1 == count { 1.0 } else { (i + 1) as f64 * step },
                    name: Cow::Owned(name(i)),
                })
                .collect()
        };
        match self.pressure {
            PressureSplit::Whole => vec![Span::WHOLE],
            PressureSplit::Halves => vec![Span::PROXIMAL, Span::DISTAL],
            PressureSplit::Pairs => {
                let count = joints.div_ceil(2);
                evenly(count, &|i| format!("pair_{}", i + 1))
            }
            PressureSplit::Joints => evenly(joints, &|i| format!("joint_{}", i + 1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_fingers_are_the_layout_of_that_name() {
        let named = SensorLayout::named("C1+F").expect("in the catalogue");
        assert_eq!(named.channels(&GripperModel::default()).expect("fits"), whole_fingers());
    }

    #[test]
    fn every_layout_has_the_channels_it_promises() {
        let gripper = GripperModel::default();
        let per_finger = [2, 3, 6, 11, 3, 4, 7, 12];
        for (layout, want) in CATALOGUE.iter().zip(per_finger) {
            let channels = layout.channels(&gripper).expect("fits");
            assert_eq!(channels.len(), 2 * want, "{}", layout.name);
            let with_force = SensorLayout { force: true, ..layout.clone() };
            let forces = channels.iter().filter(|c| c.quantity == Quantity::Pressure).count();
            assert_eq!(with_force.channels(&gripper).expect("fits").len(), 2 * want + forces);
            let mut names: Vec<String> = channels.iter().map(Channel::name).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), channels.len(), "names are unique");
            assert_eq!(SensorLayout::named(&with_force.full_name()), Ok(with_force));
        }
    }

    #[test]
    fn spans_share_every_taxel_row_between_them_once() {
        for joints in [2, 3, 10, 40] {
            for layout in &CATALOGUE {
                let spans = layout.pressure_spans(joints);
                for row in 0..40 {
                    let share = (f64::from(row) + 0.5) / 40.0;
                    assert_eq!(spans.iter().filter(|s| s.holds(share)).count(), 1, "{} row {row}", layout.name);
                }
            }
        }
    }

    #[test]
    fn too_fine_and_unknown_layouts_are_refused() {
        let mut gripper = GripperModel::default();
        gripper.finger.joints = 80;
        assert!(matches!(CATALOGUE[3].channels(&gripper), Err(LayoutError::EmptySpan { sensors: 80, .. })));
        assert!(SensorLayout::named("C9").is_err());
        assert!(SensorLayout::named("c1+f").is_ok_and(|layout| layout.force));
    }
}
