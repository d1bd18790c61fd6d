//! `palpate teach`: teaches a model new objects, from their files or from recorded grasps.

use super::Failure;
use super::interrupt::stop_flag;
use super::learning::progress_bar;
use super::output::{check_folder, file_of};
use super::recognise::load_model;
use super::setup::{classes_of, read_store};
use super::terminal::{say, say_json};
use palpate_lab::datasets::{check_model_path, make_models_folder, models_folder, save_model};
use palpate_lab::grasping::{LESSON_GRASPS, LessonError, LessonStage, Lessons};
use palpate_learn::{LearnError, Shipped};
use palpate_sim::objects::anchored;
use palpate_sim::scene::ObjectSetup;
use palpate_store::FileKind;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `palpate teach`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate teach mug.urdf
  palpate teach mug.urdf bottle.obj --out mine.safetensors
  palpate teach mug.urdf --real
  palpate teach --real --recorded mug
  palpate teach bottle.stl --model mine.safetensors

The grasps of each file are simulated, and the model learns them besides what it knows, in seconds: the other objects keep \
their classes. --recorded learns from labelled trials of the real gripper, five at least; with a file of the same name, from \
both.

See also: palpate help recognition")]
pub(super) struct TeachArguments {
    /// Object files (URDF, OBJ, STL), or built-in objects.
    #[arg(required_unless_present = "recorded")]
    files: Vec<String>,
    /// Labels whose trials of the real gripper are learned, separated by commas.
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    recorded: Vec<String>,
    /// Teach the model for real grippers (default: the one for simulated grasps of free objects).
    #[arg(long, conflicts_with = "model")]
    real: bool,
    /// Teach the model for simulated grasps of fixed objects.
    #[arg(long, conflicts_with_all = ["model", "real"])]
    fixed: bool,
    /// Model to teach, of the method geometry-network (default: the shipped one).
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Classes of the objects, separated by commas (default: the names in their files, or of the files or their folders).
    #[arg(long = "class", value_name = "A,B,..", value_delimiter = ',')]
    classes: Vec<String>,
    /// Simulated grasps of each object.
    #[arg(long, value_name = "N", default_value_t = LESSON_GRASPS, value_parser = within_grasps)]
    grasps: usize,
    /// Random seed of poses and of the fit.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Model file to write (.safetensors), with its card beside it (default: taught.safetensors in the models folder).
    #[arg(long, value_name = "FILE", value_parser = file_of(&[FileKind::Model]))]
    out: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn within_grasps(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (10..=1000).contains(number));
    number.ok_or_else(|| "write a number from 10 to 1000".to_owned())
}

/// Output of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    model: &'a Path,
    taught: &'a [String],
    classes: Vec<&'a str>,
    seconds: f64,
    cpu_s: f64,
}

pub(super) fn run(arguments: &TeachArguments, store: Option<&Path>) -> Result<(), Failure> {
    let (began, cpu) = (Instant::now(), cpu_time::ProcessTime::now());
    let shipped = if arguments.real { Shipped::AnyGripper } else { Shipped::simulated(arguments.fixed) };
    let model = load_model(arguments.model.as_deref(), shipped)?;
    let store = if arguments.recorded.is_empty() { None } else { Some(read_store(store)?) };
    // Before the work, which takes seconds.
    let out = match &arguments.out {
        Some(out) => {
            check_folder(out)?;
            check_model_path(out)?;
            out.clone()
        }
        None => {
            make_models_folder(&models_folder())?;
            models_folder().join("taught.safetensors")
        }
    };
    let (simulating, fitting) = (progress_bar("grasping")?, progress_bar("learning")?);
    let progress = |stage| match stage {
        LessonStage::Simulating(done, of) => {
            simulating.set_length(of as u64);
            simulating.set_position(done as u64);
        }
        LessonStage::Fitting(share) => {
            simulating.finish_and_clear();
            fitting.set_length(1000);
            fitting.set_position((share * 1000.0) as u64);
        }
    };
    let stop = stop_flag()?;
    let classes = classes_of(&arguments.classes, arguments.files.len())?;
    let setup = |file: &String| ObjectSetup { source: anchored(file), ..ObjectSetup::default() };
    let objects: Vec<ObjectSetup> = arguments.files.iter().map(setup).collect();
    let lessons = Lessons {
        objects: &objects,
        classes: &classes,
        recorded: &arguments.recorded,
        grasps: arguments.grasps,
        seed: arguments.seed,
        progress: &progress,
        stop: &stop,
    };
    let taught = lessons.teach(&model, store.as_ref());
    simulating.finish_and_clear();
    fitting.finish_and_clear();
    let taught = match taught {
        Err(LessonError::Learn(LearnError::Stopped)) => return Err("stopped; no model was saved".into()),
        taught => taught?,
    };
    save_model(&taught, &out)?;
    let classes: Vec<&str> = taught.card.labels.classes.iter().map(|class| class.name.as_str()).collect();
    let report = Report {
        model: &out,
        taught: &taught.card.taught,
        classes,
        seconds: began.elapsed().as_secs_f64(),
        cpu_s: cpu.elapsed().as_secs_f64(),
    };
    if arguments.json {
        return say_json(&report);
    }
    say(format!("taught   {}", report.taught.join(", ")))?;
    say(format!("classes  {}: {}", report.classes.len(), report.classes.join(", ")))?;
    say(format!("cost     {:.1} s, {:.1} s CPU", report.seconds, report.cpu_s))?;
    say(format!("saved    {}", out.display()))
}
