//! `palpate evaluate`: compares methods on stored trials, or evaluates a saved model on trials it has not seen.

use super::Failure;
use super::learning::{DataArguments, known_method, progress_bar};
use super::setup::read_store;
use super::terminal::{say, say_json, table, warn};
use palpate_lab::study::{Comparison, ComparisonRow, Controls, in_table_order};
use palpate_learn::evaluation::StageOneScores;
use palpate_learn::metrics::Interval;
use palpate_learn::{METHODS, Method, Model, StopRule};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Arguments of `palpate evaluate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate evaluate --store set.sqlite --quick
  palpate evaluate --models macro-layer,random-forest --controls
  palpate evaluate --models mine.safetensors --test-trials 100 --json

See also: palpate help recognition")]
pub(super) struct EvaluateArguments {
    /// Methods to train and test, or saved models to test, separated by commas (default: all methods).
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    models: Vec<String>,
    #[command(flatten)]
    data: DataArguments,
    /// Train on the first N trials of each object, test on the others.
    #[arg(long, value_name = "N", default_value_t = 50)]
    train_trials: usize,
    /// Test on at most N trials of each object.
    #[arg(long, value_name = "N")]
    test_trials: Option<usize>,
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

/// Output of `--json --controls`.
#[derive(Serialize)]
struct ReportWithControls {
    rows: Vec<ComparisonRow>,
    controls: Controls,
}

pub(super) fn run(arguments: &EvaluateArguments, store: Option<&Path>) -> Result<(), Failure> {
    let (methods, paths) = chosen(&arguments.models)?;
    let models = paths.iter().map(|path| Ok((path.as_str(), Model::load(Path::new(path))?)));
    let models: Vec<(&str, Model)> = models.collect::<Result<_, Failure>>()?;
    let store = read_store(store)?;
    // A saved model is tested on all trials: only the user knows which of them it was trained on.
    let train_trials = if methods.is_empty() { 0 } else { arguments.train_trials };
    let most = arguments.test_trials.map(|test| train_trials + test);
    let data = arguments.data.read(&store, !arguments.with_empty && models.is_empty(), most)?;
    let (train, test) = data.first_of_each(train_trials);
    for (_, model) in &models {
        model.check_channels(&data.channels)?;
        if let Some(seen) = model.card.data.collections.iter().find(|c| data.about.collections.contains(c)) {
            warn(&format!("{} was trained on collection {seen}, so it may have seen these trials", model.card.method));
        }
    }
    let interrupted = AtomicBool::new(false);
    let seed = arguments.data.seed;
    let stop = StopRule::default();
    let comparison =
        Comparison { train: &train, test: &test, seed, quick: arguments.data.quick, stop, interrupted: &interrupted };
    let threads = match arguments.threads {
        Some(threads) => usize::from(threads),
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let bar = progress_bar("training and testing")?;
    bar.set_length(methods.len() as u64);
    bar.tick();
    let rows = comparison.of_methods(&methods, threads, &|_| bar.inc(1));
    bar.finish_and_clear();
    let mut rows = if methods.is_empty() { Vec::new() } else { rows? };
    for (name, model) in &models {
        let test = test.relabelled(&model.card.labels).ok_or_else(|| {
            format!("{name} does not know all objects of these trials; select known ones with --objects")
        })?;
        let comparison = Comparison { train: &train, test: &test, ..comparison };
        rows.push(comparison.of_fitted(name, model)?);
    }
    let controls = match methods.first().filter(|_| arguments.controls) {
        Some(method) => Some(comparison.controls(method)?),
        None => None,
    };
    match (arguments.json, controls) {
        (true, Some(controls)) => say_json(&ReportWithControls { rows, controls }),
        (true, None) => say_json(&rows),
        (false, controls) => {
            print(&rows, arguments, &train.about.described(), train.examples.len(), test.examples.len())?;
            controls.map_or(Ok(()), |controls| print_controls(&controls))
        }
    }
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

fn print(
    rows: &[ComparisonRow],
    arguments: &EvaluateArguments,
    about: &str,
    train: usize,
    test: usize,
) -> Result<(), Failure> {
    let quick = if arguments.data.quick { "; quick training, do not quote" } else { "" };
    say(format!("{about}; {train} training trials, {test} test trials; seed {}{quick}\n", arguments.data.seed))?;
    let percent = |x: f64| format!("{:.1}", 100.0 * x);
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let e = &row.evaluation;
            let after = |grasps: usize| e.f1_by_grasps.get(grasps - 1).map_or_else(|| "-".to_owned(), |f| percent(*f));
            let stage = |pick: fn(&StageOneScores) -> f64| {
                e.stage_one.as_ref().map_or_else(|| "-".to_owned(), |s| percent(pick(s)))
            };
            vec![
                row.model.clone(),
                percent(e.f1_macro),
                format!("{}-{}", percent(e.ci95[0]), percent(e.ci95[1])),
                percent(e.macro_accuracy),
                after(3),
                after(5),
                stage(|s| s.size_f1),
                stage(|s| s.shape_f1),
                format!("{:.3}", e.ece),
                format!("{:.1}", row.train_cpu_s),
                format!("{:.1}", e.step_us),
            ]
        })
        .collect();
    let header =
        ["model", "F1", "95 %", "accuracy", "F1 (3)", "F1 (5)", "size F1", "shape F1", "ECE", "train s", "us/sample"];
    table(&header, &cells)?;
    say(
        "\nF1 and accuracy: means over the classes, in percent. (3), (5): after three and five grasps of the same object.",
    )
}

fn print_controls(controls: &Controls) -> Result<(), Failure> {
    let line = |what: &str, i: Interval| {
        let percent = [i.estimate, i.low, i.high].map(|x| format!("{:.1}", 100.0 * x));
        format!("{what:<28}{} ({} to {})", percent[0], percent[1], percent[2])
    };
    say(format!(
        "\nControls of {}: macro accuracy in percent, chance is {:.1}",
        controls.method,
        100.0 * controls.chance
    ))?;
    say(line("shuffled labels", controls.shuffled_labels))?;
    say(line("unchanged", controls.plain))?;
    say(line("true size and shape given", controls.true_size_and_shape))
}
