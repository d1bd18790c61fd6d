//! A straight line through points of known relative weight, with confidence intervals.
//!
//! Minimises sum w (y - a - b x)². The noise of a point of weight 1 is estimated from the residuals with n - 2 degrees
//! of freedom, and intervals are Student's (Draper and Smith, Applied Regression Analysis, chapter 1). Two points leave
//! no residual, so that no interval can be given.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// One point of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WeightedPoint {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Weight in the fit, proportional to 1 over its variance.
    pub(super) weight: f64,
}

/// A line y = a + b x, and its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StraightLine {
    /// a, the value at x = 0.
    pub intercept: f64,
    /// b, the change with x.
    pub slope: f64,
    /// Mean of x, by weight.
    mean_x: f64,
    /// Sum of the weights.
    weight: f64,
    /// Weighted sum of (x - mean)².
    spread_x: f64,
    /// Variance of a point of weight 1; none with two points.
    variance: Option<f64>,
    /// Half the width of a 95 % interval in units of the deviation: Student's quantile; none with two points.
    quantile: Option<f64>,
}

impl StraightLine {
    /// The line through some points; none where they do not differ in x.
    pub(super) fn through(points: &[WeightedPoint]) -> Option<Self> {
        let weight: f64 = points.iter().map(|p| p.weight).sum();
        let mean = |of: &dyn Fn(&WeightedPoint) -> f64| points.iter().map(|p| p.weight * of(p)).sum::<f64>() / weight;
        let (mean_x, mean_y) = (mean(&|p| p.x), mean(&|p| p.y));
        let spread_x = weight * mean(&|p| (p.x - mean_x).powi(2));
        let slope = weight * mean(&|p| (p.x - mean_x) * (p.y - mean_y)) / spread_x;
        let intercept = mean_y - slope * mean_x;
        if !(slope.is_finite() && intercept.is_finite()) {
            return None;
        }
        let freedom = points.len().saturating_sub(2) as f64;
        let left: f64 = points.iter().map(|p| p.weight * (p.y - intercept - slope * p.x).powi(2)).sum();
        let (variance, quantile) = match student(freedom) {
            Some(quantile) => (Some(left / freedom), Some(quantile)),
            None => (None, None),
        };
        Some(Self { intercept, slope, mean_x, weight, spread_x, variance, quantile })
    }

    /// Its value at x.
    pub(super) fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }

    /// Half the width of the 95 % interval of the line itself at x; none with two points.
    pub(super) fn interval_at(&self, x: f64) -> Option<f64> {
        let share = 1.0 / self.weight + (x - self.mean_x).powi(2) / self.spread_x;
        Some(self.quantile? * (self.variance? * share).sqrt())
    }

    /// Half the width of the 95 % interval of the slope; none with two points.
    pub(super) fn slope_interval(&self) -> Option<f64> {
        Some(self.quantile? * (self.variance? / self.spread_x).sqrt())
    }
}

/// Student's quantile for a two-sided interval of 95 %; none without a degree of freedom.
fn student(freedom: f64) -> Option<f64> {
    let distribution = StudentsT::new(0.0, 1.0, freedom).ok()?;
    Some(distribution.inverse_cdf(0.975))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(of: &[(f64, f64, f64)]) -> Vec<WeightedPoint> {
        of.iter().map(|&(x, y, weight)| WeightedPoint { x, y, weight }).collect()
    }

    #[test]
    fn a_line_is_found_and_its_interval_is_students() {
        // By hand: Sxx = 5, Sxy = 10.2, residuals 0.01, 0.07, -0.17, 0.09. The quantile is scipy.stats.t.ppf(0.975, 2).
        let line =
            StraightLine::through(&points(&[(0.0, 1.0, 1.0), (1.0, 3.1, 1.0), (2.0, 4.9, 1.0), (3.0, 7.2, 1.0)]));
        let line = line.expect("x differs");
        assert!((line.slope - 2.04).abs() < 1e-12 && (line.intercept - 0.99).abs() < 1e-12);
        let freedom_left = 4.302_652_729_911_275;
        let sum_of_squares = [0.01f64, 0.07, -0.17, 0.09].iter().map(|r| r * r).sum::<f64>();
        let slope_error = (sum_of_squares / 2.0 / 5.0).sqrt();
        assert!((line.slope_interval().expect("two left") / (freedom_left * slope_error) - 1.0).abs() < 1e-6);
        let intercept_error = (sum_of_squares / 2.0 * (0.25 + 2.25 / 5.0)).sqrt();
        assert!((line.interval_at(0.0).expect("two left") / (freedom_left * intercept_error) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn two_points_have_no_interval_and_one_x_no_line() {
        let line = StraightLine::through(&points(&[(0.0, 1.0, 1.0), (2.0, 5.0, 1.0)])).expect("x differs");
        assert_eq!((line.slope, line.intercept, line.at(3.0)), (2.0, 1.0, 7.0));
        assert_eq!((line.slope_interval(), line.interval_at(1.0)), (None, None));
        assert_eq!(StraightLine::through(&points(&[(1.0, 1.0, 1.0), (1.0, 5.0, 1.0)])), None);
        assert_eq!(StraightLine::through(&[]), None);
    }

    #[test]
    fn a_point_without_weight_does_not_count() {
        let line = StraightLine::through(&points(&[(0.0, 0.0, 4.0), (1.0, 1.0, 1.0), (0.5, 70.0, 0.0)]));
        assert!(line.is_some_and(|line| (line.slope - 1.0).abs() < 1e-12));
    }
}
