//! `palpate study stability`: hard cases, holds that chatter, and random scenes.

use super::super::Failure;
use super::super::interrupt::stop_flag;
use super::super::terminal::{note, say, say_json, table};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::three_digits;
use palpate_lab::study::stability::{
    CaseRow, Limit, RandomReport, StabilityPlan, StabilityReport, policy_table, stability_figure,
};
use palpate_lab::study::{Measuring, ResultFile, StoredStudy};
use palpate_render::{figure_picture, figure_svg};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `palpate study stability`.
#[derive(Debug, clap::Args)]
pub(super) struct StabilityArguments {
    /// Take a minute instead of hours: draft and standard only, short runs, few grasps and random scenes.
    #[arg(long)]
    quick: bool,
    /// Number of random scenes (default: 2000, with --quick 12).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    scenes: Option<u64>,
    /// Grasps of each preset at draft and at standard that are searched for chatter (default: 1000, with --quick 16).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    grasps: Option<u32>,
    /// Random seed of the scenes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for stability.json, .svg and .png. Results are kept in stability.jsonl as they are computed: after Ctrl+C or
    /// a crash the same command resumes where it stopped.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of threads (default: one per core). The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Report {
    /// One row per hard case and setting.
    table: Vec<CaseRow>,
    #[serde(flatten)]
    report: StabilityReport,
    /// CPU time (h).
    cpu_hours: f64,
}

/// Size of the figure (pixels).
const SIZE: [u32; 2] = [1200, 520];

impl StabilityArguments {
    fn plan(&self) -> StabilityPlan {
        let plan = if self.quick { StabilityPlan::QUICK } else { StabilityPlan::FULL };
        StabilityPlan {
            grasps: self.grasps.map_or(plan.grasps, |grasps| grasps as usize),
            scenes: self.scenes.unwrap_or(plan.scenes),
            seed: self.seed,
            ..plan
        }
    }

    /// The command that repeats this study.
    fn command(&self) -> String {
        let mut command = "palpate study stability".to_owned();
        if self.quick {
            command.push_str(" --quick");
        }
        let plan = self.plan();
        for (given, name, value) in [
            (self.scenes.is_some(), "scenes", plan.scenes),
            (self.grasps.is_some(), "grasps", plan.grasps as u64),
            (self.seed != 1, "seed", plan.seed),
        ] {
            if given {
                command.push_str(&format!(" --{name} {value}"));
            }
        }
        command
    }
}

pub(super) fn run(arguments: &StabilityArguments) -> Result<(), Failure> {
    let plan = arguments.plan();
    let mut results = match &arguments.out {
        Some(folder) => plan.results(&folder.join("stability.jsonl"))?,
        None => ResultFile::in_memory(),
    };
    let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {eta} left")?);
    let threads =
        arguments.threads.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from);
    let cancelled = stop_flag()?;
    let progress = |done: usize, of: usize| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    };
    let finished = plan.run(&mut results, &Measuring { threads, cancelled: &cancelled, progress: &progress });
    bar.finish_and_clear();
    if !finished? {
        return Err(match &arguments.out {
            Some(_) => "interrupted; the same command resumes where it stopped".into(),
            None => "interrupted; with --out DIR it can be resumed".into(),
        });
    }
    let cpu_hours = results.cpu_hours();
    let report = Report { table: plan.case_rows(&results), report: plan.report(&results), cpu_hours };
    if arguments.json {
        say_json(&report)?;
    } else {
        print(&report)?;
    }
    if let Some(folder) = &arguments.out {
        let stored = StoredStudy::new(&arguments.command(), cpu_hours, report.report.clone());
        write(folder, &stored)?;
    }
    match report.table.iter().filter(|row| !row.holds).count() + report.report.random.non_finite {
        0 => Ok(()),
        failed => Err(format!("{failed} hard case(s) or random scene(s) failed").into()),
    }
}

/// Writes the result and its picture.
fn write(folder: &Path, stored: &StoredStudy<StabilityReport>) -> Result<(), Failure> {
    let file = |extension: &str| folder.join(format!("stability.{extension}"));
    stored.write(&file("json"))?;
    let figure = stability_figure(stored);
    std::fs::write(file("svg"), figure_svg(&figure, Theme::Light, SIZE)?)?;
    figure_picture(&figure, Theme::Light, SIZE)?.save(&file("png"))?;
    note(&format!("written       {}, .svg and .png", file("json").display()));
    Ok(())
}

fn print(report: &Report) -> Result<(), Failure> {
    let cells: Vec<Vec<String>> = report.table.iter().map(cells_of).collect();
    table(&["case", "setting", "closest to its limit", "measured", "limit", ""], &cells)?;
    say("")?;
    print_chatter(&report.report)?;
    say("")?;
    print_random(&report.report.random)?;
    say("")?;
    say(format!("cost          {} h CPU", three_digits(report.cpu_hours)))
}

fn print_chatter(report: &StabilityReport) -> Result<(), Failure> {
    let rows: Vec<Vec<String>> = report
        .chatter
        .iter()
        .map(|row| {
            let counts =
                [row.grasps, row.changing, row.chattering, row.recomputed, row.remaining, row.chattering_stored];
            let names = [row.preset.clone(), row.accuracy.clone()];
            names.into_iter().chain(counts.map(|count| count.to_string())).collect()
        })
        .collect();
    let header = [
        "preset",
        "accuracy",
        "grasps",
        "changing",
        "chattering",
        "recomputed",
        "still restless",
        "chattering as stored",
    ];
    table(&header, &rows)
}

fn print_random(random: &RandomReport) -> Result<(), Failure> {
    let percent = |share: f64| three_digits(100.0 * share);
    say(format!("random scenes {} (seed {}), {} steps", random.scenes, random.seed, random.steps))?;
    say(format!("not finite    {} scenes", random.non_finite))?;
    say(format!("not converged {} steps", random.unconverged_steps))?;
    say(format!("Newton        {:.2} iterations per solve, {} at most", random.newton_mean, random.newton_max))?;
    let (p99, most) = (random.friction_residual_p99, random.friction_residual_max);
    say(format!("friction      residual {p99:.3} at the 99th percentile, {most:.3} at most"))?;
    let share = &random.no_answer_share;
    say(format!(
        "no answer     {} ({} %, {} to {}): a push of 1 um changes the end",
        random.no_answer,
        percent(share.estimate),
        percent(share.low),
        percent(share.high)
    ))?;
    say(format!(
        "undecided     {}: no two levels agree, or too costly; {} of them without a flag",
        random.undecided, random.undecided_unflagged
    ))?;
    say("")?;
    let accuracies: Vec<Vec<String>> = random
        .by_accuracy
        .iter()
        .map(|row| {
            let counts = [row.scenes, row.wrong, row.silent, row.silent_after_agreement].map(|count| count.to_string());
            [vec![row.accuracy.clone()], counts.to_vec(), vec![format!("{:.0}", row.solves)]].concat()
        })
        .collect();
    table(&["accuracy", "scenes", "wrong", "silently wrong", "until agreement", "solves per scene"], &accuracies)?;
    say("")?;
    let (header, rows) = policy_table(random);
    table(&header, &rows)?;
    say("")?;
    let flags: Vec<Vec<String>> =
        random.flags.iter().map(|row| vec![row.flag.clone(), percent(row.recall), percent(row.false_alarms)]).collect();
    table(&["flag", "wrong detected %", "false alarms %"], &flags)
}

fn cells_of(row: &CaseRow) -> Vec<String> {
    let verdict = if row.holds { "pass" } else { "FAIL" };
    let [what, measured, limit] = match (row.findings.first(), &row.not_finite) {
        (_, Some(body)) => [format!("{body} diverged"), String::new(), String::new()],
        (Some(finding), None) => {
            let limit = match finding.limit {
                Limit::AtMost(limit) => format!("<= {limit:.3e}"),
                Limit::AtLeast(limit) => format!(">= {limit:.3e}"),
            };
            [finding.what.clone(), format!("{:.3e}", finding.measured), limit]
        }
        (None, None) => [String::new(), String::new(), String::new()],
    };
    vec![row.case.clone(), row.setting.clone(), what, measured, limit, verdict.to_owned()]
}
