//! Traces of the current grasp and of the few before it, for the plots.

use palpate_lab::grasping::IdentificationView;
use palpate_lab::workers::TraceRow;
use palpate_sim::frame::Frame;
use std::collections::VecDeque;
use std::sync::Arc;

/// Grasps that are kept.
const KEPT: usize = 4;

/// Samples of one grasp, column by column.
#[derive(Clone, Debug, Default)]
pub struct GraspTrace {
    /// Number of the grasp.
    pub grasp: u64,
    /// Live stream outside of grasps: only its last seconds are kept.
    pub rolling: bool,
    /// Its trial was discarded: it is not drawn behind later ones.
    pub discarded: bool,
    /// Time at which the fingers begin to close (s); zero where unknown.
    pub closing_s: f64,
    /// Times (s).
    pub t: Vec<f64>,
    /// Line pressures (bar).
    pub line_bar: Vec<f64>,
    /// Channel by channel, NaN where undefined.
    pub channels: Vec<Vec<f32>>,
    /// Estimated numerical errors, channel by channel; empty without an error band.
    pub errors: Vec<Vec<f32>>,
    /// Fingers and object, sample by sample; none of a real gripper.
    pub frames: Vec<Option<Arc<Frame>>>,
    /// Answers of the recogniser, sample by sample.
    pub answers: Vec<Option<Arc<IdentificationView>>>,
}

/// Length kept of a live stream (s), and how much more may gather before it is cut (s).
const ROLLING_S: [f64; 2] = [12.0, 4.0];
/// The same of a grasp: an endless recording must not fill the memory.
const GRASP_S: [f64; 2] = [120.0, 30.0];

impl GraspTrace {
    /// The sample at a time (s), or the last before it; none before the first.
    pub fn sample_at(&self, t_s: f64) -> Option<usize> {
        self.t.partition_point(|t| *t <= t_s + 1e-9).checked_sub(1)
    }

    /// First and last time (s); zero without samples.
    pub fn span(&self) -> [f64; 2] {
        [self.t.first(), self.t.last()].map(|t| t.copied().unwrap_or(0.0))
    }

    /// Times without readings (s); a row without any number marks the beginning of each.
    pub fn gaps(&self) -> Vec<[f64; 2]> {
        let empty = |k: &usize| !self.channels.is_empty() && self.channels.iter().all(|channel| channel[*k].is_nan());
        let end = |k: usize| self.t.get(k + 1).copied();
        let marks = (0..self.t.len()).filter(|k| self.line_bar[*k].is_nan() && empty(k));
        marks.filter_map(|k| Some([self.t[k], end(k)?])).filter(|[from, to]| to > from).collect()
    }

    /// Forgets all samples.
    fn clear(&mut self) {
        self.t.clear();
        self.line_bar.clear();
        self.frames.clear();
        self.answers.clear();
        self.channels.iter_mut().chain(&mut self.errors).for_each(Vec::clear);
    }

    /// Forgets old samples.
    fn cut(&mut self) {
        let [kept, more] = if self.rolling { ROLLING_S } else { GRASP_S };
        let Some(last) = self.t.last().copied() else { return };
        if self.t.first().is_some_and(|first| last - first <= kept + more) {
            return;
        }
        let old = self.t.partition_point(|t| *t < last - kept);
        self.t.drain(..old);
        self.line_bar.drain(..old);
        self.frames.drain(..old.min(self.frames.len()));
        self.answers.drain(..old.min(self.answers.len()));
        for channel in self.channels.iter_mut().chain(&mut self.errors) {
            channel.drain(..old.min(channel.len()));
        }
    }
}

/// Traces of the last grasps, oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct TraceHistory {
    grasps: VecDeque<GraspTrace>,
    /// The last grasp is shown rather than the stream since.
    held: bool,
}

impl TraceHistory {
    /// Adds a sample; a new grasp begins a new trace and pushes out the oldest.
    pub(super) fn push(&mut self, row: &TraceRow) {
        if self.grasps.back().is_none_or(|last| last.grasp != row.grasp) {
            // A stream before a grasp is nothing to compare it with.
            self.grasps.retain(|trace| !trace.rolling);
            if self.grasps.len() == KEPT {
                self.grasps.pop_front();
            }
            // Only the current grasp is looked back on; the earlier ones are faint curves.
            for earlier in &mut self.grasps {
                (earlier.frames, earlier.answers) = Default::default();
            }
            let channels = vec![Vec::new(); row.sample.values.len()];
            let errors = vec![Vec::new(); row.errors.len()];
            self.grasps.push_back(GraspTrace {
                grasp: row.grasp,
                rolling: row.rolling,
                channels,
                errors,
                ..GraspTrace::default()
            });
        }
        let Some(last) = self.grasps.back_mut() else { return };
        // A grasp that is computed again replaces its trace.
        if !row.rolling && last.t.len() > 1 && row.sample.t_s <= last.t[0] {
            last.clear();
        }
        last.closing_s = row.closing_s;
        last.t.push(row.sample.t_s);
        last.line_bar.push(row.sample.line_bar);
        last.frames.push(row.frame.clone());
        last.answers.push(row.answer.clone());
        // A changed layout has other channels; a trace never mixes two.
        for (channel, value) in last.channels.iter_mut().zip(row.sample.values.iter()) {
            channel.push(*value);
        }
        for (channel, error) in last.errors.iter_mut().zip(row.errors.iter()) {
            channel.push(*error);
        }
        last.cut();
    }

    /// Shows a whole grasp alone.
    pub(super) fn show(&mut self, trace: GraspTrace) {
        self.grasps.clear();
        self.grasps.push_back(trace);
    }

    /// Forgets the grasps before this one: they had another scene.
    pub(super) fn forget_before(&mut self, grasp: u64) {
        self.grasps.retain(|trace| trace.grasp >= grasp);
    }

    /// The trial of the last grasp is discarded.
    pub(super) fn discard(&mut self) {
        if let Some(last) = self.grasps.iter_mut().rfind(|trace| !trace.rolling) {
            last.discarded = true;
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.grasps.clear();
    }

    /// Shows the last grasp rather than the stream after it, or the newest of either.
    pub(super) fn hold_grasp(&mut self, held: bool) {
        self.held = held;
    }

    /// Current grasp or stream.
    pub(super) fn current(&self) -> Option<&GraspTrace> {
        self.place().and_then(|place| self.grasps.get(place))
    }

    /// The grasp or stream that goes on.
    pub(super) fn newest(&self) -> Option<&GraspTrace> {
        self.grasps.back()
    }

    fn place(&self) -> Option<usize> {
        let grasp = self.grasps.iter().rposition(|trace| !trace.rolling).filter(|_| self.held);
        grasp.or(self.grasps.len().checked_sub(1))
    }

    /// Grasps before it, oldest first; none beside a stream.
    pub(super) fn earlier(&self) -> impl Iterator<Item = &GraspTrace> {
        let rolling = self.current().is_some_and(|current| current.rolling);
        let many = if rolling { 0 } else { self.place().unwrap_or(0) };
        self.grasps.iter().take(many).filter(|trace| !trace.discarded)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_lab::grasping::Row;

    fn row(grasp: u64, rolling: bool, t_s: f64, values: impl Into<Box<[f32]>>) -> TraceRow {
        let sample = Row { t_s, line_bar: 0.5, phase: None, values: values.into() };
        TraceRow { grasp, rolling, sample, closing_s: 0.0, errors: Box::default(), frame: None, answer: None }
    }

    #[test]
    fn the_last_few_grasps_are_kept_apart() {
        let mut traces = TraceHistory::default();
        for grasp in 1..=6 {
            for k in 0..3 {
                traces.push(&row(grasp, false, f64::from(k) * 0.1, [grasp as f32, f32::NAN]));
            }
        }
        assert_eq!(traces.current().map(|t| (t.grasp, t.t.len())), Some((6, 3)));
        let earlier: Vec<u64> = traces.earlier().map(|t| t.grasp).collect();
        assert_eq!(earlier, [3, 4, 5]);
        traces.forget_before(5);
        assert_eq!(traces.earlier().map(|t| t.grasp).collect::<Vec<u64>>(), [5]);
        // Computed again.
        for t in [0.0, 0.1] {
            traces.push(&row(6, false, t, [7.0, 7.0]));
        }
        let again = traces.current().map(|t| (t.grasp, t.t.clone(), t.channels[0].clone()));
        assert_eq!(again, Some((6, vec![0.0, 0.1], vec![7.0, 7.0])));
        traces.clear();
        assert!(traces.current().is_none());
    }

    #[test]
    fn a_discarded_grasp_is_no_curve_to_compare_with() {
        let mut traces = TraceHistory::default();
        traces.push(&row(1, false, 0.0, [0.0; 2]));
        traces.push(&row(2, false, 0.0, [0.0; 2]));
        // The stream after it, and its last rows, come later.
        traces.discard();
        traces.push(&row(2, false, 0.1, [0.0; 2]));
        traces.push(&row(3, true, 0.0, [0.0; 2]));
        traces.push(&row(4, false, 0.0, [0.0; 2]));
        assert_eq!(traces.earlier().map(|t| t.grasp).collect::<Vec<u64>>(), [1]);
    }

    #[test]
    fn a_live_stream_is_bounded_and_has_gaps() {
        let mut traces = TraceHistory::default();
        let mut push = |t: f64, value: f32| {
            let mut row = row(1, true, t, [value]);
            row.sample.line_bar = value.into();
            traces.push(&row);
        };
        for k in 0..100_000u32 {
            push(0.01 * f64::from(k), 1.0);
        }
        push(1000.0, f32::NAN);
        push(1002.5, 1.0);
        let trace = traces.current().unwrap();
        assert!(trace.t.len() <= 1700 && trace.channels[0].len() == trace.t.len());
        assert_eq!(trace.gaps(), [[1000.0, 1002.5]]);
        // A recording without an end is bounded as well.
        for k in 0..100_000u32 {
            traces.push(&row(9, false, 0.01 * f64::from(k), [1.0]));
        }
        assert!(traces.current().is_some_and(|trace| (12_000..=15_001).contains(&trace.t.len())));
        traces.clear();
        // A grasp stays in sight where that is wanted.
        for (grasp, rolling) in [(2, false), (3, true)] {
            traces.push(&row(grasp, rolling, 0.0, [1.0]));
        }
        assert_eq!(traces.current().map(|trace| trace.grasp), Some(3));
        traces.hold_grasp(true);
        assert_eq!(traces.current().map(|trace| trace.grasp), Some(2));
        // What goes on is the stream.
        assert_eq!(traces.newest().map(|trace| trace.grasp), Some(3));
    }
}
