//! Mean and spread of a class in a channel, for plots behind the live curve.

use palpate_learn::{Labels, Pmf, Signatures};

/// What a class feels like in one channel: mean and mean plus or minus one standard deviation over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Name of the class.
    pub class: String,
    /// Times since the start of the closing (s).
    pub t_s: Vec<f64>,
    /// Mean less one standard deviation, in the channel's unit.
    pub low: Vec<f64>,
    /// Mean, in the channel's unit.
    pub mean: Vec<f64>,
    /// Mean plus one standard deviation, in the channel's unit.
    pub high: Vec<f64>,
}

/// Bands of the two likeliest classes in a channel, the likeliest first; `None` for a channel that the model does not
/// read, and where a class has no signature.
pub fn bands_for(signatures: &Signatures, labels: &Labels, pmf: &Pmf, channel: &str) -> Option<[Band; 2]> {
    let place = signatures.channels().iter().position(|own| own == channel)?;
    let [first, second] = two_likeliest(pmf)?;
    let of = |class: usize| -> Option<Band> {
        let (mean, spread) = signatures.of_class(class, place)?;
        let shifted = |by: f64| mean.iter().zip(spread).map(|(m, s)| f64::from(*m) + by * f64::from(*s)).collect();
        Some(Band {
            class: labels.classes.get(class)?.name.clone(),
            t_s: signatures.t_s().iter().map(|t| f64::from(*t)).collect(),
            low: shifted(-1.0),
            mean: shifted(0.0),
            high: shifted(1.0),
        })
    };
    Some([of(first)?, of(second)?])
}

/// The two most likely classes, the first of equals first; `None` with fewer than two.
pub(super) fn two_likeliest(pmf: &Pmf) -> Option<[usize; 2]> {
    let (first, _) = pmf.top();
    let others = (0..pmf.classes()).filter(|class| *class != first);
    let p = pmf.probabilities();
    let second = others.reduce(|best, class| if p[class] > p[best] { class } else { best })?;
    Some([first, second])
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_learn::{Class, Dataset, Example, Sequence};
    use std::sync::Arc;

    #[test]
    fn the_bands_are_those_of_the_two_likeliest_classes() {
        let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
        let labels = Labels { classes: ["a", "b", "c"].map(class).to_vec(), ..Labels::default() };
        let grasp = |level: f32| Arc::new(Sequence { t_s: vec![0.0, 1.0], values: vec![level; 2] });
        let levels = [(0, 1.0), (0, 3.0), (1, 5.0), (2, 8.0)];
        let examples = levels.iter().enumerate();
        let examples = examples
            .map(|(k, (class, level))| Example {
                id: k as i64,
                class: *class,
                grasp: grasp(*level),
                ..Example::default()
            })
            .collect();
        let data =
            Dataset { channels: vec!["grip".to_owned()], labels: labels.clone(), examples, ..Dataset::default() };
        let signatures = Signatures::of(&data).unwrap();
        let pmf = Pmf::from_weights([0.3, 0.1, 0.6]);
        let [first, second] = bands_for(&signatures, &labels, &pmf, "grip").unwrap();
        assert_eq!((first.class.as_str(), first.mean[0], first.low[0], first.high[0]), ("c", 8.0, 8.0, 8.0));
        assert_eq!((second.class.as_str(), second.mean[7], second.low[7], second.high[7]), ("a", 2.0, 1.0, 3.0));
        assert_eq!(second.t_s.len(), second.high.len());
        assert!(bands_for(&signatures, &labels, &pmf, "bend").is_none());
        assert_eq!(two_likeliest(&Pmf::uniform(1)), None);
    }
}
