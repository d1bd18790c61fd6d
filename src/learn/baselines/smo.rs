//! Sequential minimal optimisation: training of a support vector machine that separates two classes.
//!
//! Maximises sum y_i w_i - 1/2 sum w_i w_j K_ij, with sum w_i = 0 and y_i w_i from 0 to C; y is 1 or -1. Each step changes
//! the pair of weights that second-order information chooses (Fan, Chen and Lin, JMLR 6, 2005: WSS 2), as LIBSVM does.
//! Residuals y_i - sum w_j K_ij are the gradient: a weight that may rise and one that may fall violate the optimum by the
//! difference of their residuals. Training ends below [`TOLERANCE`].

use crate::fitting::{Fitting, LearnError};

/// Greatest violation of the optimum, as scikit-learn has it.
pub(super) const TOLERANCE: f64 = 1e-3;
/// Least curvature along a pair; between equal rows it is zero.
const LEAST_CURVATURE: f64 = 1e-12;
/// Most steps, as LIBSVM has it: a bound for kernels that rounding has spoilt.
const MOST_STEPS: usize = 10_000_000;
/// Steps between two looks at the stop flag.
const STEPS_PER_CHECK: usize = 1000;

/// Trained machine: the sign of bias + sum of w K names the class.
#[derive(Debug)]
pub(super) struct Solution {
    /// Weight of each row, zero unless it is a support vector.
    pub(super) weights: Vec<f64>,
    pub(super) bias: f64,
    /// Steps taken.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests bound them"))]
    pub(super) steps: usize,
}

/// Trains on the kernel of all rows, `[rows][rows]`, and the sign of each.
pub(super) fn solve(kernel: &[f32], signs: &[f64], cost: f64, fitting: &Fitting<'_>) -> Result<Solution, LearnError> {
    let bounds = signs.iter().map(|sign| if *sign > 0.0 { (0.0, cost) } else { (-cost, 0.0) }).collect();
    let mut dual = Dual { kernel, bounds, weights: vec![0.0; signs.len()], residuals: signs.to_vec() };
    for steps in 0..MOST_STEPS {
        if steps % STEPS_PER_CHECK == 0 {
            fitting.check()?;
        }
        match dual.working_set() {
            Some(pair) => dual.step(pair),
            None => return Ok(Solution { bias: dual.bias(), weights: dual.weights, steps }),
        }
    }
    let cause = format!("the support vector machine has no solution after {MOST_STEPS} steps; train another method");
    Err(LearnError::failed(cause))
}

/// The problem and its state.
struct Dual<'a> {
    kernel: &'a [f32],
    /// Least and greatest weight of each row.
    bounds: Vec<(f64, f64)>,
    weights: Vec<f64>,
    residuals: Vec<f64>,
}

impl Dual<'_> {
    fn kernel_of(&self, row: usize) -> &[f32] {
        &self.kernel[row * self.weights.len()..][..self.weights.len()]
    }

    fn may_rise(&self, row: usize) -> bool {
        self.weights[row] < self.bounds[row].1
    }

    fn may_fall(&self, row: usize) -> bool {
        self.weights[row] > self.bounds[row].0
    }

    /// Curvature of the objective along a pair.
    fn curvature(&self, [rising, falling]: [usize; 2]) -> f64 {
        let [own, other] = [rising, falling].map(|row| self.kernel_of(row));
        (f64::from(own[rising]) + f64::from(other[falling]) - 2.0 * f64::from(own[falling])).max(LEAST_CURVATURE)
    }

    /// The weight to raise and the weight to lower next; none at the optimum.
    fn working_set(&self) -> Option<[usize; 2]> {
        let rows = 0..self.weights.len();
        let may_rise = rows.clone().filter(|row| self.may_rise(*row));
        let rising = may_rise.max_by(|a, b| self.residuals[*a].total_cmp(&self.residuals[*b]))?;
        let (mut falling, mut most_gain, mut violation) = (rising, 0.0, 0.0);
        for row in rows.filter(|row| self.may_fall(*row)) {
            let difference = self.residuals[rising] - self.residuals[row];
            if difference > 0.0 {
                violation = difference.max(violation);
                let gain = difference * difference / self.curvature([rising, row]);
                if gain > most_gain {
                    (falling, most_gain) = (row, gain);
                }
            }
        }
        (violation >= TOLERANCE).then_some([rising, falling])
    }

    /// Moves a pair of weights to the optimum between their bounds.
    fn step(&mut self, [rising, falling]: [usize; 2]) {
        let (most, least) = (self.bounds[rising].1, self.bounds[falling].0);
        let room = (most - self.weights[rising]).min(self.weights[falling] - least);
        let wanted = (self.residuals[rising] - self.residuals[falling]) / self.curvature([rising, falling]);
        let change = wanted.min(room);
        self.weights[rising] = (self.weights[rising] + change).min(most);
        self.weights[falling] = (self.weights[falling] - change).max(least);
        let count = self.weights.len();
        let [own, other] = [rising, falling].map(|row| &self.kernel[row * count..][..count]);
        for ((residual, own), other) in self.residuals.iter_mut().zip(own).zip(other) {
            *residual -= change * (f64::from(*own) - f64::from(*other));
        }
    }

    /// Mean residual of the weights between their bounds; without any, the middle of what the optimum allows.
    fn bias(&self) -> f64 {
        let of = |is_wanted: &dyn Fn(usize) -> bool| {
            let rows = (0..self.weights.len()).filter(|row| is_wanted(*row));
            rows.map(|row| self.residuals[row]).collect::<Vec<f64>>()
        };
        let free = of(&|row| self.may_rise(row) && self.may_fall(row));
        if !free.is_empty() {
            return free.iter().sum::<f64>() / free.len() as f64;
        }
        let highest = of(&|row| self.may_rise(row)).into_iter().fold(f64::NEG_INFINITY, f64::max);
        let lowest = of(&|row| self.may_fall(row)).into_iter().fold(f64::INFINITY, f64::min);
        (highest + lowest) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance_tests::quick;

    /// Trains on rows of a Gaussian kernel with gamma 1; checks the constraints and the optimum.
    fn solved(rows: &[(f64, f64)], cost: f64) -> Solution {
        let kernel: Vec<f32> =
            rows.iter().flat_map(|a| rows.iter().map(|b| (-(a.0 - b.0).powi(2)).exp() as f32)).collect();
        let signs: Vec<f64> = rows.iter().map(|row| row.1).collect();
        let solution = solve(&kernel, &signs, cost, &quick(1)).expect("has a solution");
        let weights = &solution.weights;
        assert!(
            weights.iter().zip(&signs).all(|(weight, sign)| (0.0..=cost).contains(&(weight * sign))),
            "{weights:?}"
        );
        assert!(weights.iter().sum::<f64>().abs() < 1e-9 * cost, "{weights:?}");
        for (k, of_row) in kernel.chunks(rows.len()).enumerate() {
            let answer = solution.bias + of_row.iter().zip(weights).map(|(x, w)| f64::from(*x) * w).sum::<f64>();
            let margin = signs[k] * answer;
            // Rows beyond the margin have no weight, rows within it the whole one.
            let slack = 2.0 * TOLERANCE + 1e-6 * cost;
            assert!(weights[k].abs() >= cost || margin > 1.0 - slack, "row {k}: {margin} with {weights:?}");
            assert!(weights[k] * signs[k] <= 0.0 || margin < 1.0 + slack, "row {k}: {margin} with {weights:?}");
        }
        solution
    }

    #[test]
    fn two_rows_have_the_solution_in_closed_form() {
        // One of each class: w = 1 / (1 - k), no bias.
        let solution = solved(&[(0.0, 1.0), (1.0, -1.0)], 100.0);
        let expected = 1.0 / (1.0 - (-1.0_f64).exp());
        assert!((solution.weights[0] - expected).abs() < 1e-5 && solution.bias.abs() < 1e-6, "{solution:?}");
        assert_eq!(solution.steps, 1);
    }

    #[test]
    fn hard_data_end_within_a_stated_number_of_steps() {
        let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let rows = |count: usize, x: &dyn Fn(usize) -> f64| (0..count).map(|k| (x(k), sign(k))).collect::<Vec<_>>();
        let lone = (0..50).map(|k| (f64::from(k), if k == 7 { 1.0 } else { -1.0 })).collect();
        // Most steps at each C, ten for each row; of the last, those of LIBSVM (50, 50, 727 and 136543) and a tenth more.
        for (what, rows, most) in [
            ("equal rows with opposite labels", rows(120, &|k| (k / 6) as f64), [1200; 4]),
            ("rows that are all equal", rows(80, &|_| 3.0), [800; 4]),
            ("one row of a class", lone, [500; 4]),
            ("nearly equal rows", rows(60, &|k| 1e-4 * k as f64), [600; 4]),
            ("alternating classes", rows(100, &|k| 0.5 * k as f64), [55, 55, 800, 150_000]),
        ] {
            for (cost, most) in [1e-3, 1.0, 100.0, 1e6].into_iter().zip(most) {
                let steps = solved(&rows, cost).steps;
                assert!(steps <= most, "{what}, C {cost}: {steps} steps");
            }
        }
    }

    #[test]
    fn training_stops_when_told() {
        let stop = std::sync::atomic::AtomicBool::new(true);
        let fitting = Fitting { stop: &stop, ..quick(1) };
        assert_eq!(solve(&[1.0, 0.0, 0.0, 1.0], &[1.0, -1.0], 1.0, &fitting).err(), Some(LearnError::Stopped));
    }
}
