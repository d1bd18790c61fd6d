//! The paper's studies: one subcommand for each, from the table of studies, and `all`.

use super::super::Failure;
use super::super::interrupt::stop_flag;
use super::super::learning::{QueryArguments, parse_sensors};
use super::super::output::file_or_folder;
use super::super::setup::open_store;
use super::super::terminal::{note, say, say_json, table};
use super::files::note_stopped;
use clap::{ArgMatches, Args as _, Command, FromArgMatches, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_geometry::palette::Theme;
use palpate_lab::datasets::DatasetQuery;
use palpate_lab::study::StoredStudy;
use palpate_lab::study::paper::{
    Cell, Finding, PAPER_STUDIES, PaperStudy, STUDY_PRESET, StudyBench, StudyCard, StudyColumn, StudyFolder, StudyPlan,
    StudyProgress, StudyReport, StudyRow, StudySize, StudyStep, StudyTable, StudyWork, paper_study, run_study,
};
use palpate_render::figure_svg;
use palpate_tactile::model::SensorModel;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Arguments of every study of the paper.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct PaperArguments {
    /// Take less than a minute for each study: fewer grasps, small networks, few epochs.
    #[arg(long)]
    quick: bool,
    /// Sensor model of simulated grasps: virtual or physical-like (default: both; virtual for stored trials).
    #[arg(long, value_name = "MODEL", value_parser = parse_sensors)]
    sensors: Option<SensorModel>,
    #[command(flatten)]
    trials: QueryArguments,
    /// Random seed of fits and splits.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for results, which the same command continues, tables (CSV) and figures (SVG) (default: palpate-studies,
    /// with --quick palpate-studies-quick).
    #[arg(long, value_name = "DIR", value_parser = file_or_folder(&[]))]
    out: Option<PathBuf>,
    /// Number of threads (default: one per core). The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

/// A study by its key, or all of them.
#[derive(Clone, Debug)]
pub(super) struct PaperCommand {
    /// None for all studies.
    key: Option<String>,
    arguments: PaperArguments,
}

const ALL: &str = "all";

/// Where the grasps of a study come from.
const GRASPS: &str =
    "Grasps: simulated, with --preset in the poses of that preset; any other filter reads stored trials.";

/// Subcommands, one for each study.
fn subcommands() -> Vec<Command> {
    let of = |name: &'static str, about: String, examples: String| {
        PaperArguments::augment_args(Command::new(name)).about(about).after_help(format!("{GRASPS}\n\n{examples}"))
    };
    let studies = PAPER_STUDIES.iter().map(|study| {
        let StudyCard { key, title, about, budget, .. } = study.card();
        let examples = format!(
            "Cost: {budget}, with --quick less than a minute. Ctrl+C stops; the same command resumes.\n\nExamples:\n  palpate study \
             {key} --quick\n  palpate study {key} --out studies/\n  palpate study {key} --preset A --sensors physical-like\n  \
             palpate study {key} --source serial --json\n\nSee also: palpate help studies"
        );
        of(key, format!("{title} ({}): {about}.", study.card().origin()), examples)
    });
    let all = of(
        ALL,
        "Run all studies of the paper, one after the other.".to_owned(),
        "Cost: about 9 CPU hours, with --quick a few minutes. Ctrl+C stops; the same command resumes.\n\nExamples:\n  palpate study all \
         --quick\n  palpate study all --out studies/\n\nSee also: palpate help studies"
            .to_owned(),
    );
    studies.chain([all]).collect()
}

impl FromArgMatches for PaperCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let missing = || clap::Error::new(clap::error::ErrorKind::MissingSubcommand);
        let (name, own) = matches.subcommand().ok_or_else(missing)?;
        let key = (name != ALL).then(|| name.to_owned());
        Ok(Self { key, arguments: PaperArguments::from_arg_matches(own)? })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Subcommand for PaperCommand {
    fn augment_subcommands(command: Command) -> Command {
        command.subcommands(subcommands())
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        name == ALL || paper_study(name).is_some()
    }
}

impl PaperArguments {
    fn plan(&self) -> StudyPlan {
        let size = if self.quick { StudySize::Quick } else { StudySize::Full };
        // A preset alone names poses to simulate; anything more asks for stored trials.
        let query = self.trials.query(false, None);
        let simulated = DatasetQuery { preset: query.preset.clone(), ..DatasetQuery::default() };
        let preset = query.preset.clone().map_or_else(|| STUDY_PRESET.to_owned(), |name| name.to_uppercase());
        let query = (query != simulated).then_some(query);
        let usual = StudyPlan::of_size(size);
        // Recorded trials have the sensors that they have.
        let sensors = match (self.sensors, &query) {
            (Some(sensors), _) => vec![sensors],
            (None, Some(_)) => vec![SensorModel::Virtual],
            (None, None) => usual.sensors.clone(),
        };
        StudyPlan { preset, sensors, query, seed: self.seed, ..usual }
    }

    fn folder(&self) -> StudyFolder {
        let named = || PathBuf::from(format!("palpate-studies{}", if self.quick { "-quick" } else { "" }));
        StudyFolder::new(self.out.clone().unwrap_or_else(named))
    }
}

pub(super) fn run(command: &PaperCommand, store: Option<&Path>) -> Result<(), Failure> {
    let PaperCommand { key, arguments } = command;
    let studies = PAPER_STUDIES.iter().filter(|study| key.as_ref().is_none_or(|key| study.card().key == key));
    let (plan, folder) = (arguments.plan(), arguments.folder());
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let stop = stop_flag()?;
    let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template("{msg} {bar:40} {pos}/{len} {eta} left")?);
    let progress = |progress: StudyProgress| {
        let what = match progress.step {
            StudyStep::Collecting => "collecting",
            StudyStep::Measuring => "measuring",
        };
        bar.set_message(what);
        bar.set_length(progress.of as u64);
        bar.set_position(progress.done as u64);
    };
    let threads = arguments.threads.map_or_else(cores, usize::from);
    let bench =
        StudyBench::new(open_store(store)?, &plan, StudyWork { threads, cancelled: &stop, progress: &progress });
    let mut reports = Vec::new();
    for study in studies {
        let key = study.card().key;
        bar.reset();
        let outcome = run_study(*study, &bench, Some(&folder.units(key)));
        bar.finish_and_clear();
        let Some(stored) = outcome? else {
            note_stopped(&format!("a part of {key}"));
            return Ok(());
        };
        let written = write(*study, &stored, &folder)?;
        if arguments.json {
            reports.push((key, stored));
        } else {
            print(*study, &stored, arguments.quick)?;
            say(format!("\n{}. {written}\n", stored.cpu_time()))?;
        }
    }
    match (reports.as_slice(), key) {
        ([(_, only)], Some(_)) => say_json(only),
        ([], _) => Ok(()),
        (several, _) => say_json(&several.iter().map(|(key, stored)| (*key, stored)).collect::<BTreeMap<_, _>>()),
    }
}

/// Writes a study's result, its tables and figures; returns a sentence that names the files.
fn write(study: &dyn PaperStudy, stored: &StoredStudy<StudyReport>, folder: &StudyFolder) -> Result<String, Failure> {
    let names = folder.write(study, stored, &|linked| {
        figure_svg(&linked.figure, Theme::Light, linked.size).map_err(std::io::Error::other)
    })?;
    Ok(format!("Written to {}: {}", folder.path().display(), names.join(", ")))
}

fn print(study: &dyn PaperStudy, stored: &StoredStudy<StudyReport>, quick: bool) -> Result<(), Failure> {
    let card = study.card();
    say(format!("{} ({})", card.title, card.origin()))?;
    for line in &stored.result.data {
        say(format!("  {line}"))?;
    }
    for table in &stored.result.tables {
        print_table(table)?;
    }
    stored.result.findings.iter().try_for_each(print_finding)?;
    if quick {
        note("a quick study: do not quote its numbers");
    }
    Ok(())
}

/// A claim, the verdict, and the numbers around the line that decides.
fn print_finding(finding: &Finding) -> Result<(), Failure> {
    say(format!("\n[{}] {}: {}", finding.verdict.name(), finding.section, finding.claim))?;
    say(format!("  {}", finding.found))?;
    let rows: Vec<Vec<String>> = finding
        .strips()
        .map(|(own, strip)| {
            let line = Cell::Number(own.line).shown(&own.unit);
            vec![format!("  {}", own.what), own.shown(), line, strip.to_string()]
        })
        .collect();
    if !rows.is_empty() {
        table(&["  measured", "value", "line", "around the line"], &rows)?;
    }
    finding.left_out().map_or(Ok(()), |more| say(format!("  {more}")))?;
    say(format!("  {}", finding.why))
}

/// Rows of long tables that are printed; the files have all.
const MOST_ROWS: usize = 60;

fn print_table(of: &StudyTable) -> Result<(), Failure> {
    say(format!("\n{}", of.title))?;
    let header: Vec<String> = of.columns.iter().map(StudyColumn::titled).collect();
    let row = |row: &StudyRow| -> Vec<String> {
        row.cells.iter().zip(&of.columns).map(|(cell, column)| cell.shown(&column.unit)).collect()
    };
    let rows: Vec<Vec<String>> = of.rows.iter().take(MOST_ROWS).map(row).collect();
    table(&header.iter().map(String::as_str).collect::<Vec<_>>(), &rows)?;
    match of.rows.len().saturating_sub(MOST_ROWS) {
        0 => Ok(()),
        more => say(format!("and {more} more rows in {}.csv", of.name)),
    }
}
