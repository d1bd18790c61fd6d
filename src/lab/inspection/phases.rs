//! Phases of a grasp as touch shows them: pre-shaping, contact, hold, release; measured from what the gripper sensed.

use crate::grasping::CONTACT_FORCE;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Phase, Side};

/// Phase of a grasp as touch shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TouchPhase {
    /// The fingers close in free air.
    PreShaping,
    /// A finger touches the object while both still close.
    Contact,
    /// The line pressure stays.
    Hold,
    /// The line pressure falls.
    Release,
}

impl TouchPhase {
    /// All, in their order.
    pub const ALL: [Self; 4] = [Self::PreShaping, Self::Contact, Self::Hold, Self::Release];

    /// Name on screen and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::PreShaping => "pre-shaping",
            Self::Contact => "contact",
            Self::Hold => "hold",
            Self::Release => "release",
        }
    }
}

/// A phase and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseSpan {
    /// The phase.
    pub phase: TouchPhase,
    /// Its beginning (s).
    pub from_s: f64,
    /// Its end (s).
    pub to_s: f64,
}

/// Times at which the phases of a grasp begin (s), where they are known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PhaseTimes {
    pub(super) closing: Option<f64>,
    pub(super) contact: Option<f64>,
    pub(super) hold: Option<f64>,
    pub(super) release: Option<f64>,
}

impl PhaseTimes {
    /// Times of the phases that the gripper reports with its samples: time (s) and phase.
    pub(super) fn of_samples(samples: impl IntoIterator<Item = (f64, Phase)>) -> Self {
        let mut times = Self::default();
        for (t_s, phase) in samples {
            let begin = match phase {
                Phase::Close => &mut times.closing,
                Phase::Hold => &mut times.hold,
                Phase::Release => &mut times.release,
            };
            begin.get_or_insert(t_s);
        }
        times
    }

    /// Times measured from the line pressure (bar) where the gripper reports no phases: it rises from zero, stays, and falls.
    pub(super) fn of_line(t_s: &[f64], line_bar: &[f64]) -> Self {
        let top = line_bar.iter().copied().filter(|bar| bar.is_finite()).fold(0.0, f64::max);
        if top < LEAST_BAR {
            return Self::default();
        }
        let at = |place: Option<usize>| place.and_then(|k| t_s.get(k).copied());
        let first = line_bar.iter().position(|bar| *bar >= LEAST_BAR);
        let peak = line_bar.iter().position(|bar| *bar >= PEAK_SHARE * top);
        let last = line_bar.iter().rposition(|bar| *bar >= PEAK_SHARE * top);
        let falls = last.map(|k| k + 1).filter(|k| *k < t_s.len());
        Self { closing: at(first), contact: None, hold: at(peak), release: at(falls) }
    }

    /// The phases in their order, up to the last sample. What begins before the one before it is left out.
    pub(super) fn spans(self, first_s: f64, last_s: f64) -> Vec<PhaseSpan> {
        let begins = [
            (TouchPhase::PreShaping, self.closing),
            (TouchPhase::Contact, self.contact),
            (TouchPhase::Hold, self.hold),
            (TouchPhase::Release, self.release),
        ];
        let mut spans: Vec<PhaseSpan> = Vec::new();
        for (phase, from_s) in begins.into_iter().filter_map(|(phase, from_s)| Some((phase, from_s?))) {
            let from_s = from_s.clamp(first_s, last_s.max(first_s));
            if let Some(before) = spans.last_mut() {
                if from_s < before.from_s {
                    continue;
                }
                before.to_s = from_s;
            }
            spans.push(PhaseSpan { phase, from_s, to_s: last_s });
        }
        spans.retain(|span| span.to_s > span.from_s);
        spans
    }
}

/// Phases of a simulated grasp: contact is the first sample in which a pad carries load.
pub fn phases_of_frames<'a>(frames: impl Iterator<Item = &'a Frame> + Clone, gripper: &GripperModel) -> Vec<PhaseSpan> {
    let mut times = PhaseTimes::of_samples(frames.clone().map(|frame| (frame.t, frame.phase)));
    // The first sample comes after the first step.
    times.closing = times.closing.map(|_| 0.0);
    times.contact = touches_of_frames(&frames, gripper).into_iter().flatten().reduce(f64::min);
    times.spans(0.0, frames.last().map_or(0.0, |frame| frame.t))
}

/// First contact of each finger of a simulated grasp (s), left and right: the first sample in which its pad carries load.
pub(super) fn touches_of_frames<'a>(
    frames: &(impl Iterator<Item = &'a Frame> + Clone),
    gripper: &GripperModel,
) -> [Option<f64>; 2] {
    let taxels = gripper.taxels().count();
    let touches = |frame: &&Frame, side: Side| frame.normal_force(side, taxels) > CONTACT_FORCE;
    Side::BOTH.map(|side| frames.clone().find(|frame| touches(frame, side)).map(|frame| frame.t))
}

/// Line pressure that counts as none (bar): half a step of the control box.
const LEAST_BAR: f64 = 0.025;
/// Share of the highest line pressure from which on it counts as reached.
const PEAK_SHARE: f64 = 0.98;

/// Samples of rest from which the noise of a channel is taken, at least.
const LEAST_REST: usize = 5;
/// Rise above rest that is contact: so many standard deviations, and this share of the channel's range.
const DEVIATIONS: f64 = 6.0;
const LEAST_SHARE: f64 = 0.02;

/// Time before the closing in which a hand that has opened first is at rest (s), and how much quieter it is then.
const LATE_REST_S: f64 = 0.5;
const QUIETER: f64 = 3.0;

/// First time at which a load rises above its rest before the closing (s): rest and noise are measured before `closing_s`, or
/// just before it where the hand still opened at the beginning. NaN where nothing was read. Loads are those of one pad, in any
/// unit.
pub(crate) fn onset(t_s: &[f64], loads: &[f32], closing_s: f64, least: f64) -> Option<f64> {
    let rest_from = |from_s: f64| {
        let is_rest = |(t, load): &(&f64, &f32)| (from_s..closing_s).contains(*t) && load.is_finite();
        let rest: Vec<f64> = t_s.iter().zip(loads).filter(is_rest).map(|(_, load)| f64::from(*load)).collect();
        if rest.len() < LEAST_REST {
            return None;
        }
        let mean = rest.iter().sum::<f64>() / rest.len() as f64;
        let square = rest.iter().map(|load| (load - mean).powi(2)).sum::<f64>() / (rest.len() - 1) as f64;
        Some((mean, square.sqrt()))
    };
    let late = rest_from(closing_s - LATE_REST_S);
    let (middle, noise) = match rest_from(f64::NEG_INFINITY) {
        Some(whole) => late.filter(|late| whole.1 > QUIETER * late.1).unwrap_or(whole),
        None => (loads.iter().copied().find(|load| load.is_finite()).map_or(0.0, f64::from), 0.0),
    };
    let top = loads.iter().copied().filter(|load| load.is_finite()).map(f64::from).fold(middle, f64::max);
    let threshold = middle + (DEVIATIONS * noise).max(LEAST_SHARE * (top - middle)).max(least);
    if top <= threshold {
        return None;
    }
    let rises = |(t, load): (&f64, &f32)| (*t >= closing_s && f64::from(*load) > threshold).then_some(*t);
    t_s.iter().zip(loads).find_map(rises)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_follow_each_other_to_the_last_sample() {
        let times = PhaseTimes { closing: Some(0.5), contact: Some(1.25), hold: Some(2.0), release: None };
        let spans = times.spans(0.0, 4.0);
        let named: Vec<_> = spans.iter().map(|span| (span.phase.name(), span.from_s, span.to_s)).collect();
        assert_eq!(named, [("pre-shaping", 0.5, 1.25), ("contact", 1.25, 2.0), ("hold", 2.0, 4.0)]);
        // A touch before the closing leaves no time to pre-shape; an empty hand has no contact.
        let touching = PhaseTimes { contact: Some(0.5), ..times }.spans(0.0, 4.0);
        assert_eq!(touching[0].phase, TouchPhase::Contact);
        let empty = PhaseTimes { contact: None, release: Some(3.0), ..times }.spans(0.0, 4.0);
        let named: Vec<_> = empty.iter().map(|span| (span.phase, span.to_s)).collect();
        assert_eq!(named, [(TouchPhase::PreShaping, 2.0), (TouchPhase::Hold, 3.0), (TouchPhase::Release, 4.0)]);
        assert!(PhaseTimes::default().spans(0.0, 4.0).is_empty());
    }

    #[test]
    fn line_pressure_shows_closing_hold_and_release() {
        let t: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
        let bar = |t: f64| if t < 3.95 { (t - 1.0).clamp(0.0, 1.0) * 1.2 } else { 0.0 };
        let line: Vec<f64> = t.iter().map(|t| bar(*t)).collect();
        let times = PhaseTimes::of_line(&t, &line);
        let close = |found: Option<f64>, wanted: f64| assert!((found.unwrap() - wanted).abs() < 0.051, "{found:?}");
        close(times.closing, 1.1);
        close(times.hold, 2.0);
        close(times.release, 4.0);
        assert_eq!(PhaseTimes::of_line(&t, &vec![f64::NAN; 50]), PhaseTimes::default());
        assert_eq!(PhaseTimes::of_line(&[], &[]), PhaseTimes::default());
    }

    #[test]
    fn contact_is_where_a_load_leaves_its_noise() {
        let t: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let noise = |k: usize| if k.is_multiple_of(2) { 0.5 } else { -0.5 };
        let load = |k: usize| (20.0 + noise(k) + if t[k] >= 2.0 { 40.0 * (t[k] - 2.0) } else { 0.0 }) as f32;
        let loads: Vec<f32> = (0..400).map(load).collect();
        let found = onset(&t, &loads, 0.5, 0.0).unwrap();
        assert!((2.0..2.12).contains(&found), "{found}");
        // Noise alone is no contact, and neither are readings that are missing.
        let still: Vec<f32> = (0..400).map(|k| (20.0 + noise(k)) as f32).collect();
        assert_eq!(onset(&t, &still, 0.5, 0.0), None);
        // A hand that opens first, from what it held before.
        let before: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let opened = before.iter().map(|t| if *t < 0.3 || *t > 2.5 { 900.0 } else { 0.0 });
        let found = onset(&before, &opened.collect::<Vec<f32>>(), 1.0, 0.0).unwrap();
        assert!((found - 2.51).abs() < 0.011, "{found}");
        assert_eq!(onset(&t, &[f32::NAN; 400], 0.5, 0.0), None);
        assert_eq!(onset(&[], &[], 0.5, 0.0), None);
    }
}
