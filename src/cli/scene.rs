//! `palpate scene explain`: which effects a scene calls for, why, what each costs and what it changes.

use super::Failure;
use super::setup::SceneArguments;
use super::terminal::{say, say_json, warn};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_sim::scene::Scene;
use palpate_lab::study::{ExplainedEffect, Explanation, Measuring, explain_effects};
use palpate_geometry::units::three_digits;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Arguments of `palpate scene`.
#[derive(Debug, clap::Args)]
pub(super) struct SceneCommandArguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Which effects are on and why, what each costs, and what leaving it out or putting it in would change.
    Explain {
        /// A scene file (.toml), or what to grasp: a built-in name, a URDF, OBJ or STL file, or `empty`.
        scene_or_object: Option<String>,
        #[command(flatten)]
        scene: SceneArguments,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(arguments: &SceneCommandArguments) -> Result<(), Failure> {
    let What::Explain { scene_or_object, scene, json } = &arguments.what;
    let scene = scene_of(scene_or_object.as_deref(), scene)?;
    let object = scene.load_object()?;
    // It draws on standard error, and only on a terminal.
    let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} effects")?);
    let progress = |done: usize, of: usize| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    // Nothing is written, so that Ctrl+C may end it at any moment.
    let how = Measuring { threads, cancelled: &AtomicBool::new(false), progress: &progress };
    let explanation = explain_effects(&scene, object.as_ref(), &how);
    bar.finish_and_clear();
    let explanation = explanation.ok_or("the measurement was given up")?;
    if *json { say_json(&explanation) } else { tell(&explanation) }
}

fn scene_of(name: Option<&str>, arguments: &SceneArguments) -> Result<Scene, Failure> {
    match name.filter(|name| name.to_ascii_lowercase().ends_with(".toml")) {
        Some(path) if arguments.scene.is_some() => {
            Err(format!("two scene files: {path} and the one of --scene; name one of them").into())
        }
        Some(path) => arguments.with_file(Some(&PathBuf::from(path)), None),
        None => arguments.scene(name),
    }
}

fn tell(explanation: &Explanation) -> Result<(), Failure> {
    for warning in &explanation.warnings {
        warn(warning);
    }
    let onset = explanation.contact_onset_s.map_or("never".to_owned(), |t| format!("at {t:.3} s"));
    say(format!("{}: {:.1} ms of CPU time, first contact {onset}", explanation.object, explanation.cpu_ms))?;
    for effect in &explanation.effects {
        say("")?;
        tell_effect(effect, explanation)?;
    }
    Ok(())
}

fn tell_effect(effect: &ExplainedEffect, explanation: &Explanation) -> Result<(), Failure> {
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
