//! `palpate scene`: scenes with a name; which effects a scene calls for, why, what each costs and changes.

use super::prelude::*;
use super::setup::threads;
use palpate_geometry::units::three_digits;
use palpate_sim::scene::{SCENES, Scene};
use palpate_study::{ExplainedEffect, Explanation, Measuring, StudyProgress, explain_effects};

/// Arguments of `palpate scene`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate scene list
  palpate scene explain lemon
  palpate scene explain scene.toml --json
  palpate scene explain empty --set effects.finger-contact=off

See also: palpate help effects")]
pub(super) struct SceneCommandArguments {
    #[command(subcommand)]
    command: SceneCommand,
}

#[derive(Debug, clap::Subcommand)]
enum SceneCommand {
    /// List the scenes that have a name, for --scene.
    List {
        /// Print one JSON object per scene instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Print which effects are on and why, the cost of each, and the change if it were switched.
    Explain {
        /// Scene file (.toml), or an object: a built-in name, a URDF, OBJ or STL file, or `empty`.
        scene_or_object: Option<String>,
        #[command(flatten)]
        scene: SceneArguments,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(arguments: &SceneCommandArguments) -> Result<(), Failure> {
    let (scene_or_object, scene, json) = match &arguments.command {
        SceneCommand::List { json } => return list(*json),
        SceneCommand::Explain { scene_or_object, scene, json } => (scene_or_object, scene, json),
    };
    let scene = scene_of(scene_or_object.as_deref(), scene)?;
    let object = load_object(&scene)?;
    let bar = Progress::new("{bar:40} {pos}/{len} effects");
    let progress = |own: StudyProgress| bar.show(own.done, own.of);
    let how = Measuring { threads: threads(None), cancelled: &AtomicBool::new(false), progress: &progress };
    let explanation = explain_effects(&scene, object.as_ref(), &how).ok_or("the measurement was cancelled")?;
    drop(bar);
    explanation.print(*json)
}

/// A named scene, as `--json` prints it.
#[derive(Serialize)]
struct ListedScene {
    name: &'static str,
    about: &'static str,
    /// Settings that differ from the defaults.
    settings: String,
}

fn list(json: bool) -> Result<(), Failure> {
    for named in SCENES {
        let settings = named.scene().differences();
        if json {
            say_json(&ListedScene { name: named.name, about: named.about(), settings })?;
            continue;
        }
        say(format!("{}: {}", named.name, named.about()))?;
        for setting in settings.lines() {
            say(format!("  {setting}"))?;
        }
    }
    Ok(())
}

fn scene_of(name: Option<&str>, arguments: &SceneArguments) -> Result<Scene, Failure> {
    match name.filter(|name| name.to_ascii_lowercase().ends_with(".toml")) {
        Some(path) if arguments.scene.is_some() => {
            Err(format!("two scene files, {path} and --scene: give one of them").into())
        }
        Some(path) => arguments.with_file(Some(&PathBuf::from(path)), None),
        None => arguments.scene(name),
    }
}

impl Report for Explanation {
    fn text(&self, page: &mut Page) {
        self.warnings.iter().for_each(|warning| page.warn(warning));
        let onset = self.contact_onset_s.map_or("none".to_owned(), |t| format!("at {t:.3} s"));
        page.line(format!("{}: {:.1} ms of CPU time, first contact {onset}", self.object, self.cpu_ms));
        self.effects.iter().for_each(|effect| effect_text(effect, self.contact_onset_s, page));
    }
}

fn effect_text(effect: &ExplainedEffect, onset_s: Option<f64>, page: &mut Page) {
    let planned = &effect.planned;
    let state = if planned.on { "on" } else { "off" };
    let setting = if planned.setting == state { "as set" } else { &planned.setting };
    page.line(format!("\n{:<15} {state:<4} ({setting})   {}", planned.name, effect.about));
    let compared = if planned.number > planned.threshold { "above" } else { "not above" };
    let (reason, number) = (&planned.reason, three_digits(planned.number));
    page.line(format!("  why      {reason}: {} = {number}, {compared} {}", effect.number_is, planned.threshold));
    page.line(format!("  cost     {}", effect.cost_in_words()));
    page.line(format!("  change   {}", effect.change_in_words(onset_s)));
}
