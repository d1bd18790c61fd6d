//! What all studies share: where they write, their threads and progress, and how their results are printed.

use super::super::prelude::*;
use super::super::setup::threads;
use super::super::terminal::table;
use palpate_geometry::palette::Theme;
use palpate_lab::grasping::Shard;
use palpate_render::figure_svg;
use palpate_study::paper::paper_study;
use palpate_study::{
    Cell, Experiment, Finding, LinkedFigure, Measuring, StoredStudy, StudyFolder, StudyOutcome, StudyProgress,
    StudyReport, StudyTable, cpu_cost, run_experiment, study_title,
};
use serde::de::DeserializeOwned;

/// Where a study writes, its threads, and the form of its output.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct StudyOutput {
    /// Folder for results, which the same command continues, tables (CSV) and figures (SVG) (default: palpate-studies,
    /// with --quick palpate-studies-quick).
    #[arg(long, value_name = "DIR", value_parser = file_or_folder(&[]))]
    out: Option<PathBuf>,
    /// Number of threads (default: one per core). The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Measure only part K of N, for several machines; `palpate study merge` joins the parts.
    #[arg(long, value_name = "K/N", default_value_t = Shard::WHOLE, hide_default_value = true)]
    pub(super) shard: Shard,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    pub(super) json: bool,
}

impl StudyOutput {
    pub(super) fn threads(&self) -> usize {
        threads(self.threads)
    }

    pub(super) fn folder(&self, quick: bool) -> StudyFolder {
        let named = || PathBuf::from(if quick { "palpate-studies-quick" } else { "palpate-studies" });
        StudyFolder::new(self.out.clone().unwrap_or_else(named))
    }

    /// Runs a study under a progress bar until it ends or Ctrl+C stops it, writes its files and prints it, unless as JSON.
    pub(super) fn run<E: Experiment>(
        &self,
        experiment: &E,
        quick: bool,
    ) -> Result<Option<StoredStudy<E::Report>>, Failure> {
        let (stop, bar) = (stop_flag()?, Progress::new(BAR));
        let progress = |own: StudyProgress| bar.show(own.done, own.of);
        let how = Measuring { threads: self.threads(), cancelled: &stop, progress: &progress };
        let (folder, key) = (self.folder(quick), experiment.key());
        let part = folder.part(key, self.shard);
        let outcome = run_experiment(experiment, &how, Some(&part), self.shard)?;
        drop(bar);
        let Some(stored) = whole(key, &part, outcome, "")? else { return Ok(None) };
        let (shown, figures) = (E::shown(&stored.result), E::figures(&stored.result));
        let title = study_title(key).unwrap_or(key);
        self.show(&folder, (key, title, quick), &stored, &shown, figures)?;
        Ok(Some(stored))
    }

    /// Writes the files of a study and prints it, unless as JSON.
    pub(super) fn show<R: Serialize + DeserializeOwned>(
        &self,
        folder: &StudyFolder,
        (key, title, quick): (&str, &str, bool),
        stored: &StoredStudy<R>,
        shown: &StudyReport,
        figures: Vec<LinkedFigure>,
    ) -> Result<(), Failure> {
        let draw = |linked: &LinkedFigure| {
            figure_svg(&linked.figure, Theme::Light, linked.size).map_err(std::io::Error::other)
        };
        let names = folder.write(key, stored, &shown.tables, figures, &draw)?;
        if self.json {
            return Ok(());
        }
        say(title)?;
        shown.data.iter().try_for_each(|line| say(format!("  {line}")))?;
        shown.tables.iter().try_for_each(print_table)?;
        shown.findings.iter().try_for_each(print_finding)?;
        if quick {
            note("a quick study: do not quote its numbers");
        }
        let written = format!("Written to {}: {}", folder.path().display(), names.join(", "));
        let grasps = if paper_study(key).is_some() { ", beside the simulated grasps" } else { "" };
        say(format!("\n{}{grasps}. {written}\n", cpu_cost(stored.cpu_hours)))
    }
}

/// Progress of a study.
pub(super) const BAR: &str = "{msg} {bar:40} {pos}/{len} {eta} left";

/// The result of a whole study; of a part none, and a note. Fails where it was stopped; the error ends with what is `kept`.
pub(super) fn whole<R>(
    key: &str,
    part: &Path,
    outcome: StudyOutcome<R>,
    kept: &str,
) -> Result<Option<StoredStudy<R>>, Failure> {
    match &outcome {
        StudyOutcome::Stopped => {
            return Err(format!("stopped after a part of {key}; the same command continues here{kept}").into());
        }
        StudyOutcome::Part(units) => note(&format!(
            "{units} units of {key} are in {}; `palpate study merge` joins the files of all parts",
            part.display()
        )),
        StudyOutcome::Whole(_) => {}
    }
    Ok(outcome.whole())
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

pub(super) fn print_table(of: &StudyTable) -> Result<(), Failure> {
    let (header, mut rows) = of.shown();
    let more = rows.len().saturating_sub(MOST_ROWS);
    rows.truncate(MOST_ROWS);
    say(format!("\n{}", of.title))?;
    table(&header.iter().map(String::as_str).collect::<Vec<_>>(), &rows)?;
    if more > 0 { say(format!("and {more} more rows in {}.csv", of.name)) } else { Ok(()) }
}
