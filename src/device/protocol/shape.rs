//! Which fields a board's lines have. A board repeats itself, and that is how its lines are told from noise: a line is
//! taken when it has the fields of the lines before. Other fields are believed when two lines in a row have them; a part
//! of the known ones looks like a line that was cut, and is believed only when it goes on like that. A unit belongs to its
//! field: `51k` among `512` and `513` is a damaged number, not another unit.

use super::checksum::KEY;
use super::fields::{Field, Fields, MAX_FIELDS, NAMELESS};
use palpate_tactile::board::Format;

/// Fields of one line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) format: Format,
    pub(super) fields: Fields,
    /// Words are among its fields.
    pub(super) odd: bool,
    pub(super) arrived_s: f64,
}

/// Where each field of a line goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Into the counts, at this place.
    Channel(usize),
    /// The board's time, in microseconds or milliseconds.
    Micros,
    /// The same in milliseconds.
    Millis,
    /// The sequence number.
    Sequence,
    /// Line pressure (bar).
    LineBar,
    /// The checksum, which has been looked at.
    Checksum,
    /// Nowhere: it has no name, or there are too many channels.
    Ignored,
}

impl Role {
    /// The role of a field that is no channel.
    fn named(name: &str) -> Option<Self> {
        let is = |other: &str| name.eq_ignore_ascii_case(other);
        match () {
            () if is("t_us") || is("micros") => Some(Self::Micros),
            () if is("ms") || is("t_ms") || is("millis") => Some(Self::Millis),
            () if is("seq") => Some(Self::Sequence),
            () if is("p_bar") => Some(Self::LineBar),
            () if is(KEY) => Some(Self::Checksum),
            () if name.starts_with(NAMELESS) => Some(Self::Ignored),
            () => None,
        }
    }

    /// True where a field by this name is a channel.
    pub(super) fn is_channel(name: &str) -> bool {
        Self::named(name).is_none()
    }
}

/// Lines that confirm another set of fields.
const CONFIRM: u32 = 2;
/// The same where it is a part of the known one.
const CONFIRM_PART: u32 = 20;
/// The same where words are among them, as in what a board says while it sets itself up.
const CONFIRM_ODD: u32 = 5;

/// The fields that are believed, and those that might be next.
#[derive(Clone, Debug, Default)]
pub(super) struct Shapes {
    pub(super) format: Option<Format>,
    names: Vec<String>,
    /// What stands behind their numbers, where one has come already.
    units: Vec<Option<String>>,
    roles: Vec<Role>,
    /// The newest line with other fields, and how many such came in a row.
    waiting: Option<(Candidate, u32)>,
}

/// What becomes of a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Judged {
    /// It has the known fields.
    Known(Candidate),
    /// Its fields are now known; the line before it had them too, and waited.
    Changed(Box<[Candidate; 2]>),
    /// It waits for a second one like it. How many lines are given up instead: those that waited before.
    Waits { given_up: u64 },
}

impl Shapes {
    /// What to make of a line.
    pub(super) fn judge(&mut self, line: Candidate) -> Judged {
        if self.is_known(&line) {
            for (known, field) in self.units.iter_mut().zip(&line.fields) {
                if known.is_none() {
                    *known = unit(field);
                }
            }
            // Whoever waits is given up by the caller, who has seen this line arrive.
            return Judged::Known(line);
        }
        let part = self.format == Some(line.format) && self.is_part(&line);
        let needed = match (part, line.odd) {
            (true, _) => CONFIRM_PART,
            (false, true) => CONFIRM_ODD,
            (false, false) => CONFIRM,
        };
        match self.waiting.take() {
            Some((before, count)) if before.format == line.format && same_names(&before, &line) => {
                if count + 1 >= needed {
                    self.names = line.fields.iter().map(|field| field.name.clone()).collect();
                    self.units =
                        before.fields.iter().zip(&line.fields).map(|(a, b)| unit(a).or_else(|| unit(b))).collect();
                    self.format = Some(line.format);
                    self.roles.clear();
                    return Judged::Changed(Box::new([before, line]));
                }
                self.waiting = Some((line, count + 1));
                Judged::Waits { given_up: 1 }
            }
            before => {
                self.waiting = Some((line, 1));
                Judged::Waits { given_up: u64::from(before.is_some()) }
            }
        }
    }

    /// Gives up the line that waits; true where there was one.
    pub(super) fn give_up(&mut self) -> bool {
        self.waiting.take().is_some()
    }

    /// Known fields in their order, some missing: a line that was cut.
    fn is_part(&self, line: &Candidate) -> bool {
        if line.format == Format::Csv {
            return line.fields.len() < self.names.len();
        }
        line.fields.iter().all(|field| self.names.contains(&field.name))
    }

    /// Columns have no names of their own.
    fn is_known(&self, line: &Candidate) -> bool {
        let named = |field: &Field, name: &String| line.format == Format::Csv || field.name == *name;
        let known = self.names.iter().zip(&self.units);
        self.format == Some(line.format)
            && line.fields.len() == self.names.len()
            && line
                .fields
                .iter()
                .zip(known)
                .all(|(field, (name, known))| named(field, name) && agree(&unit(field), known))
    }

    /// Where the fields go; channels that are new are added to `channels`.
    pub(super) fn roles(&mut self, channels: &mut Vec<String>) -> &[Role] {
        if self.roles.is_empty() {
            let mut role = |name: &String| {
                Role::named(name).unwrap_or_else(|| match channels.iter().position(|c| c.eq_ignore_ascii_case(name)) {
                    Some(place) => Role::Channel(place),
                    None if channels.len() >= MAX_FIELDS => Role::Ignored,
                    None => {
                        channels.push(name.clone());
                        Role::Channel(channels.len() - 1)
                    }
                })
            };
            self.roles = self.names.iter().map(&mut role).collect();
        }
        &self.roles
    }

    /// The unit behind the numbers of each channel that has one.
    pub(super) fn units(&self) -> impl Iterator<Item = (usize, &str)> {
        let channel = |role: &Role| if let Role::Channel(place) = role { Some(*place) } else { None };
        let units = self.roles.iter().zip(&self.units);
        units.filter_map(move |(role, unit)| Some((channel(role)?, unit.as_deref().filter(|unit| !unit.is_empty())?)))
    }

    /// Names of the fields.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Calls the fields by other names, one for each; true where that changes something.
    pub(super) fn rename(&mut self, names: &[String]) -> bool {
        let changed = self.names != names;
        if changed {
            self.names = names.to_vec();
            self.roles.clear();
        }
        changed
    }
}

/// A field's unit, which may be that it has none; a number that is not there says nothing of it.
fn unit(field: &Field) -> Option<String> {
    field.value.map(|_| field.unit.clone())
}

fn agree(a: &Option<String>, b: &Option<String>) -> bool {
    a.is_none() || b.is_none() || a == b
}

fn same_names(a: &Candidate, b: &Candidate) -> bool {
    let same = |(a, b): (&Field, &Field)| a.name == b.name && agree(&unit(a), &unit(b));
    a.fields.len() == b.fields.len() && a.fields.iter().zip(&b.fields).all(same)
}
