//! `palpate train`: trains a recogniser on stored trials and saves it.

use super::learning::{DataArguments, known_method, leak_checks, model_file};
use super::prelude::*;
use palpate_lab::datasets::{make_models_folder, models_folder, save_model};
use palpate_learn::evaluation::Evaluation;
use palpate_learn::search::{SearchRow, search};
use palpate_learn::{Dataset, Fitting, LearnError, METHODS, Method, Model, SplitPlan};

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
struct TrainReport<'a> {
    model: &'a Path,
    method: &'a str,
    trials: usize,
    channels: &'a [String],
    parameters: usize,
    train_cpu_s: f64,
    data: String,
    query: &'a str,
    search: Option<Vec<SearchRow>>,
    #[serde(skip)]
    title: &'a str,
    /// Result of the test, and on what.
    #[serde(skip)]
    judged: Option<&'a (String, Evaluation)>,
    /// What the model makes of unknown objects.
    #[serde(skip)]
    unknown: Option<&'static str>,
}

pub(super) fn run(arguments: &TrainArguments, store: Option<&Path>) -> Result<(), Failure> {
    if arguments.list {
        let mut page = Page::default();
        let rows = METHODS.iter().map(|method| [method.key, method.title, method.about].map(str::to_owned));
        page.table(&["method", "name", "description"], rows);
        return page.print();
    }
    let method = known_method(arguments.method.as_deref().unwrap_or_default())?;
    if arguments.print_settings {
        return match method.recipe {
            Some(recipe) => say_json(&recipe()),
            None => say("this method has no hyperparameters to set"),
        };
    }
    let out = model_file(arguments.out.as_deref(), method.key)?;
    let data = arguments.data.read(&read_store(store)?, false, arguments.trials)?;
    // Before the training, which may take long.
    if arguments.out.is_none() {
        make_models_folder(&models_folder())?;
    }
    let mut settings = parse_settings(&arguments.settings)?;
    let search = if arguments.search { Some(searched(method, &data, arguments, &mut settings)?) } else { None };
    // Before this, Ctrl+C ends the program at once.
    let stop = stop_flag()?;
    let mut model = fitted(method, &data, arguments, settings, &stop)?;
    if let Some(rows) = &search {
        model.card.metrics = serde_json::json!({ "search": rows });
    }
    let judged = arguments.split.as_ref().map(|plan| judged(method, &data, arguments, plan, &stop)).transpose();
    // A stop in its last moments counts, too.
    if stop.load(Ordering::Relaxed) {
        return Err(LearnError::Stopped.into());
    }
    let judged = judged?;
    if let Some((test, evaluation)) = &judged {
        model.card.metrics = evaluation.metrics(test);
    }
    let checks = leak_checks(&data, arguments.data.seed);
    if !checks.is_empty() {
        model.card.metrics["leak_checks"] = serde_json::json!(checks);
    }
    save_model(&model, &out)?;
    let labels = &model.card.labels;
    let unknown = match (labels.other(), &model.card.rejection) {
        (Some(_), _) => Some("class \"other\", learned from random shapes"),
        (None, None) => Some("not supported: every grasp is assigned to one of these objects"),
        (None, Some(_)) => None,
    };
    let report = TrainReport {
        model: &out,
        method: method.key,
        trials: data.examples.len(),
        channels: &data.channels,
        parameters: model.card.parameters,
        train_cpu_s: model.card.train_cpu_s,
        data: data.about.described(),
        query: &data.about.query,
        search,
        title: method.title,
        judged: judged.as_ref(),
        unknown,
    };
    report.print(arguments.json)
}

impl Report for TrainReport<'_> {
    fn text(&self, page: &mut Page) {
        page.fact("method", format!("{} ({})", self.title, self.method));
        page.fact("data", format!("{} trials: {}", self.trials, self.data));
        page.fact("query", if self.query.is_empty() { "all trials" } else { self.query }.to_owned());
        page.fact("channels", self.channels.join(", "));
        page.fact("parameters", self.parameters.to_string());
        page.fact("cost", format!("{:.1} s CPU", self.train_cpu_s));
        page.fact(
            "F1",
            self.judged.map(|(test, own)| {
                let [f1, low, high] = [own.f1_macro, own.ci95[0], own.ci95[1]].map(|x| format!("{:.1}", 100.0 * x));
                format!("{f1} percent ({low} to {high}): {test}")
            }),
        );
        page.fact("unknown", self.unknown.map(str::to_owned));
        page.fact("saved", self.model.display().to_string());
    }
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
    stop: &AtomicBool,
) -> Result<Model, LearnError> {
    let bar = Progress::of_share("training");
    let progress = |share| bar.share(share);
    let usual = Fitting::new(arguments.data.seed, arguments.data.quick, stop);
    method.train(data, &Fitting { settings, progress: &progress, ..usual })
}

/// Judges the method on splits of the data; also says on what.
fn judged(
    method: &'static Method,
    data: &Dataset,
    arguments: &TrainArguments,
    plan: &SplitPlan,
    stop: &AtomicBool,
) -> Result<(String, Evaluation), Failure> {
    let splits = plan.splits(data, arguments.data.seed, 1)?;
    let compared = arguments.data.compare(data, &splits, &[method], None, stop)?;
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
    let bar = Progress::of("searching");
    let show = |done, of| bar.show(done, of);
    let rows = search(method, data, arguments.data.seed, arguments.data.quick, settings, &show)?;
    if let Some(best) = rows.first() {
        settings.extend(best.settings.clone());
    }
    Ok(rows)
}
