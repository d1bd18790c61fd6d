//! `palpate teach`: teaches a model new objects, from their files or from recorded grasps.

use super::learning::model_file;
use super::prelude::*;
use super::recognise::load_model;
use super::setup::classes_of;
use palpate_lab::datasets::{make_models_folder, models_folder, save_model};
use palpate_lab::grasping::{LESSON_GRASPS, LessonError, LessonStage, Lessons, lesson_result, lesson_warning};
use palpate_learn::{LearnError, Lesson, Shipped};
use palpate_sim::objects::anchored;
use palpate_sim::scene::ObjectSetup;
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
    #[arg(long, value_name = "N", default_value_t = LESSON_GRASPS, value_parser = within(10..=1000_usize))]
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

/// Output of `--json`.
#[derive(Serialize)]
struct TeachReport<'a> {
    model: &'a Path,
    taught: &'a [String],
    lessons: Vec<Lesson>,
    classes: Vec<&'a str>,
    seconds: f64,
    cpu_s: f64,
    /// What `palpate demo` grasps with it, as its option.
    #[serde(skip)]
    grasped: String,
}

pub(super) fn run(arguments: &TeachArguments, store: Option<&Path>) -> Result<(), Failure> {
    let (began, cpu) = (Instant::now(), cpu_time::ProcessTime::now());
    let shipped = if arguments.real { Shipped::AnyGripper } else { Shipped::simulated(arguments.fixed) };
    let model = load_model(arguments.model.as_deref(), shipped)?;
    let store = if arguments.recorded.is_empty() { None } else { Some(read_store(store)?) };
    // Before the work, which takes seconds.
    let out = model_file(arguments.out.as_deref(), "taught")?;
    if arguments.out.is_none() {
        make_models_folder(&models_folder())?;
    }
    let (simulating, fitting) = (Progress::of("grasping"), Progress::of_share("learning"));
    let progress = |stage| match stage {
        LessonStage::Simulating(done, of) => simulating.show(done, of),
        LessonStage::Fitting(share) => {
            simulating.0.finish_and_clear();
            fitting.share(share);
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
    drop((simulating, fitting));
    let taught = match taught {
        Err(LessonError::Learn(LearnError::Stopped)) => return Err("stopped; no model was saved".into()),
        taught => taught?,
    };
    for lesson in &taught.lessons {
        if let Some(warning) = lesson_warning(lesson) {
            warn(&format!("\"{}\": {warning}", lesson.name));
        }
    }
    let (taught, lessons) = (taught.model, taught.lessons);
    save_model(&taught, &out)?;
    let classes: Vec<&str> = taught.card.labels.classes.iter().map(|class| class.name.as_str()).collect();
    let (seconds, cpu_s) = (began.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64());
    let grasped = arguments
        .files
        .first()
        .filter(|_| !arguments.real)
        .map_or("--port PORT".to_owned(), |file| format!("--object {file}"));
    TeachReport { model: &out, taught: &taught.card.taught, lessons, classes, seconds, cpu_s, grasped }
        .print(arguments.json)
}

impl Report for TeachReport<'_> {
    fn text(&self, page: &mut Page) {
        page.fact("taught", self.taught.join(", "));
        for lesson in &self.lessons {
            page.fact("test", format!("{}: {}", lesson.name, lesson_result(lesson)));
        }
        page.fact("classes", format!("{}: {}", self.classes.len(), self.classes.join(", ")));
        page.fact("cost", format!("{:.1} s, {:.1} s CPU", self.seconds, self.cpu_s));
        page.fact("saved", self.model.display().to_string());
        let (model, grasped) = (self.model.display(), &self.grasped);
        page.line("Name it where it is to be used:");
        page.line(format!("  palpate recognise TRIAL --model {model}"));
        page.line(format!("  palpate demo {grasped} --model {model}"));
    }
}
