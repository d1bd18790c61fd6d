//! Thread "portraits": draws small pictures of objects from files, for lists.

use super::background_job::BackgroundJob;
use super::messages::Wake;
use crate::picture::portrait;
use palpate_sim::objects::load_surface;

/// Side of a portrait (pixels): lists show it at 40 points, so that it is sharp on fine screens too.
pub const PORTRAIT_SIDE: u32 = 96;

/// Small picture of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Portrait {
    /// The file.
    pub source: String,
    /// Red, green, blue and opacity of [`PORTRAIT_SIDE`]² pixels, row by row from the top; none where the file cannot be read.
    pub rgba: Option<Vec<u8>>,
}

/// Handle of the thread: files in, their portraits out.
pub type PortraitJob = BackgroundJob<String, Portrait>;

impl PortraitJob {
    /// Starts the thread.
    pub fn start(wake: Wake) -> std::io::Result<Self> {
        Self::spawn("portraits", wake, |source: String, _stop, outlet| {
            let rgba = load_surface(&source).ok().map(|surface| portrait(&surface, PORTRAIT_SIDE));
            outlet.publish(Portrait { source, rgba });
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;

    #[test]
    fn open_meshes_have_portraits_and_missing_files_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = folder.path().join("open.obj");
        std::fs::write(&open, "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\n").expect("written");
        let (wake, woken) = waker();
        let job = PortraitJob::start(wake).expect("starts");
        let sources = [open.as_path(), &folder.path().join("none.stl")].map(|path| path.display().to_string());
        let [drawn, missing] = sources.map(|source| {
            job.ask(source.clone());
            until(&job, &woken, |portrait| portrait.source == source)
        });
        assert_eq!(drawn.rgba.as_ref().map(Vec::len), Some((4 * PORTRAIT_SIDE * PORTRAIT_SIDE) as usize));
        assert_ne!(drawn.rgba, Some(portrait(&palpate_geometry::SurfaceMesh::default(), PORTRAIT_SIDE)));
        assert_eq!(missing.rgba, None);
    }
}
