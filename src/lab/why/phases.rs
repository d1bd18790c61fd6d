//! Phases of a grasp, measured in what the model reads: pre-shaping until a pad feels contact, contact until the fingers
//! stop closing, then the hold. Recognisers do not read the release.

use crate::inspection::{PhaseSpan, TouchPhase, onset};
use palpate_learn::{Sequence, Signatures};
use palpate_tactile::Quantity;

/// Least reading of a pad that is contact, as a share of the largest mean of that channel in any class: noise in an empty
/// hand is less.
const CONTACT_SHARE: f32 = 0.02;
/// A channel has settled once it stays within this share of its range about its last value.
const SETTLED_SHARE: f32 = 0.05;
/// Least share of the samples in a hold that is found by settling: the last few samples always agree with the last one.
const LEAST_HOLD: f64 = 0.05;

/// Phases of a grasp with at least one sample each. `hold_s` is the start of the hold where it is known; otherwise the hold
/// begins when all channels have settled.
pub fn phases_of(grasp: &Sequence, signatures: &Signatures, hold_s: Option<f64>) -> Vec<PhaseSpan> {
    let [Some(first), Some(last)] = [grasp.t_s.first(), grasp.t_s.last()].map(|t| t.map(|t| f64::from(*t))) else {
        return Vec::new();
    };
    let hold = hold_s.or_else(|| settled_s(grasp)).unwrap_or(f64::INFINITY);
    let contact = contact_s(grasp, signatures).unwrap_or(f64::INFINITY);
    let begins = [(TouchPhase::PreShaping, first), (TouchPhase::Contact, contact), (TouchPhase::Hold, hold)];
    let mut spans: Vec<PhaseSpan> = Vec::new();
    for (place, (phase, from_s)) in begins.into_iter().enumerate() {
        let to_s = begins[place + 1..].iter().map(|(_, begin)| *begin).fold(f64::INFINITY, f64::min);
        let has_samples = grasp.t_s.iter().any(|t| (from_s..to_s).contains(&f64::from(*t)));
        if has_samples {
            spans.push(PhaseSpan { phase, from_s, to_s: to_s.min(last) });
        }
    }
    spans
}

/// Place of the phase that a time belongs to (s): the last that has begun.
pub(super) fn phase_at(spans: &[PhaseSpan], t_s: f64) -> Option<usize> {
    spans.iter().rposition(|span| span.from_s <= t_s)
}

/// First time at which a pad feels something (s).
fn contact_s(grasp: &Sequence, signatures: &Signatures) -> Option<f64> {
    let t_s: Vec<f64> = grasp.t_s.iter().map(|t| f64::from(*t)).collect();
    let onsets = (0..signatures.channels().len()).filter_map(|channel| {
        let least = least_load(signatures, channel)?;
        let loads: Vec<f32> = grasp.rows().map(|(_, row)| row[channel]).collect();
        onset(&t_s, &loads, f64::NEG_INFINITY, f64::from(least))
    });
    onsets.reduce(f64::min)
}

/// Least reading of a pad that is contact, in the channel's unit; none for channels that are no pad's.
fn least_load(signatures: &Signatures, channel: usize) -> Option<f32> {
    let (quantity, _) = Quantity::of_name(&signatures.channels()[channel])?;
    let classes = (0..signatures.grasps().len()).filter_map(|class| signatures.of_class(class, channel));
    let most = classes.flat_map(|(mean, _)| mean.iter().copied()).fold(0.0, f32::max);
    (quantity.is_pressure() || quantity == Quantity::Force).then_some(CONTACT_SHARE * most)
}

/// True for each channel and phase in which a pad carries no load, `[channels][phases]`.
pub(super) fn unloaded(grasp: &Sequence, signatures: &Signatures, phases: &[PhaseSpan]) -> Vec<Vec<bool>> {
    let of_channel = |channel: usize| {
        let least = least_load(signatures, channel);
        let is_unloaded = |phase: usize| {
            let mut rows = grasp.rows().filter(|(t, _)| phase_at(phases, f64::from(*t)) == Some(phase));
            least.is_some_and(|least| rows.all(|(_, row)| row[channel] <= least))
        };
        (0..phases.len()).map(is_unloaded).collect()
    };
    (0..signatures.channels().len()).map(of_channel).collect()
}

/// Time from which on all channels stay close to their last values (s); none for a grasp that changes to its end.
fn settled_s(grasp: &Sequence) -> Option<f64> {
    let (_, last) = grasp.rows().last()?;
    let mut ranges: Vec<[f32; 2]> = last.iter().map(|x| [*x, *x]).collect();
    for (_, row) in grasp.rows() {
        ranges.iter_mut().zip(row).for_each(|(range, x)| *range = [range[0].min(*x), range[1].max(*x)]);
    }
    let is_settled = |row: &[f32]| {
        let each = row.iter().zip(last).zip(&ranges);
        each.fold(true, |all, ((x, last), [low, high])| all && (x - last).abs() <= SETTLED_SHARE * (high - low))
    };
    let rows: Vec<(f32, bool)> = grasp.rows().map(|(t, row)| (t, is_settled(row))).collect();
    let first = rows.iter().rposition(|(_, settled)| !settled).map_or(0, |k| k + 1);
    let lasts = rows.len().saturating_sub(first) as f64;
    (first > 0 && lasts > LEAST_HOLD * rows.len() as f64).then(|| f64::from(rows[first].0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_learn::{Class, Dataset, Example, Labels};
    use std::sync::Arc;

    /// Bend rises until 2 s, pressure from 1 s to 2 s.
    fn grasp(press: f32) -> Sequence {
        let t_s: Vec<f32> = (0..=40).map(|k| 0.1 * k as f32).collect();
        let values = t_s.iter().flat_map(|t| [t.min(2.0), press * (t.min(2.0) - 1.0).max(0.0)]).collect();
        Sequence { t_s, values }
    }

    #[test]
    fn contact_is_felt_and_the_hold_is_where_all_has_settled() {
        let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
        let labels = Labels { classes: ["a", "b"].map(class).to_vec(), ..Labels::default() };
        let examples = [(0, 4.0), (1, 8.0)];
        let examples = examples
            .map(|(class, press)| Example {
                id: class as i64,
                class,
                grasp: Arc::new(grasp(press)),
                ..Example::default()
            })
            .to_vec();
        let channels = ["curvature_left", "pressure_left"].map(str::to_owned).to_vec();
        let signatures = Signatures::of(&Dataset { channels, labels, examples, ..Dataset::default() }).unwrap();
        let found = phases_of(&grasp(4.0), &signatures, None);
        let names: Vec<&str> = found.iter().map(|span| span.phase.name()).collect();
        assert_eq!(names, ["pre-shaping", "contact", "hold"]);
        // 2 % of 8 is reached 0.04 s after contact; 95 % of the pressure 0.05 s before the end of closing.
        assert!((found[1].from_s - 1.1).abs() < 0.11 && (found[2].from_s - 2.0).abs() < 0.11, "{found:?}");
        // A known hold is taken; an empty hand never feels contact.
        let empty = phases_of(&grasp(0.0), &signatures, Some(2.5));
        let spans: Vec<(&str, f64)> = empty.iter().map(|span| (span.phase.name(), span.from_s)).collect();
        assert_eq!(spans, [("pre-shaping", 0.0), ("hold", 2.5)]);
        // Every sample is in one phase.
        for t in &grasp(4.0).t_s {
            let place = phase_at(&found, f64::from(*t)).unwrap();
            assert!((found[place].from_s..=found[place].to_s).contains(&f64::from(*t)), "{t}");
        }
        assert!(phases_of(&Sequence::default(), &signatures, None).is_empty());
        // The pad is silent until contact; a bend is never a load.
        let spans = phases_of(&grasp(4.0), &signatures, None);
        assert_eq!(unloaded(&grasp(4.0), &signatures, &spans), [[false; 3], [true, false, false]]);
    }
}
