//! LeRobot data sets, version 3.0: a folder of Parquet tables and JSON, each trial an episode. Source: the package `lerobot`
//! 0.4.4, and <https://huggingface.co/docs/lerobot/lerobot-dataset-v3>.
//!
//! | file | content |
//! |---|---|
//! | `meta/info.json`, `meta/stats.json` | features and counts; statistics of each feature |
//! | `meta/tasks.parquet` | labels, which are the tasks |
//! | `meta/episodes/chunk-000/file-000.parquet` | length, task, place and statistics of each episode |
//! | `data/chunk-000/file-000.parquet` | a row for each frame; further files after 100 MB |
//! | `README.md` | card of the data set |
//!
//! Episodes are alike: they hold the channels that all trials have, at the median rate of their samples, and every number is
//! finite. A frame holds the last sample until its time.

use crate::card::data_set_card;
use crate::content::{TrialContent, channels_of, common_pads};
use crate::format::{ExchangeError, TrialExport, TrialFormat as _, Written, new_folder};
use crate::parquet::Parquet;
use crate::parquet_table::{Cells, Columns, TableWriter};
use ::parquet::errors::ParquetError;
use palpate_lab::inspection::Column;
use palpate_store::NewFile;
use palpate_store::labels::shown_name;
use palpate_tactile::trial::TrialSource;
use serde_json::{Value, json};
use std::path::Path;

/// Version of the format.
const VERSION: &str = "v3.0";
/// Size from which on a further file of data begins (MB), and files in a folder.
const FILE_MEGABYTES: usize = 100;
const CHUNK_FILES: usize = 1000;
/// Most frames of a data set.
const MOST_FRAMES: usize = 10_000_000;
/// Unit of the channels that tell how the fingers are bent.
const BENT: &str = "1/m";
/// Times that differ by less are the same (s).
const SAME_S: f64 = 1e-6;

/// Writes trials as a data set into a folder that is empty or does not exist.
pub fn write_lerobot(export: &TrialExport<'_>, folder: &Path) -> Result<Written, ExchangeError> {
    let new = new_folder(folder)?;
    let trials = export.contents()?.collect::<Result<Vec<_>, _>>()?;
    let set = DataSet::of(&trials, export.taxels)?;
    let written = set.write(new.unfinished()).and_then(|()| Ok(new.finish()?));
    written.map_err(|cause| ExchangeError::cannot_write(folder, &cause))?;
    Ok(Written::whole(folder))
}

/// Trials as episodes.
struct DataSet<'a> {
    trials: &'a [TrialContent],
    /// Frames in a second.
    fps: u32,
    /// Channels that all trials have: how the fingers are bent, and what they touch.
    state: Vec<&'a str>,
    tactile: Vec<&'a str>,
    /// The line pressure of all trials is known.
    has_action: bool,
    /// Fingers, rows and columns of taxels, where forces on these are written.
    pads: Option<[usize; 3]>,
    tasks: Vec<&'a str>,
}

impl<'a> DataSet<'a> {
    fn of(trials: &'a [TrialContent], taxels: bool) -> Result<Self, ExchangeError> {
        if taxels && let Some(other) = trials.iter().find(|trial| trial.simulated().is_none()) {
            let text =
                format!("trial {} has no taxels, and all episodes have to be alike; leave it out", other.open.id);
            return Err(ExchangeError::Refused(text));
        }
        let shared = |name: &str| trials.iter().all(|trial| channel(trial, name).is_some());
        let mut channels = channels_of(trials);
        channels.retain(|(name, _)| shared(name));
        if channels.is_empty() {
            let text = "there is no channel that all of these trials have; export trials of one gripper together";
            return Err(ExchangeError::Refused(text.to_owned()));
        }
        let (state, tactile): (Vec<_>, Vec<_>) = channels.into_iter().partition(|(_, unit)| *unit == BENT);
        let names = |channels: Vec<(&'a str, &str)>| channels.into_iter().map(|(name, _)| name).collect();
        let mut tasks: Vec<&str> = Vec::new();
        for task in trials.iter().map(task_of) {
            if !tasks.contains(&task) {
                tasks.push(task);
            }
        }
        let set = Self {
            trials,
            fps: frame_rate(trials),
            state: names(state),
            tactile: names(tactile),
            has_action: trials.iter().all(|trial| trial.samples.iter().all(|k| trial.open.line_bar[*k].is_finite())),
            pads: if taxels { Some(common_pads(trials)?) } else { None },
            tasks,
        };
        let frames = trials.iter().fold(0, |all: usize, trial| all.saturating_add(set.frame_count(trial)));
        if frames > MOST_FRAMES {
            let text =
                format!("it would have {frames} frames, more than {MOST_FRAMES}; export trials without long pauses");
            return Err(ExchangeError::Refused(text));
        }
        Ok(set)
    }

    fn frame_count(&self, trial: &TrialContent) -> usize {
        let (Some(first), Some(last)) = (trial.samples.first(), trial.samples.last()) else { return 0 };
        let seconds = trial.open.t_s[*last] - trial.open.t_s[*first] + SAME_S;
        ((seconds * f64::from(self.fps)) as usize).saturating_add(1)
    }

    /// Samples of a trial at its frames.
    fn frames_of(&self, trial: &TrialContent) -> Vec<usize> {
        let t_s = |k: &usize| trial.open.t_s[*k];
        let sample = |frame: usize| {
            let until = t_s(&trial.samples[0]) + frame as f64 / f64::from(self.fps) + SAME_S;
            trial.samples[trial.samples.partition_point(|k| t_s(k) <= until).saturating_sub(1)]
        };
        (0..self.frame_count(trial)).map(sample).collect()
    }

    /// Columns of an episode, of which `before` frames precede it.
    fn columns(&self, episode: usize, before: usize) -> Columns {
        let trial = &self.trials[episode];
        let frames = self.frames_of(trial);
        let mut columns: Vec<(&str, Cells)> = Vec::new();
        for (name, channels) in [("observation.state", &self.state), ("observation.tactile", &self.tactile)] {
            if !channels.is_empty() {
                columns.push((name, vectors(readings(trial, &frames, channels), channels.len(), frames.len())));
            }
        }
        if let Some(pads) = self.pads {
            let count = pads.iter().product();
            let (mut normal, mut shear) = (Vec::new(), Vec::new());
            for [own, along, across] in trial.taxel_forces(frames.iter().copied()) {
                normal.push(own);
                shear.extend([along, across]);
            }
            columns.push((TAXELS[0], vectors(normal, count, frames.len())));
            columns.push((TAXELS[1], vectors(shear, 2 * count, frames.len())));
        }
        if self.has_action {
            columns.push(("action", Cells::Small(frames.iter().map(|k| trial.open.line_bar[*k] as f32).collect())));
        }
        let task = self.tasks.iter().position(|task| *task == task_of(trial)).unwrap_or(0);
        let whole = |number: usize| Cells::Whole(vec![number as i64; frames.len()]);
        let count = |from: usize| Cells::Whole((from..from + frames.len()).map(|frame| frame as i64).collect());
        let seconds = (0..frames.len()).map(|frame| (frame as f64 / f64::from(self.fps)) as f32);
        columns.extend([
            ("timestamp", Cells::Small(seconds.collect())),
            ("frame_index", count(0)),
            ("episode_index", whole(episode)),
            ("index", count(before)),
            ("task_index", whole(task)),
        ]);
        columns.into_iter().map(|(name, cells)| (name.to_owned(), cells)).collect()
    }

    /// Writes all files.
    fn write(&self, folder: &Path) -> Result<(), ParquetError> {
        let mut episodes: Vec<Episode> = Vec::new();
        let (mut place, mut bytes, mut before) = ([0; 2], 0, 0);
        let mut table: Option<TableWriter> = None;
        let mut widths: Vec<(String, usize)> = Vec::new();
        for episode in 0..self.trials.len() {
            let columns = self.columns(episode, before);
            let frames = self.frames_of(&self.trials[episode]).len();
            let numbers: Vec<(&str, Vec<f64>)> =
                columns.iter().map(|(name, cells)| (name.as_str(), cells.numbers())).collect();
            let size = 4 * numbers.iter().map(|(_, numbers)| numbers.len()).sum::<usize>();
            if bytes > 0 && bytes + size > FILE_MEGABYTES << 20 {
                table.take().map_or(Ok(()), TableWriter::finish)?;
                place = if place[1] + 1 == CHUNK_FILES { [place[0] + 1, 0] } else { [place[0], place[1] + 1] };
                bytes = 0;
            }
            bytes += size;
            let own = match &mut table {
                Some(own) => own,
                None => table.insert(TableWriter::create(new_table(folder, "data", place)?, &columns, [])?),
            };
            own.write(&columns)?;
            let stats = numbers.iter().map(|(name, numbers)| ((*name).to_owned(), Stats::of(numbers, frames)));
            episodes.push(Episode { place, frames: [before, before + frames], stats: stats.collect() });
            let width = |numbers: &[f64]| numbers.len().checked_div(frames).unwrap_or(1);
            widths = numbers.iter().map(|(name, numbers)| ((*name).to_owned(), width(numbers))).collect();
            before += frames;
        }
        table.map_or(Ok(()), TableWriter::finish)?;
        self.write_meta(folder, &episodes, &widths)
    }

    fn write_meta(&self, folder: &Path, episodes: &[Episode], widths: &[(String, usize)]) -> Result<(), ParquetError> {
        let (stats, of_episodes) = (statistics(episodes), self.episodes(episodes));
        let mut table = TableWriter::create(new_table(folder, "meta/episodes", [0, 0])?, &of_episodes, [])?;
        table.write(&of_episodes)?;
        table.finish()?;
        let tasks: Columns = vec![
            ("task_index".to_owned(), Cells::Whole((0..self.tasks.len() as i64).collect())),
            (INDEX.to_owned(), Cells::Text(self.tasks.iter().map(|task| (*task).to_owned()).collect())),
        ];
        let file = NewFile::create(&folder.join("meta/tasks.parquet"), Parquet.kind())?;
        let mut table = TableWriter::create(file, &tasks, [("pandas", pandas_index().to_string())])?;
        table.write(&tasks)?;
        table.finish()?;
        let info = self.info(episodes, widths);
        for (name, value) in [("info", &info), ("stats", &stats)] {
            std::fs::write(folder.join(format!("meta/{name}.json")), format!("{value:#}\n"))?;
        }
        std::fs::write(folder.join("README.md"), data_set_card(self.trials, &info))?;
        Ok(())
    }

    /// `meta/info.json`.
    fn info(&self, episodes: &[Episode], widths: &[(String, usize)]) -> Value {
        let features: serde_json::Map<String, Value> = widths
            .iter()
            .map(|(name, width)| {
                let names = match name.as_str() {
                    "observation.state" => json!(self.state),
                    "observation.tactile" => json!(self.tactile),
                    "action" => json!(["line_pressure_bar"]),
                    _ => Value::Null,
                };
                let whole = name.ends_with("index");
                let dtype = if whole { "int64" } else { "float32" };
                (name.clone(), json!({"dtype": dtype, "shape": [width], "names": names}))
            })
            .collect();
        json!({
            "codebase_version": VERSION,
            "robot_type": "palpate_soft_gripper",
            "total_episodes": episodes.len(),
            "total_frames": episodes.last().map_or(0, |last| last.frames[1]),
            "total_tasks": self.tasks.len(),
            "chunks_size": CHUNK_FILES,
            "data_files_size_in_mb": FILE_MEGABYTES,
            "video_files_size_in_mb": 200,
            "fps": self.fps,
            "splits": {"train": format!("0:{}", episodes.len())},
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": null,
            "features": features,
        })
    }

    /// A row for each episode.
    fn episodes(&self, episodes: &[Episode]) -> Columns {
        let whole = |number: &dyn Fn(&Episode) -> usize| {
            Cells::Whole(episodes.iter().map(|episode| number(episode) as i64).collect())
        };
        let tasks = Cells::Text(self.trials.iter().map(|trial| task_of(trial).to_owned()).collect());
        let mut columns: Columns = [
            ("episode_index", Cells::Whole((0..episodes.len() as i64).collect())),
            ("tasks", Cells::lists(tasks, episodes.len())),
            ("length", whole(&|own| own.frames[1] - own.frames[0])),
            ("data/chunk_index", whole(&|own| own.place[0])),
            ("data/file_index", whole(&|own| own.place[1])),
            ("dataset_from_index", whole(&|own| own.frames[0])),
            ("dataset_to_index", whole(&|own| own.frames[1])),
            ("meta/episodes/chunk_index", whole(&|_| 0)),
            ("meta/episodes/file_index", whole(&|_| 0)),
        ]
        .map(|(name, cells)| (name.to_owned(), cells))
        .into();
        let features = episodes.first().map_or(&[][..], |first| &first.stats);
        for (place, (feature, _)) in features.iter().enumerate() {
            let stats = || episodes.iter().map(|episode| &episode.stats[place].1);
            for (k, name) in Stats::NAMES.iter().enumerate() {
                let numbers = stats().flat_map(|own| own.rows[k].iter().copied()).collect();
                let lists = Cells::lists(Cells::Real(numbers), episodes.len());
                columns.push((format!("stats/{feature}/{name}"), lists));
            }
            let counts = Cells::Whole(stats().map(|own| own.count as i64).collect());
            columns.push((format!("stats/{feature}/count"), Cells::lists(counts, episodes.len())));
        }
        columns
    }
}

/// Features of forces on taxels.
const TAXELS: [&str; 2] = ["observation.taxel_normal", "observation.taxel_shear"];
/// Name of the column that is the index of a table of pandas.
const INDEX: &str = "__index_level_0__";

/// An episode as it was written.
struct Episode {
    /// Numbers of its folder and file.
    place: [usize; 2],
    /// Its first frame in the data set, and the first after it.
    frames: [usize; 2],
    /// Statistics of each feature.
    stats: Vec<(String, Stats)>,
}

/// Statistics of a feature: rows of [`Stats::NAMES`] with a number for each of its columns.
struct Stats {
    count: usize,
    rows: [Vec<f64>; 9],
}

impl Stats {
    const NAMES: [&str; 9] = ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"];
    /// Quantiles that follow the fourth.
    const QUANTILES: [f64; 5] = [0.01, 0.1, 0.5, 0.9, 0.99];

    /// Statistics of frames with several numbers each.
    fn of(numbers: &[f64], frames: usize) -> Self {
        let width = numbers.len().checked_div(frames).unwrap_or(0);
        let mut rows = [const { Vec::new() }; 9];
        for column in 0..width {
            let mut values: Vec<f64> = numbers.iter().skip(column).step_by(width).copied().collect();
            values.sort_by(f64::total_cmp);
            let mean = values.iter().sum::<f64>() / frames as f64;
            let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / frames as f64;
            let quantile = |share: f64| {
                let place = share * (frames - 1) as f64;
                let (low, high) = (values[place.floor() as usize], values[place.ceil() as usize]);
                low + (high - low) * place.fract()
            };
            let first = [values[0], values[frames - 1], mean, variance.sqrt()];
            let own = first.into_iter().chain(Self::QUANTILES.map(quantile));
            rows.iter_mut().zip(own).for_each(|(row, number)| row.push(number));
        }
        Self { count: frames, rows }
    }

    /// Those of several episodes, as `lerobot` joins them: quantiles are means, weighted by frames.
    fn joined(all: &[&Self]) -> Self {
        let count = all.iter().map(|own| own.count).sum();
        let width = all.first().map_or(0, |own| own.rows[0].len());
        let folded = |row: usize, column: usize, fold: fn(f64, f64) -> f64| {
            all.iter().map(|own| own.rows[row][column]).reduce(fold).unwrap_or(f64::NAN)
        };
        let mean_of = |number: &dyn Fn(&Self) -> f64| {
            all.iter().map(|own| own.count as f64 * number(own)).sum::<f64>() / count as f64
        };
        let number = |row: usize, column: usize| match row {
            0 => folded(row, column, f64::min),
            1 => folded(row, column, f64::max),
            3 => {
                let mean = mean_of(&|own| own.rows[2][column]);
                let spread = |own: &Self| own.rows[3][column].powi(2) + (own.rows[2][column] - mean).powi(2);
                mean_of(&spread).sqrt()
            }
            _ => mean_of(&|own| own.rows[row][column]),
        };
        let rows = std::array::from_fn(|row| (0..width).map(|column| number(row, column)).collect());
        Self { count, rows }
    }
}

/// `meta/stats.json`.
fn statistics(episodes: &[Episode]) -> Value {
    let features = episodes.first().map_or(&[][..], |first| &first.stats);
    let feature = |(place, (name, _)): (usize, &(String, Stats))| {
        let all: Vec<&Stats> = episodes.iter().map(|episode| &episode.stats[place].1).collect();
        let joined = Stats::joined(&all);
        let rows = Stats::NAMES.iter().zip(&joined.rows).map(|(row, numbers)| ((*row).to_owned(), json!(numbers)));
        let rows = rows.chain([("count".to_owned(), json!([joined.count]))]);
        (name.clone(), Value::Object(rows.collect()))
    };
    Value::Object(features.iter().enumerate().map(feature).collect())
}

/// Tells pandas which column of the tasks is their index.
fn pandas_index() -> Value {
    let column = |name: Option<&str>, field: &str, kinds: [&str; 2]| json!({"name": name, "field_name": field, "pandas_type": kinds[0], "numpy_type": kinds[1], "metadata": null});
    json!({
        "index_columns": [INDEX],
        "column_indexes": [],
        "columns": [
            column(Some("task_index"), "task_index", ["int64", "int64"]),
            column(None, INDEX, ["unicode", "object"]),
        ],
        "pandas_version": "2.0.0",
    })
}

fn new_table(folder: &Path, kind: &str, [chunk, file]: [usize; 2]) -> Result<NewFile, ParquetError> {
    let folder = folder.join(format!("{kind}/chunk-{chunk:03}"));
    std::fs::create_dir_all(&folder)?;
    Ok(NewFile::create(&folder.join(format!("file-{file:03}.parquet")), Parquet.kind())?)
}

fn task_of(trial: &TrialContent) -> &str {
    shown_name(&trial.open.header.object)
}

/// A column of a trial that is no raw count of a board beside the channels derived from it.
fn channel<'a>(trial: &'a TrialContent, name: &str) -> Option<&'a Column> {
    let derived = |column: &&Column| column.channel.is_some() || trial.open.source != TrialSource::Recorded;
    trial.open.column(name).filter(derived)
}

/// Values of channels at frames of a trial, those of a frame side by side. A gap keeps the value before it; a pressure that
/// is undefined counts as none, as recognisers take it.
fn readings(trial: &TrialContent, frames: &[usize], channels: &[&str]) -> Vec<f32> {
    let columns: Vec<&Column> = channels.iter().filter_map(|name| channel(trial, name)).collect();
    let mut last = vec![0.0; columns.len()];
    let mut values = Vec::with_capacity(frames.len() * columns.len());
    for k in frames {
        for (column, last) in columns.iter().zip(&mut last) {
            let value = column.values[*k];
            if value.is_finite() {
                *last = value;
            } else if trial.simulated().is_some() {
                *last = 0.0;
            }
            values.push(*last);
        }
    }
    values
}

/// Numbers as vectors of a width; as they are where this is one.
fn vectors(numbers: Vec<f32>, width: usize, rows: usize) -> Cells {
    if width == 1 { Cells::Small(numbers) } else { Cells::lists(Cells::Small(numbers), rows) }
}

/// Frames in a second: the median rate of all samples.
fn frame_rate(trials: &[TrialContent]) -> u32 {
    let steps = |trial: &TrialContent| -> Vec<f64> {
        let times: Vec<f64> = trial.samples.iter().map(|k| trial.open.t_s[*k]).collect();
        times.windows(2).map(|pair| pair[1] - pair[0]).collect()
    };
    let mut steps: Vec<f64> = trials.iter().flat_map(steps).filter(|step| *step > 0.0).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return 1;
    }
    (1.0 / *steps.select_nth_unstable_by(middle, f64::total_cmp).1).round().clamp(1.0, 10_000.0) as u32
}
