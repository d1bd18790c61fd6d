//! Teleplot sends one number to a line; a reading is complete when a name comes again or the time moves on.

use super::fields::{Field, Fields, MAX_FIELDS};

/// Gathers numbers into readings.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembler {
    gathered: Fields,
    time: Option<f64>,
}

impl Assembler {
    /// Takes in the fields of a line, a number and perhaps its time; hands over the reading that it ends.
    pub(super) fn push(&mut self, fields: Fields) -> Option<Fields> {
        let time = fields.iter().find(|field| field.name == "ms").and_then(|field| field.value);
        let value = fields.into_iter().next()?;
        let known = self.gathered.iter().any(|field| field.name == value.name);
        let moved = self.time.is_some() && self.time != time;
        let ended = (known || moved || self.gathered.len() >= MAX_FIELDS).then(|| self.take());
        self.time = time;
        self.gathered.push(value);
        ended
    }

    fn take(&mut self) -> Fields {
        let mut fields = std::mem::take(&mut self.gathered);
        if let Some(time) = self.time {
            fields.push(Field { name: "ms".to_owned(), unit: String::new(), value: Some(time) });
        }
        fields
    }
}
