//! Names of the columns of CSV lines: from a header, whenever it comes; from the handshake; or assumed, which
//! [`Columns::why`] states.

use super::fields::{Field, Fields, names_a_sensor};
use palpate_tactile::board::{Board, SensorList};

/// Names for columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    sensors: SensorList,
    header: Option<Vec<String>>,
    /// The header is from before an interruption: another sketch may be on the board by now.
    header_is_old: bool,
    origin: Origin,
}

/// Origin of the names in use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Origin {
    #[default]
    Number,
    Header,
    Handshake,
    Order,
}

impl Columns {
    /// Names for columns of these sensors.
    pub(super) fn new(sensors: SensorList) -> Self {
        Self { sensors, ..Self::default() }
    }

    /// Sensors of the gripper.
    pub(super) fn sensors(&self) -> SensorList {
        self.sensors
    }

    /// Takes names; false where they are words that would put the names of sensors out of use.
    pub(super) fn set_header(&mut self, names: Vec<String>) -> bool {
        let has_sensor = |names: &[String]| names_a_sensor(names, self.sensors);
        let worse = !has_sensor(&names) && self.header.as_ref().is_some_and(|known| has_sensor(known));
        let taken = !worse || self.header_is_old;
        if taken {
            (self.header, self.header_is_old) = (Some(names), false);
        }
        taken
    }

    /// The stream was interrupted.
    pub(super) fn interrupt(&mut self) {
        self.header_is_old = true;
    }

    /// Names for this many columns.
    pub(super) fn names(&mut self, count: usize, handshake: Option<&Board>) -> Vec<String> {
        let fits = |names: &&Vec<String>| names.len() == count;
        let (origin, names) = if let Some(names) = self.header.as_ref().filter(fits) {
            (Origin::Header, names.clone())
        } else if let Some(names) = handshake.map(|board| &board.channels).filter(fits) {
            (Origin::Handshake, names.clone())
        } else if count == self.sensors.len() {
            (Origin::Order, self.sensors.iter().map(|sensor| sensor.channel().to_owned()).collect())
        } else {
            (Origin::Number, (1..=count).map(|number| format!("ch{number}")).collect())
        };
        self.origin = origin;
        names
    }

    /// The values of a line with their names.
    pub(super) fn name(&mut self, values: Vec<Option<f64>>, handshake: Option<&Board>) -> Fields {
        let names = self.names(values.len(), handshake);
        names.into_iter().zip(values).map(|(name, value)| Field { name, value }).collect()
    }

    /// Origin of the names, in words.
    pub(super) fn why(&self) -> String {
        match self.origin {
            Origin::Header => "a header names them".to_owned(),
            Origin::Handshake => "the handshake names them".to_owned(),
            Origin::Order => {
                let count = match self.sensors.len() {
                    4 => "four".to_owned(),
                    many => many.to_string(),
                };
                format!("no header seen: {count} columns are assumed to be {} in this order", self.sensors.names())
            }
            Origin::Number => "no header seen: columns are numbered".to_owned(),
        }
    }
}
