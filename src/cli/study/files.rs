//! What all studies share: where they write, how many threads they use, and their progress.

use super::super::Failure;
use super::super::interrupt::stop_flag;
use super::super::output::{file_or_folder, write_new};
use super::super::terminal::note;
use indicatif::{ProgressBar, ProgressStyle};
use palpate_geometry::drawing::Figure;
use palpate_geometry::palette::Theme;
use palpate_lab::study::{Measuring, StoredStudy};
use palpate_render::{figure_picture, figure_svg};
use palpate_store::FileKind;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::PathBuf;

/// Where a study writes, and its threads.
#[derive(Debug, clap::Args)]
pub(super) struct StudyOutput {
    /// Folder for the results, which the same command continues, and for the pictures (default: palpate-NAME, with
    /// --quick palpate-NAME-quick).
    #[arg(long, value_name = "DIR", value_parser = file_or_folder(&[]))]
    out: Option<PathBuf>,
    /// Number of threads (default: one per core).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

impl StudyOutput {
    pub(super) fn folder(&self, study: &str, quick: bool) -> StudyFolder {
        let named = || PathBuf::from(format!("palpate-{study}{}", if quick { "-quick" } else { "" }));
        StudyFolder(self.out.clone().unwrap_or_else(named))
    }

    /// Runs a study under a progress bar until it ends or Ctrl+C stops it.
    pub(super) fn run<T>(&self, study: impl FnOnce(&Measuring<'_>) -> T) -> Result<T, Failure> {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let stop = stop_flag()?;
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {eta} left")?;
        let bar = ProgressBar::new(0).with_style(style);
        let progress = |done: usize, of: usize| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        };
        let threads = self.threads.map_or_else(cores, usize::from);
        let outcome = study(&Measuring { threads, cancelled: &stop, progress: &progress });
        bar.finish_and_clear();
        Ok(outcome)
    }
}

/// Folder of a study's files.
pub(super) struct StudyFolder(PathBuf);

/// Size of pictures (points): the width of a README.
const SIZE: [u32; 2] = [960, 860];

impl StudyFolder {
    /// File of finished units.
    pub(super) fn units(&self, study: &str) -> PathBuf {
        self.0.join(format!("{study}.jsonl"))
    }

    /// Writes result and picture; returns a sentence that names the files.
    pub(super) fn write<R: Serialize + DeserializeOwned>(
        &self,
        study: &str,
        stored: &StoredStudy<R>,
        figure: &Figure,
    ) -> Result<String, Failure> {
        let path = |extension: &str| self.0.join(format!("{study}.{extension}"));
        stored.write(&path("json"))?;
        write_new(&path("svg"), FileKind::Svg, figure_svg(figure, Theme::Light, SIZE)?.as_bytes())?;
        write_new(&path("png"), FileKind::Png, &figure_picture(figure, Theme::Light, SIZE)?.to_png()?)?;
        let files = ["json", "svg", "png"].map(|extension| path(extension).display().to_string());
        Ok(format!("Written: {}", files.join(", ")))
    }
}

/// Says how far a study got that was stopped.
pub(super) fn note_stopped(after: &str) {
    note(&format!("stopped after {after}; the same command continues here"));
}
