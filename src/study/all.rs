//! All studies, as the window lists them.

use crate::frame::ListedStudy;
use crate::paper::PAPER_STUDIES;
use crate::{accuracy, effects, stability};

/// The studies of the paper, then those of the simulation.
pub fn all_studies() -> impl DoubleEndedIterator<Item = &'static dyn ListedStudy> {
    let own: [&dyn ListedStudy; 3] = [&accuracy::LISTED, &effects::LISTED, &stability::LISTED];
    PAPER_STUDIES.iter().map(|study| *study as &dyn ListedStudy).chain(own)
}

/// Finds a study by its key.
pub fn listed_study(key: &str) -> Option<&'static dyn ListedStudy> {
    all_studies().find(|study| study.card().key == key)
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
            let shown = study.shipped()?.expect("ships a result");
            assert!(!shown.stored.result.tables.is_empty() && !shown.figures.is_empty(), "{}", study.card().key);
        }
        Ok(())
    }
}
