//! `palpate promise`: calibrates the answers of a model, so that they are wrong no more often than asked for.

use super::prelude::*;
use palpate_lab::datasets::{check_model_path, save_model};
use palpate_lab::grasping::GraspRounds;
use palpate_learn::{AnswerSets, CalibratedBy, Model};
use palpate_store::labels::shown_title;
use std::sync::Arc;

/// Arguments of `palpate promise`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate promise mine.safetensors
  palpate promise mine.safetensors --wrong 5 --grasps 6
  palpate promise mine.safetensors --rounds 100 --out promised.safetensors --json

The model then names the classes that are left after each grasp. The true one is among them in as many rounds of grasps as \
promised, whenever grasping stops. Each grasp of a round finds the object put down anew (or as --as-released or --guided say), in \
simulation, by the gripper that the model learned from; sets are shown in rounds of the same kind. A grasp ends a round by \
itself only at a confidence at which the decisions are wrong no more often; where there is none, it never does.

See also: palpate help recognition")]
pub(super) struct PromiseArguments {
    /// Model to calibrate (.safetensors).
    model: PathBuf,
    /// Largest share of wrong answers, in percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 10.0, value_parser = within(0.1..=50.0))]
    wrong: f64,
    /// Simulated rounds of each class; below 300 classes share theirs.
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = within(10..=100_000_usize))]
    rounds: usize,
    /// Grasps of a round.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = within(1..=20_usize))]
    grasps: usize,
    #[command(flatten)]
    between: BetweenArguments,
    /// Random seed of the poses.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Model file to write (.safetensors), with its card beside it (default: the model itself).
    #[arg(long, value_name = "FILE", value_parser = file_of(&[FileKind::Model]))]
    out: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct PromiseReport<'a> {
    model: &'a Path,
    sets: &'a AnswerSets,
    #[serde(skip)]
    classes: Vec<&'a str>,
}

pub(super) fn run(arguments: &PromiseArguments) -> Result<(), Failure> {
    let model = Arc::new(Model::load(&arguments.model)?);
    // Before the work, which takes minutes.
    let out = arguments.out.as_ref().unwrap_or(&arguments.model);
    check_model_path(out)?;
    let (stop, bar) = (stop_flag()?, Progress::of("grasping"));
    let progress = |done: usize, of: usize| bar.show(done, of);
    let PromiseArguments { rounds, grasps, seed, wrong, .. } = *arguments;
    let between = arguments.between.chosen().unwrap_or_default();
    let promised =
        GraspRounds { rounds, grasps, seed, progress: &progress, stop: &stop }.promised(&model, 0.01 * wrong, between);
    drop(bar);
    let promised = promised?;
    save_model(&promised, out)?;
    let classes = promised.card.labels.classes.iter().map(|class| class.name.as_str()).collect();
    let Some(sets) = &promised.card.answer_sets else { return Ok(()) };
    PromiseReport { model: out, sets, classes }.print(arguments.json)
}

impl Report for PromiseReport<'_> {
    fn text(&self, page: &mut Page) {
        let AnswerSets { risk, by, rounds, stop, .. } = self.sets;
        let percent =
            |share: f64| format!("{:.3}", 100.0 * share).trim_end_matches('0').trim_end_matches('.').to_owned();
        page.fact(
            "promise",
            format!("the true class is left in {} % of rounds, by {rounds} rounds", percent(1.0 - risk)),
        );
        for (how, whose) in [(CalibratedBy::Shape, "classes of a shape"), (CalibratedBy::All, "all classes")] {
            let of = self.classes.iter().zip(by).filter(|(_, by)| **by == how).map(|(name, _)| shown_title(name));
            let names: Vec<String> = of.collect();
            if !names.is_empty() {
                page.fact("too few rounds", format!("{}: the promise holds on average over {whose}", names.join(", ")));
            }
        }
        let (stopped, wrong, at_most) = (stop.stopped, stop.wrong, percent(stop.at_most));
        page.fact(
            "automatic stop",
            match stop.level {
                Some(level) => {
                    format!("at {} %: {wrong} of {stopped} were wrong, at most {at_most} %", percent(level))
                }
                None => format!(
                    "never: even at the highest confidence {wrong} of {stopped} were wrong, which may be up to {at_most} %"
                ),
            },
        );
        page.fact("saved", self.model.display().to_string());
    }
}
