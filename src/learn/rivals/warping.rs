//! Nearest neighbours by dynamic time warping: sequences are compared after one of them has been stretched and pressed
//! in time, within a band, as to lie best on the other (Sakoe and Chiba 1978).

use super::super::data::{Dataset, Sequence};
use super::super::model_file::{Arrays, ModelCard};
use super::super::network::Preparation;
use super::super::{FitError, Fitting, Pmf, Recogniser, Verdict, check_enough};
use serde::{Deserialize, Serialize};

/// Neighbours that vote.
const VOTERS: usize = 5;
/// Samples per second that are compared: warping costs the square of it.
const RATE_HZ: f32 = 8.0;
/// Steps by which a sequence may be ahead of the other.
const BAND: usize = 3;

/// Sequences that are remembered.
#[derive(Clone, Debug)]
pub(in super::super) struct Warping {
    learned: Learned,
    classes: usize,
    pages: Vec<Vec<f32>>,
    labels: Vec<usize>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    preparation: Preparation,
    mirror: Option<Vec<usize>>,
    voters: usize,
    band: usize,
}

impl Warping {
    /// Remembers all grasps.
    pub(in super::super) fn fit(data: &Dataset, fitting: &Fitting<'_>) -> Result<Self, FitError> {
        check_enough(data, 1)?;
        fitting.refuse_settings()?;
        let preparation = Preparation::fit(data, RATE_HZ);
        let pages = data.examples.iter().map(|e| scaled(&preparation, &e.grasp)).collect();
        let mirror = super::super::network::mirror(&data.channels);
        let learned = Learned { preparation, mirror, voters: VOTERS, band: BAND };
        (fitting.progress)(1.0);
        Ok(Self { learned, classes: data.labels.classes.len(), pages, labels: data.truth() })
    }

    /// Brings it back from a card and arrays.
    pub(in super::super) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, String> {
        let learned: Learned =
            serde_json::from_value(card.settings.clone()).map_err(|e| format!("its settings: {e}"))?;
        let channels = card.channels.len();
        let mirror = learned.mirror.as_ref().is_none_or(|m| m.len() == channels && m.iter().all(|to| *to < channels));
        let classes = card.labels.classes.len();
        let (labels, lengths) = (arrays.get_integers("labels")?, arrays.get_integers("lengths")?);
        let values = arrays.get_f32("values")?;
        let mut rest = values.as_slice();
        let mut pages = Vec::new();
        for length in &lengths {
            let length = usize::try_from(*length).ok().filter(|l| *l <= rest.len() && l % channels.max(1) == 0);
            let (page, left) = rest.split_at(length.ok_or("its sequences are cut short")?);
            pages.push(page.to_vec());
            rest = left;
        }
        let labels: Vec<usize> = labels.into_iter().filter_map(|l| usize::try_from(l).ok()).collect();
        let whole = labels.len() == pages.len() && labels.iter().all(|l| *l < classes) && rest.is_empty();
        let sound = learned.preparation.is_sound() && learned.preparation.scales.len() == channels;
        if !whole || !sound || !mirror || !(1..=1000).contains(&learned.voters) || learned.band > 10_000 {
            return Err("its parts do not fit each other".to_owned());
        }
        Ok(Self { learned, classes, pages, labels })
    }

    fn distances(&self, page: &[f32]) -> Vec<f32> {
        let channels = self.learned.preparation.scales.len();
        self.pages.iter().map(|own| warped_distance(own, page, channels, self.learned.band)).collect()
    }
}

/// Scaled values at even steps, without departures from the mean course: warping moves in time, they do not.
fn scaled(preparation: &Preparation, grasp: &Sequence) -> Vec<f32> {
    let (width, channels) = (preparation.width(), preparation.scales.len());
    preparation.inputs(grasp).chunks_exact(width.max(1)).flat_map(|row| row[..channels].to_vec()).collect()
}

/// Least sum of squared distances along a path through both sequences, `[steps][channels]`.
fn warped_distance(a: &[f32], b: &[f32], channels: usize, band: usize) -> f32 {
    let (rows, columns) = (a.len() / channels.max(1), b.len() / channels.max(1));
    if rows == 0 || columns == 0 {
        return f32::MAX;
    }
    // Sequences of different lengths need a band at least as wide as they differ.
    let band = band.max(rows.abs_diff(columns));
    let mut before = vec![f32::INFINITY; columns + 1];
    before[0] = 0.0;
    for i in 0..rows {
        let mut now = vec![f32::INFINITY; columns + 1];
        let x = &a[i * channels..(i + 1) * channels];
        for j in i.saturating_sub(band)..(i + band + 1).min(columns) {
            let y = &b[j * channels..(j + 1) * channels];
            let step: f32 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
            now[j + 1] = step + before[j].min(before[j + 1]).min(now[j]);
        }
        before = now;
    }
    before[columns]
}

impl Recogniser for Warping {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let page = scaled(&self.learned.preparation, grasp);
        let mut distances = self.distances(&page);
        if let Some(mirror) = &self.learned.mirror {
            let exchanged: Vec<f32> =
                page.chunks_exact(mirror.len().max(1)).flat_map(|row| mirror.iter().map(|m| row[*m])).collect();
            let others = self.distances(&exchanged);
            distances.iter_mut().zip(others).for_each(|(d, other)| *d = d.min(other));
        }
        let mut order: Vec<usize> = (0..distances.len()).collect();
        order.sort_by(|a, b| distances[*a].total_cmp(&distances[*b]));
        let mut votes = vec![0.0; self.classes];
        for k in order.into_iter().take(self.learned.voters) {
            votes[self.labels[k]] += 1.0 / f64::from(distances[k]).sqrt().max(1e-6);
        }
        let pmf = Pmf::from_weights(votes);
        Verdict { pmf: before.map_or_else(|| pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        arrays.put_integers("labels", &self.labels.iter().map(|l| *l as i64).collect::<Vec<_>>());
        arrays.put_integers("lengths", &self.pages.iter().map(|p| p.len() as i64).collect::<Vec<_>>());
        let values: Vec<f32> = self.pages.concat();
        arrays.put("values", &[values.len()], &values);
        arrays
    }

    fn parameters(&self) -> usize {
        self.pages.iter().map(Vec::len).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warping_forgives_a_delay_but_not_a_height() {
        let bump = |at: usize, height: f32| -> Vec<f32> {
            (0..20).map(|i| if (at..at + 4).contains(&i) { height } else { 0.0 }).collect()
        };
        let of = |b: &[f32], band: usize| warped_distance(&bump(6, 1.0), b, 1, band);
        assert_eq!(of(&bump(6, 1.0), 3), 0.0);
        assert_eq!(of(&bump(8, 1.0), 3), 0.0);
        assert!(of(&bump(8, 1.0), 0) > 3.9, "without a band it is the plain distance");
        assert!(of(&bump(6, 2.0), 3) > 3.9);
        assert_eq!(of(&bump(6, 1.0)[..18], 0), 0.0, "different lengths");
    }
}
