//! The force pad: above a threshold F0 its conductance follows a power law,
//!
//!   G = a F^b,
//!
//! a straight line in logarithms (data sheet of the FSR07CE; its threshold is below 15 g). The line is fitted with
//! weights: the relative error of a pad is its repeatability, 2 %, plus the effect of the noise of the counts, which is
//! large if the pad hardly conducts. Two effects are independent of force: the conductance at rest, which is
//! subtracted, and the effect of bending, the [`BendingZero`].

use super::CalibrationFault;
use super::input::Input;
use super::point::{Point, check, merged};
use super::straight_line::{StraightLine, WeightedPoint};
use crate::electronics::PadPart;
use crate::sensor_list::SensorKind;
use palpate_geometry::units::{STANDARD_GRAVITY, three_digits};
use serde::{Deserialize, Serialize};

/// Error of a pad that is pressed again with the same force, as a share of its conductance (data sheet).
const REPEATABILITY: f64 = 0.02;

/// A pad conducts when it reads this much more than at rest (counts): four deviations of the usual noise.
const CONDUCTING_COUNTS: f64 = 8.0;

/// Weights that must conduct.
const LEAST_WEIGHTS: usize = 5;

/// Ratio of the largest to the smallest weight that conducts, at least.
const LEAST_SPAN: f64 = 4.0;

/// Largest force for which the law holds (N): 5 kg (data sheet).
const MOST: f64 = 5.0 * STANDARD_GRAVITY;

/// Plausible exponents: 0.6 to 1 in tables of such pads, with a margin for weights set by hand.
const EXPONENTS: [f64; 2] = [0.6, 1.2];

/// Plausible resistance under 1 N (ohm): four times less and more than the 6 kΩ of an Interlink 402 (the table
/// of Adafruit; there is none for the FSR07).
const OHM_AT_1_N: [f64; 2] = [1.5e3, 25e3];

/// A point this far off, as a share of its force, is mentioned.
const WORTH_A_WORD: f64 = 0.10;

/// A point this far off is refused.
const TOO_FAR: f64 = 0.40;

/// A calibrated pad.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PadCurve {
    /// Conductance at 1 N, a (S).
    pub gain: f64,
    /// Exponent, b.
    pub exponent: f64,
    /// Force below which it does not conduct, F0 (N): that of the data sheet, within the bounds of the weights.
    pub threshold: f64,
    /// Conductance at rest, when it was calibrated (S).
    pub idle_siemens: f64,
    /// Largest force it was calibrated with (N).
    pub most: f64,
    /// Residual of each point as a share of its force, read less set; none for those that did not conduct.
    pub residuals: Vec<Option<f64>>,
    /// The fit itself, in logarithms.
    line: StraightLine,
}

impl PadCurve {
    /// Fits a pad; five weights at least that make it conduct. Also returns remarks.
    pub(super) fn fit(points: &[Point], input: &Input) -> Result<(Self, Vec<String>), CalibrationFault> {
        check(points, SensorKind::Pad, input, MOST)?;
        let idle = idle_counts(points);
        let conducts = |p: &&Point| p.stimulus > 0.0 && p.counts > idle + CONDUCTING_COUNTS.max(4.0 * p.spread);
        let loaded: Vec<Point> = points.iter().filter(conducts).copied().collect();
        let distinct = merged(&loaded, 0.005 * STANDARD_GRAVITY);
        enough(&distinct)?;
        rises(&distinct, input)?;
        let idle_siemens = input.siemens(idle);
        let conductance = |p: &Point| input.siemens(p.counts) - idle_siemens;
        let weighted = |p: &Point| {
            let noise = p.error() * input.relative_step(p.counts);
            let weight = 1.0 / (REPEATABILITY * REPEATABILITY + noise * noise);
            WeightedPoint { x: p.stimulus.ln(), y: conductance(p).ln(), weight }
        };
        let line = StraightLine::through(&loaded.iter().map(weighted).collect::<Vec<_>>());
        // Five different weights are five different logarithms: its numbers left the range.
        let line = line.ok_or_else(|| CalibrationFault::divider(input))?;
        let silent = points.iter().filter(|p| !conducts(p)).map(|p| p.stimulus).fold(0.0, f64::max);
        let lightest = distinct[0].stimulus;
        let threshold = PadPart::LEAST_FORCE.max(silent.min(lightest)).min(lightest);
        let mut curve = Self {
            gain: line.intercept.exp(),
            exponent: line.slope,
            threshold,
            idle_siemens,
            most: distinct[distinct.len() - 1].stimulus,
            residuals: Vec::new(),
            line,
        };
        curve.is_such_a_part(input)?;
        let residual = |p: &Point| conducts(&p).then(|| curve.law(conductance(p)) / p.stimulus - 1.0);
        curve.residuals = points.iter().map(residual).collect();
        let words = curve.remarks(points, silent)?;
        Ok((curve, words))
    }

    /// Force at a conductance beyond that at rest (N); zero below the threshold.
    pub fn force(&self, siemens: f64) -> f64 {
        if siemens < self.siemens(self.threshold) { 0.0 } else { self.law(siemens) }
    }

    /// Conductance under a force, beyond that at rest (S), threshold or not.
    pub fn siemens(&self, force: f64) -> f64 {
        self.gain * force.max(0.0).powf(self.exponent)
    }

    /// Half the width of the 95 % interval of the calibration at a force, as a share of it.
    pub fn force_interval(&self, force: f64) -> Option<f64> {
        Some(self.line.interval_at(force.max(self.threshold).ln())? / self.exponent)
    }

    fn law(&self, siemens: f64) -> f64 {
        (siemens.max(0.0) / self.gain).powf(1.0 / self.exponent)
    }

    fn is_such_a_part(&self, input: &Input) -> Result<(), CalibrationFault> {
        let within = |[least, most]: [f64; 2], value: f64| value >= least && value <= most;
        let ohm = 1.0 / self.gain;
        if !within(OHM_AT_1_N, ohm) {
            let [low, high] = OHM_AT_1_N.map(|wanted| three_digits(1e-3 * input.divider.fixed_ohm * wanted / ohm));
            let said = three_digits(1e-3 * input.divider.fixed_ohm);
            return Err(CalibrationFault(format!(
                "under 1 N the pad comes out at {} kΩ, but such parts have about 6 (1.5 to 25): the resistor beside it is \
                 not the {said} kΩ entered but {low} to {high}, or weights were given in another unit than kg",
                three_digits(ohm * 1e-3)
            )));
        }
        if !within(EXPONENTS, self.exponent) {
            return Err(CalibrationFault(format!(
                "the pad's conductance grows with the power {} of the force, but such parts have 0.6 to 1.2: weights that \
                 rest partly beside the pad do this. Put a small stiff disc between, and the weight on its middle",
                three_digits(self.exponent)
            )));
        }
        Ok(())
    }

    fn remarks(&self, points: &[Point], silent: f64) -> Result<Vec<String>, CalibrationFault> {
        let mut words = Vec::new();
        let at = |p: &Point| SensorKind::Pad.with_unit(p.stimulus);
        let off = |p: &Point| p.stimulus > self.threshold * 1.5 && p.stimulus < silent;
        if let Some(point) = points.iter().find(|p| off(p)) {
            words.push(format!(
                "{} was measured, but the heavier {} was not: check that the weight rests on the pad",
                at(point),
                SensorKind::Pad.with_unit(silent)
            ));
        }
        let residuals = points.iter().zip(&self.residuals).filter_map(|(p, r)| Some((p, (*r)?)));
        let Some((point, residual)) = residuals.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else {
            return Ok(words);
        };
        let percent = format!("{:.0} %", 100.0 * residual.abs());
        if residual.abs() > TOO_FAR {
            let at = at(point);
            return Err(CalibrationFault(format!("{at} is {percent} off the curve through the others: take it again")));
        }
        if residual.abs() > WORTH_A_WORD {
            words.push(format!(
                "{} is {percent} off the curve; take it again if the weight may have shifted",
                at(point)
            ));
        }
        if self.most < 0.45 * STANDARD_GRAVITY {
            words.push(format!("forces above {} are extrapolated", SensorKind::Pad.with_unit(self.most)));
        }
        Ok(words)
    }
}

/// Mean reading without a weight (counts); 0 where that was not measured.
fn idle_counts(points: &[Point]) -> f64 {
    let bare: Vec<f64> = points.iter().filter(|p| p.stimulus <= 0.0).map(|p| p.counts).collect();
    if bare.is_empty() { 0.0 } else { bare.iter().sum::<f64>() / bare.len() as f64 }
}

fn enough(distinct: &[Point]) -> Result<(), CalibrationFault> {
    if distinct.len() < LEAST_WEIGHTS {
        return Err(CalibrationFault(format!(
            "{} of at least {LEAST_WEIGHTS} different weights that make the pad conduct: take five or more between 0.03 and \
             0.5 kg, such as 0.03, 0.06, 0.1, 0.2, 0.35 and 0.5; such a pad does not respond below 0.015 kg",
            distinct.len()
        )));
    }
    let (least, most) = (distinct[0].stimulus, distinct[distinct.len() - 1].stimulus);
    if most < LEAST_SPAN * least {
        let [from, to] = [least, most].map(|force| SensorKind::Pad.with_unit(force));
        return Err(CalibrationFault(format!(
            "the pad has points from {from} to {to} only: the heaviest weight must be at least four times the lightest, best \
             0.05 to 0.5 kg"
        )));
    }
    Ok(())
}

/// A pad that is pressed harder conducts better.
fn rises(distinct: &[Point], input: &Input) -> Result<(), CalibrationFault> {
    for pair in distinct.windows(2) {
        let (before, after) = (input.siemens(pair[0].counts), input.siemens(pair[1].counts));
        if after <= before {
            let micro = |siemens: f64| format!("{} µS", three_digits(siemens * 1e6));
            let [from, to] = [0, 1].map(|i| SensorKind::Pad.with_unit(pair[i].stimulus));
            return Err(CalibrationFault(format!(
                "between {from} and {to} the conductance falls from {} to {}, but it must rise: two weights were mixed up, \
                 one stood partly beside the pad, or the input is wired the other way round",
                micro(before),
                micro(after)
            )));
        }
    }
    Ok(())
}

/// Bending zero of a pad: its reading without a load as a function of its finger's curvature, found from an empty
/// close. Bending presses the layers of such pads together (Interlink's guide, "false triggering"), which reads as a
/// force.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BendingZero {
    /// Curvature (1/m) and conductance (S), curvature rising.
    knots: Vec<(f64, f64)>,
}

/// Width of the bins that readings of an empty close are averaged in (1/m).
const BIN: f64 = 1.5;

/// Readings that a bin must hold.
const LEAST_READINGS: usize = 3;

/// Curvature that an empty close must reach (1/m).
const LEAST_CURVATURE: f64 = 5.0;

impl BendingZero {
    /// The zero from readings of an empty close, pairs of curvature (1/m) and conductance (S). The middle one of each
    /// bin counts, so that a few readings in which something was touched do no harm.
    pub fn from_empty_close(readings: &[(f64, f64)]) -> Result<Self, CalibrationFault> {
        let mut sorted: Vec<(f64, f64)> =
            readings.iter().copied().filter(|(kappa, siemens)| kappa.is_finite() && siemens.is_finite()).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let bins = sorted.chunk_by(|a, b| (a.0 / BIN).floor() == (b.0 / BIN).floor());
        let middle = |bin: &[(f64, f64)]| {
            let mut siemens: Vec<f64> = bin.iter().map(|reading| reading.1).collect();
            siemens.sort_by(f64::total_cmp);
            (bin.iter().map(|reading| reading.0).sum::<f64>() / bin.len() as f64, siemens[siemens.len() / 2])
        };
        let knots: Vec<(f64, f64)> = bins.filter(|bin| bin.len() >= LEAST_READINGS).map(middle).collect();
        let span = knots.last().map_or(0.0, |last| last.0) - knots.first().map_or(0.0, |first| first.0);
        if span < LEAST_CURVATURE - BIN {
            return Err(CalibrationFault::bending_too_short(sorted.len(), span));
        }
        Ok(Self { knots })
    }

    /// Load that bending alone puts on a pad at a curvature (1/m), as if it were a force (N). It adds to the contact
    /// force as a load and not as a conductance. Below the threshold nothing of it shows, but it cannot have jumped to
    /// where it first does: up to there it is taken to rise straight from none.
    pub fn preload(&self, curve: &PadCurve, kappa: f64) -> f64 {
        let loads = self.knots.iter().map(|(kappa, siemens)| (*kappa, curve.force(*siemens)));
        let loads = loads.filter(|(kappa, force)| *kappa > 0.0 && *force > 0.0);
        let mut before = (0.0, 0.0);
        if kappa <= 0.0 {
            return 0.0;
        }
        for knot in loads {
            if kappa <= knot.0 {
                return before.1 + (knot.1 - before.1) * (kappa - before.0) / (knot.0 - before.0);
            }
            before = knot;
        }
        before.1
    }

    /// Curvature up to which it is known (1/m).
    pub fn reaches(&self) -> f64 {
        self.knots.last().map_or(0.0, |last| last.0)
    }

    /// True if its numbers are possible: it may come from a file.
    pub(super) fn is_possible(&self) -> bool {
        let finite = self.knots.iter().all(|(kappa, siemens)| kappa.is_finite() && siemens.is_finite());
        finite && self.knots.is_sorted_by(|a, b| a.0 < b.0)
    }
}
