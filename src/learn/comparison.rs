//! Comparison of methods: all fitted to the same training grasps and evaluated on the same test grasps, in one split of
//! the data or in several.

use crate::belief::{Round, StopRule};
use crate::data::{DataCard, Dataset};
use crate::evaluation::{
    Answers, Evaluation, Stop, answer, evaluate_stopped, f1_by_grasps, most_grasps, product_of_experts, rounds, stops,
};
use crate::fitting::{Fitting, LearnError};
use crate::methods::{METHODS, Method, MethodKind, method};
use crate::metrics::{Bootstrap, Confusion, Interval, McNemar, holm};
use crate::model::Model;
use crate::pmf::Pmf;
use crate::split::{SplitError, check_apart};
use serde::Serialize;
use std::collections::BTreeSet;
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
    /// Training set of stage two, as in the paper's 40/40/20.
    pub second: Option<&'a Dataset>,
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

/// A method's tests, in one split or several.
struct TestRun {
    model: String,
    title: String,
    /// Test grasps of all splits, one after the other.
    data: Dataset,
    answers: Answers,
    followed: Vec<Round>,
    independent: Vec<Round>,
    stops: Vec<Stop>,
    train_cpu_s: f64,
    parameters: usize,
    fingerprint: Option<String>,
    quick: bool,
    splits: usize,
}

impl TestRun {
    /// Adds the tests of another split.
    fn with(mut self, other: Self) -> Self {
        let splits = (self.splits + other.splits) as f64;
        let share = other.splits as f64 / splits;
        self.data.examples.extend(other.data.examples);
        self.answers.truth.extend(other.answers.truth);
        self.answers.verdicts.extend(other.answers.verdicts);
        self.answers.step_us += share * (other.answers.step_us - self.answers.step_us);
        self.followed.extend(other.followed);
        self.independent.extend(other.independent);
        self.stops.extend(other.stops);
        self.train_cpu_s += share * (other.train_cpu_s - self.train_cpu_s);
        self.parameters = self.parameters.max(other.parameters);
        self.splits += other.splits;
        self
    }
}

/// Rows of a comparison, and the methods that these data cannot train.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Compared {
    /// Rows, in the order of the methods.
    pub rows: Vec<ComparisonRow>,
    /// Key and reason of each method left out.
    pub left_out: Vec<(&'static str, LearnError)>,
}

/// Result of a method in short, as soon as its last fit has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodResult {
    /// Key of the method.
    pub method: &'static str,
    /// Macro F1 over the tests of all splits.
    pub f1_macro: f64,
    /// CPU time of a fit (s).
    pub train_cpu_s: f64,
}

impl MethodResult {
    /// The result where all splits have ended and none has failed.
    fn of(method: &'static str, splits: &[Option<Result<TestRun, ComparisonError>>]) -> Option<Self> {
        let tested: Vec<&TestRun> = splits.iter().map(|split| split.as_ref()?.as_ref().ok()).collect::<Option<_>>()?;
        let pairs = tested.iter().flat_map(|own| own.answers.truth.iter().copied().zip(decisions(&own.answers)));
        let confusion = Confusion::from_pairs(tested.first()?.data.labels.classes.len(), pairs)?;
        let train_cpu_s = tested.iter().map(|own| own.train_cpu_s).sum::<f64>() / tested.len() as f64;
        Some(Self { method, f1_macro: confusion.macro_f1()?, train_cpu_s })
    }
}

/// Error of a comparison.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ComparisonError {
    #[error("{method}: {cause}")]
    Fit {
        /// Key of the method.
        method: &'static str,
        cause: LearnError,
    },
    #[error(transparent)]
    Split(#[from] SplitError),
    #[error("no test grasps left: collect more trials, or train on fewer with --train-trials")]
    NoTest,
}

/// Fits and evaluates methods on several splits in parallel, each fit on one thread; rows are in the order of the methods.
/// A row holds the tests of all splits. `progress` is called after each fit, with the method's result after its last one.
/// Methods that cannot learn from these data are left out, unless there is no other.
pub fn compare(
    splits: &[Comparison<'_>],
    methods: &[&'static Method],
    threads: usize,
    progress: &(dyn Fn(Option<MethodResult>) + Sync),
) -> Result<Compared, ComparisonError> {
    let Some(first) = splits.first() else { return Err(ComparisonError::NoTest) };
    for split in splits {
        split.check()?;
    }
    let fits = methods.len() * splits.len();
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<Option<Result<TestRun, ComparisonError>>>> = Mutex::new((0..fits).map(|_| None).collect());
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, fits.max(1)) {
            scope.spawn(|| {
                while let Some(n) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|n| *n < fits) {
                    let method = methods[n / splits.len()];
                    let tested = splits[n % splits.len()].of_method(method);
                    // The lock is poisoned only when another thread has panicked, and then the scope panics too.
                    let result = done.lock().ok().and_then(|mut done| {
                        done[n] = Some(tested);
                        MethodResult::of(method.key, &done[n - n % splits.len()..][..splits.len()])
                    });
                    progress(result);
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_default().into_iter().flatten();
    let (mut kept, mut left_out, mut refused) = (Vec::new(), Vec::new(), None);
    for method in methods {
        let of_splits: Result<Vec<TestRun>, _> =
            done.by_ref().take(splits.len()).collect::<Vec<_>>().into_iter().collect();
        match of_splits {
            Ok(tested) => kept.extend(tested.into_iter().reduce(TestRun::with)),
            Err(ComparisonError::Fit { cause, .. }) if cause != LearnError::Stopped => {
                left_out.push((method.key, cause.clone()));
                refused.get_or_insert(ComparisonError::Fit { method: method.key, cause });
            }
            Err(error) => return Err(error),
        }
    }
    match refused {
        Some(error) if kept.is_empty() => Err(error),
        _ => Ok(Compared { rows: first.compared(&kept)?, left_out }),
    }
}

impl Comparison<'_> {
    /// Refuses a test without grasps, or with grasps of the training.
    fn check(&self) -> Result<(), ComparisonError> {
        if self.test.examples.is_empty() {
            return Err(ComparisonError::NoTest);
        }
        let second = self.second.map_or(&[][..], |second| &second.examples);
        Ok(check_apart(self.train.examples.iter().chain(second), &self.test.examples)?)
    }

    /// Settings of the method, without progress reports.
    fn fitting(&self) -> Fitting<'_> {
        Fitting { second: self.second, ..Fitting::new(self.seed, self.quick, self.interrupted) }
    }

    fn of_method(&self, method: &'static Method) -> Result<TestRun, ComparisonError> {
        let fitting = self.fitting();
        let model =
            method.train(self.train, &fitting).map_err(|cause| ComparisonError::Fit { method: method.key, cause })?;
        Ok(self.of_model(method.key, method.title, &model))
    }

    /// Evaluates a model that was fitted elsewhere.
    pub fn of_fitted(&self, name: &str, model: &Model) -> Result<ComparisonRow, ComparisonError> {
        self.check()?;
        let title = method(&model.card.method).map_or("", |m| m.title);
        self.row(&self.of_model(name, title, model))
    }

    fn of_model(&self, name: &str, title: &str, model: &Model) -> TestRun {
        let recogniser = model.recogniser.as_ref();
        let answers = answer(recogniser, self.test);
        let seed = self.seed ^ 0x6ea5;
        let followed = rounds(recogniser, self.test, &answers, seed);
        TestRun {
            model: name.to_owned(),
            title: title.to_owned(),
            data: self.test.clone(),
            independent: product_of_experts(self.test, &answers, seed),
            stops: stops(recogniser, &followed, self.stop),
            answers,
            followed,
            train_cpu_s: model.card.train_cpu_s,
            parameters: model.card.parameters,
            fingerprint: model.card.fingerprint.clone(),
            quick: model.card.quick,
            splits: 1,
        }
    }

    fn row(&self, tested: &TestRun) -> Result<ComparisonRow, ComparisonError> {
        let TestRun { data, answers, followed, independent, .. } = tested;
        let bootstrap = Bootstrap { seed: self.seed ^ 0x6ea5, ..Bootstrap::default() };
        let evaluation = evaluate_stopped(data, answers, followed, &tested.stops, self.stop, &bootstrap);
        let classes = data.labels.classes.len();
        Ok(ComparisonRow {
            model: tested.model.clone(),
            title: tested.title.clone(),
            evaluation: evaluation.ok_or(ComparisonError::NoTest)?,
            train_cpu_s: tested.train_cpu_s,
            parameters: tested.parameters,
            f1_by_grasps_independent: f1_by_grasps(classes, independent),
            gain_over_independent: fed_back_against_independent(classes, followed, independent),
            data: data.about.clone(),
            fingerprint: tested.fingerprint.clone(),
            quick: tested.quick,
            against_first: None,
        })
    }

    fn compared(&self, tested: &[TestRun]) -> Result<Vec<ComparisonRow>, ComparisonError> {
        let mut rows = tested.iter().map(|tested| self.row(tested)).collect::<Result<Vec<_>, _>>()?;
        let Some((first, others)) = tested.split_first() else { return Ok(rows) };
        // A trial that several splits test counts once.
        let mut met = BTreeSet::new();
        let examples = first.data.examples.iter().enumerate();
        let once: Vec<usize> = examples.filter(|(_, e)| met.insert((e.id, e.class))).map(|(k, _)| k).collect();
        let decided = |tested: &TestRun| -> Vec<Option<usize>> {
            once.iter().map(|k| Some(tested.answers.verdicts[*k].pmf.top().0)).collect()
        };
        let truth: Vec<usize> = once.iter().map(|k| first.answers.truth[*k]).collect();
        let sessions: Vec<u32> = once.iter().map(|k| first.data.examples[*k].session).collect();
        let classes = first.data.labels.classes.len();
        let f1 = |decided: &[Option<usize>], trials: &[usize]| {
            Confusion::from_pairs(classes, trials.iter().map(|k| (truth[*k], decided[*k])))?.f1_over_occurring()
        };
        let of_first = decided(first);
        let of_others: Vec<Vec<Option<usize>>> = others.iter().map(decided).collect();
        let p_values: Vec<f64> =
            of_others.iter().map(|own| McNemar::of(&truth, own, &of_first).map_or(1.0, |m| m.p_value())).collect();
        let adjusted = holm(&p_values);
        let bootstrap = Bootstrap { resamples: 1000, seed: self.seed };
        for (((row, own), mcnemar_p), mcnemar_p_holm) in
            rows[1..].iter_mut().zip(&of_others).zip(p_values).zip(adjusted)
        {
            let difference =
                bootstrap.difference((&truth, &sessions), |trials| f1(own, trials), |trials| f1(&of_first, trials));
            row.against_first = difference.map(|f1| Difference { f1, mcnemar_p, mcnemar_p_holm });
        }
        Ok(rows)
    }

    /// Controls of a fair comparison: a method trained on shuffled labels, which must score at chance, and one that is
    /// given the true size and shape, an upper bound for methods that must estimate them.
    pub fn controls(&self, method: &'static Method) -> Result<Controls, ComparisonError> {
        self.check()?;
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
        let oracle = with_true_size_and_shape(&plain, self.test);
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

/// Answers as if the true size and shape of each grasped object were known.
pub fn with_true_size_and_shape(answers: &Answers, test: &Dataset) -> Answers {
    let mut told = answers.clone();
    let labels = &test.labels;
    for (verdict, class) in told.verdicts.iter_mut().zip(test.truth()) {
        let like = |other: usize| {
            let (own, other) = (&labels.classes[class], &labels.classes[other]);
            (own.size, own.shape) == (other.size, other.shape)
        };
        let kept = verdict.pmf.probabilities().iter().enumerate().map(|(c, p)| if like(c) { *p } else { 0.0 });
        verdict.pmf = Pmf::from_weights(kept.collect::<Vec<_>>());
    }
    told
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
    let most = most_grasps(fed_back).min(most_grasps(independent));
    let f1 = |rounds: &[Round], grasps: usize, trials: &[usize]| {
        let decided = |k: usize| Some((rounds[k].truth, Some(rounds[k].belief.steps().get(grasps)?.top().0)));
        let pairs = trials.iter().filter_map(|k| decided(*k));
        Confusion::from_pairs(classes, pairs)?.macro_f1()
    };
    let bootstrap = Bootstrap { resamples: 500, seed: 0 };
    (0..most)
        .filter_map(|grasps| {
            bootstrap.difference((&truth, &[]), |t| f1(fed_back, grasps, t), |t| f1(independent, grasps, t))
        })
        .collect()
}

/// Methods in the order of a table: the paper's networks, single models, ensembles, further baselines.
pub fn in_table_order() -> Vec<&'static Method> {
    let order = [MethodKind::Network, MethodKind::Single, MethodKind::Ensemble, MethodKind::Further];
    let of = |kind: MethodKind| METHODS.iter().filter(move |m| m.kind == kind);
    order.into_iter().flat_map(of).collect()
}
