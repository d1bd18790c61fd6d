//! Comparison of methods: all fitted to the same training grasps and evaluated on the same test grasps.

use palpate_learn::evaluation::{Answers, Evaluation, Round, answer, evaluate, product_of_experts, rounds};
use palpate_learn::metrics::{Bootstrap, Confusion, Interval, McNemar, holm};
use palpate_learn::{DataCard, Dataset, Fitting, LearnError, Method, MethodKind, Model, Pmf, StopRule};
use serde::Serialize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Row of one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparisonRow {
    /// Key of the method, or path of a model.
    pub model: String,
    /// Display name.
    pub title: String,
    /// Evaluation on the test grasps.
    #[serde(flatten)]
    pub evaluation: Evaluation,
    /// CPU time of the fit (s).
    pub train_cpu_s: f64,
    /// Number of learned parameters.
    pub parameters: usize,
    /// Macro F1 after one grasp, two, and so on, by the product of experts, which treats grasps as independent.
    pub f1_by_grasps_independent: Vec<f64>,
    /// Gain of PMF feedback over the product of experts after one grasp, two, and so on: difference of macro F1 on the
    /// same grasps, with paired 95 % intervals.
    pub gain_over_independent: Vec<Interval>,
    /// Origin of the grasps.
    pub data: DataCard,
    /// Fingerprint of the method; null for models of older versions.
    pub fingerprint: Option<String>,
    /// True for a quick fit.
    pub quick: bool,
    /// Comparison with the first row.
    pub against_first: Option<Difference>,
}

/// One model against another on the same grasps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Macro F1 of this model minus that of the other, with its paired 95 % interval.
    pub f1: Interval,
    /// Exact McNemar test of the decisions.
    pub mcnemar_p: f64,
    /// The same p-value with Holm's correction for the number of comparisons.
    pub mcnemar_p_holm: f64,
}

/// Inputs of a comparison.
pub struct Comparison<'a> {
    /// Training set.
    pub train: &'a Dataset,
    /// Test set, disjoint from `train`.
    pub test: &'a Dataset,
    /// Seed of fits and draws.
    pub seed: u64,
    /// Quick fits, for tests and quick looks.
    pub quick: bool,
    /// Stop rule of grasping until sure.
    pub stop: StopRule,
    /// Flag that cancels the work.
    pub interrupted: &'a AtomicBool,
}

/// A method's results before rows are compared.
struct Judged {
    row: ComparisonRow,
    decided: Vec<Option<usize>>,
}

/// Error of a comparison.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ComparisonError {
    /// A method could not be fitted.
    #[error("{method}: {cause}")]
    Fit {
        /// Key of the method.
        method: &'static str,
        /// Cause.
        cause: LearnError,
    },
    /// No test grasps.
    #[error("no test grasps left: collect more trials, or train on fewer with --train-trials")]
    NoTest,
}

impl Comparison<'_> {
    /// Fits and evaluates methods in parallel, each on one thread; rows are in the order of the methods.
    /// `progress` receives every finished method.
    pub fn of_methods(
        &self,
        methods: &[&'static Method],
        threads: usize,
        progress: &(dyn Fn(&ComparisonRow) + Sync),
    ) -> Result<Vec<ComparisonRow>, ComparisonError> {
        if self.test.examples.is_empty() {
            return Err(ComparisonError::NoTest);
        }
        let next = AtomicUsize::new(0);
        let done: Mutex<Vec<Option<Result<Judged, ComparisonError>>>> =
            Mutex::new((0..methods.len()).map(|_| None).collect());
        std::thread::scope(|scope| {
            for _ in 0..threads.clamp(1, methods.len().max(1)) {
                scope.spawn(|| {
                    while let Some((n, method)) =
                        Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|n| Some((n, methods.get(n)?)))
                    {
                        let judged = self.of_method(method);
                        if let Ok(judged) = &judged {
                            progress(&judged.row);
                        }
                        // The lock is poisoned only when another thread has panicked, and then the scope panics too.
                        if let Ok(mut done) = done.lock() {
                            done[n] = Some(judged);
                        }
                    }
                });
            }
        });
        let done = done.into_inner().unwrap_or_default();
        let judged = done.into_iter().flatten().collect::<Result<Vec<Judged>, _>>()?;
        Ok(self.compared(judged))
    }

    /// Settings of the method, without progress reports.
    fn fitting(&self) -> Fitting<'_> {
        Fitting {
            seed: self.seed,
            quick: self.quick,
            settings: serde_json::Map::new(),
            second: None,
            progress: &|_| (),
            stop: self.interrupted,
        }
    }

    /// Fits and evaluates one method in this thread.
    pub fn row_of(&self, method: &'static Method) -> Result<ComparisonRow, ComparisonError> {
        self.of_method(method).map(|judged| judged.row)
    }

    fn of_method(&self, method: &'static Method) -> Result<Judged, ComparisonError> {
        let fitting = self.fitting();
        let model =
            method.train(self.train, &fitting).map_err(|cause| ComparisonError::Fit { method: method.key, cause })?;
        self.of_model(method.key, method.title, &model)
    }

    /// Evaluates a model that was fitted elsewhere.
    pub fn of_fitted(&self, name: &str, model: &Model) -> Result<ComparisonRow, ComparisonError> {
        let title = palpate_learn::method(&model.card.method).map_or("", |m| m.title);
        self.of_model(name, title, model).map(|judged| judged.row)
    }

    fn of_model(&self, name: &str, title: &str, model: &Model) -> Result<Judged, ComparisonError> {
        let recogniser = model.recogniser.as_ref();
        let answers = answer(recogniser, self.test);
        let seed = self.seed ^ 0x6ea5;
        let followed = rounds(recogniser, self.test, &answers, seed);
        let independent = product_of_experts(self.test, &answers, seed);
        let evaluation = evaluate(
            recogniser,
            self.test,
            &answers,
            &followed,
            self.stop,
            &Bootstrap { seed, ..Bootstrap::default() },
        )
        .ok_or(ComparisonError::NoTest)?;
        let classes = self.test.labels.classes.len();
        let row = ComparisonRow {
            model: name.to_owned(),
            title: title.to_owned(),
            evaluation,
            train_cpu_s: model.card.train_cpu_s,
            parameters: model.card.parameters,
            f1_by_grasps_independent: palpate_learn::evaluation::f1_by_grasps(classes, &independent),
            gain_over_independent: fed_back_against_independent(classes, &followed, &independent),
            data: self.test.about.clone(),
            fingerprint: model.card.fingerprint.clone(),
            quick: model.card.quick,
            against_first: None,
        };
        Ok(Judged { row, decided: decisions(&answers) })
    }

    fn compared(&self, mut judged: Vec<Judged>) -> Vec<ComparisonRow> {
        let Some((first, others)) = judged.split_first_mut() else { return Vec::new() };
        let truth = self.test.truth();
        let classes = self.test.labels.classes.len();
        let f1 = |decided: &[Option<usize>], trials: &[usize]| {
            Confusion::from_pairs(classes, trials.iter().map(|k| (truth[*k], decided[*k])))?.macro_f1()
        };
        let p_values: Vec<f64> = others
            .iter()
            .map(|o| McNemar::of(&truth, &o.decided, &first.decided).map_or(1.0, |m| m.p_value()))
            .collect();
        let adjusted = holm(&p_values);
        let bootstrap = Bootstrap { resamples: 1000, seed: self.seed };
        for ((other, mcnemar_p), mcnemar_p_holm) in others.iter_mut().zip(p_values).zip(adjusted) {
            let difference =
                bootstrap.difference(&truth, |trials| f1(&other.decided, trials), |trials| f1(&first.decided, trials));
            other.row.against_first = difference.map(|f1| Difference { f1, mcnemar_p, mcnemar_p_holm });
        }
        judged.into_iter().map(|j| j.row).collect()
    }

    /// Controls of a fair comparison: a method trained on shuffled labels, which must score at chance, and one that is
    /// given the true size and shape, an upper bound for methods that must estimate them.
    pub fn controls(&self, method: &'static Method) -> Result<Controls, ComparisonError> {
        let fitting = self.fitting();
        let failed = |cause| ComparisonError::Fit { method: method.key, cause };
        let shuffled = method.train(&self.train.with_shuffled_labels(self.seed), &fitting).map_err(failed)?;
        let classes = self.test.labels.classes.len();
        let truth = self.test.truth();
        let accuracy = |answers: &Answers| {
            let decided = decisions(answers);
            let of = |trials: &[usize]| {
                let pairs = trials.iter().map(|k| (truth[*k], decided[*k]));
                Confusion::from_pairs(classes, pairs)?.macro_accuracy()
            };
            Bootstrap { resamples: 1000, seed: self.seed }.interval(&truth, of)
        };
        let by_chance = answer(shuffled.recogniser.as_ref(), self.test);
        let model = method.train(self.train, &fitting).map_err(failed)?;
        let plain = answer(model.recogniser.as_ref(), self.test);
        let mut oracle = plain.clone();
        let labels = &self.test.labels;
        for (verdict, class) in oracle.verdicts.iter_mut().zip(&truth) {
            let like = |other: usize| {
                let (own, other) = (&labels.classes[*class], &labels.classes[other]);
                (own.size, own.shape) == (other.size, other.shape)
            };
            let kept = verdict.pmf.probabilities().iter().enumerate().map(|(c, p)| if like(c) { *p } else { 0.0 });
            verdict.pmf = Pmf::from_weights(kept.collect::<Vec<_>>());
        }
        let of = |answers: &Answers| accuracy(answers).ok_or(ComparisonError::NoTest);
        Ok(Controls {
            method: method.key,
            chance: 1.0 / self.test.by_class().iter().filter(|c| !c.is_empty()).count().max(1) as f64,
            shuffled_labels: of(&by_chance)?,
            plain: of(&plain)?,
            true_size_and_shape: of(&oracle)?,
        })
    }
}

/// Macro-accuracy of the controls, with 95 % intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Controls {
    /// Key of the method.
    pub method: &'static str,
    /// One over the number of classes.
    pub chance: f64,
    /// Trained on shuffled labels.
    pub shuffled_labels: Interval,
    /// Trained on the true labels.
    pub plain: Interval,
    /// Given the true size and shape.
    pub true_size_and_shape: Interval,
}

fn decisions(answers: &Answers) -> Vec<Option<usize>> {
    answers.verdicts.iter().map(|v| Some(v.pmf.top().0)).collect()
}

/// Iterated recognition against the product of experts on the same rounds: F1 of the first minus that of the second
/// after each number of grasps, with paired 95 % intervals.
fn fed_back_against_independent(classes: usize, fed_back: &[Round], independent: &[Round]) -> Vec<Interval> {
    let truth: Vec<usize> = fed_back.iter().map(|r| r.truth).collect();
    let most = fed_back.iter().chain(independent).map(|r| r.belief.grasps()).min().unwrap_or(0);
    let f1 = |rounds: &[Round], grasps: usize, trials: &[usize]| {
        let pairs = trials.iter().map(|k| (rounds[*k].truth, Some(rounds[*k].belief.steps()[grasps].top().0)));
        Confusion::from_pairs(classes, pairs)?.macro_f1()
    };
    let bootstrap = Bootstrap { resamples: 500, seed: 0 };
    (0..most)
        .filter_map(|grasps| bootstrap.difference(&truth, |t| f1(fed_back, grasps, t), |t| f1(independent, grasps, t)))
        .collect()
}

/// Methods in the order of a table: the paper's networks, single models, ensembles, further baselines.
pub fn in_table_order() -> Vec<&'static Method> {
    let order = [MethodKind::Network, MethodKind::Single, MethodKind::Ensemble, MethodKind::Further];
    let of = |kind: MethodKind| palpate_learn::METHODS.iter().filter(move |m| m.kind == kind);
    order.into_iter().flat_map(of).collect()
}
