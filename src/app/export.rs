//! Files out of the window: figures, the 3-D view and trials, written beside the window.

use palpate_exchange::{Exported, TrialExport, export_labelled, sound_ones, write_trials};
use palpate_geometry::drawing::{DrawList, Figure};
use palpate_geometry::palette::Theme;
use palpate_lab::inspection::{OpenOptions, trial_numbers};
use palpate_lab::workers::{Job, JobError, Newer, Wake};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer, figure_picture, figure_svg};
use palpate_store::{FileKind, Store, write_whole};
use palpate_tactile::trial::TrialId;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Something to be written to a file. The extension of the file chooses the format.
#[derive(Clone, Debug)]
pub enum ExportRequest {
    /// A figure, width and height in points: .svg, or .png with two pixels per point.
    Figure(Figure, Theme, [u32; 2]),
    /// The 3-D view, width and height in points: .png with two pixels per point.
    View3d(Box<DrawList>, [u32; 2]),
    /// A table of a study: .csv.
    Table(String),
    /// Sound trials of a store: the formats of [`palpate_exchange::FORMATS`]; as CSV into a new folder.
    Trials {
        store: PathBuf,
        ids: Vec<TrialId>,
        options: OpenOptions,
        /// With the force on every taxel.
        taxels: bool,
    },
    /// All labelled trials of a store, into a new folder.
    Labelled(PathBuf),
}

/// Longest name that is made of a title (characters).
const LONGEST_NAME: usize = 60;

impl ExportRequest {
    /// Name of its file, without ending: what it shows, in lower case.
    pub(super) fn name(&self) -> String {
        let figure = match self {
            Self::Figure(figure, ..) => figure,
            Self::Trials { ids, .. } if ids.len() == 1 => return format!("trial_{}", ids[0]),
            Self::Trials { ids, .. } => return format!("{}_trials", ids.len()),
            Self::View3d(..) | Self::Table(_) | Self::Labelled(_) => return "palpate".to_owned(),
        };
        let plot = match figure.plots.as_slice() {
            [one] => one.y.title.split(" (").next().unwrap_or_default(),
            _ => "",
        };
        let shown = format!("{} {plot}", figure.title).to_lowercase();
        let words: Vec<&str> = shown.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        // As many whole words as there is room for.
        let mut whole = (1..=words.len()).rev().map(|count| words[..count].join("_"));
        let name = whole.find(|name| name.chars().count() <= LONGEST_NAME).unwrap_or_default();
        if name.is_empty() { "palpate".to_owned() } else { name }
    }

    /// Writes it and says so; the file appears whole or not at all. `stop` ends an export of trials.
    pub fn write(&self, path: &Path, stop: &AtomicBool) -> Result<String, JobError> {
        let kind = FileKind::of(path, &[FileKind::Svg, FileKind::Png, FileKind::Csv]);
        let is = |wanted: FileKind| kind == Some(wanted);
        let unknown = |known: &str| Err(format!("cannot write \"{}\": choose {known}", path.display()).into());
        let bytes = match self {
            Self::Figure(figure, theme, size) if is(FileKind::Svg) => figure_svg(figure, *theme, *size)?.into_bytes(),
            Self::Figure(figure, theme, size) if is(FileKind::Png) => {
                figure_picture(figure, *theme, *size)?.to_png()?
            }
            Self::Figure(..) => {
                return unknown(
                    "an .svg or a .png file; numbers are exported in the library of Inspect mode: Edit > Export",
                );
            }
            Self::View3d(list, size) if is(FileKind::Png) => {
                let gpu = Gpu::headless(DriverChoice::Any)?;
                let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
                Picture::draw(&gpu, &mut renderer, list, size.map(|side| 2 * side), 2.0)?.to_png()?
            }
            Self::View3d(..) => return unknown("a .png file"),
            Self::Table(text) if is(FileKind::Csv) => text.clone().into_bytes(),
            Self::Table(_) => return unknown("a .csv file"),
            Self::Trials { store, ids, options, taxels } => {
                let (store, is_stopped) = (&Store::open(store)?, &|| stop.load(Ordering::Relaxed));
                return write_sound(&TrialExport { store, ids, options, taxels: *taxels, is_stopped }, path);
            }
            Self::Labelled(store) => return write_labelled(&Store::open(store)?, path),
        };
        write_whole(path, kind.unwrap_or(FileKind::Png), &bytes)
            .map_err(|cause| format!("cannot write \"{}\": {cause}", path.display()))?;
        Ok(format!("Saved as {}.", path.display()))
    }
}

fn write_sound(export: &TrialExport<'_>, path: &Path) -> Result<String, JobError> {
    // A name without ending is that of a folder, which several trials need as CSV.
    let is_csv = FileKind::of(path, &[FileKind::Csv]).is_some();
    let folder = path.extension().is_none() || (is_csv && export.ids.len() > 1);
    let path = if folder { unused(&path.with_extension("")) } else { path.to_owned() };
    let (mut written, mut missing) = sound_ones(export.store, export.ids)?;
    let left_out = write_trials(&TrialExport { ids: &written, ..*export }, &path)?.left_out;
    missing.extend(left_out.into_iter().map(|(id, _)| id));
    written.retain(|id| !missing.contains(id));
    let what = match export.taxels {
        _ if folder => "as CSV",
        _ if is_csv => "as CSV, loaded taxels of a simulated one in .contacts.csv",
        true => "with taxels",
        false => "without taxels (the box \"With taxels\" in Edit > Export of the library adds them)",
    };
    let written = if written.is_empty() { "no trial".to_owned() } else { trial_numbers(written) };
    let missing = match missing.is_empty() {
        true => String::new(),
        false => format!("; left out as unsound or damaged: {}", trial_numbers(missing)),
    };
    Ok(format!("Exported {written} {what}: {}{missing}", path.display()))
}

fn write_labelled(store: &Store, path: &Path) -> Result<String, JobError> {
    let Exported { folder, trials, derived, left_out } = export_labelled(store, &unused(path))?;
    let missing = match left_out.first() {
        Some((id, why)) => format!("; {} without signals, such as trial {id}: {why}", left_out.len()),
        None => String::new(),
    };
    Ok(format!("{trials} labelled trials exported into {}, {derived} with signals{missing}", folder.display()))
}

/// A name that nothing has yet: export, export-2, export-3 ..
fn unused(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let others = (2..=u32::MAX).map(|k| path.with_file_name(format!("{name}-{k}")));
    std::iter::once(path.to_owned()).chain(others).find(|path| !path.exists()).unwrap_or_else(|| path.to_owned())
}

/// The job that writes files. One that is stopped leaves no file.
pub(super) fn export_job(wake: Wake) -> Job<(PathBuf, ExportRequest), String> {
    Job::new("export", Newer::Waits, wake, |(path, request): &(PathBuf, ExportRequest), run| {
        Ok(Some(request.write(path, run.stop())?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::mpsc::channel;
    use std::time::Duration;

    #[test]
    fn trials_are_written_into_a_new_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let (store, out) = (folder.path().join("s.sqlite"), folder.path().join("export"));
        std::fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/suite/data/store.sqlite"), &store).expect("copies");
        std::fs::create_dir(&out).expect("a folder of this name");
        let options = OpenOptions::default();
        let request = ExportRequest::Trials { store: store.clone(), ids: vec![1, 2, 4], options, taxels: false };
        let said = request.write(&out, &AtomicBool::new(false)).expect("writes");
        assert!(said.starts_with("Exported trials 1, 2, 4 as CSV: ") && said.ends_with("export-2"), "{said}");
        assert_eq!(request.name(), "3_trials");
        for name in ["trial_1_lemon.csv", "trial_1_lemon.contacts.csv", "trial_2_mug.csv", "trial_4_lemon.bytes"] {
            assert!(folder.path().join("export-2").join(name).is_file(), "{name}");
        }
        // Several trials as CSV are a folder of that name.
        let said = request.write(&folder.path().join("two.csv"), &AtomicBool::new(false)).expect("writes");
        assert!(said.ends_with("two") && folder.path().join("two").join("trial_2_mug.csv").is_file(), "{said}");
        // A file says where the taxels are.
        let request = ExportRequest::Trials { ids: vec![1], store, options: OpenOptions::default(), taxels: false };
        let said = request.write(&out.with_extension("csv"), &AtomicBool::new(false)).expect("writes");
        assert!(said.contains(".contacts.csv: ") && folder.path().join("export.contacts.csv").is_file(), "{said}");
    }

    #[test]
    fn a_file_is_named_after_what_it_shows() {
        let plot = |title: &str| palpate_geometry::drawing::Plot {
            y: palpate_geometry::drawing::PlotAxis::linear(title),
            ..Default::default()
        };
        let name = |title: &str, plots: &[&str]| {
            let plots = plots.iter().map(|title| plot(title)).collect();
            let figure = Figure { title: title.to_owned(), plots, ..Figure::default() };
            ExportRequest::Figure(figure, Theme::Light, [1, 1]).name()
        };
        assert_eq!(name("Lemon (2), Tomato (1)", &["pressure (kPa)"]), "lemon_2_tomato_1_pressure");
        assert_eq!(name("Lemon, trial 7", &["force (N)", "line"]), "lemon_trial_7");
        assert_eq!(name("Lemon (3): trials 23 to 25", &[]), "lemon_3_trials_23_to_25");
        assert_eq!(name("", &[]), "palpate");
    }

    #[test]
    fn a_figure_is_written_by_a_job_in_the_format_of_its_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let (sender, woken) = channel();
        let exports = export_job(Arc::new(move || {
            let _heard = sender.send(());
        }));
        for (name, begin) in [("a.svg", &b"<svg"[..]), ("a.PNG", b"\x89PNG")] {
            let path = folder.path().join(name);
            exports.start((path.clone(), ExportRequest::Figure(Figure::default(), Theme::Light, [200, 100])));
            woken.recv_timeout(Duration::from_secs(60)).expect("ends");
            assert!(exports.take().iter().all(|ended| ended.command.0 == path && ended.outcome.is_ok()));
            assert!(std::fs::read(&path).expect("written").starts_with(begin));
        }
        let (stop, table) = (AtomicBool::new(false), ExportRequest::Table("a,b\n".to_owned()));
        table.write(&folder.path().join("a.csv"), &stop).expect("written");
        assert!(
            table.write(&folder.path().join("a.svg"), &stop).is_err_and(|error| error.to_string().contains(".csv"))
        );
        let wrong = ExportRequest::Figure(Figure::default(), Theme::Light, [200, 100]);
        let error = wrong.write(&folder.path().join("a.pdf"), &stop).expect_err("refused").to_string();
        assert!(error.contains("choose an .svg or a .png file; numbers are exported in the library"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("reads").count(), 3);
    }
}
