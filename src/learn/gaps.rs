//! Readings that are not finite numbers: gaps of a recording, or a pressure where contact spans no area. They keep the
//! reading before, zero at the start.

use crate::data::{Dataset, Sequence};
use std::borrow::Cow;
use std::sync::Arc;

/// A sequence without gaps.
pub(crate) fn filled(grasp: &Sequence) -> Cow<'_, Sequence> {
    if grasp.values.iter().all(|x| x.is_finite()) {
        return Cow::Borrowed(grasp);
    }
    let width = grasp.values.len() / grasp.len().max(1);
    let mut last = vec![0.0; width.max(1)];
    let mut values = grasp.values.clone();
    for row in values.chunks_exact_mut(width.max(1)) {
        keep(row, &mut last);
        row.copy_from_slice(&last);
    }
    Cow::Owned(Sequence { t_s: grasp.t_s.clone(), values })
}

/// Keeps the readings of a row as the last ones; where it has a gap, the last one stays.
pub(crate) fn keep(row: &[f32], last: &mut [f32]) {
    last.iter_mut().zip(row).filter(|(_, x)| x.is_finite()).for_each(|(last, x)| *last = *x);
}

/// A data set without gaps.
pub(crate) fn filled_data(data: &Dataset) -> Dataset {
    let mut other = data.clone();
    for example in &mut other.examples {
        if let Cow::Owned(grasp) = filled(&example.grasp) {
            example.grasp = Arc::new(grasp);
        }
    }
    other
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_keep_the_reading_before() {
        let values = vec![f32::NAN, 1.0, 2.0, f32::INFINITY, f32::NAN, 3.0];
        let grasp = Sequence { t_s: vec![0.1, 0.2, 0.3], values };
        assert_eq!(filled(&grasp).values, [0.0, 1.0, 2.0, 1.0, 2.0, 3.0]);
        let whole = filled(&grasp).into_owned();
        assert!(matches!(filled(&whole), Cow::Borrowed(_)));
        assert!(filled(&Sequence::default()).is_empty());
    }
}
