//! Files out of the window: figures, the 3-D view and trials, written beside the window.

use palpate_geometry::drawing::{DrawList, Figure};
use palpate_geometry::palette::Theme;
use palpate_lab::exchange::write_trials;
use palpate_lab::inspection::OpenOptions;
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
    /// Trials of a store: the formats of [`palpate_lab::exchange::FORMATS`].
    Trials(PathBuf, Vec<TrialId>, OpenOptions),
}

impl ExportRequest {
    /// Writes it; the file appears whole or not at all. `stop` ends an export of trials.
    pub fn write(&self, path: &Path, stop: &AtomicBool) -> Result<(), JobError> {
        let kind = FileKind::of(path, &[FileKind::Svg, FileKind::Png]);
        let is = |wanted: FileKind| kind == Some(wanted);
        let unknown = |known: &str| Err(format!("cannot write \"{}\": choose {known}", path.display()).into());
        let bytes = match self {
            Self::Figure(figure, theme, size) if is(FileKind::Svg) => figure_svg(figure, *theme, *size)?.into_bytes(),
            Self::Figure(figure, theme, size) if is(FileKind::Png) => {
                figure_picture(figure, *theme, *size)?.to_png()?
            }
            Self::Figure(..) => return unknown("an .svg or a .png file"),
            Self::View3d(list, size) if is(FileKind::Png) => {
                let gpu = Gpu::headless(DriverChoice::Any)?;
                let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
                Picture::draw(&gpu, &mut renderer, list, size.map(|side| 2 * side), 2.0)?.to_png()?
            }
            Self::View3d(..) => return unknown("a .png file"),
            Self::Trials(store, ids, options) => {
                let store = Store::open(store)?;
                write_trials(&store, ids, options, path, &mut |_, _| !stop.load(Ordering::Relaxed))?;
                return Ok(());
            }
        };
        write_whole(path, kind.unwrap_or(FileKind::Png), &bytes)
            .map_err(|cause| format!("cannot write \"{}\": {cause}", path.display()).into())
    }
}

/// The job that writes files. One that is stopped leaves no file.
pub(super) fn export_job(wake: Wake) -> Job<(PathBuf, ExportRequest), ()> {
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
        let stop = AtomicBool::new(false);
        let wrong = ExportRequest::Figure(Figure::default(), Theme::Light, [200, 100]);
        let error = wrong.write(&folder.path().join("a.pdf"), &stop).expect_err("refused").to_string();
        assert!(error.contains("choose an .svg or a .png file"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("reads").count(), 2);
    }
}
