//! `palpate scene`: scenes with a name; which effects a scene calls for, why, what each costs and changes.

use super::Failure;
use super::setup::SceneArguments;
use super::terminal::{say, say_json, warn};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_geometry::units::three_digits;
use palpate_lab::study::{ExplainedEffect, Explanation, Measuring, explain_effects};
use palpate_sim::scene::{SCENES, Scene};
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

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
    let object = scene.load_object()?;
    let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} effects")?);
    let progress = |done: usize, of: usize| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let how = Measuring { threads, cancelled: &AtomicBool::new(false), progress: &progress };
    let explanation = explain_effects(&scene, object.as_ref(), &how);
    bar.finish_and_clear();
    let explanation = explanation.ok_or("the measurement was cancelled")?;
    if *json { say_json(&explanation) } else { print(&explanation) }
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

fn print(explanation: &Explanation) -> Result<(), Failure> {
    for warning in &explanation.warnings {
        warn(warning);
    }
    let onset = explanation.contact_onset_s.map_or("none".to_owned(), |t| format!("at {t:.3} s"));
    say(format!("{}: {:.1} ms of CPU time, first contact {onset}", explanation.object, explanation.cpu_ms))?;
    for effect in &explanation.effects {
        say("")?;
        print_effect(effect, explanation)?;
    }
    Ok(())
}

fn print_effect(effect: &ExplainedEffect, explanation: &Explanation) -> Result<(), Failure> {
    let planned = &effect.planned;
    let state = if planned.on { "on" } else { "off" };
    let setting = if planned.setting == state { "as set".to_owned() } else { planned.setting.clone() };
    say(format!("{:<15} {state:<4} ({setting})   {}", planned.name, effect.about))?;
    let compared = if planned.number > planned.threshold { "above" } else { "not above" };
    say(format!(
        "  why      {}: {} = {}, {compared} {}",
        planned.reason,
        effect.number_is,
        three_digits(planned.number),
        planned.threshold
    ))?;
    say(format!("  cost     {}", effect.cost_in_words()))?;
    say(format!("  change   {}", effect.change_in_words(explanation.contact_onset_s)))
}
