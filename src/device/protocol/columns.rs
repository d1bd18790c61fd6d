//! What the columns of CSV lines are called: by a line of names, whenever it comes; by the board's hello line; or by a
//! guess that is told as one.

use super::fields::{Cell, Field, Fields, names_a_sensor};
use palpate_tactile::board::{Board, Sensor};

/// Names for columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    header: Option<Vec<String>>,
    /// The header is from before an interruption: another sketch may be on the board by now.
    header_is_old: bool,
    origin: Origin,
}

/// Where the names in use come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Origin {
    #[default]
    Number,
    Header,
    Handshake,
    Order,
}

impl Columns {
    /// Takes names; false where they are words that would put the names of sensors out of use.
    pub(super) fn set_header(&mut self, names: Vec<String>) -> bool {
        let worse = !names_a_sensor(&names) && self.header.as_ref().is_some_and(|known| names_a_sensor(known));
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
    pub(super) fn names(&mut self, count: usize, hello: Option<&Board>) -> Vec<String> {
        let fits = |names: &&Vec<String>| names.len() == count;
        let (origin, names) = if let Some(names) = self.header.as_ref().filter(fits) {
            (Origin::Header, names.clone())
        } else if let Some(names) = hello.map(|board| &board.channels).filter(fits) {
            (Origin::Handshake, names.clone())
        } else if count == Sensor::ALL.len() {
            (Origin::Order, Sensor::ALL.iter().map(|sensor| sensor.channel().to_owned()).collect())
        } else {
            (Origin::Number, (1..=count).map(|number| format!("ch{number}")).collect())
        };
        self.origin = origin;
        names
    }

    /// The values of a line with their names.
    pub(super) fn name(&mut self, cells: Vec<Cell>, hello: Option<&Board>) -> Fields {
        let names = self.names(cells.len(), hello);
        names.into_iter().zip(cells).map(|(name, Cell { value, unit, .. })| Field { name, unit, value }).collect()
    }

    /// Where the names come from, in words.
    pub(super) fn why(&self) -> &'static str {
        match self.origin {
            Origin::Header => "a line of names says what they are",
            Origin::Handshake => "the board's first line says what they are",
            Origin::Order => {
                "no line of names was seen, so that four columns are taken for flexL, flexR, fsrL, fsrR in this order"
            }
            Origin::Number => "no line of names was seen, so that they are numbered",
        }
    }
}
