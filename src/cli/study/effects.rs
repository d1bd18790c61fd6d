//! `palpate study effects`: audit of the rules of `auto`.

use super::super::Failure;
use super::super::interrupt::stop_flag;
use super::super::terminal::{note, say, say_json, table};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_geometry::palette::Theme;
use palpate_lab::study::{
    AuditPlan, AuditReport, AuditedScene, Measuring, ResultFile, StoredStudy, audit_effects, audit_figure,
};
use palpate_render::{figure_picture, figure_svg};
use std::path::PathBuf;

/// Arguments of `palpate study effects`.
#[derive(Debug, clap::Args)]
pub(super) struct EffectsArguments {
    /// Take seconds instead of minutes: few scenes.
    #[arg(long)]
    quick: bool,
    /// Number of random scenes (default: 500, with --quick 40).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    scenes: Option<u32>,
    /// Random seed of the scenes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder that receives finished scenes as they come (effects.jsonl), the result (effects.json) and a picture
    /// (effects.svg, effects.png). The same command resumes where it stopped.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

const SCENES: u32 = 500;
const QUICK_SCENES: u32 = 40;
/// Size of the picture (points).
const SIZE: [u32; 2] = [920, 420];
const NAME: &str = "effects";

pub(super) fn run(arguments: &EffectsArguments) -> Result<(), Failure> {
    let scenes = arguments.scenes.unwrap_or(if arguments.quick { QUICK_SCENES } else { SCENES });
    let plan = AuditPlan { scenes, seed: arguments.seed };
    let mut results: ResultFile<AuditedScene> = match &arguments.out {
        // More scenes of the same seed go on from fewer.
        Some(folder) => ResultFile::open(&folder.join(format!("{NAME}.jsonl")), NAME, &plan.seed)?,
        None => ResultFile::in_memory(),
    };
    let bar = ProgressBar::new(u64::from(scenes));
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} scenes, {eta} left")?);
    let stop = stop_flag()?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let progress = |done: usize, _of: usize| bar.set_position(done as u64);
    let how = Measuring { threads, cancelled: &stop, progress: &progress };
    let finished = audit_effects(plan, &mut results, &how)?;
    bar.finish_and_clear();
    let count = results.units().len();
    if !finished {
        let hint = if arguments.out.is_some() { "; the same command goes on from here" } else { "" };
        return Err(format!("stopped after {count} of {scenes} scenes{hint}").into());
    }
    let report = AuditReport::new(results.units().values().take(scenes as usize));
    let seed = if plan.seed == 1 { String::new() } else { format!(" --seed {}", plan.seed) };
    let amount = if scenes == SCENES { String::new() } else { format!(" --scenes {scenes}") };
    let stored = StoredStudy::new(&format!("palpate study effects{amount}{seed}"), results.cpu_hours(), report);
    if let Some(folder) = &arguments.out {
        let path = |extension: &str| folder.join(format!("{NAME}.{extension}"));
        stored.write(&path("json"))?;
        let figure = audit_figure(&stored);
        std::fs::write(path("svg"), figure_svg(&figure, Theme::Light, SIZE)?)?;
        figure_picture(&figure, Theme::Light, SIZE)?.save(&path("png"))?;
        note(&format!("written: effects.json, effects.svg, effects.png in {}", folder.display()));
    }
    if arguments.json { say_json(&stored) } else { print(&stored) }
}

fn print(stored: &StoredStudy<AuditReport>) -> Result<(), Failure> {
    let report = &stored.result;
    let rows: Vec<Vec<String>> = report
        .effects
        .iter()
        .filter(|row| row.on + row.off > 0)
        .map(|row| {
            let counts = [row.on, row.needless, row.off, row.missed, row.within_noise].map(|count| count.to_string());
            let cost = row.cost.map_or("-".to_owned(), |cost| format!("{cost:.2}"));
            [vec![row.name.clone(), row.threshold.to_string()], counts.to_vec(), vec![cost]].concat()
        })
        .collect();
    table(&["effect", "threshold", "on", "not seen", "off", "missed", "in noise", "CPU time"], &rows)?;
    say("")?;
    let AuditReport { scenes, missed, within_noise, .. } = report;
    say(format!("all effects on: seen in {missed} of {scenes} scenes, within noise in {within_noise}"))?;
    say(
        "seen: curvature changes by more than 0.1 1/m or force by more than 10 mN (RMS), and by more than twice what a",
    )?;
    say("tenth of the tolerance or a push of 10 um changes")?;
    say(stored.origin().replace('`', ""))
}
