//! The class "other": half of the prior, however many grasps it has, and once over several grasps of one object.

use crate::data::Dataset;
use crate::pmf::Pmf;

/// The class "other" and the weight that gives its rows, among those of these classes, half of the prior.
pub(super) fn other_weight(data: &Dataset, classes: &[usize]) -> Option<(usize, f64)> {
    let other = data.labels.other()?;
    let own = classes.iter().filter(|class| **class == other).count();
    let rest = classes.len() - own;
    (own > 0 && rest > 0).then(|| (other, rest as f64 / own as f64))
}

/// Combines the answers to two grasps. The prior of the class "other" counts once.
pub(super) fn combined(before: &Pmf, now: &Pmf, other: Option<usize>) -> Pmf {
    let Some(other) = other else { return before.times(now) };
    let rest = now.classes().saturating_sub(1).max(1) as f64;
    let weights = now.probabilities().iter().enumerate();
    before.times(&Pmf::from_weights(weights.map(|(class, p)| if class == other { p / rest } else { *p })))
}
