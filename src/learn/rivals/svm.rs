//! Support vectors with a Gaussian kernel, one machine for each pair of classes. smartcore finds them; they are kept in
//! arrays of our own, because smartcore's machines borrow what they were fitted to.

use super::super::model_file::Arrays;
use super::super::{FitError, Fitting};
use super::tabular::Rows;
use smartcore::linalg::basic::matrix::DenseMatrix;
use smartcore::svm::Kernels;
use smartcore::svm::svc::{SVC, SVCParameters};

/// Cost of a training row on the wrong side.
const COST: f64 = 100.0;
/// Steepness with which margins become votes.
const STEEPNESS: f64 = 2.0;

/// Machines for pairs of classes.
#[derive(Clone, Debug)]
pub(super) struct Svm {
    columns: usize,
    classes: usize,
    gamma: f64,
    /// Rows that are a support vector of any machine.
    vectors: Vec<f32>,
    machines: Vec<Machine>,
}

/// Tells one class from another: the sign of b + sum of w exp(-gamma |x - v|²).
#[derive(Clone, Debug)]
struct Machine {
    /// Negative and positive class.
    pair: [usize; 2],
    bias: f64,
    /// Index of a support vector, and its weight.
    terms: Vec<(usize, f64)>,
}

impl Svm {
    pub(super) fn fit(rows: &Rows, fitting: &Fitting<'_>) -> Result<Self, FitError> {
        // scikit-learn's "scale": one over columns times variance, and columns have been scaled to a variance of one.
        let gamma = 1.0 / rows.columns.max(1) as f64;
        let mut present: Vec<usize> = rows.labels.clone();
        present.sort_unstable();
        present.dedup();
        let mut svm =
            Self { columns: rows.columns, classes: rows.classes, gamma, vectors: Vec::new(), machines: Vec::new() };
        let mut known = std::collections::HashMap::new();
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
        known: &mut std::collections::HashMap<Vec<u32>, usize>,
    ) -> Result<Machine, FitError> {
        let failed = |cause: String| FitError::Failed { cause };
        let mut own: Vec<usize> = (0..rows.labels.len()).filter(|k| pair.contains(&rows.labels[*k])).collect();
        // smartcore 0.7 cuts rows to as many columns as there are rows. So many copies of every row, each at its share
        // of the cost, have the same solution.
        let copies = rows.columns.div_ceil(own.len().max(1)).max(1);
        own = own.repeat(copies);
        let row = |k: usize| &rows.values[k * rows.columns..(k + 1) * rows.columns];
        let table: Vec<Vec<f64>> = own.iter().map(|k| row(*k).iter().map(|x| f64::from(*x)).collect()).collect();
        let x = DenseMatrix::from_2d_vec(&table).map_err(|e| failed(e.to_string()))?;
        let y: Vec<i32> = own.iter().map(|k| if rows.labels[*k] == pair[1] { 1 } else { -1 }).collect();
        let settings = SVCParameters::default()
            .with_c(COST / copies as f64)
            .with_kernel(Kernels::rbf().with_gamma(self.gamma))
            .with_seed(Some(1));
        let fitted = SVC::fit(&x, &y, &settings).map_err(|e| failed(e.to_string()))?;
        // smartcore keeps what it found to itself, but writes it out.
        let written = serde_json::to_value(&fitted).map_err(|e| failed(e.to_string()))?;
        let read = || -> Option<(f64, Vec<f64>, Vec<Vec<f64>>)> {
            let numbers = |v: &serde_json::Value| v.as_array()?.iter().map(serde_json::Value::as_f64).collect();
            let instances = written["instances"].as_array()?.iter().map(numbers).collect::<Option<_>>()?;
            Some((written["b"].as_f64()?, numbers(&written["w"])?, instances))
        };
        let (bias, weights, instances) =
            read().ok_or_else(|| failed("smartcore's support vectors could not be read".to_owned()))?;
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

    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    pub(super) fn classes(&self) -> usize {
        self.classes
    }

    pub(super) fn described(&self) -> String {
        let vectors = self.vectors.len() / self.columns.max(1);
        format!("Gaussian kernel, gamma {:.3e}, C {COST}, one against one, {vectors} support vectors", self.gamma)
    }

    /// Every pair votes by its margin; the product of all votes for a class, as probabilities.
    pub(super) fn predict(&self, row: &[f32]) -> Vec<f64> {
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
        // The class is that of most votes, as in scikit-learn; margins break ties and grade the rest.
        let count = self.classes.max(2) as f64;
        votes
            .iter()
            .zip(scores)
            .zip(met)
            .map(|((votes, score), met)| if met { (STEEPNESS * (votes + score / (2.0 * count))).exp() } else { 0.0 })
            .collect()
    }

    pub(super) fn save(&self, arrays: &mut Arrays) {
        let vectors = self.vectors.len() / self.columns.max(1);
        arrays.put("svm.vectors", &[vectors, self.columns], &self.vectors);
        arrays.put_f64("svm.gamma", &[self.gamma]);
        let pairs: Vec<i64> =
            self.machines.iter().flat_map(|m| [m.pair[0] as i64, m.pair[1] as i64, m.terms.len() as i64]).collect();
        arrays.put_integers("svm.pairs", &pairs);
        arrays.put_f64("svm.biases", &self.machines.iter().map(|m| m.bias).collect::<Vec<_>>());
        let terms = || self.machines.iter().flat_map(|m| &m.terms);
        arrays.put_integers("svm.term_vectors", &terms().map(|(v, _)| *v as i64).collect::<Vec<_>>());
        arrays.put_f64("svm.term_weights", &terms().map(|(_, w)| *w).collect::<Vec<_>>());
    }

    pub(super) fn load(arrays: &Arrays, columns: usize, classes: usize) -> Result<Self, String> {
        let vectors = arrays.get_f32("svm.vectors")?;
        if columns == 0 || vectors.len() % columns != 0 {
            return Err("its support vectors do not fit its features".to_owned());
        }
        let count = vectors.len() / columns;
        let index = |x: &i64, below: usize| usize::try_from(*x).ok().filter(|x| *x < below);
        let bad = || "its machines contradict each other".to_owned();
        let (pairs, biases) = (arrays.get_integers("svm.pairs")?, arrays.get_f64("svm.biases")?);
        let term_vectors = arrays.get_integers("svm.term_vectors")?;
        let mut terms = term_vectors.iter().zip(arrays.get_f64("svm.term_weights")?);
        let (rows, rest) = pairs.as_chunks::<3>();
        if !rest.is_empty() || rows.len() != biases.len() {
            return Err(bad());
        }
        let machine = |([negative, positive, length], bias): (&[i64; 3], f64)| -> Option<Machine> {
            let pair = [index(negative, classes)?, index(positive, classes)?];
            let own = (0..*length).map(|_| terms.next().and_then(|(v, w)| Some((index(v, count)?, w))));
            Some(Machine { pair, bias, terms: own.collect::<Option<_>>()? })
        };
        let machines: Option<Vec<Machine>> = rows.iter().zip(biases).map(machine).collect();
        let gamma = arrays.get_f64("svm.gamma")?.first().copied().filter(|g| *g > 0.0).ok_or_else(bad)?;
        Ok(Self { columns, classes, gamma, vectors, machines: machines.ok_or_else(bad)? })
    }
}
