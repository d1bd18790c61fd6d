//! Checks of the last finished grasp: other runs to compare with, and the grasp computed again.

use super::super::messages::{Checking, FinishedGrasp, TraceRow};
use super::Session;
use super::jobs::{CheckRequest, CheckResult, Subject};
use crate::grasping::{GraspComparison, GraspSummary, Row};
use crate::recording::Recorder;
use palpate_tactile::trial::SimulatedTrial;
use std::sync::Arc;

impl Session {
    /// Compares the grasp that has just ended with other runs, where it can be computed again.
    pub(super) fn begin_check(&mut self, subject: Option<Subject>) {
        self.status.checking = None;
        self.subject = subject;
        self.checker.stop();
        // What is red already needs no comparison.
        let sound = self.last.as_ref().is_some_and(|last| last.summary.quality.is_sound());
        if let Some(subject) = self.subject.as_ref().filter(|_| sound) {
            self.checker.start(CheckRequest::Compare(subject.clone()));
            self.status.checking = Some(Checking::Comparing);
        }
    }

    /// Pauses, and computes the last finished grasp again until levels of accuracy agree.
    pub(super) fn compute_again(&mut self) {
        if let Some(subject) = &self.subject {
            self.checker.start(CheckRequest::ComputeAgain(subject.clone()));
            self.status.checking = Some(Checking::ComputingAgain);
            self.status.playing = false;
            self.status.actual_speed = 0.0;
        }
    }

    /// Takes in what the jobs have found.
    pub(super) fn take_results(&mut self) {
        if !self.accuracy.take().is_empty() | !self.ghost.take().is_empty() {
            self.publish();
        }
        let settled = self.checker.is_settled();
        // A check that failed leaves the grasp as it is.
        for result in self.checker.take().into_iter().filter_map(|ended| ended.outcome.ok()) {
            let answered = match &*result {
                CheckResult::Compared { grasp, found } => {
                    self.take_comparison(*grasp, *found);
                    Checking::Comparing
                }
                CheckResult::ComputedAgain { grasp, trial } => {
                    self.take_again(*grasp, trial);
                    Checking::ComputingAgain
                }
            };
            self.status.checking = self.status.checking.filter(|checking| *checking != answered);
            self.publish();
        }
        // A check that was cancelled ends without a result.
        if settled && self.status.checking.take().is_some() {
            self.publish();
        }
    }

    /// The recorder, where it has the checked grasp.
    fn recorder_of_subject(&self) -> Option<&Recorder> {
        self.recorder.as_ref().filter(|_| self.subject.as_ref().is_some_and(|subject| subject.recorded))
    }

    fn take_comparison(&mut self, grasp: u64, found: GraspComparison) {
        let Some(last) = self.last.as_ref().filter(|last| last.grasp == grasp) else { return };
        let mut last = FinishedGrasp::clone(last);
        found.note(&mut last.summary.quality);
        if let Some(recorder) = self.recorder_of_subject() {
            recorder.note_quality(last.summary.quality.clone());
        }
        self.last = Some(Arc::new(last));
    }

    /// Shows and stores a grasp that was computed again instead of the one before.
    fn take_again(&mut self, grasp: u64, trial: &SimulatedTrial) {
        let Some(last) = self.last.as_ref().filter(|last| last.grasp == grasp) else { return };
        let scene = &trial.header.scene;
        let (summary, repeatable) = (GraspSummary::new(trial, scene), last.repeatable);
        let accuracy = scene.solver.accuracy;
        self.last = Some(Arc::new(FinishedGrasp { grasp, summary, accuracy, repeatable }));
        if let Some(recorder) = self.recorder_of_subject() {
            let mut trial = trial.clone();
            trial.header.earlier = self.current.as_ref().and_then(|current| current.earlier.clone());
            recorder.replace(trial);
        }
        let Some(current) = self.current.as_mut().filter(|current| current.ended && self.grasp == grasp) else {
            return;
        };
        let plotted = self.channels.len();
        for frame in trial.frames() {
            let mut sample = Row::of_frame(frame, &current.reader);
            sample.values = sample.values[..plotted].into();
            let (errors, frame) = (Box::default(), Some(Arc::new(frame.clone())));
            // The recogniser has answered to the first computation only.
            self.publisher.row(TraceRow { grasp, rolling: false, sample, closing_s: 0.0, errors, frame, answer: None });
        }
        if let Some(frame) = trial.frames().last() {
            current.frame = Arc::new(frame.clone());
        }
        current.plan = Arc::new(trial.data.plan.clone());
        current.scene = Arc::new(scene.clone());
    }
}
