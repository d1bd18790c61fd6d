//! The fields of a board's lines. A board repeats its fields, and noise does not: a line is accepted when it has the
//! fields of the previous lines. Other fields are accepted when two lines in a row have them; a part of the known
//! fields looks like a line that was cut, and is accepted only when twenty lines in a row have it.

use super::checksum::KEY;
use super::fields::{Field, Fields, MAX_FIELDS, NAMELESS};
use palpate_tactile::board::Format;

/// Fields of one line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) format: Format,
    pub(super) fields: Fields,
    pub(super) arrived_s: f64,
}

/// Role of a field of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Counts, at this place.
    Channel(usize),
    /// The board's time, in microseconds.
    Micros,
    /// The board's time, in milliseconds.
    Millis,
    /// The sequence number.
    Sequence,
    /// Line pressure (bar).
    LineBar,
    /// The checksum, already verified.
    Checksum,
    /// Ignored: the field has no name, or there are too many channels.
    Ignored,
}

impl Role {
    /// The role of a field that is not a channel.
    fn named(name: &str) -> Option<Self> {
        let is = |other: &str| name.eq_ignore_ascii_case(other);
        match () {
            () if ["t_us", "micros", "time_us"].into_iter().any(is) => Some(Self::Micros),
            () if ["ms", "t_ms", "millis", "time_ms"].into_iter().any(is) => Some(Self::Millis),
            () if is("seq") => Some(Self::Sequence),
            () if is("p_bar") => Some(Self::LineBar),
            () if is(KEY) => Some(Self::Checksum),
            () if name.starts_with(NAMELESS) => Some(Self::Ignored),
            () => None,
        }
    }

    /// The board's time in a line, where it has one (s).
    pub(super) fn time_s(fields: &[Field]) -> Option<f64> {
        let time = |field: &Field| match Self::named(&field.name)? {
            Self::Micros => Some(1e-6 * field.value?),
            Self::Millis => Some(1e-3 * field.value?),
            _ => None,
        };
        fields.iter().find_map(time)
    }

    /// True where a field of this name is a channel.
    pub(super) fn is_channel(name: &str) -> bool {
        Self::named(name).is_none()
    }
}

/// Lines that confirm another set of fields.
const CONFIRM: u32 = 2;
/// Lines that confirm a set of fields that is a part of the known one.
const CONFIRM_PART: u32 = 20;

/// Accepted fields, and the candidates for others.
#[derive(Clone, Debug, Default)]
pub(super) struct Shapes {
    pub(super) format: Option<Format>,
    names: Vec<String>,
    roles: Vec<Role>,
    /// Newest line with other fields, and how many such came in a row.
    waiting: Option<(Candidate, u32)>,
}

/// Verdict on a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LineVerdict {
    /// The line has the known fields.
    Known(Candidate),
    /// The fields of the line are now accepted; the previous line, which also had them, waited.
    Changed(Box<[Candidate; 2]>),
    /// The line waits for another like it, in place of `given_up` lines that waited before.
    Waits { given_up: u64 },
}

impl Shapes {
    /// Judges a line.
    pub(super) fn judge(&mut self, line: Candidate) -> LineVerdict {
        if self.is_known(&line) {
            // The caller, who has seen this line arrive, gives up the line that waits.
            return LineVerdict::Known(line);
        }
        let part = self.format == Some(line.format) && self.is_part(&line);
        let needed = if part { CONFIRM_PART } else { CONFIRM };
        match self.waiting.take() {
            Some((before, count)) if before.format == line.format && same_names(&before, &line) => {
                if count + 1 >= needed {
                    self.names = line.fields.iter().map(|field| field.name.clone()).collect();
                    self.format = Some(line.format);
                    self.roles.clear();
                    return LineVerdict::Changed(Box::new([before, line]));
                }
                self.waiting = Some((line, count + 1));
                LineVerdict::Waits { given_up: 1 }
            }
            before => {
                self.waiting = Some((line, 1));
                LineVerdict::Waits { given_up: u64::from(before.is_some()) }
            }
        }
    }

    /// Gives up the waiting line; true where there was one.
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
        self.format == Some(line.format)
            && line.fields.len() == self.names.len()
            && line.fields.iter().zip(&self.names).all(|(field, name)| named(field, name))
    }

    /// Roles of the fields; new channels are added to `channels`.
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

    /// Names of the fields.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Renames the fields; true where that changes something.
    pub(super) fn rename(&mut self, names: &[String]) -> bool {
        let changed = self.names != names;
        if changed {
            self.names = names.to_vec();
            self.roles.clear();
        }
        changed
    }
}

fn same_names(a: &Candidate, b: &Candidate) -> bool {
    a.fields.len() == b.fields.len() && a.fields.iter().zip(&b.fields).all(|(a, b)| a.name == b.name)
}
