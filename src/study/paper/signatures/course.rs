//! Numbers of a tactile signature: when contact comes, what bending and pressure do before and after it.

use super::super::prelude::*;

/// Bending and pressure of a grasp over time, means of both fingers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct GraspCurves {
    pub(super) t_s: Vec<f64>,
    pub(super) bend: Vec<f64>,
    pub(super) pressure: Vec<f64>,
}

/// What a signature is about.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Grasped {
    /// Name of the object.
    pub(super) object: String,
    /// `round` or `flat`; others for unknown shapes.
    pub(super) shape: String,
    /// Width across the fingers (mm), where known.
    pub(super) width_mm: Option<f64>,
    /// Its trial, where it is stored.
    pub(super) trial: Option<TrialId>,
}

/// Numbers of a signature. Rates are shares of the mean rate before contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Signature {
    #[serde(flatten)]
    pub(super) of: Grasped,
    /// Time from the beginning of bending to contact (s).
    pub(super) onset_s: f64,
    /// Rank correlation of bending with time up to contact.
    pub(super) rises: Option<f64>,
    /// Mean pressure before contact as a share of that of the hold.
    pub(super) before: f64,
    /// Share of the hold's bending that comes after contact.
    pub(super) share: f64,
    /// Rate of bending from 0.4 to 0.75 s after contact.
    pub(super) rate: Option<f64>,
    /// Share of the variance of bending that a line explains, from 0.15 to 0.75 s after contact.
    pub(super) line: Option<f64>,
    /// Time from contact to 90 % of the hold's pressure (s).
    pub(super) rise_s: f64,
    /// Bending in the hold (1/m).
    pub(super) bend: f64,
    /// Pressure in the hold (kPa).
    pub(super) pressure_kpa: f64,
}

/// Share of the hold's value that counts as the beginning: of bending and of contact.
const BEGINNING: f64 = 0.05;
/// End of the grasp whose mean is the hold's value (s).
const HOLD_S: f64 = 0.25;
/// Times after contact (s): the blow has passed; half-way; end of what is looked at.
const PASSED_S: f64 = 0.15;
const HALF_WAY_S: f64 = 0.40;
const LOOKED_AT_S: f64 = 0.75;

impl GraspCurves {
    /// The mean of the channels of curvature, and of those of pressure or else of force; none without both.
    pub(super) fn of(channels: &[String], grasp: &Sequence) -> Option<Self> {
        let with = |word: &str| -> Vec<usize> { (0..channels.len()).filter(|k| channels[*k].contains(word)).collect() };
        let (bends, pressures) = (with("curvature"), Some(with("pressure")).filter(|found| !found.is_empty()));
        let pressures = pressures.unwrap_or_else(|| with("force"));
        if bends.is_empty() || pressures.is_empty() {
            return None;
        }
        let mean = |row: &[f32], of: &[usize]| of.iter().map(|k| f64::from(row[*k])).sum::<f64>() / of.len() as f64;
        let mut course = Self::default();
        for (t, row) in grasp.rows() {
            course.t_s.push(f64::from(t));
            course.bend.push(mean(row, &bends));
            course.pressure.push(mean(row, &pressures));
        }
        Some(course)
    }

    /// Mean over the end of the grasp.
    fn held(&self, values: &[f64]) -> f64 {
        let from = self.t_s.last().copied().unwrap_or_default() - HOLD_S;
        let kept = || self.t_s.iter().zip(values).filter(|(t, _)| **t >= from).map(|(_, value)| *value);
        kept().sum::<f64>() / kept().count().max(1) as f64
    }

    /// First sample from which values stay a twentieth of the way to the hold for three samples.
    fn begins(&self, values: &[f64]) -> Option<usize> {
        let first = *values.first()?;
        let rise = self.held(values) - first;
        let above = |value: &f64| value - first > BEGINNING * rise;
        (rise > 0.0).then(|| values.windows(3).position(|three| three.iter().all(above)))?
    }

    /// Its numbers; none where there was no contact, or before bending began.
    pub(super) fn signature(&self, of: Grasped) -> Option<Signature> {
        let (begun, contact) = (self.begins(&self.bend)?, self.begins(&self.pressure)?);
        // Bending begins below what counts as begun: there the line back to its first value begins.
        let begun = self.bend[..begun].iter().rposition(|bend| *bend <= self.bend[0]).unwrap_or(0);
        let onset_s = self.t_s[contact] - self.t_s[begun];
        let (bend, pressure) = (self.held(&self.bend), self.held(&self.pressure));
        if onset_s <= 0.0 || bend <= self.bend[0] {
            return None;
        }
        let rate_before = (self.bend[contact] - self.bend[begun]) / onset_s;
        let after = |from: f64| {
            let span = (self.t_s[contact] + from)..=(self.t_s[contact] + LOOKED_AT_S);
            let points: Vec<[f64; 2]> =
                self.t_s.iter().zip(&self.bend).filter(|(t, _)| span.contains(t)).map(|(t, k)| [*t, *k]).collect();
            line(&points)
        };
        let quiet = self.pressure[0];
        let before = self.pressure[..contact].iter().map(|p| p - quiet).sum::<f64>() / contact.max(1) as f64;
        let high = quiet + 0.9 * (pressure - quiet);
        let risen = (contact..self.t_s.len()).find(|k| self.pressure[*k] >= high)?;
        Some(Signature {
            of,
            onset_s,
            rises: rank_correlation(&self.t_s[begun..=contact], &self.bend[begun..=contact]),
            before: before / (pressure - quiet),
            share: (bend - self.bend[contact]) / (bend - self.bend[0]),
            rate: after(HALF_WAY_S).filter(|_| rate_before > 0.0).map(|(slope, _)| slope / rate_before),
            line: after(PASSED_S).map(|(_, explained)| explained),
            rise_s: self.t_s[risen] - self.t_s[contact],
            bend,
            pressure_kpa: 1e-3 * pressure,
        })
    }
}

/// Slope of the line through points, and the share of their variance that it explains.
fn line(points: &[[f64; 2]]) -> Option<(f64, f64)> {
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
    let middle = [mean(0), mean(1)];
    let sum = |a: usize, b: usize| points.iter().map(|p| (p[a] - middle[a]) * (p[b] - middle[b])).sum::<f64>();
    let (xx, xy, yy) = (sum(0, 0), sum(0, 1), sum(1, 1));
    (points.len() >= 6 && xx > 0.0 && yy > 0.0).then(|| (xy / xx, xy * xy / (xx * yy)))
}

/// Rank correlation (Spearman), with mean ranks for equal values; none for less than three or where all are equal.
pub(super) fn rank_correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    let (x, y) = (ranks(x), ranks(y));
    let mean = 0.5 * (x.len() as f64 + 1.0);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    (x.len() >= 3 && x.len() == y.len() && scale > 0.0).then(|| product(&x, &y) / scale)
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = |value: &f64| {
        let below = sorted.partition_point(|other| other < value);
        let up_to = sorted.partition_point(|other| other <= value);
        0.5 * (below + up_to + 1) as f64
    };
    values.iter().map(rank).collect()
}

/// Median; none of nothing.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        count if count % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bends at one rate up to contact at 0.8 s and at another after it; pressure rises within `rise` seconds.
    fn course(after: f64, rise: f64) -> GraspCurves {
        let t_s: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
        let bend = t_s.iter().map(|t| 10.0 * t.min(0.8) + 10.0 * after * (t - 0.8).max(0.0)).collect();
        let pressure = t_s.iter().map(|t| 2e3 * ((t - 0.8) / rise).clamp(0.0, 1.0)).collect();
        GraspCurves { t_s, bend, pressure }
    }

    #[test]
    fn the_numbers_of_a_known_course_are_found() {
        let of = |after, rise| course(after, rise).signature(Grasped::default()).expect("touches");
        let steady = of(0.05, 0.2);
        assert!((steady.onset_s - 0.82).abs() < 0.015, "{}", steady.onset_s);
        assert!((steady.rate.expect("long enough") - 0.05).abs() < 2e-3 && steady.rises == Some(1.0));
        assert!((steady.rise_s - 0.17).abs() < 0.015 && steady.before.abs() < 0.01, "{steady:?}");
        let growing = of(0.5, 1.0);
        assert!((growing.rate.expect("long enough") - 0.5).abs() < 0.02 && growing.line > Some(0.999), "{growing:?}");
        assert!(growing.share > 0.5 && growing.rise_s > 0.8, "{growing:?}");
        let untouched = GraspCurves { pressure: vec![0.0; 300], ..course(0.1, 0.1) };
        assert_eq!(untouched.signature(Grasped::default()), None);
    }

    #[test]
    fn ranks_are_correlated_as_in_tables() {
        // Spearman: 1 - 6 sum d² / n (n² - 1) without ties.
        let found = rank_correlation(&[1.0, 2.0, 3.0, 4.0, 5.0], &[2.0, 1.0, 4.0, 3.0, 5.0]).expect("enough");
        assert!((found - 0.8).abs() < 1e-12);
        assert_eq!(rank_correlation(&[1.0, 2.0, 3.0], &[7.0, 7.0, 7.0]), None);
        assert_eq!(
            (median([3.0, 1.0, 2.0]), median([4.0, 1.0, f64::NAN, 2.0, 3.0]), median([])),
            (Some(2.0), Some(2.5), None)
        );
    }
}
