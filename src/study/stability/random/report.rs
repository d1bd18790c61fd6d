//! Shares of silently wrong results among judged scenes, by accuracy and by policy.

use super::judged::{ComparedResult, JudgedScene, LEVELS, LevelResult, SceneVerdict};
use palpate_learn::metrics::Interval;
use palpate_sim::scene::Accuracy;
use serde::{Deserialize, Serialize};

/// What is done to notice or to avoid a wrong result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Nothing: every result counts as right.
    None,
    /// Flags of a trial: not finite, not converged, restless.
    Flags,
    /// A restless trial is computed again at a tenth of the tolerance, down to the reference; the others are flagged.
    Restless,
    /// Two coarser runs from starts 50 µm away have to give the same result, or else one at a tenth of the tolerance, as for
    /// the trust light.
    Compared,
    /// A run at a tenth of the tolerance flags what it disagrees with.
    RefinedRun,
    /// Two coarser runs and one at a tenth have to give the same result, or else one at a hundredth.
    ComparedTwice,
    /// Refined until two levels agree; what never agrees is flagged.
    TwoAgree,
    /// Refined until three levels in a row agree, as `--until-agreement` does.
    ThreeAgree,
}

impl Policy {
    /// All of them, the cheapest first.
    pub const ALL: [Self; 8] = [
        Self::None,
        Self::Flags,
        Self::Restless,
        Self::Compared,
        Self::RefinedRun,
        Self::ComparedTwice,
        Self::TwoAgree,
        Self::ThreeAgree,
    ];
    /// Those of drawn tolerances, which are refined until two levels agree and no further.
    const DRAWN: [Self; 5] = [Self::None, Self::Flags, Self::Restless, Self::RefinedRun, Self::TwoAgree];

    /// Name in the figure.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "nothing",
            Self::Flags => "flags",
            Self::Restless => "restless again",
            Self::Compared => "compared",
            Self::RefinedRun => "refined run",
            Self::ComparedTwice => "compared twice",
            Self::TwoAgree => "two agree",
            Self::ThreeAgree => "three agree",
        }
    }

    /// Description in tables.
    pub fn about(self) -> &'static str {
        match self {
            Self::None => "nothing",
            Self::Flags => "flags of a trial",
            Self::Restless => "flags; restless trials again",
            Self::Compared => "flags; two coarser runs from 50 µm away, else a tenth (trust light)",
            Self::RefinedRun => "flags and a refined run",
            Self::ComparedTwice => "flags; those coarser runs and a tenth, else a hundredth",
            Self::TwoAgree => "refine until two levels agree",
            Self::ThreeAgree => "refine until three levels agree (`--until-agreement`)",
        }
    }

    /// Reported result, whether it is flagged, and the convex minimisations that were spent on it.
    fn outcome<'a>(self, ladder: &Ladder<'a>) -> (&'a LevelResult, bool, u64) {
        let levels = ladder.levels;
        let first = &levels[0];
        let spent = |count: usize| levels[..count.min(levels.len())].iter().map(|level| level.solves).sum::<u64>();
        match self {
            Self::None => (first, false, spent(1)),
            Self::Flags => (first, first.is_flagged(), spent(1)),
            Self::Restless => {
                let last = levels.iter().position(|level| !level.restless).unwrap_or(levels.len() - 1);
                (&levels[last], levels[last].is_flagged(), spent(last + 1))
            }
            Self::RefinedRun => {
                let agrees = levels.get(1).and_then(|second| second.agrees).unwrap_or(true);
                (first, first.is_flagged() || !agrees, spent(2))
            }
            // What is flagged already is not compared.
            Self::Compared | Self::ComparedTwice if first.is_flagged() => (first, true, spent(1)),
            Self::Compared => {
                let Some(compared) = ladder.compared else { return (first, false, spent(1)) };
                (first, !compared.confirmed, spent(1) + compared.coarser_solves + compared.tenth_solves)
            }
            Self::ComparedTwice => {
                let Some(compared) = ladder.compared else { return (first, false, spent(1)) };
                let settled = compared.coarser && levels.get(1).and_then(|second| second.agrees) != Some(false);
                let solves = spent(if settled { 2 } else { 3 }) + compared.coarser_solves;
                (first, !settled && !compared.reference, solves)
            }
            Self::TwoAgree => agreed(levels, 1, spent),
            Self::ThreeAgree => agreed(levels, 2, spent),
        }
    }
}

/// Results of a scene from an accuracy on.
#[derive(Clone, Copy)]
struct Ladder<'a> {
    levels: &'a [LevelResult],
    /// Runs that a trial at standard is compared with.
    compared: Option<&'a ComparedResult>,
}

impl<'a> Ladder<'a> {
    /// From a level on.
    fn of(scene: &'a JudgedScene, first: usize) -> Self {
        let compared = (LEVELS[first] == Accuracy::Standard).then_some(&scene.compared);
        Self { levels: scene.ladder(first), compared }
    }

    /// From the drawn tolerance on.
    fn drawn(scene: &'a JudgedScene) -> Self {
        Self { levels: &scene.drawn, compared: None }
    }
}

/// The first level that agrees with the one before, as do so many in a row; else the last, which is flagged.
fn agreed(levels: &[LevelResult], in_a_row: usize, spent: impl Fn(usize) -> u64) -> (&LevelResult, bool, u64) {
    let agree = |last: &usize| (last + 1 - in_a_row..=*last).all(|k| levels[k].agrees == Some(true));
    let found = (in_a_row..levels.len()).find(agree);
    let last = found.unwrap_or(levels.len() - 1);
    (&levels[last], found.is_none() || levels[last].is_flagged(), spent(last + 1))
}

/// What a policy comes to, from one accuracy on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PolicyRow {
    /// Accuracy that was asked for.
    pub accuracy: String,
    /// What is done.
    pub policy: Policy,
    /// Scenes with a single answer.
    pub scenes: usize,
    /// Wrong results without a flag.
    pub silent: usize,
    /// Their share, with its interval.
    pub silent_share: Interval,
    /// The same where scenes without a known end count as wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub silent_or_undecided: Option<Interval>,
    /// Wrong results, flagged or not.
    pub wrong: usize,
    /// Share of right results that are flagged.
    pub false_alarms: f64,
    /// Convex minimisations as a multiple of those of one run.
    pub cost: f64,
}

/// Results at one accuracy, without flags or refinement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SilentShareRow {
    /// Accuracy, or a range of drawn tolerances.
    pub accuracy: String,
    /// Scenes with a single answer.
    pub scenes: usize,
    /// Wrong results.
    pub wrong: usize,
    /// Of these, without a flag.
    pub silent: usize,
    /// Share of the latter, with its interval.
    pub silent_share: Interval,
    /// The same where results are refined until three levels agree; absent for drawn tolerances.
    pub silent_after_agreement: Option<usize>,
    /// Convex minimisations per scene.
    pub solves: f64,
}

/// Detection performance of one flag, at the drawn accuracies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlagRow {
    /// The flag and its limit.
    pub flag: String,
    /// Share of the wrong results that are flagged.
    pub recall: f64,
    /// Share of the right results that are flagged.
    pub false_alarms: f64,
}

/// Results of random scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RandomReport {
    /// Seed of the scenes.
    pub seed: u64,
    pub scenes: usize,
    /// Scenes without a single answer: small changes of the start change the end.
    pub no_answer: usize,
    /// Their share, with its interval.
    pub no_answer_share: Interval,
    /// Scenes whose end is not known: no two levels agree, or their cost was too high.
    pub undecided: usize,
    /// Of these, scenes whose result at the drawn accuracy is not flagged.
    pub undecided_unflagged: usize,
    /// Scenes with a number that is not finite, at any level.
    pub non_finite: usize,
    /// Steps at the drawn accuracies.
    pub steps: u64,
    /// Steps among them that missed the solver's tolerance.
    pub unconverged_steps: u64,
    /// Newton iterations per minimisation.
    pub newton_mean: f64,
    /// Most Newton iterations in a step.
    pub newton_max: u32,
    /// 99th percentile over scenes of the largest outer friction residual.
    pub friction_residual_p99: f64,
    /// Largest outer friction residual.
    pub friction_residual_max: f64,
    /// Results by accuracy: the levels, then ranges of drawn tolerances.
    pub by_accuracy: Vec<SilentShareRow>,
    /// Results by policy: from drawn tolerances, from draft and from standard on.
    pub by_policy: Vec<PolicyRow>,
    /// Flags, singly and together.
    pub flags: Vec<FlagRow>,
    /// First scenes that are silently wrong from draft on although three levels agree.
    pub examples: Vec<u64>,
    /// CPU time (s).
    pub cpu_s: f64,
}

/// Names of rows that begin at drawn tolerances.
const DRAWN: &str = "1e-5 to 1e-2";
/// Ends of the ranges of drawn tolerances.
const RANGES: [f64; 7] = [1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2];

impl RandomReport {
    /// Sums up scenes of a seed, in the order of their numbers.
    pub fn new(seed: u64, scenes: &[JudgedScene]) -> Self {
        let with = |verdict| scenes.iter().filter(move |scene| scene.verdict == verdict);
        let clear: Vec<&JudgedScene> = with(SceneVerdict::Single).collect();
        let no_answer = with(SceneVerdict::NoAnswer).count();
        let drawn: Vec<&LevelResult> = scenes.iter().map(|scene| &scene.drawn[0]).collect();
        let solves: u64 = drawn.iter().map(|level| level.solves).sum();
        let newton: f64 = drawn.iter().map(|level| level.newton_mean * level.solves as f64).sum();
        let mut friction: Vec<f64> = drawn.iter().map(|level| level.friction_residual).collect();
        friction.sort_by(f64::total_cmp);
        let silent = |scene: &&&JudgedScene| {
            let (level, flagged, _) = Policy::ThreeAgree.outcome(&Ladder::of(scene, 0));
            !level.right && !flagged
        };
        Self {
            seed,
            scenes: scenes.len(),
            no_answer,
            no_answer_share: Interval::of_share(no_answer, scenes.len()),
            undecided: with(SceneVerdict::Undecided).count(),
            undecided_unflagged: with(SceneVerdict::Undecided).filter(|scene| !scene.drawn[0].is_flagged()).count(),
            non_finite: scenes.iter().filter(|scene| scene.diverged).count(),
            steps: drawn.iter().map(|level| level.steps).sum(),
            unconverged_steps: drawn.iter().map(|level| level.unconverged).sum(),
            newton_mean: newton / solves.max(1) as f64,
            newton_max: drawn.iter().map(|level| level.newton_max).max().unwrap_or(0),
            friction_residual_p99: friction.get(friction.len() * 99 / 100).copied().unwrap_or(0.0),
            friction_residual_max: friction.last().copied().unwrap_or(0.0),
            by_accuracy: accuracy_rows(&clear),
            by_policy: policy_rows(&clear, &with(SceneVerdict::Undecided).collect::<Vec<_>>()),
            flags: flag_rows(&clear),
            examples: clear.iter().filter(silent).map(|scene| scene.number).take(10).collect(),
            cpu_s: scenes.iter().map(|scene| scene.cpu_s).sum(),
        }
    }

    /// The row of a policy from an accuracy on.
    pub fn policy(&self, accuracy: &str, policy: Policy) -> Option<&PolicyRow> {
        self.by_policy.iter().find(|row| row.accuracy == accuracy && row.policy == policy)
    }
}

fn accuracy_rows(scenes: &[&JudgedScene]) -> Vec<SilentShareRow> {
    let row = |accuracy: String, ladders: &[&[LevelResult]], named: bool| {
        let those: Vec<&LevelResult> = ladders.iter().map(|levels| &levels[0]).collect();
        let silent = those.iter().filter(|level| !level.right && !level.is_flagged()).count();
        let after = |levels: &&&[LevelResult]| {
            let (level, flagged, _) = Policy::ThreeAgree.outcome(&Ladder { levels, compared: None });
            !level.right && !flagged
        };
        SilentShareRow {
            accuracy,
            scenes: those.len(),
            wrong: those.iter().filter(|level| !level.right).count(),
            silent,
            silent_share: Interval::of_share(silent, those.len()),
            silent_after_agreement: named.then(|| ladders.iter().filter(after).count()),
            solves: those.iter().map(|level| level.solves as f64).sum::<f64>() / those.len().max(1) as f64,
        }
    };
    let at = |k: usize| scenes.iter().map(|scene| scene.ladder(k)).collect::<Vec<_>>();
    let mut rows: Vec<SilentShareRow> = (0..4).map(|k| row(LEVELS[k].to_string(), &at(k), k < 3)).collect();
    for range in RANGES.windows(2) {
        let within = |scene: &&&JudgedScene| (range[0]..range[1]).contains(&scene.drawn[0].tolerance);
        let those: Vec<&[LevelResult]> = scenes.iter().filter(within).map(|scene| scene.drawn.as_slice()).collect();
        rows.push(row(format!("{:e} to {:e}", range[0], range[1]), &those, false));
    }
    rows
}

fn policy_rows(scenes: &[&JudgedScene], undecided: &[&JudgedScene]) -> Vec<PolicyRow> {
    let rows_of = |accuracy: &str, ladder: &dyn for<'a> Fn(&'a JudgedScene) -> Ladder<'a>, policies: &[Policy]| {
        let row = |policy: &Policy| {
            let outcomes: Vec<_> = scenes.iter().map(|scene| policy.outcome(&ladder(scene))).collect();
            let count = |is: &dyn Fn(bool, bool) -> bool| {
                outcomes.iter().filter(|(level, flagged, _)| is(level.right, *flagged)).count()
            };
            let silent = count(&|right, flagged| !right && !flagged);
            let right = count(&|right, _| right);
            let unflagged = undecided.iter().filter(|scene| !policy.outcome(&ladder(scene)).1).count();
            let single: u64 = scenes.iter().map(|scene| ladder(scene).levels[0].solves).sum();
            PolicyRow {
                accuracy: accuracy.to_owned(),
                policy: *policy,
                scenes: scenes.len(),
                silent,
                silent_share: Interval::of_share(silent, scenes.len()),
                silent_or_undecided: Some(Interval::of_share(silent + unflagged, scenes.len() + undecided.len())),
                wrong: scenes.len() - right,
                false_alarms: count(&|right, flagged| right && flagged) as f64 / right.max(1) as f64,
                cost: outcomes.iter().map(|(_, _, spent)| spent).sum::<u64>() as f64 / single.max(1) as f64,
            }
        };
        policies.iter().map(row).collect::<Vec<_>>()
    };
    let mut rows = rows_of(DRAWN, &|scene| Ladder::drawn(scene), &Policy::DRAWN);
    for (k, level) in LEVELS.iter().enumerate().take(2) {
        let compared = |policy: &Policy| !matches!(policy, Policy::Compared | Policy::ComparedTwice);
        let policies: Vec<Policy> = Policy::ALL.into_iter().filter(|p| k == 1 || compared(p)).collect();
        rows.extend(rows_of(&level.to_string(), &|scene| Ladder::of(scene, k), &policies));
    }
    rows
}

fn flag_rows(scenes: &[&JudgedScene]) -> Vec<FlagRow> {
    let row = |flag: String, is_raised: &dyn Fn(&[LevelResult]) -> bool| {
        let share = |right: bool| {
            let those: Vec<&&JudgedScene> = scenes.iter().filter(|scene| scene.drawn[0].right == right).collect();
            those.iter().filter(|scene| is_raised(&scene.drawn)).count() as f64 / those.len().max(1) as f64
        };
        FlagRow { flag, recall: share(false), false_alarms: share(true) }
    };
    let mut rows = vec![
        row("no end: a number left the range, or too many steps".to_owned(), &|levels| !levels[0].ended),
        row("a step missed the solver's tolerance".to_owned(), &|levels| levels[0].unconverged > 0),
        row("a step missed the accuracy".to_owned(), &|levels| levels[0].missed > 0),
    ];
    for limit in [1, 5, 20] {
        let raised = move |levels: &[LevelResult]| levels[0].hold_changes >= limit;
        rows.push(row(format!("changes of force in the hold >= {limit}"), &raised));
    }
    for limit in [0.01, 0.05, 0.2] {
        rows.push(row(format!("static residual > {limit}"), &|levels| levels[0].static_residual > limit));
    }
    for limit in [1.0, 5.0, 20.0] {
        rows.push(row(format!("friction residual > {limit}"), &|levels| levels[0].friction_residual > limit));
    }
    rows.push(row("all flags of a trial".to_owned(), &|levels| levels[0].is_flagged()));
    rows.push(row("a refined run disagrees".to_owned(), &|levels| levels[1].agrees == Some(false)));
    rows
}
