//! `palpate evaluate`: compares methods on stored trials, or evaluates a saved model on trials it has not seen.

use super::learning::{DataArguments, known_method, leak_checks, parts};
use super::prelude::*;
use super::terminal::Column;
use palpate_learn::comparison::{ComparisonRow, Controls, in_table_order};
use palpate_learn::evaluation::interval_words;
use palpate_learn::{Dataset, LeakCheck, METHODS, Method, Model, SplitPlan};
use std::collections::BTreeSet;

/// Arguments of `palpate evaluate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate evaluate --store set.sqlite --quick
  palpate evaluate --preset B --split 40/40/20 --repeats 5
  palpate evaluate --collection mine --models svm,random-forest --split folds:10
  palpate evaluate --models macro-layer,random-forest --controls
  palpate evaluate --models mine.safetensors --test-trials 100 --json

See also: palpate help recognition")]
pub(super) struct EvaluateArguments {
    /// Methods to train and test, or saved models to test, separated by commas (default: all methods).
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    models: Vec<String>,
    #[command(flatten)]
    data: DataArguments,
    /// Split into training and test trials: 40/40/20 (shares; the second for stage two), folds:5 (cross-validation),
    /// first:50 or first:50:100 (the oldest of each object for training, those after them for testing),
    /// leave-a-pose-out or leave-a-session-out (a session ends with the day, after ten minutes without a trial, with a
    /// tare, and with an imported file) (default: first:50 where there are more, else folds:5).
    #[arg(long, value_name = "PLAN", conflicts_with_all = ["train_trials", "test_trials"])]
    split: Option<SplitPlan>,
    /// Repeat a random split N times, each with new draws.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeats: u16,
    /// Train on the first N trials of each object, test on the others; short for --split first:N.
    #[arg(long, value_name = "N")]
    train_trials: Option<usize>,
    /// Test on at most N trials of each object.
    #[arg(long, value_name = "N")]
    test_trials: Option<usize>,
    /// Subtract the mean of the first half of each trial's rest; for trials of a real gripper and imported ones.
    #[arg(long)]
    rezero: bool,
    /// Include the empty hand as a class.
    #[arg(long)]
    with_empty: bool,
    /// Also run the controls of the first method: shuffled labels, and true size and shape given.
    #[arg(long)]
    controls: bool,
    /// Number of threads (default: one per core). The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print JSON: one row per model.
    #[arg(long)]
    json: bool,
}

/// Training trials of each object where no split is asked for.
const TRAIN_TRIALS: usize = 50;

/// Output of `--json --controls`; without controls it is the rows alone.
#[derive(Serialize)]
struct EvaluateReport {
    rows: Vec<ComparisonRow>,
    controls: Option<Controls>,
    /// What was split and tested.
    #[serde(skip)]
    heading: Vec<String>,
}

pub(super) fn run(arguments: &EvaluateArguments, store: Option<&Path>) -> Result<(), Failure> {
    let (methods, paths) = chosen(&arguments.models)?;
    let models = paths.iter().map(|path| Ok((path.as_str(), Model::load(Path::new(path))?)));
    let models: Vec<(&str, Model)> = models.collect::<Result<_, Failure>>()?;
    let store = read_store(store)?;
    let data =
        arguments.data.read(&store, !arguments.with_empty && models.is_empty(), arguments.most_of_each(&methods))?;
    for (_, model) in &models {
        model.check_channels(&data.channels)?;
    }
    if arguments.rezero && !data.about.is_recorded() {
        return Err("--rezero is for trials of a real gripper and imported ones; choose them with --source".into());
    }
    let data = if arguments.rezero { data.rezeroed() } else { data };
    let checks = leak_checks(&data, arguments.data.seed);
    let plan = arguments.plan(&data);
    let splits = match methods.is_empty() {
        true => Vec::new(),
        false => plan.splits(&data, arguments.data.seed, usize::from(arguments.repeats))?,
    };
    let (mut rows, interrupted) = (Vec::new(), stop_flag()?);
    if !methods.is_empty() {
        let compared = arguments.data.compare(&data, &splits, &methods, arguments.threads, &interrupted)?;
        rows = compared.rows;
        for (method, reason) in &compared.left_out {
            warn(&format!("{method} is left out: {reason}"));
        }
    }
    // A saved model is tested on all trials that it has not learned from; beside methods, on their test trials.
    let tested: Vec<usize> = match splits.as_slice() {
        [split] => split.test.clone(),
        _ => (0..data.examples.len()).collect(),
    };
    for (name, model) in &models {
        let unseen = [data.part(&[]), data.part(&[]), unseen(name, model, &data, &tested)?];
        rows.push(arguments.data.comparison(&unseen, &interrupted).of_fitted(name, model)?);
    }
    let controls = match (methods.first().filter(|_| arguments.controls), splits.first()) {
        (Some(method), Some(first)) => {
            Some(arguments.data.comparison(&parts(&data, first), &interrupted).controls(method)?)
        }
        _ => None,
    };
    if arguments.json && controls.is_none() {
        return say_json(&rows);
    }
    let sessions = data.sessions().into_iter().collect::<BTreeSet<u32>>().len();
    let is_bound = sessions > 1 && !splits.is_empty() && matches!(plan, SplitPlan::Shares(_) | SplitPlan::Folds { .. });
    let plan = if splits.is_empty() { "trials that the models have not learned".to_owned() } else { plan.described() };
    let fits = if splits.len() > 1 { format!(", {} fits", splits.len()) } else { String::new() };
    let (trials, tested) = (data.examples.len(), rows.first().map_or(0, |row| row.evaluation.trials));
    let (seed, quick) = (arguments.data.seed, arguments.data.quick);
    let quick = if quick { "; quick training, do not quote" } else { "" };
    let mut heading = data.about.lines();
    heading.push(format!("split: {plan}{fits}; {trials} trials, {tested} of them tested; seed {seed}{quick}"));
    heading.extend(is_bound.then(|| {
        format!(
            "random parts of {sessions} sessions are an upper bound: new sessions do worse (--split leave-a-session-out)"
        )
    }));
    heading.extend((sessions > 1).then(|| interval_words(&data).to_owned()));
    heading.extend(arguments.rezero.then(|| "re-zeroed by the first half of each rest".to_owned()));
    heading.extend(checks.iter().filter(|check| !check.leaks).map(LeakCheck::to_string));
    heading.push(String::new());
    EvaluateReport { rows, controls, heading }.print(arguments.json)
}

impl EvaluateArguments {
    /// Largest number of trials of each object that the options use.
    fn most_of_each(&self, methods: &[&Method]) -> Option<usize> {
        let train = if methods.is_empty() { 0 } else { self.train_trials.unwrap_or(TRAIN_TRIALS) };
        self.test_trials.map(|test| train + test)
    }

    /// The plan that was asked for; else the first trials of each object for training, where others are left for testing,
    /// and cross-validation where there are too few.
    fn plan(&self, data: &Dataset) -> SplitPlan {
        if let Some(plan) = &self.split {
            return plan.clone();
        }
        let train = self.train_trials.unwrap_or(TRAIN_TRIALS);
        let enough = data.by_class().iter().all(|members| members.is_empty() || members.len() > train);
        if self.train_trials.is_some() || self.test_trials.is_some() || enough {
            SplitPlan::FirstOfEach { train, test: self.test_trials }
        } else {
            SplitPlan::CROSS_VALIDATION
        }
    }
}

/// Test trials that a saved model has not learned from, by its own classes.
fn unseen(name: &str, model: &Model, data: &Dataset, tested: &[usize]) -> Result<Dataset, Failure> {
    let card = &model.card;
    if card.learned.is_empty()
        && let Some(seen) = card.data.collections.iter().find(|c| data.about.collections.contains(c))
    {
        warn(&format!("{name} was trained on collection {seen}, so it may have seen these trials"));
    }
    let fresh: Vec<usize> = tested.iter().copied().filter(|k| !card.learned.contains(&data.examples[*k])).collect();
    let seen = tested.len() - fresh.len();
    if fresh.is_empty() {
        return Err(
            format!("{name} has learned from all of these {seen} trials; collect others with another --seed").into()
        );
    }
    if seen > 0 {
        warn(&format!("{name}: {seen} trial(s) skipped because it has learned from them"));
    }
    data.part(&fresh).relabelled(&card.labels).ok_or_else(|| {
        format!("{name} does not know all objects of these trials; select known ones with --objects").into()
    })
}

/// Splits names into methods and model files.
fn chosen(names: &[String]) -> Result<(Vec<&'static Method>, Vec<String>), Failure> {
    if names.is_empty() {
        return Ok((in_table_order(), Vec::new()));
    }
    let is_method = |name: &&String| METHODS.iter().any(|m| m.key == **name);
    let (keys, rest): (Vec<&String>, Vec<&String>) = names.iter().partition(is_method);
    let methods: Result<Vec<_>, Failure> = keys.into_iter().map(|key| known_method(key)).collect();
    for name in &rest {
        if !name.ends_with(".safetensors") && !Path::new(name.as_str()).exists() {
            known_method(name)?;
        }
    }
    Ok((methods?, rest.into_iter().cloned().collect()))
}

/// A share in percent.
fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

fn or_none(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), percent)
}

const COLUMNS: &[Column<ComparisonRow>] = &[
    ("model", |row| row.model.clone()),
    ("F1", |row| percent(row.evaluation.f1_macro)),
    ("95 %", |row| format!("{}-{}", percent(row.evaluation.ci95[0]), percent(row.evaluation.ci95[1]))),
    ("accuracy", |row| percent(row.evaluation.macro_accuracy)),
    ("F1 (3)", |row| or_none(row.evaluation.f1_by_grasps.get(2).copied())),
    ("F1 (5)", |row| or_none(row.evaluation.f1_by_grasps.get(4).copied())),
    ("size F1", |row| or_none(row.evaluation.stage_one.as_ref().map(|scores| scores.size_f1))),
    ("shape F1", |row| or_none(row.evaluation.stage_one.as_ref().map(|scores| scores.shape_f1))),
    ("ECE", |row| format!("{:.3}", row.evaluation.ece)),
    ("train s", |row| format!("{:.1}", row.train_cpu_s)),
    ("us/sample", |row| format!("{:.1}", row.evaluation.step_us)),
];

impl Report for EvaluateReport {
    fn text(&self, page: &mut Page) {
        self.heading.iter().for_each(|line| page.line(line));
        page.columns(COLUMNS, &self.rows);
        page.line(
            "\nF1 and accuracy: means over the classes, in percent. (3), (5): after three and five grasps of the same \
             object.",
        );
        let Some(controls) = &self.controls else { return };
        let (method, chance) = (&controls.method, percent(controls.chance));
        page.line(format!("\nControls of {method}: macro accuracy in percent, chance is {chance}"));
        for (what, own) in [
            ("shuffled labels", controls.shuffled_labels),
            ("unchanged", controls.plain),
            ("true size and shape given", controls.true_size_and_shape),
        ] {
            page.line(format!("{what:<28}{} ({} to {})", percent(own.estimate), percent(own.low), percent(own.high)));
        }
    }
}
