//! The class "other": half of the prior while training, however many grasps it has, and that of one class in answers.

use crate::pmf::Pmf;

/// The class "other" and the weight that gives its rows, among those of these classes, half of the prior.
pub(super) fn other_weight(other: Option<usize>, classes: &[usize]) -> Option<(usize, f64)> {
    let other = other?;
    let own = classes.iter().filter(|class| **class == other).count();
    let rest = classes.len() - own;
    (own > 0 && rest > 0).then(|| (other, rest as f64 / own as f64))
}

/// An answer with the prior of training, in which "other" has as much as all known classes together, as one in which it has
/// as much as each of them: few people put mostly unknown objects into the hand. Grasps are then combined as usual.
pub(super) fn as_one_of_many(pmf: &Pmf, other: Option<usize>) -> Pmf {
    let Some(other) = other else { return pmf.clone() };
    let rest = pmf.classes().saturating_sub(1).max(1) as f64;
    let weights = pmf.probabilities().iter().enumerate();
    Pmf::from_weights(weights.map(|(class, p)| if class == other { p / rest } else { *p }))
}

/// Weight of each row with which all known classes together have half of the prior, in equal parts, and "other" the other half.
pub(super) fn balanced_weights(other: Option<usize>, classes: &[usize]) -> Vec<f32> {
    let mut counts = vec![0_usize; classes.iter().max().map_or(0, |most| most + 1)];
    classes.iter().for_each(|class| counts[*class] += 1);
    let known = (0..counts.len()).filter(|class| counts[*class] > 0 && Some(*class) != other).count();
    let share = |class: &usize| if Some(*class) == other { known.max(1) as f64 } else { 1.0 };
    classes.iter().map(|class| (share(class) / counts[*class] as f64) as f32).collect()
}
