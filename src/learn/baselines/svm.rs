//! Support vector machines with a Gaussian kernel, one for each pair of classes. smartcore fits them; the support
//! vectors are kept in arrays, because smartcore's machines borrow their training rows.

use super::row_model::{RowModel, Rows};
use crate::arrays::{ArrayError, Arrays};
use crate::fitting::{Fitting, LearnError};
use crate::model::LoadError;
use smartcore::linalg::basic::matrix::DenseMatrix;
use smartcore::svm::Kernels;
use smartcore::svm::svc::{SVC, SVCParameters};
use std::collections::HashMap;

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
        let mut known = HashMap::new();
        let pairs = present.len() * present.len().saturating_sub(1) / 2;
        for (n, &negative) in present.iter().enumerate() {
            for &positive in &present[n + 1..] {
                fitting.check()?;
                let machine = svm.fit_pair(rows, [negative, positive], &mut known)?;
                svm.machines.push(machine);
                (fitting.progress)(0.1 + 0.9 * svm.machines.len() as f64 / pairs as f64);
            }
        }
        Ok(svm)
    }

    fn fit_pair(
        &mut self,
        rows: &Rows,
        pair: [usize; 2],
        known: &mut HashMap<Vec<u32>, usize>,
    ) -> Result<Machine, LearnError> {
        let mut own: Vec<usize> = (0..rows.labels.len()).filter(|k| pair.contains(&rows.labels[*k])).collect();
        // smartcore 0.7 truncates each row to as many columns as there are rows. Repeating all rows, each at its share of
        // the cost, has the same solution.
        let copies = rows.columns.div_ceil(own.len().max(1)).max(1);
        own = own.repeat(copies);
        let row = |k: usize| &rows.values[k * rows.columns..(k + 1) * rows.columns];
        let table: Vec<Vec<f64>> = own.iter().map(|k| row(*k).iter().map(|x| f64::from(*x)).collect()).collect();
        let x = DenseMatrix::from_2d_vec(&table).map_err(LearnError::failed)?;
        let y: Vec<i32> = own.iter().map(|k| if rows.labels[*k] == pair[1] { 1 } else { -1 }).collect();
        let settings = SVCParameters::default()
            .with_c(COST / copies as f64)
            .with_kernel(Kernels::rbf().with_gamma(self.gamma))
            .with_seed(Some(1));
        let fitted = SVC::fit(&x, &y, &settings).map_err(LearnError::failed)?;
        // smartcore's fields are private, but it serialises them.
        let written = serde_json::to_value(&fitted).map_err(LearnError::failed)?;
        let read = || -> Option<(f64, Vec<f64>, Vec<Vec<f64>>)> {
            let numbers = |v: &serde_json::Value| v.as_array()?.iter().map(serde_json::Value::as_f64).collect();
            let instances = written["instances"].as_array()?.iter().map(numbers).collect::<Option<_>>()?;
            Some((written["b"].as_f64()?, numbers(&written["w"])?, instances))
        };
        let (bias, weights, instances) =
            read().ok_or_else(|| LearnError::failed("cannot read the support vectors of smartcore"))?;
        let mut terms = Vec::new();
        for (instance, weight) in instances.iter().zip(weights) {
            let row: Vec<f32> = instance.iter().map(|x| *x as f32).collect();
            let next = known.len();
            let index = *known.entry(row.iter().map(|x| x.to_bits()).collect()).or_insert(next);
            if index == next {
                self.vectors.extend(row);
            }
            terms.push((index, weight));
        }
        Ok(Machine { pair, bias, terms })
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

    pub(super) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, LoadError> {
        let vectors = arrays.f32_rows("svm.vectors", columns)?;
        let gamma = match *arrays.f64_vector("svm.gamma")? {
            [gamma] if gamma > 0.0 => gamma,
            [_] => Err(ArrayError::Value { name: "svm.gamma".to_owned(), index: 0, expected: "positive" })?,
            ref other => {
                let (name, found) = ("svm.gamma".to_owned(), vec![other.len()]);
                Err(ArrayError::Shape { name, found, expected: vec![1] })?
            }
        };
        let biases = arrays.f64_vector("svm.biases")?;
        arrays.require("svm.pairs", &[3 * biases.len()], "svm.biases")?;
        let (pairs, _) = arrays.integers("svm.pairs")?.as_chunks::<3>();
        let mut machines = Vec::with_capacity(biases.len());
        let mut length = 0_usize;
        for (k, (pair, bias)) in pairs.iter().zip(biases).enumerate() {
            let [negative, positive, terms] = pair.map(|x| usize::try_from(x).unwrap_or(usize::MAX));
            if negative >= classes || positive >= classes || terms > MOST_TERMS {
                let (name, expected) = ("svm.pairs".to_owned(), "two classes and a number of terms");
                Err(ArrayError::Value { name, index: 3 * k, expected })?;
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
