//! Sensor layouts: which stretches of each finger carry a curvature and which a pressure sensor, and what their signals are.
//!
//! The paper varies both (section IV-A1) and numbers its patterns C1 to C6 without saying which is which, but for C1,
//! the simplest. Our numbering: C1 to C4 read whole-finger curvature with pressure over the whole finger, over halves,
//! over pairs of joints, at every joint; C5 to C8 the same with the curvature of both halves. `+F` adds force as a
//! channel of its own beside each contact pressure; a pad's pressure is its force already.

use crate::sensor_list::{Measures, Sensor, SensorKind, SensorList};
use crate::unit::Dimension;
use palpate_sim::gripper::{GripperModel, Side};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Definition of the signals of a layout's channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SignalDefinition {
    /// What the parts of a real gripper measure: a strip the bend of the length it covers, a pad its normal force, as a
    /// pressure over its sensing area.
    #[default]
    Parts,
    /// Quantities of the simulation: the circle through all joints, and force over participation area.
    Contact,
    /// As `Contact`, but force over the convex hull of the contacts, as in the paper; undefined for points and rows.
    Hull,
}

impl SignalDefinition {
    /// All definitions, that of real grippers first.
    pub const ALL: [Self; 3] = [Self::Parts, Self::Contact, Self::Hull];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Parts => "parts",
            Self::Contact => "contact",
            Self::Hull => "hull",
        }
    }

    /// A definition by its name, in either case.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|own| own.name().eq_ignore_ascii_case(name.trim()))
    }
}

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

    /// A stretch between two shares of the finger's length, under a name.
    pub(crate) fn between(name: &'static str, from: f64, to: f64) -> Self {
        Self::fixed(name, from.clamp(0.0, 1.0), to.clamp(0.0, 1.0))
    }

    /// The stretch that a name stands for on a finger of so many joints: `proximal`, `distal`, `pair_2`, `joint_7`; the
    /// whole finger for all other names.
    pub(crate) fn named(name: &'static str, joints: usize) -> Self {
        let nth = |prefix: &str, count: usize| {
            let number: usize = name.strip_prefix(prefix)?.parse().ok()?;
            (1..=count).contains(&number).then(|| [number - 1, number].map(|k| k as f64 / count.max(1) as f64))
        };
        let halves =
            [Self::PROXIMAL, Self::DISTAL].into_iter().find(|half| half.name == name).map(|half| [half.from, half.to]);
        let [from, to] = halves.or(nth("pair_", joints.div_ceil(2))).or(nth("joint_", joints)).unwrap_or([0.0, 1.0]);
        Self::fixed(name, from, to)
    }

    /// Its name; empty for the whole finger.
    pub fn name(&self) -> &str {
        &self.name
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
    /// Sensors of a gripper file, which have their own stretches.
    pub list: Option<SensorList>,
}

const fn row(name: &'static str, curvature: CurvatureSplit, pressure: PressureSplit) -> SensorLayout {
    SensorLayout { name, curvature, pressure, force: false, list: None }
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
    /// Normal force of a pad over its sensing area (Pa).
    Pressure,
    /// Normal force over the area of the contact (Pa), which only simulations know.
    ContactPressure,
    /// Normal force (N).
    Force,
    /// Anything else that a sensor reads, less its reading at rest.
    Raw {
        /// Of what its values are, where it is known.
        dimension: Option<Dimension>,
        /// What it measures, where simulations can give it.
        measures: Option<Measures>,
    },
}

impl Quantity {
    /// The name used in files and on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Curvature => "curvature",
            Self::Pressure => "pressure",
            Self::ContactPressure => "contact_pressure",
            Self::Force => "force",
            Self::Raw { .. } => "raw",
        }
    }

    /// Quantity and place of a channel's name: `left_distal` of `pressure_left_distal`; none of other names.
    pub fn of_name(name: &str) -> Option<(Self, &str)> {
        [Self::Curvature, Self::Pressure, Self::ContactPressure, Self::Force]
            .into_iter()
            .find_map(|quantity| Some((quantity, name.strip_prefix(quantity.name())?.strip_prefix('_')?)))
    }

    /// True for a pressure of either kind.
    pub fn is_pressure(self) -> bool {
        matches!(self, Self::Pressure | Self::ContactPressure)
    }

    /// Its dimension, where it is known.
    pub fn dimension(self) -> Option<Dimension> {
        match self {
            Self::Curvature => Some(Dimension::Curvature),
            Self::Pressure | Self::ContactPressure => Some(Dimension::Pressure),
            Self::Force => Some(Dimension::Force),
            Self::Raw { dimension, .. } => dimension,
        }
    }

    /// The unit of its values; empty where it is not known.
    pub fn unit(self) -> &'static str {
        self.dimension().map_or("", Dimension::unit)
    }
}

/// One sensor of a layout on one finger.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Measured quantity.
    pub quantity: Quantity,
    /// On which finger; empty for a sensor of the whole hand.
    pub finger: Cow<'static, str>,
    /// Over which stretch of it; for a raw sensor, its name.
    pub span: Span,
    /// Definition of the signal. That of a force is always [`SignalDefinition::Parts`]: all definitions have the same.
    pub signals: SignalDefinition,
}

impl Channel {
    /// A channel of a layout; [`Quantity::Pressure`] becomes the pressure of the definition.
    fn new(quantity: Quantity, side: Side, span: Span, signals: SignalDefinition) -> Self {
        let (quantity, signals) = match (quantity, signals) {
            (Quantity::Pressure, SignalDefinition::Contact | SignalDefinition::Hull) => {
                (Quantity::ContactPressure, signals)
            }
            (Quantity::Force, _) => (quantity, SignalDefinition::Parts),
            _ => (quantity, signals),
        };
        Self { quantity, finger: Cow::Borrowed(side.name()), span, signals }
    }

    /// The simulated finger that carries it.
    pub fn side(&self) -> Option<Side> {
        Side::BOTH.into_iter().find(|side| side.name() == self.finger)
    }

    /// Its name in files: `pressure_left_distal`; of a raw sensor its own, with the unit where it is known.
    pub fn name(&self) -> String {
        let (quantity, finger, place) = (self.quantity.name(), &self.finger, &self.span.name);
        match self.quantity {
            Quantity::Raw { dimension: None, .. } => place.to_string(),
            Quantity::Raw { dimension: Some(dimension), .. } => format!("{place} [{}]", dimension.unit()),
            _ if place.is_empty() => format!("{quantity}_{finger}"),
            _ => format!("{quantity}_{finger}_{place}"),
        }
    }
}

/// Reason why a layout or its signals cannot be used, as a sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct LayoutError(String);

impl LayoutError {
    /// Parts of a real gripper do not measure contact pressure.
    pub fn no_such_part() -> Self {
        Self(
            "physical-like sensors are the parts of a real gripper, which do not measure contact pressure: choose --signals \
             parts, or --sensors virtual"
                .to_owned(),
        )
    }
}

/// Curvature, pressure and force of each finger, which any gripper has.
pub fn whole_fingers(signals: SignalDefinition) -> Vec<Channel> {
    let pair = |quantity| Side::BOTH.map(|side| Channel::new(quantity, side, Span::WHOLE, signals));
    [Quantity::Curvature, Quantity::Pressure, Quantity::Force].map(pair).concat()
}

/// Channels of the sensors of a gripper file.
impl SensorList {
    /// All channels that calibrated sensors give: curvature of the strips, pressure and then force of the pads, raw values.
    pub fn channels(self) -> Vec<Channel> {
        self.channels_on(&GripperModel::default())
    }

    /// The same on the model of a gripper, whose fingers' length places sensors that the file places in metres or rows.
    pub fn channels_on(self, gripper: &GripperModel) -> Vec<Channel> {
        let of = |kind, quantity: &dyn Fn(Sensor) -> Quantity| -> Vec<Channel> {
            let channel = |sensor: Sensor| sensor.channel_on(quantity(sensor), gripper);
            self.of_kind(kind).map(channel).collect()
        };
        let mut channels = of(SensorKind::Flex, &|_| Quantity::Curvature);
        channels.extend(of(SensorKind::Pad, &|_| Quantity::Pressure));
        channels.extend(of(SensorKind::Pad, &|_| Quantity::Force));
        channels.extend(of(SensorKind::Raw, &|sensor| Quantity::Raw {
            dimension: sensor.row().raw_unit().map(|unit| unit.dimension),
            measures: sensor.row().measures,
        }));
        channels
    }

    /// Those that a simulation of a gripper can give: not of other fingers, and of raw sensors only where the file says what
    /// they measure.
    pub fn simulated_on(self, gripper: &GripperModel) -> Vec<Channel> {
        let can = |channel: &Channel| match channel.quantity {
            Quantity::Raw { measures, .. } => measures.is_some(),
            _ => channel.side().is_some(),
        };
        self.channels_on(gripper).into_iter().filter(can).collect()
    }
}

impl Sensor {
    /// Its channel of a quantity on a gripper.
    fn channel_on(self, quantity: Quantity, gripper: &GripperModel) -> Channel {
        let row = self.row();
        let (length, rows) = (gripper.finger.length, gripper.taxels().rows.max(1) as f64);
        let from_rows = row.rows.map(|[from, to]| [from as f64 / rows, to as f64 / rows]);
        let from_m = row.from_m.map(|from| [from / length, row.length_m.map_or(1.0, |own| (from + own) / length)]);
        let place = if row.kind == SensorKind::Raw { &row.name } else { self.place() };
        let span = match from_rows.or(from_m) {
            Some([from, to]) => Span::between(place, from, to),
            None => Span::named(place, gripper.finger.joints),
        };
        let signals = SignalDefinition::Parts;
        Channel { quantity, finger: Cow::Borrowed(&row.finger), span, signals }
    }

    /// True where it gives a channel.
    pub fn gives(self, channel: &Channel) -> bool {
        let kind = match channel.quantity {
            Quantity::Curvature => SensorKind::Flex,
            Quantity::Pressure | Quantity::Force => SensorKind::Pad,
            Quantity::Raw { .. } => SensorKind::Raw,
            Quantity::ContactPressure => return false,
        };
        let place = if kind == SensorKind::Raw { self.channel() } else { self.place() };
        self.kind() == kind && *self.finger() == *channel.finger && channel.span.name() == place
    }
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
            None => Err(LayoutError(format!(
                "unknown sensor layout \"{name}\"; choose C1 to C8, or with --signals contact also C1+F to C8+F, with force"
            ))),
        }
    }

    /// The sensors of a gripper file as a layout, as far as simulations can give them.
    pub fn of_list(list: SensorList) -> Self {
        Self { list: Some(list), ..row(Self::OF_FILE, CurvatureSplit::Whole, PressureSplit::Whole) }
    }

    /// Name of the layout of a gripper file.
    pub const OF_FILE: &'static str = "gripper";

    /// A layout by its name, for recognisers: refuses a pad's force beside its pressure.
    pub fn learnt(name: &str, signals: SignalDefinition) -> Result<Self, LayoutError> {
        let layout = Self::named(name)?;
        match signals {
            SignalDefinition::Parts if layout.force => Err(LayoutError(format!(
                "{0}+F would hold each pad twice, for its pressure is its force over its area: choose {0}, or --signals \
                 contact for force beside the contact pressure of simulations",
                layout.name
            ))),
            _ => Ok(layout),
        }
    }

    /// The layout that is shown and exported: of pads also the force, which is the same reading in newtons.
    #[must_use]
    pub fn shown(self, signals: SignalDefinition) -> Self {
        Self { force: self.force || signals == SignalDefinition::Parts, ..self }
    }

    /// The name with which [`SensorLayout::named`] finds it again.
    pub fn full_name(&self) -> String {
        format!("{}{}", self.name, if self.force { "+F" } else { "" })
    }

    /// The channels on a gripper: curvature left and right, then pressure, then force, each from palm to tip.
    pub fn channels(&self, gripper: &GripperModel, signals: SignalDefinition) -> Result<Vec<Channel>, LayoutError> {
        if let Some(list) = self.list {
            if signals != SignalDefinition::Parts {
                return Err(LayoutError::no_such_part());
            }
            let mut channels = list.simulated_on(gripper);
            channels.retain(|channel| self.force || channel.quantity != Quantity::Force);
            return Ok(channels);
        }
        let pressure = self.pressure_spans(gripper.finger.joints);
        let grid = gripper.taxels();
        let covered = |span: &Span| (0..grid.rows).any(|r| span.holds((r as f64 + 0.5) / grid.rows as f64));
        if !pressure.iter().all(covered) {
            let (layout, sensors, rows) = (self.full_name(), pressure.len(), grid.rows);
            return Err(LayoutError(format!(
                "layout {layout} has {sensors} pressure sensors per finger, but the pad has only {rows} rows of taxels: raise \
                 gripper.pad.rows or choose a coarser layout"
            )));
        }
        let mut channels = Vec::new();
        let mut add = |quantity: Quantity, spans: &[Span]| {
            for side in Side::BOTH {
                channels.extend(spans.iter().map(|span| Channel::new(quantity, side, span.clone(), signals)));
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
        for signals in SignalDefinition::ALL {
            assert_eq!(named.channels(&GripperModel::default(), signals).expect("fits"), whole_fingers(signals));
            assert_eq!(SignalDefinition::named(signals.name()), Some(signals));
        }
    }

    #[test]
    fn contact_pressure_has_a_name_that_no_board_has_and_names_lead_back_to_quantities() {
        let names = |signals| whole_fingers(signals).iter().map(Channel::name).collect::<Vec<_>>();
        let [parts, contact, hull] = SignalDefinition::ALL.map(names);
        assert_eq!(parts[2..], ["pressure_left", "pressure_right", "force_left", "force_right"]);
        assert_eq!(contact[2..4], ["contact_pressure_left", "contact_pressure_right"]);
        assert_eq!((&contact, &contact[4..]), (&hull, &parts[4..]));
        assert_eq!(Quantity::of_name("contact_pressure_left"), Some((Quantity::ContactPressure, "left")));
        assert_eq!(Quantity::of_name("pressure_right_joint_3"), Some((Quantity::Pressure, "right_joint_3")));
        assert_eq!((Quantity::of_name("grip"), Quantity::of_name("force")), (None, None));
    }

    #[test]
    fn a_pads_force_is_shown_beside_its_pressure_and_not_learnt_twice() {
        let (parts, contact) = (SignalDefinition::Parts, SignalDefinition::Contact);
        let refused = SensorLayout::learnt("c6+f", parts).expect_err("the same signal twice");
        assert!(refused.to_string().contains("choose C6,"), "{refused}");
        assert!(SensorLayout::learnt("C6+F", contact).is_ok_and(|layout| layout.force));
        let shown = |signals| SensorLayout::learnt("C6", signals).expect("known").shown(signals).force;
        assert!(shown(parts) && !shown(contact));
    }

    #[test]
    fn every_layout_has_the_channels_it_promises() {
        let gripper = GripperModel::default();
        let per_finger = [2, 3, 6, 11, 3, 4, 7, 12];
        for (layout, want) in CATALOGUE.iter().zip(per_finger) {
            let channels = layout.channels(&gripper, SignalDefinition::Parts).expect("fits");
            assert_eq!(channels.len(), 2 * want, "{}", layout.name);
            let with_force = SensorLayout { force: true, ..layout.clone() };
            let forces = channels.iter().filter(|c| c.quantity == Quantity::Pressure).count();
            let with = with_force.channels(&gripper, SignalDefinition::Contact).expect("fits");
            assert_eq!(with.len(), 2 * want + forces);
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
        let too_fine = CATALOGUE[3].channels(&gripper, SignalDefinition::Parts).expect_err("80 joints").to_string();
        assert!(too_fine.contains("has 80 pressure sensors"), "{too_fine}");
        let unknown = SensorLayout::named("C9").expect_err("there are eight").to_string();
        assert!(unknown.contains("with --signals contact also C1+F"), "{unknown}");
        assert!(SensorLayout::named("c1+f").is_ok_and(|layout| layout.force));
    }
}
