//! New objects: a model that knows all others is taught each object in turn, from simulated grasps alone.

use super::super::answers::BOOTSTRAP;
use super::super::plan::POSES;
use super::super::prelude::*;
use super::novelty::Scored;
use super::questions::{Question, READINGS};
use super::tested;
use palpate_learn::check_apart;

/// Grasps of each object by which models learn.
const GRASPS: usize = 50;

/// Which test grasps a model that was taught one object takes for it.
pub(super) fn new_object(
    question: &Question,
    left_out: &str,
    method: &Method,
    bench: &StudyData<'_>,
) -> Result<Scored, StudyError> {
    let plan = bench.plan();
    let test = tested(question, bench)?;
    let mut wanted = question.wanted(plan, plan.grasps(GRASPS, 20), POSES);
    // Sensors that are not drawn are read once.
    wanted.view.draws = plan.pick(READINGS, 2, 1);
    let all = bench.data(&wanted)?;
    check_apart(&all.examples, &test.examples)?;
    let of_class = |known: bool| -> Vec<usize> {
        let is_known = |k: &usize| all.labels.classes[all.examples[*k].class].name != left_out;
        (0..all.examples.len()).filter(|k| is_known(k) == known).collect()
    };
    let known = all.part(&of_class(true)).without_empty_classes();
    let lesson = all.part(&of_class(false)).without_empty_classes();
    let model = bench.teach(&bench.fit(method, &known)?, &lesson)?;
    let missing = || StudyError::missing(format_args!("grasps of {left_out}"));
    let new = model.card.labels.class(left_out).ok_or_else(missing)?;
    let test = test.relabelled(&model.card.labels).ok_or_else(missing)?;
    let says_new = |pmf: &Pmf| f64::from(u8::from(pmf.top().0 == new));
    Ok(Scored::of(&model, &test, |name| name == left_out, plan.seed, says_new))
}

/// Mean over the objects of the F1 of the object's class, over resampled trials.
pub(super) fn mean_f1(scored: &[Scored], grasps: usize) -> Option<Interval> {
    let all: Vec<(usize, bool, bool)> = scored
        .iter()
        .enumerate()
        .flat_map(|(k, own)| own.is_new.iter().zip(&own.scores[grasps]).map(move |(new, said)| (k, *new, *said > 0.5)))
        .collect();
    let strata: Vec<usize> = all.iter().map(|(k, new, _)| 2 * k + usize::from(*new)).collect();
    BOOTSTRAP.interval(&strata, |chosen| {
        // True positives, and all grasps that are of the class or taken for it.
        let mut counts = vec![[0_usize; 2]; scored.len()];
        for (k, new, said) in chosen.iter().map(|at| all[*at]) {
            counts[k][0] += usize::from(new && said);
            counts[k][1] += usize::from(new) + usize::from(said);
        }
        let f1 = counts.iter().map(|[right, of]| 2.0 * *right as f64 / (*of).max(1) as f64);
        Some(f1.sum::<f64>() / scored.len().max(1) as f64)
    })
}
