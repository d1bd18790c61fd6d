//! Accuracy job: cost and error of a scene's accuracy. It runs whole grasps of its own, so that the numbers stand there long
//! before the watched grasp is over; another scene makes it start over.

use super::job::{Job, Newer};
use super::messages::{MeasuredAccuracy, Wake};
use crate::study::accuracy_cost;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use std::sync::Arc;

/// A scene to measure, and its object.
pub(super) type AccuracyRequest = (Scene, Option<Arc<ObjectModel>>);

/// Measures the accuracy of scenes.
pub(super) fn accuracy_job(wake: Wake) -> Job<AccuracyRequest, MeasuredAccuracy> {
    Job::new("accuracy", Newer::Replaces, wake, |(scene, object): &AccuracyRequest, run| {
        let cost = accuracy_cost(scene, object.as_deref(), &|| run.stopped());
        Ok(cost.and_then(|cost| run.unless_stopped(MeasuredAccuracy { scene: scene.clone(), cost })))
    })
}
