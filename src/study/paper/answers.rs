//! Models fitted and judged in a study: their answers to test grasps, with intervals and paired differences.

use super::bench::StudyData;
use super::plan::{DataWanted, StudyPlan};
use crate::frame::{Cell, PERCENT, StudyError, StudyTable};
use palpate_learn::evaluation::{Answers, answer};
use palpate_learn::metrics::{Bootstrap, CALIBRATION_BINS, Confusion, Forecasts, Interval, McNemar};
use palpate_learn::{Dataset, Method, Model, SplitError, SplitPlan};
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::TrialId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Answers of a model to test grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ModelAnswers {
    /// Description of the data.
    pub(super) data: String,
    /// Names of the classes.
    pub(super) classes: Vec<String>,
    /// Test grasps.
    pub(super) trials: Vec<TrialId>,
    /// Their classes.
    pub(super) truth: Vec<usize>,
    /// The model's decisions.
    pub(super) decided: Vec<usize>,
    /// Session of each grasp; empty where all are of the first. A part may be a session by itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) sessions: Vec<u32>,
    /// Expected calibration error.
    pub(super) ece: f64,
    pub(super) cost: ModelCost,
}

/// Cost of a model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ModelCost {
    /// CPU time of the fit (s).
    pub(super) train_cpu_s: f64,
    /// CPU time of the answer to a whole grasp (ms).
    pub(super) answer_ms: f64,
    /// CPU time per sample as it arrives (µs); none for methods that need the whole grasp.
    pub(super) step_us: Option<f64>,
    /// Size of the model file (bytes).
    pub(super) bytes: usize,
    /// Number of learned parameters.
    pub(super) parameters: usize,
}

/// A model's answers, or the reason why it could not be fitted to these data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum TestAnswers {
    Answers(ModelAnswers),
    /// It could not be fitted.
    NotFitted(String),
}

impl TestAnswers {
    /// The answers, where there are some.
    pub(super) fn answers(&self) -> Option<&ModelAnswers> {
        match self {
            Self::Answers(answers) => Some(answers),
            Self::NotFitted(_) => None,
        }
    }

    /// Reason why it could not be fitted, where it could not.
    pub(crate) fn reason(&self) -> Option<&str> {
        match self {
            Self::NotFitted(reason) => Some(reason),
            Self::Answers(_) => None,
        }
    }
}

/// A division into training and test grasps: one of several equal parts is the test set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TestPart {
    /// Number of parts.
    pub(super) of: usize,
    /// The part to test on, from 0.
    pub(super) part: usize,
    /// Largest number of training grasps of each class; fewer are contained in more.
    pub(super) train: usize,
}

/// Parts of the grasps, of which a unit tests one, and training grasps of each object in the others.
pub(super) const PARTS: usize = 3;
pub(super) const TRAIN: usize = 50;
/// Grasps of each object in the quick form.
const QUICK: usize = 40;

/// Grasps that most studies share.
pub(super) fn usual_grasps(plan: &StudyPlan, sensors: SensorModel) -> DataWanted {
    plan.wanted(plan.grasps(PARTS * TRAIN, QUICK), sensors)
}

impl TestPart {
    /// A part of the [`usual_grasps`].
    pub(super) fn usual(plan: &StudyPlan, part: usize) -> Self {
        // With three parts, samples of six grasps train on the four that dual-stage networks need.
        Self { of: plan.pick(PARTS, 2, 3), part, train: TRAIN }
    }

    /// Training and test set.
    pub(super) fn split(self, data: &Dataset, seed: u64) -> Result<[Dataset; 2], StudyError> {
        let splits = SplitPlan::Folds { folds: self.of }.splits(data, seed, 1)?;
        let split = splits.get(self.part).ok_or(StudyError::Split(SplitError::folds()))?.limited(data, self.train);
        Ok([data.part(&split.train), data.part(&split.test)])
    }
}

impl StudyData<'_> {
    /// Training and test grasps of a method.
    pub(super) fn split(
        &self,
        wanted: DataWanted,
        method: &Method,
        part: TestPart,
    ) -> Result<[Dataset; 2], StudyError> {
        part.split(&*self.data(&wanted.read_by(method))?, self.plan().seed)
    }

    /// Fits a method to training grasps and judges it on test grasps.
    pub(super) fn judge(&self, method: &Method, sets: &[Dataset; 2]) -> Result<TestAnswers, StudyError> {
        self.judged_model(method, sets).map(|(_, answers)| answers)
    }

    /// The same with the model; without one where it cannot be fitted to these grasps.
    pub(super) fn judged_model(
        &self,
        method: &Method,
        [train, test]: &[Dataset; 2],
    ) -> Result<(Option<Model>, TestAnswers), StudyError> {
        match self.fit(method, train) {
            Ok(model) => {
                let answers = TestAnswers::Answers(judge(&model, test));
                Ok((Some(model), answers))
            }
            Err(StudyError::Fit { cause, .. }) => Ok((None, TestAnswers::NotFitted(cause.to_string()))),
            Err(other) => Err(other),
        }
    }
}

/// Mean over models; none where one of them has none.
pub(super) fn mean<'a>(
    all: impl IntoIterator<Item = &'a ModelAnswers>,
    pick: impl Fn(&ModelAnswers) -> Option<f64>,
) -> Option<f64> {
    let values = all.into_iter().map(pick).collect::<Option<Vec<f64>>>().filter(|values| !values.is_empty())?;
    Some(values.iter().sum::<f64>() / values.len() as f64)
}

/// Size of the model's file (bytes), without the digits of the time that its training took.
fn file_size(model: &Model) -> usize {
    let mut timeless = model.clone();
    timeless.card.train_cpu_s = 0.0;
    timeless.to_bytes().map_or(0, |bytes| bytes.len())
}

/// A model's answers to test grasps.
pub(crate) fn judge(model: &Model, test: &Dataset) -> ModelAnswers {
    judge_answers(model, test, &answer(model.recogniser.as_ref(), test))
}

/// The same from the answers.
pub(super) fn judge_answers(model: &Model, test: &Dataset, answers: &Answers) -> ModelAnswers {
    let samples: usize = test.examples.iter().map(|example| example.grasp.len()).sum();
    let probabilities: Vec<Vec<f64>> = answers.verdicts.iter().map(|v| v.pmf.probabilities().to_vec()).collect();
    let forecasts = Forecasts::new(&answers.truth, &probabilities);
    ModelAnswers {
        data: test.about.described(),
        classes: test.labels.classes.iter().map(|class| class.name.clone()).collect(),
        trials: test.examples.iter().map(|example| example.id).collect(),
        decided: answers.verdicts.iter().map(|verdict| verdict.pmf.top().0).collect(),
        ece: forecasts.map_or(f64::NAN, |forecasts| forecasts.calibration_error(CALIBRATION_BINS)),
        cost: ModelCost {
            train_cpu_s: model.card.train_cpu_s,
            answer_ms: 1e-3 * answers.step_us * samples as f64 / test.examples.len().max(1) as f64,
            step_us: live_step_us(model, test),
            bytes: file_size(model),
            parameters: model.card.parameters,
        },
        truth: answers.truth.clone(),
        sessions: if test.examples.iter().any(|example| example.session > 0) {
            test.examples.iter().map(|example| example.session).collect()
        } else {
            Vec::new()
        },
    }
}

/// Grasps on which a live step is timed.
const TIMED: usize = 20;

/// CPU time of a sample as it arrives (µs).
fn live_step_us(model: &Model, test: &Dataset) -> Option<f64> {
    let mut live = model.recogniser.live()?;
    let (mut samples, start) = (0, cpu_time::ThreadTime::now());
    for example in test.examples.iter().take(TIMED) {
        live.begin(None);
        for (t, row) in example.grasp.rows() {
            std::hint::black_box(live.push(t, row));
            samples += 1;
        }
    }
    (samples > 0).then(|| 1e6 * start.elapsed().as_secs_f64() / f64::from(samples))
}

/// Answers of one kind of model over several test parts, by trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pool {
    pub(super) classes: Vec<String>,
    /// Class and decisions of each trial.
    trials: BTreeMap<TrialId, (usize, Vec<usize>)>,
    /// Session of each trial that is not of the first; empty where all are.
    sessions: BTreeMap<TrialId, u32>,
}

/// Resamples of an interval: its ends vary between seeds by 2 % of its width.
pub(super) const BOOTSTRAP: Bootstrap = Bootstrap { resamples: 1000, seed: 0 };

/// One kind of model against another on the same trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PairedDifference {
    /// Macro F1 of the first minus that of the second.
    pub(crate) f1: Interval,
    /// Exact McNemar test.
    pub(super) p: f64,
}

impl Pool {
    /// Decisions on trials: number, class and decision of each.
    pub(crate) fn of_decisions(classes: &[String], all: impl IntoIterator<Item = (TrialId, usize, usize)>) -> Self {
        let mut pool = Self { classes: classes.to_vec(), ..Self::default() };
        for (trial, truth, decided) in all {
            pool.trials.entry(trial).or_insert((truth, Vec::new())).1.push(decided);
        }
        pool
    }

    /// Pools the answers of several parts; those with other classes than the first are left out.
    pub(super) fn of<'a>(parts: impl IntoIterator<Item = &'a ModelAnswers>) -> Self {
        let mut pool = Self::default();
        for part in parts {
            if pool.classes.is_empty() {
                pool.classes.clone_from(&part.classes);
            }
            if pool.classes == part.classes {
                for ((trial, truth), decided) in part.trials.iter().zip(&part.truth).zip(&part.decided) {
                    pool.trials.entry(*trial).or_insert((*truth, Vec::new())).1.push(*decided);
                }
                pool.sessions.extend(part.trials.iter().copied().zip(part.sessions.iter().copied()));
            }
        }
        pool
    }

    /// Pools what could be fitted of several parts.
    pub(crate) fn of_parts(parts: &[TestAnswers]) -> Self {
        Self::of(parts.iter().filter_map(TestAnswers::answers))
    }

    /// Number of trials.
    pub(crate) fn len(&self) -> usize {
        self.trials.len()
    }

    /// Macro F1 with its interval, over the classes of the test grasps: a model may know others too.
    pub(crate) fn f1(&self) -> Option<Interval> {
        self.scored(Confusion::f1_over_occurring)
    }

    /// Macro-accuracy with its interval.
    pub(crate) fn accuracy(&self) -> Option<Interval> {
        self.scored(Confusion::macro_accuracy)
    }

    fn scored(&self, score: impl Fn(&Confusion) -> Option<f64>) -> Option<Interval> {
        let all: Vec<&(usize, Vec<usize>)> = self.trials.values().collect();
        let objects: Vec<usize> = all.iter().map(|(truth, _)| *truth).collect();
        let sessions = self.sessions_of(self.trials.keys());
        BOOTSTRAP.over_sessions(&objects, &sessions, |trials| score(&confusion(self.classes.len(), &all, trials)?))
    }

    /// Sessions of trials; empty where all are of one.
    fn sessions_of<'a>(&self, trials: impl Iterator<Item = &'a TrialId>) -> Vec<u32> {
        if self.sessions.is_empty() {
            return Vec::new();
        }
        trials.map(|id| self.sessions.get(id).copied().unwrap_or_default()).collect()
    }

    /// This kind of model against another on the trials that both answered.
    pub(crate) fn against(&self, other: &Self) -> Option<PairedDifference> {
        if self.classes != other.classes {
            return None;
        }
        let both: Vec<_> = self.trials.iter().filter_map(|(id, own)| Some((own, other.trials.get(id)?))).collect();
        let objects: Vec<usize> = both.iter().map(|(own, _)| own.0).collect();
        let [own, others]: [Vec<_>; 2] =
            [both.iter().map(|pair| pair.0).collect(), both.iter().map(|pair| pair.1).collect()];
        let f1 = |of: &[&(usize, Vec<usize>)], trials: &[usize]| {
            confusion(self.classes.len(), of, trials)?.f1_over_occurring()
        };
        let sessions = self.sessions_of(self.trials.keys().filter(|id| other.trials.contains_key(id)));
        let f1 =
            BOOTSTRAP.difference((&objects, &sessions), |trials| f1(&own, trials), |trials| f1(&others, trials))?;
        let (mut truth, mut first, mut second) = (Vec::new(), Vec::new(), Vec::new());
        for (own, other) in &both {
            for (a, b) in own.1.iter().zip(&other.1) {
                truth.push(own.0);
                first.push(Some(*a));
                second.push(Some(*b));
            }
        }
        Some(PairedDifference { f1, p: McNemar::of(&truth, &first, &second)?.p_value() })
    }

    /// Trials that were misjudged, one of each object in turn.
    pub(super) fn misjudged(&self) -> Vec<TrialId> {
        let wrong = |class: usize| {
            let own = self.trials.iter().filter(move |(_, (truth, _))| *truth == class);
            own.filter(|(_, (truth, decided))| decided.iter().any(|d| d != truth)).map(|(id, _)| *id)
        };
        let mut each: Vec<_> = (0..self.classes.len()).map(wrong).collect();
        let mut found = Vec::new();
        while found.len() < SHOWN {
            let before = found.len();
            found.extend(each.iter_mut().filter_map(Iterator::next));
            if found.len() == before {
                break;
            }
        }
        found.truncate(SHOWN);
        found
    }

    /// Share of the trials of two classes that were taken for the other of them; and the share of a pair of classes on average.
    pub(super) fn taken_for_each_other(&self, names: [&str; 2]) -> Option<(Interval, f64)> {
        let [Some(a), Some(b)] = names.map(|name| self.classes.iter().position(|class| class == name)) else {
            return None;
        };
        let cells = self.confusions();
        let count = |is: &dyn Fn(usize, usize) -> bool| -> usize {
            cells.iter().filter(|((truth, decided), _)| is(*truth, *decided)).map(|(_, (count, _))| count).sum()
        };
        let taken = count(&|truth, decided| truth != decided && [a, b].contains(&truth) && [a, b].contains(&decided));
        let wrong = count(&|truth, decided| truth != decided) as f64 / count(&|_, _| true).max(1) as f64;
        let share = Interval::of_share(taken, count(&|truth, _| [a, b].contains(&truth)));
        Some((share, wrong / (self.classes.len() as f64 - 1.0).max(1.0)))
    }

    /// Counts of decisions with some of their trials, by true and decided class.
    pub(super) fn confusions(&self) -> BTreeMap<(usize, usize), (usize, Vec<TrialId>)> {
        let mut cells: BTreeMap<(usize, usize), (usize, Vec<TrialId>)> = BTreeMap::new();
        for (id, (truth, decided)) in &self.trials {
            for decided in decided {
                let (count, trials) = cells.entry((*truth, *decided)).or_default();
                *count += 1;
                if trials.len() < SHOWN && !trials.contains(id) {
                    trials.push(*id);
                }
            }
        }
        cells
    }
}

/// Most trials behind a row of a table.
pub(super) const SHOWN: usize = 12;

/// Table of confusions, one row for each kind of grasps and pair of classes that occurs.
pub(super) fn confusion_table(name: &str, title: &str, kinds: &[(&str, &Pool)]) -> StudyTable {
    let columns = [("grasps", ""), ("true", ""), ("predicted", ""), ("count", "grasps"), ("share", PERCENT)];
    let mut table = StudyTable::new(name, title, &columns);
    for (kind, pool) in kinds {
        let cells = pool.confusions();
        for ((truth, decided), (count, trials)) in &cells {
            let of_class: usize = cells.iter().filter(|(cell, _)| cell.0 == *truth).map(|(_, (count, _))| count).sum();
            let names = [*truth, *decided].map(|class| Cell::text(&pool.classes[class]));
            let numbers = [*count as f64, *count as f64 / of_class.max(1) as f64].map(Cell::Number);
            let cells = [vec![Cell::text(*kind)], names.to_vec(), numbers.to_vec()].concat();
            table.push(cells, trials.clone());
        }
    }
    table
}

fn confusion(classes: usize, all: &[&(usize, Vec<usize>)], trials: &[usize]) -> Option<Confusion> {
    let pairs = trials.iter().flat_map(|k| all[*k].1.iter().map(|decided| (all[*k].0, Some(*decided))));
    Confusion::from_pairs(classes, pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty trials of two classes, of which each `wrong`th is misjudged.
    fn answers(wrong: usize) -> ModelAnswers {
        let truth: Vec<usize> = (0..20).map(|k| k % 2).collect();
        ModelAnswers {
            data: String::new(),
            classes: ["ball", "cube"].map(str::to_owned).to_vec(),
            trials: (0..20).collect(),
            sessions: Vec::new(),
            decided: truth.iter().enumerate().map(|(k, t)| if k % wrong == 0 { 1 - t } else { *t }).collect(),
            truth,
            ece: 0.0,
            cost: ModelCost { train_cpu_s: 0.0, answer_ms: 0.0, step_us: None, bytes: 0, parameters: 0 },
        }
    }

    #[test]
    fn parts_that_are_sessions_give_intervals_over_sessions() {
        // Four sessions, each tested by itself: two without a mistake, two with nothing but mistakes.
        let part = |session: u32| {
            let own = answers(if session.is_multiple_of(2) { 1 } else { 99 });
            let trials = (0..20).map(|k| TrialId::from(session) * 20 + k).collect();
            let sessions = if session == 0 { Vec::new() } else { vec![session; 20] };
            ModelAnswers { trials, sessions, ..own }
        };
        let parts: Vec<ModelAnswers> = (0..4).map(part).collect();
        let by_sessions = Pool::of(&parts).f1().expect("defined");
        let plain: Vec<ModelAnswers> =
            parts.iter().map(|part| ModelAnswers { sessions: Vec::new(), ..part.clone() }).collect();
        let by_trials = Pool::of(&plain).f1().expect("defined");
        assert_eq!(by_sessions.estimate, by_trials.estimate);
        assert!(by_sessions.high - by_sessions.low > 2.0 * (by_trials.high - by_trials.low), "{by_sessions:?}");
    }

    #[test]
    fn pooled_answers_keep_trials_together() {
        let (good, bad) = (answers(10), answers(4));
        let pool = Pool::of([&good, &good]);
        assert_eq!((pool.len(), pool.misjudged()), (20, vec![0, 10]));
        let accuracy = pool.accuracy().expect("trials");
        assert!((accuracy.estimate - 0.9).abs() < 1e-12, "{accuracy:?}");
        // A trial that counts twice makes the interval no narrower.
        assert_eq!(accuracy, Pool::of([&good]).accuracy().expect("trials"));
        let cells = pool.confusions();
        assert_eq!((cells[&(0, 1)].clone(), cells[&(1, 1)].0), ((4, vec![0, 10]), 20));
        let difference = Pool::of([&good]).against(&Pool::of([&bad])).expect("the same trials");
        assert!(difference.f1.estimate > 0.1 && difference.p > 0.05, "{difference:?}");
        let same = pool.against(&pool).expect("the same trials");
        assert_eq!((same.f1.low, same.f1.high, same.p), (0.0, 0.0, 1.0));
    }
}
