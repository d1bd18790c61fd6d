//! Closing in steps. The real control box raises the pressure in steps, and signals are sampled after the transient of
//! each (paper, section IV-B and Fig. 3). In the recordings curvature rises about every 0.7 s of 7.5 s, ten steps or
//! so.
//!
//! This is a *quasi-static re-timing* of a grasp that was simulated with a pressure rising ten times a second. The
//! signals are held at the instants of a grid; from one to the next they go by a first-order transient, and every
//! reading falls into the settled part of its step. Nothing is simulated again: the model does not contain how a finger
//! swings, slips or snaps when a whole step of pressure arrives at once. The grid covers the whole trial, so that the
//! release moves in steps as well.

use super::sampling::Trace;

/// From one step to the next (s): the 0.7 s of the recordings, scaled from their 7.5 s to the 4 s of a simulated trial.
const STEP_S: f64 = 0.7 * 4.0 / 7.5;

/// Time constant of the transient, as a share of a step. Assumed: about 0.1 s of the real 0.7 s.
const TRANSIENT: f64 = 0.15;

/// Share of a step after which readings begin. Assumed: less than a tenth of the transient is then left.
const SETTLED: f64 = 0.4;

/// The value of a trace at time `t` (s) when it is held on a grid that begins at `start` (s).
pub(super) fn stepped(trace: Trace<'_>, start: f64, t: f64) -> f64 {
    let steps = ((t - start) / STEP_S).max(0.0);
    let instant = |step: f64| trace.at(start + step * STEP_S);
    let (before, now) = (instant(steps.floor() - 1.0), instant(steps.floor()));
    let within = SETTLED + (1.0 - SETTLED) * steps.fract();
    now + (before - now) * (-within / TRANSIENT).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Signals;

    #[test]
    fn a_ramp_becomes_stairs_seen_once_they_have_settled() {
        let signals = Signals { channels: vec!["x".to_owned()], t_s: vec![0.0, 4.0], values: vec![0.0, 4.0] };
        let trace = Trace::new(&signals, 0);
        for step in 0..10 {
            let level = f64::from(step) * STEP_S;
            let begin = stepped(trace, 0.0, level + 1e-9);
            let end = stepped(trace, 0.0, level + STEP_S - 1e-9);
            // exp(-0.4 / 0.15) = 7 % of a step is left when readings begin, 0.13 % when they end.
            assert!(begin <= level && level - begin < 0.0702 * STEP_S, "{step}: {begin} of {level}");
            assert!(end <= level && level - end < 0.0014 * STEP_S, "{step}: {end} of {level}");
        }
    }

    #[test]
    fn level_signals_stay_level() {
        let signals = Signals { channels: vec!["x".to_owned()], t_s: vec![1.0, 2.0], values: vec![3.0, 3.0] };
        for t in [0.0, 1.0, 1.5, 2.0, 5.0] {
            assert_eq!(stepped(Trace::new(&signals, 0), 1.0, t), 3.0);
        }
    }
}
