//! `palpate train`: trains a recogniser on stored trials and saves it.

use super::Failure;
use super::learning::{DataArguments, known_method, progress_bar};
use super::output::{check_folder, file_of};
use super::setup::read_store;
use super::terminal::{say, say_json, table};
use palpate_lab::datasets::{check_model_path, make_models_folder, models_folder, save_model};
use palpate_lab::study::{SearchRow, search};
use palpate_learn::evaluation::Evaluation;
use palpate_learn::{Dataset, Fitting, LearnError, METHODS, Method, Model, SplitPlan};
use palpate_store::FileKind;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Arguments of `palpate train`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate train --list
  palpate train ids-lstm --trials 50 --store set.sqlite --out mine.safetensors
  palpate train macro-layer --collection mine --set epochs=50
  palpate train macro-layer --source serial
  palpate train random-forest --preset B --since today --split folds:5

See also: palpate help recognition")]
pub(super) struct TrainArguments {
    /// Method; --list prints all.
    #[arg(required_unless_present = "list")]
    method: Option<String>,
    /// List the methods.
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    data: DataArguments,
    /// Train on at most N trials of each object, oldest first.
    #[arg(long, value_name = "N")]
    trials: Option<usize>,
    /// Set a hyperparameter, e.g. --set epochs=50 (may be repeated).
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Print the hyperparameters of the method, then exit.
    #[arg(long)]
    print_settings: bool,
    /// Also judge the method on these trials by a split, such as folds:5 or 80/20, and write the result on the card.
    #[arg(long, value_name = "PLAN", conflicts_with_all = ["settings", "search"])]
    split: Option<SplitPlan>,
    /// Search the method's grid of hyperparameters by cross-validation first, and train with the best.
    #[arg(long)]
    search: bool,
    /// Model file to write (.safetensors), with its card beside it (default: in the models folder).
    #[arg(long, value_name = "FILE", value_parser = file_of(&[FileKind::Model]))]
    out: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    model: &'a Path,
    method: &'a str,
    trials: usize,
    channels: &'a [String],
    parameters: usize,
    train_cpu_s: f64,
    data: String,
    query: &'a str,
    search: Option<Vec<SearchRow>>,
}

pub(super) fn run(arguments: &TrainArguments, store: Option<&Path>) -> Result<(), Failure> {
    if arguments.list {
        let rows: Vec<Vec<String>> =
            METHODS.iter().map(|m| vec![m.key.to_owned(), m.title.to_owned(), m.about.to_owned()]).collect();
        return table(&["method", "name", "description"], &rows);
    }
    let method = known_method(arguments.method.as_deref().unwrap_or_default())?;
    if arguments.print_settings {
        return match method.recipe {
            Some(recipe) => say_json(&recipe()),
            None => say("this method has no hyperparameters to set"),
        };
    }
    if let Some(out) = &arguments.out {
        check_folder(out)?;
        check_model_path(out)?;
    }
    let store = read_store(store)?;
    let data = arguments.data.read(&store, false, arguments.trials)?;
    // Before the training, which may take long.
    let out = match &arguments.out {
        Some(out) => out.clone(),
        None => {
            make_models_folder(&models_folder())?;
            models_folder().join(format!("{}.safetensors", method.key))
        }
    };
    let mut settings = parse_settings(&arguments.settings)?;
    let search = if arguments.search { Some(searched(method, &data, arguments, &mut settings)?) } else { None };
    let mut model = fitted(method, &data, arguments, settings)?;
    if let Some(rows) = &search {
        model.card.metrics = serde_json::json!({ "search": rows });
    }
    let judged = arguments.split.as_ref().map(|plan| judged(method, &data, arguments, plan)).transpose()?;
    if let Some((test, evaluation)) = &judged {
        model.card.metrics = evaluation.metrics(test);
    }
    save_model(&model, &out)?;
    let report = Report {
        model: &out,
        method: method.key,
        trials: data.examples.len(),
        channels: &data.channels,
        parameters: model.card.parameters,
        train_cpu_s: model.card.train_cpu_s,
        data: data.about.described(),
        query: &data.about.query,
        search,
    };
    if arguments.json {
        return say_json(&report);
    }
    say(format!("method      {} ({})", method.title, method.key))?;
    say(format!("data        {} trials: {}", report.trials, report.data))?;
    say(format!("query       {}", if report.query.is_empty() { "all trials" } else { report.query }))?;
    say(format!("channels    {}", report.channels.join(", ")))?;
    say(format!("parameters  {}", report.parameters))?;
    say(format!("cost        {:.1} s CPU", report.train_cpu_s))?;
    if let Some((test, evaluation)) = &judged {
        let [f1, low, high] =
            [evaluation.f1_macro, evaluation.ci95[0], evaluation.ci95[1]].map(|x| format!("{:.1}", 100.0 * x));
        say(format!("F1          {f1} percent ({low} to {high}): {test}"))?;
    }
    if model.card.labels.other().is_some() {
        say("unknown     class \"other\", learned from random shapes")?;
    } else if model.card.rejection.is_none() {
        say("unknown     not supported: every grasp is assigned to one of these objects")?;
    }
    say(format!("saved       {}", out.display()))
}

/// Parses hyperparameters: numbers, true or false.
fn parse_settings(written: &[String]) -> Result<serde_json::Map<String, serde_json::Value>, Failure> {
    let parse = |text: &String| -> Result<(String, serde_json::Value), Failure> {
        let (name, value) = text.split_once('=').ok_or_else(|| format!("write --set NAME=VALUE, not \"{text}\""))?;
        let value = serde_json::from_str(value.trim())
            .map_err(|_unread| format!("setting {name}: \"{value}\" is not a number, true or false"))?;
        Ok((name.trim().to_owned(), value))
    };
    written.iter().map(parse).collect()
}

fn fitted(
    method: &'static Method,
    data: &Dataset,
    arguments: &TrainArguments,
    settings: serde_json::Map<String, serde_json::Value>,
) -> Result<Model, LearnError> {
    let bar = progress_bar("training").map_err(|e| LearnError::Failed { cause: e.to_string() })?;
    bar.set_length(1000);
    let stop = AtomicBool::new(false);
    let fitting = Fitting {
        seed: arguments.data.seed,
        quick: arguments.data.quick,
        settings,
        second: None,
        progress: &|share| bar.set_position((share * 1000.0) as u64),
        stop: &stop,
    };
    let model = method.train(data, &fitting);
    bar.finish_and_clear();
    model
}

/// Judges the method on splits of the data; also says on what.
fn judged(
    method: &'static Method,
    data: &Dataset,
    arguments: &TrainArguments,
    plan: &SplitPlan,
) -> Result<(String, Evaluation), Failure> {
    let splits = plan.splits(data, arguments.data.seed, 1)?;
    let compared = arguments.data.compare(data, &splits, &[method], None)?;
    let row = compared.rows.into_iter().next().ok_or("no test grasps left")?;
    let trials = row.evaluation.trials;
    Ok((format!("{}, {trials} trials tested: {}", plan.described(), data.about.lines().join("; ")), row.evaluation))
}

fn searched(
    method: &'static Method,
    data: &Dataset,
    arguments: &TrainArguments,
    settings: &mut serde_json::Map<String, serde_json::Value>,
) -> Result<Vec<SearchRow>, Failure> {
    let bar = progress_bar("searching")?;
    let rows = search(method, data, arguments.data.seed, arguments.data.quick, settings, &|done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let rows = rows?;
    if let Some(best) = rows.first() {
        settings.extend(best.settings.clone());
    }
    Ok(rows)
}
