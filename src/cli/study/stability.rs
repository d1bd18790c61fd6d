//! `palpate study stability`: the hard-case table and the random scenes.

use super::super::Failure;
use super::super::terminal::{say, say_json, table};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_lab::study::stability::{ACCURACIES, CASES, CaseRow, Limit, QUICK_ACCURACIES, RandomReport, random_scenes};
use serde::Serialize;

/// Arguments of `palpate study stability`.
#[derive(Debug, clap::Args)]
pub(super) struct StabilityArguments {
    /// Seconds instead of minutes: draft and standard only, short runs, few random steps.
    #[arg(long)]
    quick: bool,
    /// Random steps, before the finer ones that check them (default: 1000000, with --quick 20000).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    steps: Option<u64>,
    /// Other seeds give other random scenes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    /// Cases by settings.
    table: Vec<CaseRow>,
    random: RandomReport,
    /// Share of the random scenes that have a right answer and were silently given another.
    silently_wrong_rate: f64,
}

const STEPS: u64 = 1_000_000;
const QUICK_STEPS: u64 = 20_000;

pub(super) fn run(arguments: &StabilityArguments) -> Result<(), Failure> {
    // It draws on standard error, and only on a terminal.
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg} {eta} left")?;
    let bar = ProgressBar::new(0).with_style(style);
    let accuracies = if arguments.quick { QUICK_ACCURACIES } else { &ACCURACIES };
    let thorough = !arguments.quick;
    let plan: Vec<_> = CASES
        .iter()
        .flat_map(|case| case.settings(accuracies, thorough).into_iter().map(move |setting| (case, setting)))
        .collect();
    bar.set_length(plan.len() as u64);
    let mut rows = Vec::new();
    for (case, setting) in plan {
        bar.set_message(format!("{}, {}", case.name, setting.name()));
        rows.push(case.run(setting, thorough));
        bar.inc(1);
    }
    let steps = arguments.steps.unwrap_or(if arguments.quick { QUICK_STEPS } else { STEPS });
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    bar.set_message("random scenes");
    let random = random_scenes(arguments.seed, steps, threads, &|done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let report = Report { silently_wrong_rate: random.silently_wrong_rate(), table: rows, random };
    if arguments.json {
        say_json(&report)?;
    } else {
        tell(&report)?;
    }
    match report.table.iter().filter(|row| !row.holds).count() + report.random.non_finite {
        0 => Ok(()),
        failed => Err(format!("{failed} hard case(s) or random scene(s) do not hold").into()),
    }
}

fn tell(report: &Report) -> Result<(), Failure> {
    let cells: Vec<Vec<String>> = report.table.iter().map(cells_of).collect();
    table(&["case", "setting", "nearest its limit", "measured", "limit", ""], &cells)?;
    let random = &report.random;
    say("")?;
    say(format!("random scenes {} of seed {}, {} steps", random.scenes, random.seed, random.steps))?;
    say(format!("              {} steps more to check them at h/4", random.finer_steps))?;
    say(format!("not finite    {} scenes", random.non_finite))?;
    say(format!("not converged {} steps", random.missed_steps))?;
    say(format!("Newton        {:.2} iterations per step, {} at most", random.newton_mean, random.newton_max))?;
    let (p99, most) = (random.friction_residual_p99, random.friction_residual_max);
    say(format!("friction      residual {p99:.3} at the 99th percentile, {most:.3} at most"))?;
    let (wrong, no_answer) = (random.wrong, random.no_answer);
    say(format!("answers       {wrong} change at h/4, {no_answer} of these with a push of 1 um as well"))?;
    let rate = 100.0 * report.silently_wrong_rate;
    say(format!("silently      {} wrong ({rate:.2} % of those that have an answer)", random.silently_wrong))?;
    say("")?;
    let mut shortest = 0.0;
    let steps: Vec<Vec<String>> = random
        .by_step
        .iter()
        .map(|row| {
            let range = format!("{:.1} .. {:.1}", shortest * 1e3, row.longest_s * 1e3);
            shortest = row.longest_s;
            let counts = [row.scenes, row.wrong, row.no_answer, row.silently_wrong].map(|count| count.to_string());
            [vec![range], counts.to_vec()].concat()
        })
        .collect();
    table(&["step ms", "scenes", "change at h/4", "no answer", "silently wrong"], &steps)?;
    say("")?;
    let flags: Vec<Vec<String>> = random
        .flags
        .iter()
        .map(|row| {
            let percent = |share: f64| format!("{:.1}", 100.0 * share);
            vec![row.flag.clone(), percent(row.recall), percent(row.false_alarms)]
        })
        .collect();
    table(&["flag", "wrong caught %", "right suspected %"], &flags)
}

fn cells_of(row: &CaseRow) -> Vec<String> {
    let verdict = if row.holds { "holds" } else { "FAILS" };
    let [what, measured, limit] = match (row.findings.first(), &row.not_finite) {
        (_, Some(body)) => [format!("{body} left the range of numbers"), String::new(), String::new()],
        (Some(finding), None) => {
            let limit = match finding.limit {
                Limit::AtMost(limit) => format!("<= {limit:.3e}"),
                Limit::AtLeast(limit) => format!(">= {limit:.3e}"),
            };
            [finding.what.clone(), format!("{:.3e}", finding.measured), limit]
        }
        (None, None) => [String::new(), String::new(), String::new()],
    };
    vec![row.case.to_owned(), row.setting.clone(), what, measured, limit, verdict.to_owned()]
}
