//! `palpate study stability`: hard cases, holds that chatter, and random scenes.

use super::super::Failure;
use super::super::terminal::{say, say_json, table};
use super::files::{StudyOutput, note_stopped};
use palpate_geometry::units::three_digits;
use palpate_lab::study::stability::{
    CaseRow, RandomReport, StabilityPlan, StabilityReport, policy_table, stability_figure,
};
use palpate_lab::study::{StoredStudy, StudyCommand};
use serde::Serialize;

/// Arguments of `palpate study stability`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study stability --quick
  palpate study stability --out stability/
  palpate study stability --scenes 500 --grasps 200 --seed 2 --json

See also: palpate help stability")]
pub(super) struct StabilityArguments {
    /// Take a minute instead of hours: draft and standard only, short runs, few grasps and random scenes.
    #[arg(long)]
    quick: bool,
    /// Number of random scenes (default: 2000, with --quick 5).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    scenes: Option<u64>,
    /// Grasps of each preset at draft and at standard that are searched for chatter (default: 1000, with --quick 16).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    grasps: Option<u32>,
    /// Random seed of the scenes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    output: StudyOutput,
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
    fn command(&self) -> StudyCommand {
        StudyCommand::new("stability")
            .flag("quick", self.quick)
            .option("scenes", self.scenes)
            .option("grasps", self.grasps)
            .option("seed", (self.seed != 1).then_some(self.seed))
    }
}

pub(super) fn run(arguments: &StabilityArguments) -> Result<(), Failure> {
    let plan = arguments.plan();
    let folder = arguments.output.folder("stability", arguments.quick);
    let mut results = plan.results(&folder.units("stability"))?;
    let finished = arguments.output.run(|how| plan.run(&mut results, how))??;
    let cpu_hours = results.cpu_hours();
    if !finished {
        note_stopped(&format!("{cpu_hours:.2} CPU hours"));
        return Ok(());
    }
    let stored = StoredStudy::new(arguments.command().text(), cpu_hours, plan.report(&results));
    let written = folder.write("stability", &stored, &stability_figure(&stored))?;
    let cpu_time = stored.cpu_time();
    let report = Report { table: plan.case_rows(&results), report: stored.result, cpu_hours };
    if arguments.json {
        say_json(&report)?;
    } else {
        print(&report)?;
        say(format!("{cpu_time}. {written}"))?;
    }
    match report.table.iter().filter(|row| !row.holds).count() + report.report.random.non_finite {
        0 => Ok(()),
        failed => Err(format!("{failed} hard case(s) or random scene(s) failed").into()),
    }
}

fn print(report: &Report) -> Result<(), Failure> {
    let cells: Vec<Vec<String>> = report.table.iter().map(cells_of).collect();
    table(&["case", "setting", "closest to its limit", "measured", "limit", ""], &cells)?;
    say("")?;
    print_chatter(&report.report)?;
    say("")?;
    print_random(&report.report.random)?;
    say("")
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
            let after = row.silent_after_agreement.map_or_else(String::new, |count| count.to_string());
            let counts = [row.scenes, row.wrong, row.silent].map(|count| count.to_string());
            let solves = if row.scenes > 0 { format!("{:.0}", row.solves) } else { String::new() };
            [vec![row.accuracy.clone()], counts.to_vec(), vec![after, solves]].concat()
        })
        .collect();
    table(&["accuracy", "scenes", "wrong", "silently wrong", "three agree", "solves per scene"], &accuracies)?;
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
        (Some(finding), None) => [finding.what.clone(), format!("{:.3e}", finding.measured), finding.limit.to_string()],
        (None, None) => [String::new(), String::new(), String::new()],
    };
    vec![row.case.clone(), row.setting.clone(), what, measured, limit, verdict.to_owned()]
}
