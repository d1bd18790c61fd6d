//! `palpate trials`: manages the store of trials.

mod import;
mod labels;
mod selection;
mod show;

use super::output::trials_target;
use super::prelude::*;
pub(super) use import::{MappingArguments, import_all};
use labels::LabelCommand;
use palpate_exchange::{CSV, TrialExport, format_of, write_lerobot};
use palpate_geometry::units::capital;
use palpate_lab::inspection::OpenOptions;
use palpate_learn::{Model, Models};
use palpate_store::labels::shown_title;
use palpate_store::{Library, Shown, StoreError, TrialColumn, TrialOrder, TrialPlace, TrialQuery, TrialRow};
use selection::{ChosenTrials, Filters, Numbers, chosen};
use std::io::IsTerminal as _;
use std::sync::Arc;

/// Arguments of `palpate trials`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate trials list --object lemon --since yesterday --quality sound
  palpate trials show 1
  palpate trials export 1 2 3 --out csv/
  palpate trials export 1 2 3 --out grasps.mcap
  palpate trials export 1 2 3 --taxels --out grasps.npz
  palpate trials export matching --preset B --as lerobot --out grasps/
  palpate trials import grasps.mcap
  palpate trials label 7 lemon
  palpate trials tag matching wet --add --search slipped
  palpate trials discard 7-9
  palpate trials keep 12
  palpate trials undo
  palpate trials merge part1.sqlite part2.sqlite --store set.sqlite

See also: palpate help store, palpate help formats")]
pub(super) struct TrialsArguments {
    #[command(subcommand)]
    command: TrialsCommand,
}

#[derive(Debug, clap::Subcommand)]
enum TrialsCommand {
    /// List trials, oldest first, by the filters of the library.
    List {
        #[command(flatten)]
        filters: Filters,
        /// List trials simulated for data sets and studies, too, which a list without filters leaves out.
        #[arg(long)]
        data_sets: bool,
        /// Include deleted trials.
        #[arg(long)]
        deleted: bool,
        /// Only deleted trials.
        #[arg(long, conflicts_with = "deleted")]
        discarded: bool,
        /// Column to sort by: id, object, date, source, preset, sensors, quality, tags, note or samples.
        #[arg(long, value_name = "COLUMN", default_value = "id")]
        sort: TrialColumn,
        /// Last first.
        #[arg(long)]
        reverse: bool,
        /// Print this many at most (default: all; on a terminal the newest 1000).
        #[arg(long, value_name = "N")]
        limit: Option<usize>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Show one trial: summary, effects, quality, labels.
    Show {
        /// Trial number.
        id: TrialId,
        /// Print JSON instead of text.
        #[arg(long)]
        json: bool,
    },
    #[command(flatten)]
    Labels(LabelCommand),
    /// Export trials as CSV files, or into one file of other programs: .mcap (ROS 2, Foxglove, PlotJuggler), .npz (numpy) or
    /// .parquet (where built with it); with --labelled, all labelled trials of the real gripper as a data set.
    Export {
        /// Trial numbers: 7, 3,7-9, or `matching` with filters.
        #[arg(required_unless_present = "labelled", value_name = "TRIALS")]
        ids: Vec<Numbers>,
        #[command(flatten)]
        filters: Filters,
        /// Export all labelled trials of the real gripper to a new folder: trials.csv (list), signals.csv (for `palpate trials
        /// import`) and raw/ (counts and bytes).
        #[arg(long, conflicts_with_all = ["ids", "layout", "signals", "unsound"])]
        labelled: bool,
        /// Folder, CSV file for a single trial, or a file of another format for any number.
        #[arg(long, value_name = "PATH", value_parser = trials_target())]
        out: PathBuf,
        #[command(flatten)]
        signals: SignalArguments,
        /// Data set to write into a folder instead of CSV files: version 3.0 of LeRobot's, with a card.
        #[arg(long = "as", value_name = "KIND", conflicts_with_all = ["labelled", "model"])]
        kind: Option<DataSetKind>,
        /// Write the force on every taxel of simulated trials as well, normal and shear: .npz, .parquet, .mcap and LeRobot.
        #[arg(long, conflicts_with = "labelled")]
        taxels: bool,
        /// Include trials that diverged, did not converge or did not come to rest.
        #[arg(long)]
        unsound: bool,
        /// Recognition model whose answers .mcap and .npz files hold (default: the shipped one).
        #[arg(long, value_name = "FILE", conflicts_with = "labelled")]
        model: Option<PathBuf>,
    },
    /// Import grasps from CSV, MCAP, NPZ or Parquet files: with the columns trial, label, t_s and any channels, or with other
    /// columns, whose roles the options or a profile give.
    #[command(after_help = import::EXAMPLES)]
    Import(import::ImportArguments),
    /// Copy trials from other stores into this one, without duplicates.
    Merge {
        /// Stores to copy from.
        #[arg(required = true, value_name = "FILE")]
        stores: Vec<PathBuf>,
    },
    /// Mark trials as deleted: lists and data sets exclude them; `restore` or `undo` brings them back.
    #[command(visible_alias = "discard")]
    Delete(ChosenTrials),
    /// Restore deleted trials.
    Restore(ChosenTrials),
    /// Remove all deleted trials permanently.
    Purge,
}

/// Data sets of other programs.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum DataSetKind {
    Lerobot,
}

pub(super) fn run(arguments: &TrialsArguments, store: Option<&Path>) -> Result<(), Failure> {
    let creates = matches!(arguments.command, TrialsCommand::Import(_) | TrialsCommand::Merge { .. });
    let mut store = match &arguments.command {
        _ if creates => open_store(store)?,
        TrialsCommand::List { json, .. } => match existing_store(store)? {
            Some(store) => store,
            None if *json => return say_json(&[(); 0]),
            None => return say(NONE_YET),
        },
        TrialsCommand::Export { labelled: true, .. } => {
            existing_store(store)?.ok_or("no trial has a label: there is no store yet")?
        }
        TrialsCommand::Show { .. } | TrialsCommand::Export { .. } => read_store(store)?,
        _ => store_to_change(store)?,
    };
    match &arguments.command {
        TrialsCommand::List { filters, data_sets, deleted, discarded, sort, reverse, limit, json } => {
            let shown = match (deleted, discarded) {
                (true, _) => Shown::All,
                (_, true) => Shown::Discarded,
                _ => Shown::Kept,
            };
            let order = TrialOrder { column: *sort, descending: *reverse };
            let query = TrialQuery { order, ..filters.query(shown) };
            // `matching` takes what a list with the same filters shows.
            let filtered = TrialQuery { shown: Shown::Kept, ..query.clone() }.is_filtered();
            let without_collected = !data_sets && !filtered;
            list(&store, &TrialQuery { without_collected, ..query }, *limit, *json)?.print(*json)
        }
        TrialsCommand::Show { id, json } => show::show(&store, *id, *json),
        TrialsCommand::Labels(command) => labels::run(command, &mut store),
        TrialsCommand::Export { labelled: true, out, .. } => labels::export(&store, out),
        TrialsCommand::Export { ids, filters, out, signals, kind, taxels, unsound, model, .. } => {
            let ids = &chosen(&store, ids, filters, Shown::Kept)?;
            let ids = if *unsound { ids.clone() } else { sound_ones(&store, ids)? };
            let sensors = signals.of_store(signals.view(), &store)?;
            let options = OpenOptions { sensors, ..OpenOptions::default() };
            export(&store, (&ids, *taxels), (out, *kind), options, model.as_deref())
        }
        TrialsCommand::Import(arguments) => import::run(arguments, &mut store),
        TrialsCommand::Merge { stores } => {
            for other in stores {
                let merged = store.merge_from(other).map_err(|error| nothing_added(other, &error))?;
                let (added, known) = (merged.added, merged.known);
                merged.warnings.iter().for_each(|warning| warn(warning));
                if !merged.damaged.is_empty() {
                    let (other, damaged) = (other.display(), numbers(&merged.damaged));
                    warn(&format!(
                        "{other}: left out because damaged: trial {damaged}; `palpate trials list --store {other}` shows what to do"
                    ));
                }
                say(format!("{}: {added} trial(s) added, {known} already there", other.display()))?;
                if merged.annotated > 0 {
                    warn(&format!(
                        "{}: {} known trial(s) have labels, notes, tags or corrected phases that were not merged; `palpate \
                         trials list --store {}` shows them",
                        other.display(),
                        merged.annotated,
                        other.display()
                    ));
                }
            }
            Ok(())
        }
        TrialsCommand::Delete(trials) => {
            let ids = trials.of(&store, Shown::Kept)?;
            store.delete(&ids)?;
            say(format!("deleted {} trial(s); `palpate trials restore` brings them back", ids.len()))
        }
        TrialsCommand::Restore(trials) => {
            let ids = trials.of(&store, Shown::Discarded)?;
            store.restore(&ids)?;
            say(format!("restored {} trial(s)", ids.len()))
        }
        TrialsCommand::Purge => {
            let warned = store.warnings().len();
            say(format!("removed {} trial(s) permanently", store.purge()?))?;
            store.warnings().iter().skip(warned).for_each(|warning| warn(warning));
            Ok(())
        }
    }
}

/// A file of which nothing came into the store.
fn nothing_added(file: &Path, error: &StoreError) -> String {
    format!("nothing was added from \"{}\": {error}", file.display())
}

fn numbers(ids: &[TrialId]) -> String {
    ids.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

const NONE_YET: &str = "no trials yet: `palpate grasp lemon` records one";

/// Most trials that a terminal shows without `--limit`.
const ON_TERMINAL: usize = 1000;

/// The rows to print: the first of a limit; without one all, but on a terminal only as many as can be looked through, from
/// the end with the newest.
fn shown_rows<T>(found: &[T], limit: Option<usize>, newest_first: bool, on_terminal: bool) -> &[T] {
    let most = limit.unwrap_or(if on_terminal { ON_TERMINAL } else { usize::MAX }).min(found.len());
    if limit.is_some() || newest_first { &found[..most] } else { &found[found.len() - most..] }
}

/// Output of `list --json`.
#[derive(Serialize)]
#[serde(transparent)]
struct ListReport {
    rows: Vec<TrialRow>,
    /// What is said where there are none.
    #[serde(skip)]
    none: &'static str,
}

fn list(store: &Store, query: &TrialQuery, limit: Option<usize>, json: bool) -> Result<ListReport, Failure> {
    let library = Library::read(store)?;
    let found = library.find(store, query)?;
    let on_terminal = std::io::stdout().is_terminal() && !json;
    let rows = shown_rows(&found, limit, query.order.descending, on_terminal);
    let hidden = match query.hides_collected() {
        true => library.find(store, &TrialQuery { without_collected: false, ..query.clone() })?.len() - found.len(),
        false => 0,
    };
    if hidden > 0 {
        note(&format!("{hidden} trial(s) of data sets are not listed; --data-sets lists them"));
    }
    if !json && !rows.is_empty() && rows.len() < found.len() {
        let all = if limit.is_none() { "; `palpate trials list | less` shows all" } else { "" };
        note(&format!("{} of {} trials{all}", rows.len(), found.len()));
    }
    let is_filtered = query.is_filtered() && library.counts().kept > 0;
    let none = match (is_filtered, hidden) {
        (true, _) => "no trial matches",
        (_, 0) => NONE_YET,
        _ => "no trials but those of data sets",
    };
    Ok(ListReport { rows: rows.iter().map(|trial| trial.row.clone()).collect(), none })
}

impl Report for ListReport {
    fn text(&self, page: &mut Page) {
        if self.rows.is_empty() {
            return page.line(self.none);
        }
        let row = |row: &TrialRow| {
            let [id, samples, seed] = [row.id.to_string(), row.samples.to_string(), row.seed.to_string()];
            let title = shown_title(&row.object);
            let title = if row.object.is_empty() { title } else { capital(&title) };
            [id, title, date(&row.created), row.gripper().to_owned(), samples, seed, remark(row)]
        };
        let header = ["id", "object", "recorded (UTC)", "gripper", "samples", "seed", ""];
        page.table(&header, self.rows.iter().map(row));
    }
}

fn remark(row: &TrialRow) -> String {
    let mut remarks = Vec::new();
    if row.damaged {
        remarks.push(format!("damaged: take the store from a backup, or `palpate trials delete {}`", row.id));
    }
    if row.deleted.is_some() {
        remarks.push("deleted".to_owned());
    }
    if row.place == TrialPlace::DemoLog {
        remarks.push(row.place.title().to_owned());
    }
    if row.state != "complete" {
        remarks.push("interrupted or still recording".to_owned());
    }
    if !row.sound && !row.damaged {
        remarks.push("unsound: data sets exclude it".to_owned());
    }
    if row.warnings > 0 {
        remarks.push(format!("{} warning(s)", row.warnings));
    }
    remarks.extend(row.flags.iter().map(|found| found.flag.label().to_owned()));
    if row.unsure {
        remarks.push("unsure".to_owned());
    }
    if !row.tags.is_empty() {
        remarks.push(format!("[{}]", row.tags.join(", ")));
    }
    if !row.note.is_empty() {
        remarks.push(format!("\"{}\"", row.note));
    }
    remarks.join(", ")
}

/// Excludes unsound trials.
fn sound_ones(store: &Store, ids: &[TrialId]) -> Result<Vec<TrialId>, Failure> {
    let (kept, left_out) = palpate_exchange::sound_ones(store, ids)?;
    if left_out.is_empty() {
        return Ok(kept);
    }
    let text = format!(
        "trial {} excluded: diverged, did not converge or did not come to rest (--unsound includes it)",
        numbers(&left_out)
    );
    if kept.is_empty() {
        return Err(text.into());
    }
    warn(&text);
    Ok(kept)
}

fn export(
    store: &Store,
    (ids, taxels): (&[TrialId], bool),
    (out, kind): (&Path, Option<DataSetKind>),
    mut options: OpenOptions,
    model: Option<&Path>,
) -> Result<(), Failure> {
    let format = format_of(out).unwrap_or(CSV);
    if kind.is_some() && out.extension().is_some() && !out.is_dir() {
        return Err(format!("\"{}\" has an ending, but a data set is a folder: --out FOLDER", out.display()).into());
    }
    if kind.is_none() && format.kind() != FileKind::Csv {
        check_new(out, format.kind())?;
        options.models = match model {
            Some(path) => Models::all(&Arc::new(Model::load(path)?)),
            None => Models::shipped()?,
        };
    }
    let stop = stop_flag()?;
    let is_stopped = || stop.load(Ordering::Relaxed);
    let export = TrialExport { store, ids, options: &options, taxels, is_stopped: &is_stopped };
    let written = match kind {
        Some(DataSetKind::Lerobot) => write_lerobot(&export, out),
        None => format.write(&export, out),
    }?;
    written.left_out.iter().for_each(|(_, why)| warn(why));
    written.files.iter().try_for_each(|file| say(file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_shows_the_newest_thousand_and_a_pipe_everything() {
        let found: Vec<u32> = (1..=2500).collect();
        let reversed: Vec<u32> = found.iter().rev().copied().collect();
        assert_eq!(shown_rows(&found, None, false, true), &found[1500..]);
        assert_eq!(shown_rows(&reversed, None, true, true), &reversed[..1000]);
        assert_eq!(shown_rows(&found, None, false, false), &found);
        assert_eq!(shown_rows(&found, Some(2000), false, true), &found[..2000]);
        assert_eq!(shown_rows(&found[..3], None, false, true), &found[..3]);
    }
}
