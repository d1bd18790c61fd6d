//! The stored trials nearest to a grasp: all are resampled to the times of the class signatures and compared by their
//! distance, in spreads within a class. Only the newest trials of the store are compared, so that the work is bounded.

use crate::datasets::{SensorView, sequence_of, trial_signals};
use palpate_learn::{Sequence, Signatures};
use palpate_store::{Store, StoreError, TrialRow};
use palpate_tactile::trial::{TrialId, TrialSource};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest number of trials compared, newest first.
pub const NEWEST_TRIALS: usize = 2000;

/// Question for the trials nearest to a grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct NearestQuery {
    /// Class signatures of the model, whose channels and times are compared.
    pub signatures: Arc<Signatures>,
    /// Sensors through which simulated trials are read.
    pub view: SensorView,
    /// Trial to leave out: the grasp itself.
    pub except: Option<TrialId>,
    /// Number of trials wanted.
    pub count: usize,
}

/// A stored trial and its distance from a grasp.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NearestTrial {
    /// Number in the store.
    pub id: TrialId,
    /// Label; empty while unlabelled.
    pub label: String,
    /// Origin.
    #[serde(rename = "rig")]
    pub source: TrialSource,
    /// Root mean square difference, in spreads within a class.
    pub distance: f64,
}

/// The nearest trials.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NearestReport {
    /// The trials, nearest first.
    pub trials: Vec<NearestTrial>,
    /// Trials compared.
    pub compared: usize,
    /// Trials left out: of other channels, not calibrated or unreadable.
    pub left_out: usize,
    /// Trials in the store that are older than those.
    pub older: usize,
}

/// Resampled trials of a store, kept between questions.
#[derive(Debug, Default)]
pub struct TrialIndex {
    /// Signatures and sensors by which they were read.
    read_by: Option<(Arc<Signatures>, SensorView)>,
    /// Resampled channels of each trial; none for a trial that cannot be compared.
    trials: BTreeMap<TrialId, Option<Vec<f32>>>,
}

impl TrialIndex {
    /// Finds the trials nearest to a grasp; `None` once `stop` is set. `progress` gets the number of trials compared and
    /// their total.
    pub fn nearest(
        &mut self,
        store: &Store,
        grasp: &Sequence,
        query: &NearestQuery,
        stop: &AtomicBool,
        progress: &dyn Fn(usize, usize),
    ) -> Result<Option<NearestReport>, StoreError> {
        let mut rows = store.list(false)?;
        rows.retain(|row| row.state == "complete" && Some(row.id) != query.except);
        let older = rows.len().saturating_sub(NEWEST_TRIALS);
        let rows = &rows[older..];
        self.keep(query, rows.first().map(|row| row.id));
        let own = query.signatures.resampled(grasp);
        let mut report = NearestReport { older, ..NearestReport::default() };
        for (k, row) in rows.iter().rev().enumerate() {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            progress(k, rows.len());
            let Some(other) = self.resampled(store, row, query) else {
                report.left_out += 1;
                continue;
            };
            let distance = query.signatures.distance(&own, &other);
            report.compared += 1;
            let place = report.trials.partition_point(|nearer| nearer.distance <= distance);
            if place < query.count && distance.is_finite() {
                let (id, label, source) = (row.id, row.object.clone(), row.source);
                report.trials.insert(place, NearestTrial { id, label, source, distance });
                report.trials.truncate(query.count);
            }
        }
        Ok(Some(report))
    }

    /// Forgets what was read otherwise, and trials that are not compared any more.
    fn keep(&mut self, query: &NearestQuery, oldest: Option<TrialId>) {
        let same = self
            .read_by
            .as_ref()
            .is_some_and(|(signatures, view)| Arc::ptr_eq(signatures, &query.signatures) && *view == query.view);
        if !same {
            self.trials.clear();
            self.read_by = Some((Arc::clone(&query.signatures), query.view.clone()));
        }
        self.trials.retain(|id, _| oldest.is_some_and(|oldest| *id >= oldest));
    }

    fn resampled(&mut self, store: &Store, row: &TrialRow, query: &NearestQuery) -> Option<Vec<f32>> {
        if let Some(known) = self.trials.get(&row.id) {
            return known.clone();
        }
        let read = trial_signals(store, row.id, row.source, &query.view).ok();
        let chosen = read.and_then(|read| read.signals.chosen(query.signatures.channels()));
        let values = chosen.filter(|signals| !signals.is_empty());
        let values = values.map(|signals| query.signatures.resampled(&sequence_of(&signals)));
        // A newer calibration changes what a recorded trial reads.
        if row.source != TrialSource::Recorded {
            self.trials.insert(row.id, values.clone());
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_learn::{Dataset, Example, Shipped};
    use palpate_sim::scene::Scene;

    static NEVER: AtomicBool = AtomicBool::new(false);

    fn scene(object: &str) -> Scene {
        let mut scene = Scene::default();
        scene.object.source = object.to_owned();
        scene
    }

    #[test]
    fn the_nearest_of_a_copy_is_itself_and_other_objects_are_farther() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = Store::open(&folder.path().join("s.sqlite")).unwrap();
        let model = Shipped::PerfectSensors.model().unwrap();
        let view = SensorView::of_model(&model.card);
        let mut grasps = Vec::new();
        // With seeds of their own: the store keeps one trial of each grasp.
        for (seed, name) in ["lemon", "tomato", "lemon", "case"].into_iter().enumerate() {
            let scene = scene(name);
            let object = scene.load_object().unwrap();
            let trial = grasp(&scene, object.as_ref(), seed as u64);
            grasps.push(sequence_of(&view.signals(&trial).unwrap()));
            store.insert(&trial).unwrap();
        }
        let examples = grasps.iter().zip([10, 16, 10, 4]).enumerate();
        let examples = examples.map(|(k, (grasp, class))| Example {
            id: k as i64,
            class,
            grasp: Arc::new(grasp.clone()),
            ..Example::default()
        });
        let data = Dataset {
            channels: model.card.channels.clone(),
            labels: model.card.labels.clone(),
            examples: examples.collect(),
            ..Dataset::default()
        };
        let signatures = Arc::new(Signatures::of(&data).unwrap());
        let mut query = NearestQuery { signatures, view, except: None, count: 3 };
        let mut index = TrialIndex::default();
        let found = index.nearest(&store, &grasps[0], &query, &NEVER, &|_, _| ()).unwrap().unwrap();
        let places: Vec<(TrialId, &str)> = found.trials.iter().map(|t| (t.id, t.label.as_str())).collect();
        assert_eq!(places[..2], [(3, "lemon"), (1, "lemon")], "both copies, the newer first");
        assert_eq!((found.trials[0].distance, found.trials[1].distance), (0.0, 0.0));
        assert!(found.trials[2].distance > 1.0, "{:?}", found.trials[2]);
        assert_eq!((found.compared, found.left_out, found.older), (4, 0, 0));
        // Without the trial itself; what was read is kept.
        query.except = Some(3);
        let found = index.nearest(&store, &grasps[0], &query, &NEVER, &|_, _| ()).unwrap().unwrap();
        assert_eq!((found.trials[0].id, found.compared, index.trials.len()), (1, 3, 4));
        assert!(index.nearest(&store, &grasps[0], &query, &AtomicBool::new(true), &|_, _| ()).unwrap().is_none());
    }
}
