//! Clearances known from earlier steps: most rays meet nothing, and need not be cast again before the ways gone since
//! add up to what was free.

use super::model::PhysicsModel;
use crate::gripper::SegmentPose;
use glam::{DMat3, DVec3};

/// Distances as they were when last computed, and the ways gone.
#[derive(Clone, Debug)]
pub(super) struct Clearances {
    /// Way that any point of each segment has gone relative to the object or to the world, at most (m).
    ways: Vec<f64>,
    /// Clearance of each segment and of each contact spring's foot, plus the way gone when it was computed (m).
    links: Vec<f64>,
    springs: Vec<f64>,
    segments: Vec<SegmentPose>,
    object: (DMat3, DVec3),
}

impl Clearances {
    pub(super) fn new(model: &PhysicsModel) -> Self {
        Self {
            ways: vec![0.0; model.link_count()],
            links: vec![f64::NEG_INFINITY; model.link_count()],
            springs: vec![f64::NEG_INFINITY; 2 * model.springs.all.len()],
            segments: vec![SegmentPose::default(); model.link_count()],
            object: (DMat3::IDENTITY, DVec3::ZERO),
        }
    }

    /// Adds the ways from the last layout to this one.
    ///
    /// `object`: its rotation and its centre.
    pub(super) fn follow(&mut self, model: &PhysicsModel, segments: &[SegmentPose], object: Option<(DMat3, DVec3)>) {
        let links = model.chain.joints + 1;
        let depth = model.skin.thickness.max(model.skin.back);
        let (mut moved, mut turned, mut centre) = (0.0, 0.0, DVec3::ZERO);
        if let Some((axes, place)) = object {
            let change = axes - self.object.0;
            turned = change.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
            moved = (place - self.object.1).length();
            (self.object, centre) = ((axes, place), place);
        }
        for (link, (now, before)) in segments.iter().zip(&mut self.segments).enumerate() {
            let lever = model.chain.lengths[link % links] + depth;
            let from_centre = model.planes[link / links].point(now.start, 0.0) - centre;
            let arm = from_centre.length() + lever + model.skin.width;
            let own = (now.start - before.start).length() + (now.along - before.along).length() * lever;
            self.ways[link] += own + moved + turned * arm;
            *before = *now;
        }
    }

    /// Least clearance of a segment at present (m).
    #[inline]
    pub(super) fn of_link(&self, link: usize) -> f64 {
        self.links[link] - self.ways[link]
    }

    pub(super) fn note_link(&mut self, link: usize, clearance: f64) {
        self.links[link] = clearance + self.ways[link];
    }

    /// Least distance of a contact spring's foot from everything at present (m).
    #[inline]
    pub(super) fn of_spring(&self, spring: usize, link: usize) -> f64 {
        self.springs[spring] - self.ways[link]
    }

    pub(super) fn note_spring(&mut self, spring: usize, link: usize, clearance: f64) {
        self.springs[spring] = clearance + self.ways[link];
    }
}
