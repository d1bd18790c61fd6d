//! Opened trials with given values, for tests.

use super::open_trial::{Column, OpenTrial};
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{TrialHeader, TrialSource};

/// A trial with these columns.
pub(crate) fn open_trial(t_s: Vec<f64>, columns: Vec<(&str, Vec<f32>)>) -> OpenTrial {
    let column = |(name, values): (&str, Vec<f32>)| Column { name: name.to_owned(), channel: None, unit: "", values };
    let header = TrialHeader::new("mug", Scene::default());
    OpenTrial {
        line_bar: vec![f64::NAN; t_s.len()],
        t_s,
        columns: columns.into_iter().map(column).collect(),
        ..OpenTrial::empty(1, String::new(), TrialSource::Imported, header)
    }
}
