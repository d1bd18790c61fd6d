//! Traces as the plots show them: the samples of the grasp that is going on, and of the few before it.

use palpate_core::workers::TraceRow;
use std::collections::VecDeque;

/// Grasps that are kept: the current one and some to compare it with.
const KEPT: usize = 4;

/// All samples of one grasp, column by column.
#[derive(Clone, Debug, Default)]
pub struct GraspTrace {
    /// Which grasp.
    pub grasp: u64,
    /// Times (s).
    pub t: Vec<f64>,
    /// Line pressures (bar).
    pub line_bar: Vec<f64>,
    /// Channel by channel, NaN where undefined.
    pub channels: Vec<Vec<f32>>,
    /// Estimated numerical errors, channel by channel; empty without a companion.
    pub errors: Vec<Vec<f32>>,
}

/// The traces of the last grasps, oldest first.
#[derive(Clone, Debug, Default)]
pub struct Traces {
    grasps: VecDeque<GraspTrace>,
}

impl Traces {
    /// Adds a sample; a new grasp begins a new trace and pushes out the oldest.
    pub fn push(&mut self, row: &TraceRow) {
        if self.grasps.back().is_none_or(|last| last.grasp != row.grasp) {
            if self.grasps.len() == KEPT {
                self.grasps.pop_front();
            }
            let channels = vec![Vec::new(); row.values.len()];
            let errors = vec![Vec::new(); row.errors.len()];
            self.grasps.push_back(GraspTrace { grasp: row.grasp, channels, errors, ..GraspTrace::default() });
        }
        let Some(last) = self.grasps.back_mut() else { return };
        last.t.push(row.t);
        last.line_bar.push(row.line_bar);
        // A changed layout has other channels; a trace never mixes two.
        for (channel, value) in last.channels.iter_mut().zip(row.values.iter()) {
            channel.push(*value);
        }
        for (channel, error) in last.errors.iter_mut().zip(row.errors.iter()) {
            channel.push(*error);
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.grasps.clear();
    }

    /// The current grasp.
    pub fn current(&self) -> Option<&GraspTrace> {
        self.grasps.back()
    }

    /// The grasps before it, oldest first.
    pub fn earlier(&self) -> impl Iterator<Item = &GraspTrace> {
        self.grasps.iter().take(self.grasps.len().saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_few_grasps_are_kept_apart() {
        let mut traces = Traces::default();
        for grasp in 1..=6 {
            for k in 0..3 {
                let t = f64::from(k) * 0.1;
                traces.push(&TraceRow {
                    grasp,
                    t,
                    line_bar: 0.5,
                    values: Box::new([grasp as f32, f32::NAN]),
                    errors: Box::default(),
                });
            }
        }
        assert_eq!(traces.current().map(|t| (t.grasp, t.t.len())), Some((6, 3)));
        let earlier: Vec<u64> = traces.earlier().map(|t| t.grasp).collect();
        assert_eq!(earlier, [3, 4, 5]);
        traces.clear();
        assert!(traces.current().is_none());
    }
}
