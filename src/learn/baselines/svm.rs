//! Support vector machines with a Gaussian kernel, one for each pair of classes.

use super::smo;
use crate::arrays::{Arrays, ModelError};
use crate::fitting::{Fitting, LearnError};
use crate::network::{Matrix, multiply};
use crate::rows::{RowModel, Rows};

/// Penalty C of margin violations.
const COST: f64 = 100.0;
/// Steepness of the exponential that turns votes into probabilities.
const STEEPNESS: f64 = 2.0;
/// Largest number of support vectors of one machine in a file; sums of it must not overflow.
const MOST_TERMS: usize = 1 << 30;

/// Machines for all pairs of classes.
#[derive(Clone, Debug)]
pub(super) struct Svm {
    columns: usize,
    classes: usize,
    gamma: f64,
    /// Support vectors of all machines, `[vectors][columns]`.
    vectors: Vec<f32>,
    machines: Vec<Machine>,
}

/// Separates two classes by the sign of b + sum of w exp(-gamma |x - v|²).
#[derive(Clone, Debug)]
struct Machine {
    /// Negative and positive class.
    pair: [usize; 2],
    bias: f64,
    /// Index of a support vector, and its weight.
    terms: Vec<(usize, f64)>,
}

impl Svm {
    pub(super) fn fit(rows: &Rows, fitting: &Fitting<'_>) -> Result<Self, LearnError> {
        // scikit-learn's "scale": one over columns times variance; columns are scaled to unit variance.
        let gamma = 1.0 / rows.columns.max(1) as f64;
        let mut present: Vec<usize> = rows.labels.clone();
        present.sort_unstable();
        present.dedup();
        let mut svm =
            Self { columns: rows.columns, classes: rows.classes, gamma, vectors: Vec::new(), machines: Vec::new() };
        let mut known = vec![None; rows.labels.len()];
        let pairs = present.len() * present.len().saturating_sub(1) / 2;
        for (n, &negative) in present.iter().enumerate() {
            for &positive in &present[n + 1..] {
                fitting.check()?;
                let machine = svm.fit_pair(rows, [negative, positive], &mut known, fitting)?;
                svm.machines.push(machine);
                (fitting.progress)(0.1 + 0.9 * svm.machines.len() as f64 / pairs as f64);
            }
        }
        Ok(svm)
    }

    /// Trains the machine of a pair; `known` holds the index of each row among the support vectors.
    fn fit_pair(
        &mut self,
        rows: &Rows,
        pair: [usize; 2],
        known: &mut [Option<usize>],
        fitting: &Fitting<'_>,
    ) -> Result<Machine, LearnError> {
        let own: Vec<usize> = (0..rows.labels.len()).filter(|k| pair.contains(&rows.labels[*k])).collect();
        let row = |k: usize| &rows.values[k * rows.columns..(k + 1) * rows.columns];
        let values: Vec<f32> = own.iter().flat_map(|k| row(*k)).copied().collect();
        let signs: Vec<f64> = own.iter().map(|k| if rows.labels[*k] == pair[1] { 1.0 } else { -1.0 }).collect();
        let solution = smo::solve(&kernel(&values, own.len(), self.gamma), &signs, COST, fitting)?;
        let mut terms = Vec::new();
        for (k, weight) in own.into_iter().zip(solution.weights).filter(|(_, weight)| *weight != 0.0) {
            let next = self.vectors.len() / rows.columns.max(1);
            let index = *known[k].get_or_insert(next);
            if index == next {
                self.vectors.extend(row(k));
            }
            terms.push((index, weight));
        }
        Ok(Machine { pair, bias: solution.bias, terms })
    }

    /// Settings of every fit.
    pub(super) fn decided_by() -> String {
        format!("Gaussian kernel, gamma one over columns, C {COST}, one against one, steepness {STEEPNESS}")
    }

    /// Description of the fit for the model's card.
    pub(super) fn described(&self) -> String {
        let vectors = self.vectors.len() / self.columns.max(1);
        format!("Gaussian kernel, gamma {:.3e}, C {COST}, one against one, {vectors} support vectors", self.gamma)
    }

    pub(super) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, ModelError> {
        let vectors = arrays.f32_rows("svm.vectors", columns)?;
        let gamma = match *arrays.f64_vector("svm.gamma")? {
            [gamma] if gamma > 0.0 => gamma,
            [_] => Err(ModelError::value("svm.gamma", 0, "positive"))?,
            ref other => Err(ModelError::shape("svm.gamma", &[other.len()], &[1]))?,
        };
        let biases = arrays.f64_vector("svm.biases")?;
        arrays.require("svm.pairs", &[3 * biases.len()], "svm.biases")?;
        let (pairs, _) = arrays.integers("svm.pairs")?.as_chunks::<3>();
        let mut machines = Vec::with_capacity(biases.len());
        let mut length = 0_usize;
        for (k, (pair, bias)) in pairs.iter().zip(biases).enumerate() {
            let [negative, positive, terms] = pair.map(|x| usize::try_from(x).unwrap_or(usize::MAX));
            if negative >= classes || positive >= classes || terms > MOST_TERMS {
                Err(ModelError::value("svm.pairs", 3 * k, "two classes and a number of terms"))?;
            }
            length += terms;
            machines.push((Machine { pair: [negative, positive], bias: *bias, terms: Vec::new() }, terms));
        }
        arrays.require("svm.term_vectors", &[length], "svm.pairs")?;
        arrays.require("svm.term_weights", &[length], "svm.pairs")?;
        let of_terms = arrays.indices("svm.term_vectors", MOST_TERMS, "the index of a support vector")?;
        // Every support vector belongs to a term.
        arrays.require(
            "svm.vectors",
            &[of_terms.iter().max().map_or(0, |most| most + 1), columns],
            "svm.term_vectors",
        )?;
        let mut terms = of_terms.into_iter().zip(arrays.f64_vector("svm.term_weights")?.iter().copied());
        let filled = |(mut machine, length): (Machine, usize)| {
            machine.terms = terms.by_ref().take(length).collect();
            machine
        };
        let machines = machines.into_iter().map(filled).collect();
        Ok(Self { columns, classes, gamma, vectors: vectors.to_vec(), machines })
    }
}

/// Gaussian kernel of all pairs of rows, `[rows][rows]`.
fn kernel(values: &[f32], rows: usize, gamma: f64) -> Vec<f32> {
    let table = Matrix::new(values, rows, values.len() / rows.max(1));
    let mut kernel = vec![0.0; rows * rows];
    multiply(table, table.t(), 0.0, &mut kernel);
    let squares: Vec<f64> = kernel.iter().step_by(rows + 1).map(|x| f64::from(*x)).collect();
    for (row, own) in kernel.chunks_exact_mut(rows.max(1)).zip(&squares) {
        for (x, other) in row.iter_mut().zip(&squares) {
            let distance = (own + other - 2.0 * f64::from(*x)).max(0.0);
            *x = (-gamma * distance).exp() as f32;
        }
    }
    kernel
}

impl RowModel for Svm {
    /// Exponential of each class's votes over all pairs; margins break ties.
    fn predict(&self, row: &[f32]) -> Vec<f64> {
        let kernel: Vec<f64> = self
            .vectors
            .chunks_exact(self.columns.max(1))
            .map(|v| {
                let distance: f64 = v.iter().zip(row).map(|(a, b)| f64::from(a - b).powi(2)).sum();
                (-self.gamma * distance).exp()
            })
            .collect();
        let mut votes = vec![0.0; self.classes];
        let mut met = vec![false; self.classes];
        let mut scores = vec![0.0; self.classes];
        for machine in &self.machines {
            let margin = machine.bias + machine.terms.iter().map(|(v, w)| w * kernel[*v]).sum::<f64>();
            let [negative, positive] = machine.pair;
            votes[if margin > 0.0 { positive } else { negative }] += 1.0;
            scores[positive] += margin.clamp(-1.0, 1.0);
            scores[negative] -= margin.clamp(-1.0, 1.0);
            (met[negative], met[positive]) = (true, true);
        }
        // The class with most votes wins, as in scikit-learn; margins break ties and grade the others.
        let count = self.classes.max(2) as f64;
        votes
            .iter()
            .zip(scores)
            .zip(met)
            .map(|((votes, score), met)| if met { (STEEPNESS * (votes + score / (2.0 * count))).exp() } else { 0.0 })
            .collect()
    }

    fn save(&self, arrays: &mut Arrays) {
        let vectors = self.vectors.len() / self.columns.max(1);
        arrays.put("svm.vectors", &[vectors, self.columns], self.vectors.clone());
        arrays.put_f64("svm.gamma", vec![self.gamma]);
        let pairs = self.machines.iter().flat_map(|m| [m.pair[0], m.pair[1], m.terms.len()]);
        arrays.put_integers("svm.pairs", pairs);
        arrays.put_f64("svm.biases", self.machines.iter().map(|m| m.bias).collect());
        let terms = || self.machines.iter().flat_map(|m| &m.terms);
        arrays.put_integers("svm.term_vectors", terms().map(|(v, _)| *v));
        arrays.put_f64("svm.term_weights", terms().map(|(_, w)| *w).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance_tests::quick;

    /// Three classes that overlap, in small numbers.
    fn rows(first: usize, end: usize) -> Rows {
        let value = |r: usize, c: usize| {
            (((r * r * (7 + 4 * c) + 13 * r) % 61) as f64 / 8.0 + if r % 3 == c { 3.0 } else { 0.0 }) as f32
        };
        let values = (first..end).flat_map(|r| (0..3).map(move |c| value(r, c))).collect();
        Rows { values, columns: 3, labels: (first..end).map(|r| r % 3).collect(), weights: None, classes: 3 }
    }

    /// Agreement with scikit-learn 1.9.1, which printed the numbers by
    ///
    /// ```python
    /// import numpy as np
    /// from sklearn.svm import SVC
    /// def rows(first, end):
    ///     x = [[(r*r*(7+4*c) + 13*r) % 61 / 8 + 3*(r % 3 == c) for c in range(3)] for r in range(first, end)]
    ///     return np.array(x), np.arange(first, end) % 3
    /// (x, y), (t, _) = rows(0, 90), rows(90, 390)
    /// m = SVC(C=100, gamma=1/3, decision_function_shape="ovo").fit(x, y)
    /// d = -m.decision_function(t)
    /// wins = d > 0
    /// clear = ~((wins[:, 0] == wins[:, 2]) & (wins[:, 0] != wins[:, 1]))
    /// print(m.n_support_, -m.intercept_, d[:4], np.bincount(m.predict(t)[clear]))
    /// ends = np.r_[0, np.cumsum(m.n_support_)]
    /// for i, j in (0, 1), (0, 2), (1, 2):
    ///     i_rows, j_rows = slice(*ends[i:i+2]), slice(*ends[j:j+2])
    ///     w = np.r_[m.dual_coef_[j-1, i_rows], m.dual_coef_[i, j_rows]]
    ///     v = np.r_[m.support_vectors_[i_rows], m.support_vectors_[j_rows]]
    ///     k = np.exp(-((v[:, None] - v)**2).sum(2) / 3)
    ///     print(abs(w).sum() - w @ k @ w / 2)
    /// ```
    #[test]
    fn support_vectors_objectives_and_answers_are_those_of_scikit_learn() {
        let (train, test) = (rows(0, 90), rows(90, 390));
        let svm = Svm::fit(&train, &quick(1)).expect("fits");
        let mut support = [0; 3];
        for v in svm.vectors.chunks(3) {
            let of = train.values.chunks(3).position(|row| row == v).expect("a training row");
            support[train.labels[of]] += 1;
        }
        assert_eq!(support, [28, 26, 30]);
        let kernel = |a: &[f32], b: &[f32]| -> f64 {
            let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
            (-svm.gamma * squares.sum::<f64>()).exp()
        };
        let vector = |k: usize| &svm.vectors[3 * k..3 * k + 3];
        let answer = |machine: &Machine, row: &[f32]| {
            machine.bias + machine.terms.iter().map(|(v, w)| w * kernel(vector(*v), row)).sum::<f64>()
        };
        let biases = [-0.0464, -0.3814, -0.0902];
        let objectives = [45.1421, 434.4077, 47.1054];
        for (n, machine) in svm.machines.iter().enumerate() {
            let objective = |(v, w): &(usize, f64)| w.abs() - w * (answer(machine, vector(*v)) - machine.bias) / 2.0;
            let objective: f64 = machine.terms.iter().map(objective).sum();
            assert!((objective - objectives[n]).abs() < 1e-3, "machine {n}: {objective}");
            assert!((machine.bias - biases[n]).abs() < 2e-3, "machine {n}: {}", machine.bias);
        }
        // scikit-learn's sign is positive for the first class of a pair, and so the script turns it.
        let expected = [
            [0.0448, -0.8173, -0.3643],
            [-0.0046, -0.9480, -0.7303],
            [-0.0177, 0.5658, 0.5062],
            [0.1837, -0.5926, 1.0194],
        ];
        for (row, expected) in test.values.chunks(3).zip(expected) {
            for (machine, expected) in svm.machines.iter().zip(expected) {
                assert!((answer(machine, row) - expected).abs() < 2e-3, "{} for {expected}", answer(machine, row));
            }
        }
        // Where each class has one vote, scikit-learn answers the first and margins decide here.
        let mut predicted = [0; 3];
        for row in test.values.chunks(3) {
            let wins: Vec<bool> = svm.machines.iter().map(|machine| answer(machine, row) > 0.0).collect();
            if wins[0] != wins[2] || wins[0] == wins[1] {
                let weights = svm.predict(row);
                predicted[(0..3).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).expect("three classes")] += 1;
            }
        }
        assert_eq!(predicted, [116, 100, 76]);
    }
}
