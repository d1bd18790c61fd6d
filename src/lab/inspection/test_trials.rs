//! Opened trials with given values, for tests.

use super::open_trial::{Column, OpenTrial};
use crate::datasets::SensorView;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{TrialHeader, TrialSource};

/// A trial with these columns.
pub(crate) fn open_trial(t_s: Vec<f64>, columns: Vec<(&str, Vec<f32>)>) -> OpenTrial {
    let column = |(name, values): (&str, Vec<f32>)| Column { name: name.to_owned(), channel: None, unit: "", values };
    OpenTrial {
        id: 1,
        source: TrialSource::Imported,
        created: String::new(),
        header: TrialHeader::new("mug", Scene::default()),
        title: "Mug".to_owned(),
        sensors: SensorView::default(),
        line_bar: vec![f64::NAN; t_s.len()],
        t_s,
        columns: columns.into_iter().map(column).collect(),
        board: None,
        phases: Vec::new(),
        simulated: None,
        stage: None,
        frames: Vec::new(),
        answers: Vec::new(),
        recognition_off: None,
        remarks: Vec::new(),
    }
}
