//! All studies, as the window lists them.

use crate::frame::ListedStudy;
use crate::paper::PAPER_STUDIES;
use crate::{accuracy, added_sensors, answers, effects, public, sensor_faults, stability};

/// The studies of the paper, then those of answers and of the simulation.
pub fn all_studies() -> impl DoubleEndedIterator<Item = &'static dyn ListedStudy> {
    let own: [&dyn ListedStudy; 5] =
        [&answers::LISTED, &added_sensors::LISTED, &accuracy::LISTED, &effects::LISTED, &stability::LISTED];
    PAPER_STUDIES.iter().map(|study| *study as &dyn ListedStudy).chain(own)
}

/// Finds a study by its key.
pub fn listed_study(key: &str) -> Option<&'static dyn ListedStudy> {
    all_studies().find(|study| study.card().key == key)
}

/// Name of a study by its key, of the list or not.
pub fn study_title(key: &str) -> Option<&'static str> {
    let unlisted = [(public::PUBLIC, public::TITLE), (sensor_faults::SENSOR_FAULTS, sensor_faults::TITLE)];
    let title = unlisted.into_iter().find(|(own, _)| *own == key).map(|(_, title)| title);
    title.or_else(|| listed_study(key).map(|study| study.card().title))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_study_has_a_key_of_its_own_and_shows_its_full_result() -> Result<(), serde_json::Error> {
        let keys: BTreeSet<&str> = all_studies().map(|study| study.card().key).collect();
        assert_eq!(keys.len(), all_studies().count());
        for study in all_studies() {
            let shown = study.shipped()?.unwrap_or_else(|| panic!("{} ships no result", study.card().key));
            assert!(!shown.stored.result.tables.is_empty() && !shown.figures.is_empty(), "{}", study.card().key);
        }
        Ok(())
    }
}
