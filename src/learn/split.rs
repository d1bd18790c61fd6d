//! Splits of a data set into training and test trials.
//!
//! A [`SplitPlan`] is stratified: it divides each class by itself. Trials with equal [`Example::content`] are copies of
//! one grasp; only the first copy is used, so no recogniser is tested on a grasp that it was trained on. A succession
//! is a series of grasps between which the object stays as released ([`Example::after`]). Its poses are similar, so
//! random plans put the whole succession either into training or into test. If a grasp in the middle is missing from
//! the data, the succession splits in two, and the two pieces may end up on different sides.
//!
//! ```
//! use palpate_learn::{Class, Dataset, Example, Labels, SplitPlan};
//!
//! let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
//! let grasp = |k: usize| Example { id: k as i64, class: k % 2, content: k as u64, ..Example::default() };
//! let labels = Labels { classes: vec![class("ball"), class("cube")], ..Labels::default() };
//! let data = Dataset { labels, examples: (0..20).map(grasp).collect(), ..Dataset::default() };
//! let splits = "40/40/20".parse::<SplitPlan>()?.splits(&data, 1, 3)?;
//! assert_eq!(splits.len(), 3);
//! assert_eq!([splits[0].train.len(), splits[0].second.len(), splits[0].test.len()], [8, 8, 4]);
//! # Ok::<(), palpate_learn::SplitError>(())
//! ```

use crate::data::{Dataset, Example};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;

/// Trials to learn from and to test with, as indices into a data set.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Split {
    /// Training trials. Random plans list them in random order but keep each succession together; other plans list them
    /// oldest first.
    pub train: Vec<usize>,
    /// Training trials of stage two, as in the paper's 40/40/20; empty otherwise.
    pub second: Vec<usize>,
    /// Test trials, ascending.
    pub test: Vec<usize>,
}

/// Reason why a data set cannot be split, as a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct SplitError(String);

impl SplitError {
    /// Fewer than two folds.
    pub fn folds() -> Self {
        Self("cross-validation needs at least two folds".to_owned())
    }
}

/// Way to split a data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SplitPlan {
    /// Random shares of each class, 0 to 1: training, training of stage two, test.
    Shares([f64; 3]),
    /// Cross-validation: each grasp is tested once, by training on the other folds.
    Folds {
        /// Number of folds.
        folds: usize,
    },
    /// The oldest grasps of each class for training, those after them for testing.
    FirstOfEach {
        /// Training grasps of each class.
        train: usize,
        /// Largest number of test grasps of each class; all others if `None`.
        test: Option<usize>,
    },
    /// Each pose ([`Example::pose`]) is tested once, by training on the other poses.
    LeavePoseOut,
    /// Each session ([`Example::session`]) is tested once, by training on the other sessions.
    LeaveSessionOut,
}

/// Refuses to test on grasps of the training.
pub fn check_apart<'a>(
    train: impl IntoIterator<Item = &'a Example>,
    test: impl IntoIterator<Item = &'a Example>,
) -> Result<(), SplitError> {
    let learned: BTreeMap<u64, i64> = train.into_iter().map(|example| (example.content, example.id)).collect();
    let shared = |test: &Example| Some((*learned.get(&test.content)?, test.id));
    match test.into_iter().find_map(shared) {
        Some((first, other)) => Err(SplitError(format!(
            "trials {first} and {other} are the same grasp; one is for training, the other for testing"
        ))),
        None => Ok(()),
    }
}

impl Split {
    /// Refuses a split with the same grasp for training and for testing.
    pub fn check(&self, data: &Dataset) -> Result<(), SplitError> {
        let of = |part: &[usize]| part.iter().map(|&k| &data.examples[k]).collect::<Vec<_>>();
        check_apart(of(&self.all_training()), of(&self.test))
    }

    /// The same test with at most this many training trials of each class (in each of both shares), for learning curves:
    /// smaller choices are contained in larger ones.
    pub fn limited(&self, data: &Dataset, most: usize) -> Self {
        let first = |of: &[usize]| {
            let mut met = vec![0; data.labels.classes.len()];
            let few_enough = |k: &usize| {
                let count = &mut met[data.examples[*k].class];
                *count += 1;
                *count <= most
            };
            of.iter().copied().filter(few_enough).collect()
        };
        Self { train: first(&self.train), second: first(&self.second), test: self.test.clone() }
    }

    /// All training trials, for recognisers with one stage.
    pub fn all_training(&self) -> Vec<usize> {
        self.train.iter().chain(&self.second).copied().collect()
    }
}

impl SplitPlan {
    /// Cross-validation with five folds.
    pub const CROSS_VALIDATION: Self = Self::Folds { folds: 5 };

    /// Makes the splits. Random plans (`Shares`, `Folds`) are drawn `repeats` times from `seed`; the other plans ignore
    /// both and return their splits once.
    pub fn splits(&self, data: &Dataset, seed: u64, repeats: usize) -> Result<Vec<Split>, SplitError> {
        let grasps = different_grasps(data, self.needed())?;
        let successions: Vec<Vec<Vec<usize>>> = grasps.iter().map(|members| data.successions(members)).collect();
        if let Self::Shares(_) | Self::Folds { .. } = self {
            check_successions(data, &successions, self.needed())?;
        }
        let mut draws = (0..repeats.max(1) as u64).map(|repeat| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(repeat);
            let mut drawn = successions.clone();
            drawn.iter_mut().for_each(|members| members.shuffle(&mut random));
            drawn
        });
        match self {
            Self::Shares(shares) => draws.map(|drawn| by_shares(&drawn, *shares)).collect(),
            Self::Folds { folds } => Ok(draws.try_fold(Vec::new(), |mut all, drawn| {
                all.extend(by_folds(&drawn, *folds)?);
                Ok(all)
            })?),
            Self::FirstOfEach { train, test } => Ok(vec![first_of_each(&grasps, *train, *test)]),
            Self::LeavePoseOut => by_group(data, &grasps, "pose", |example| example.pose),
            Self::LeaveSessionOut => by_group(data, &grasps, "session", |example| example.session),
        }
    }

    /// Smallest number of different grasps that each class needs; for random plans, also of successions.
    fn needed(&self) -> usize {
        match self {
            Self::Shares(shares) => shares.iter().filter(|share| **share > 0.0).count(),
            Self::Folds { .. } | Self::LeavePoseOut | Self::LeaveSessionOut => 2,
            Self::FirstOfEach { train, .. } => train.saturating_add(1),
        }
    }

    /// Description for tables, such as `cross-validation with 5 folds`.
    pub fn described(&self) -> String {
        match self {
            Self::Shares(shares) => {
                let percent = shares.map(|share| format!("{:.0}", 100.0 * share));
                format!("random shares {}", percent.join("/"))
            }
            Self::Folds { folds } => format!("cross-validation with {folds} folds"),
            Self::FirstOfEach { train, test: None } => format!("first {train} of each object for training"),
            Self::FirstOfEach { train, test: Some(test) } => {
                format!("first {train} of each object for training, the next {test} for testing")
            }
            Self::LeavePoseOut => "one pose left out at a time".to_owned(),
            Self::LeaveSessionOut => "one session left out at a time".to_owned(),
        }
    }
}

/// Writes it as it is read: `40/40/20`, `folds:5`, `first:50`, `first:50:100`, `leave-a-pose-out`.
impl std::fmt::Display for SplitPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Shares(shares) => {
                let [train, second, test] = shares.map(|share| (1e6 * share).round() / 1e4);
                write!(f, "{train}/{second}/{test}")
            }
            Self::Folds { folds } => write!(f, "folds:{folds}"),
            Self::FirstOfEach { train, test: None } => write!(f, "first:{train}"),
            Self::FirstOfEach { train, test: Some(test) } => write!(f, "first:{train}:{test}"),
            Self::LeavePoseOut => write!(f, "leave-a-pose-out"),
            Self::LeaveSessionOut => write!(f, "leave-a-session-out"),
        }
    }
}

impl FromStr for SplitPlan {
    type Err = SplitError;

    fn from_str(text: &str) -> Result<Self, SplitError> {
        let unknown = || {
            SplitError(format!(
                "unknown split \"{text}\"; write 40/40/20, folds:5, first:50, first:50:100, leave-a-pose-out or \
                 leave-a-session-out"
            ))
        };
        let count = |text: &str| text.parse::<usize>().map_err(|_no_number| unknown());
        if text == "leave-a-pose-out" {
            return Ok(Self::LeavePoseOut);
        }
        if text == "leave-a-session-out" {
            return Ok(Self::LeaveSessionOut);
        }
        match text.split(':').collect::<Vec<_>>()[..] {
            ["folds", folds] => match count(folds)? {
                0 | 1 => Err(SplitError::folds()),
                folds => Ok(Self::Folds { folds }),
            },
            ["first", train] => Ok(Self::FirstOfEach { train: count(train)?, test: None }),
            ["first", train, test] => Ok(Self::FirstOfEach { train: count(train)?, test: Some(count(test)?) }),
            _ => {
                let parts: Result<Vec<f64>, _> = text.split('/').map(str::parse::<f64>).collect();
                let shares = match parts.map_err(|_no_number| unknown())?[..] {
                    [train, test] => [train, 0.0, test],
                    [train, second, test] => [train, second, test],
                    _ => return Err(unknown()),
                };
                let shares = shares.map(|percent| percent / 100.0);
                checked(shares).map(|()| Self::Shares(shares))
            }
        }
    }
}

/// Indices of the different grasps of each class, oldest first: of trials with equal content, only the first.
fn different_grasps(data: &Dataset, needed: usize) -> Result<Vec<Vec<usize>>, SplitError> {
    if data.examples.is_empty() {
        return Err(SplitError("no trials to split".to_owned()));
    }
    let mut met = BTreeSet::new();
    let by_class = data.by_class();
    let is_first: Vec<bool> = data.examples.iter().map(|example| met.insert(example.content)).collect();
    let classes = by_class.into_iter().zip(&data.labels.classes).map(|(members, class)| {
        let trials = members.len();
        let first: Vec<usize> = members.into_iter().filter(|k| is_first[*k]).collect();
        // Classes of the labels without trials take no part.
        if trials > 0 && first.len() < needed {
            return Err(SplitError(format!(
                "object \"{}\" has {} different grasp(s) in {trials} trial(s), {needed} are needed: copies of one grasp \
                 cannot be both learned and tested. Collect more grasps, or leave the object out with --objects",
                class.name,
                first.len()
            )));
        }
        Ok(first)
    });
    classes.collect()
}

fn checked(shares: [f64; 3]) -> Result<(), SplitError> {
    let [train, _, test] = shares;
    let sum: f64 = shares.iter().sum();
    let valid = shares.iter().all(|share| *share >= 0.0) && (sum - 1.0).abs() < 1e-6 && train > 0.0 && test > 0.0;
    if valid {
        return Ok(());
    }
    let cause = "shares must sum to 100, with some for training and some for testing; write 40/40/20 or 80/0/20";
    Err(SplitError(cause.to_owned()))
}

/// Refuses classes with too few successions: random plans do not divide them.
fn check_successions(data: &Dataset, successions: &[Vec<Vec<usize>>], needed: usize) -> Result<(), SplitError> {
    let mut classes = successions.iter().zip(&data.labels.classes);
    match classes.find(|(own, _)| (1..needed).contains(&own.len())) {
        Some((own, class)) => Err(SplitError(format!(
            "object \"{}\" was put down anew only {} time(s) for its {} grasps, but this split needs {needed}: all grasps \
             until it is put down again must go to the same side (training or test). Put it down anew between grasps, or \
             leave it out with --objects",
            class.name,
            own.len(),
            own.iter().map(Vec::len).sum::<usize>()
        ))),
        None => Ok(()),
    }
}

/// The successions of each class, in random order.
type Drawn = [Vec<Vec<usize>>];

fn by_shares(drawn: &Drawn, shares: [f64; 3]) -> Result<Split, SplitError> {
    checked(shares)?;
    let mut split = Split::default();
    for class in drawn.iter().filter(|class| !class.is_empty()) {
        // Each share that is not empty gets at least one succession.
        let least = shares.map(|share| usize::from(share > 0.0));
        let count: usize = class.iter().map(Vec::len).sum();
        let rounded = |sum: f64| (count as f64 * sum).round() as usize;
        let first = rounded(shares[0]).clamp(least[0], count - least[1] - least[2]);
        let second = rounded(shares[0] + shares[1]).clamp(first + least[1], count - least[2]);
        let ends = [first, second, count];
        let (mut part, mut of_part, mut taken) = (0, 0, 0);
        for (n, succession) in class.iter().enumerate() {
            let needed_later = |part: usize| least[part + 1..].iter().sum::<usize>();
            while part < 2 && of_part >= least[part] && (taken >= ends[part] || class.len() - n <= needed_later(part)) {
                (part, of_part) = (part + 1, 0);
            }
            [&mut split.train, &mut split.second, &mut split.test][part].extend_from_slice(succession);
            (of_part, taken) = (of_part + 1, taken + succession.len());
        }
    }
    split.test.sort_unstable();
    Ok(split)
}

fn by_folds(drawn: &Drawn, folds: usize) -> Result<Vec<Split>, SplitError> {
    if folds < 2 {
        return Err(SplitError::folds());
    }
    // More folds than successions would be empty.
    let folds = folds.min(drawn.iter().map(Vec::len).sum());
    let mut splits = vec![Split::default(); folds];
    // Each class continues where the previous class ended, so that folds have equal size.
    for (n, succession) in drawn.iter().flatten().enumerate() {
        for (fold, split) in splits.iter_mut().enumerate() {
            if n % folds == fold { &mut split.test } else { &mut split.train }.extend_from_slice(succession);
        }
    }
    splits.iter_mut().for_each(|split| split.test.sort_unstable());
    Ok(splits)
}

fn first_of_each(grasps: &[Vec<usize>], train: usize, test: Option<usize>) -> Split {
    let mut split = Split::default();
    for members in grasps {
        let (first, rest) = members.split_at(train.min(members.len()));
        split.train.extend_from_slice(first);
        split.test.extend(rest.iter().take(test.unwrap_or(usize::MAX)));
    }
    split.train.sort_unstable();
    split.test.sort_unstable();
    split
}

fn by_group(
    data: &Dataset,
    grasps: &[Vec<usize>],
    what: &str,
    group: impl Fn(&Example) -> u32,
) -> Result<Vec<Split>, SplitError> {
    let group = |k: usize| group(&data.examples[k]);
    let one_group = |members: &&Vec<usize>| members.windows(2).all(|pair| group(pair[0]) == group(pair[1]));
    if let Some(members) = grasps.iter().filter(|members| !members.is_empty()).find(one_group) {
        let class = data.examples[members[0]].class;
        let class = &data.labels.classes[class].name;
        return Err(SplitError(format!(
            "all trials of \"{class}\" are of the same {what}; leaving a {what} out needs at least two"
        )));
    }
    let groups: BTreeSet<u32> = grasps.iter().flatten().map(|k| group(*k)).collect();
    let split_of = |left_out: u32| {
        let (mut test, train) = grasps.iter().flatten().partition::<Vec<usize>, _>(|k| group(**k) == left_out);
        test.sort_unstable();
        Split { train, second: Vec::new(), test }
    };
    Ok(groups.into_iter().map(split_of).collect())
}

impl Dataset {
    /// Draws a random number of trials of each class, within a range: the paper's recordings have 40 to 55 of each object.
    /// A class with fewer keeps all.
    pub fn imbalanced(&self, counts: std::ops::RangeInclusive<usize>, seed: u64) -> Self {
        use rand::RngExt;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut kept = Vec::new();
        for mut members in self.by_class() {
            let count = random.random_range(counts.clone());
            members.shuffle(&mut random);
            members.truncate(count);
            kept.append(&mut members);
        }
        kept.sort_unstable();
        self.part(&kept)
    }
}
