//! Clearances known from earlier steps: most rays meet nothing, and need not be cast again before the ways gone since
//! add up to what was free.

use super::model::PhysicsModel;
use crate::gripper::{SegmentFrame, SegmentPose};
use glam::{DMat3, DVec3};

/// Distances as they were when last computed, and the ways gone.
#[derive(Clone, Debug)]
pub(super) struct Clearances {
    /// Way that any point of each segment has gone relative to the object or to the world, at most (m).
    ways: Vec<f64>,
    /// Clearance of each segment and of each contact spring's foot, plus the way gone when it was computed (m).
    links: Vec<f64>,
    springs: Vec<f64>,
    /// Clearance between the fingers, plus the way that they had gone towards each other then, and that way now (m).
    fingers: f64,
    fingers_way: f64,
    segments: Vec<SegmentPose>,
    /// The same in space; none where fingers stay in their planes.
    frames: Vec<SegmentFrame>,
    object: (DMat3, DVec3),
    /// Way that any point of the object has gone, at most (m).
    object_way: f64,
    resting: Nearby,
    world: DVec3,
}

/// Places where the object may rest on its support soon.
#[derive(Clone, Debug)]
pub(super) struct Nearby {
    /// Resting points of the object.
    pub(super) points: Vec<u32>,
    /// Points of the pedestal's rim.
    pub(super) rim: Vec<u32>,
    /// Gap below which these are all, at the way of the object then (m).
    gap: f64,
    way: f64,
}

/// Way of the object for which nearby places are collected ahead (m).
const COLLECTED_AHEAD: f64 = 2e-3;

impl Clearances {
    pub(super) fn new(model: &PhysicsModel) -> Self {
        Self {
            ways: vec![0.0; model.link_count()],
            links: vec![f64::NEG_INFINITY; model.link_count()],
            springs: vec![f64::NEG_INFINITY; 2 * model.springs.all.len()],
            fingers: f64::NEG_INFINITY,
            fingers_way: 0.0,
            segments: vec![SegmentPose::default(); model.link_count()],
            frames: vec![SegmentFrame::default(); if model.sideways.is_some() { model.link_count() } else { 0 }],
            object: (DMat3::IDENTITY, DVec3::ZERO),
            object_way: 0.0,
            resting: Nearby {
                points: Vec::with_capacity(model.resting_points()),
                rim: Vec::with_capacity(model.environment.rim().len()),
                gap: f64::NEG_INFINITY,
                way: 0.0,
            },
            world: DVec3::ZERO,
        }
    }

    /// Adds the ways from the last layout to this one.
    ///
    /// `object`: its rotation and its centre; `world`: its displacement (m).
    #[inline]
    pub(super) fn follow(
        &mut self,
        model: &PhysicsModel,
        (segments, frames): (&[SegmentPose], &[SegmentFrame]),
        object: Option<(DMat3, DVec3)>,
        world: DVec3,
    ) {
        let links = model.chain.joints + 1;
        let depth = model.skin.thickness.max(model.skin.back);
        let (mut moved, mut turned, mut centre) = ((world - self.world).length(), 0.0, DVec3::ZERO);
        self.world = world;
        if let Some((axes, place)) = object {
            let change = axes - self.object.0;
            turned = change.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
            moved += (place - self.object.1).length();
            (self.object, centre) = ((axes, place), place);
            self.object_way += moved + turned * model.body.as_ref().map_or(0.0, |body| body.radius);
        }
        let mut farthest = [0.0f64; 2];
        if frames.is_empty() {
            for (link, (now, before)) in segments.iter().zip(&mut self.segments).enumerate() {
                let lever = model.chain.lengths[link % links] + depth;
                let from_centre = model.planes[link / links].point(now.start, 0.0) - centre;
                let arm = from_centre.length() + lever + model.skin.width;
                let own = (now.start - before.start).length() + (now.along - before.along).length() * lever;
                self.ways[link] += own + moved + turned * arm;
                farthest[link / links] = farthest[link / links].max(own);
                *before = *now;
            }
        }
        for (link, (now, before)) in frames.iter().zip(&mut self.frames).enumerate() {
            let lever = model.chain.lengths[link % links] + depth + model.skin.width;
            let arm = (now.start - centre).length() + lever;
            let axes = (now.axes - before.axes).to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
            let own = (now.start - before.start).length() + axes * lever;
            self.ways[link] += own + moved + turned * arm;
            farthest[link / links] = farthest[link / links].max(own);
            *before = *now;
        }
        self.fingers_way += farthest[0] + farthest[1];
    }

    /// Least clearance of a segment at present (m).
    #[inline]
    pub(super) fn of_link(&self, link: usize) -> f64 {
        self.links[link] - self.ways[link]
    }

    pub(super) fn note_link(&mut self, link: usize, clearance: f64) {
        self.links[link] = clearance + self.ways[link];
    }

    /// Places that are closer than `gap` (m), and some more; `collect` finds those closer than what it is given.
    #[inline]
    pub(super) fn resting(&mut self, gap: f64, collect: impl FnOnce(f64, &mut Nearby)) -> &Nearby {
        let gone = self.object_way - self.resting.way;
        if gap + gone > self.resting.gap {
            self.resting.points.clear();
            self.resting.rim.clear();
            (self.resting.gap, self.resting.way) = (gap + COLLECTED_AHEAD, self.object_way);
            collect(gap + COLLECTED_AHEAD, &mut self.resting);
        }
        &self.resting
    }

    /// Least clearance between the fingers at present (m).
    pub(super) fn of_fingers(&self) -> f64 {
        self.fingers - self.fingers_way
    }

    pub(super) fn note_fingers(&mut self, clearance: f64) {
        self.fingers = clearance + self.fingers_way;
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
