//! Small pictures of objects from files, for lists, drawn in the background.

use super::job::{Job, Newer};
use super::messages::Wake;
use crate::picture::portrait;
use palpate_sim::objects::load_surface;

/// Side of a portrait (pixels): lists show it at 40 points, so that it is sharp on fine screens too.
pub const PORTRAIT_SIDE: u32 = 96;

/// The job: files in, out come red, green, blue and opacity of [`PORTRAIT_SIDE`]² pixels, row by row from the top; nothing
/// where the file cannot be read.
pub fn portrait_job(wake: Wake) -> Job<String, Vec<u8>> {
    Job::new("portraits", Newer::Waits, wake, |source: &String, _run| {
        Ok(load_surface(source).ok().map(|surface| portrait(&surface, PORTRAIT_SIDE)))
    })
}

#[cfg(test)]
mod tests {
    use super::super::job::watch::{settled, waker};
    use super::*;

    #[test]
    fn open_meshes_have_portraits_and_missing_files_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = folder.path().join("open.obj");
        std::fs::write(&open, "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\n").expect("written");
        let (wake, woken) = waker();
        let job = portrait_job(wake);
        for path in [open.as_path(), &folder.path().join("none.stl")] {
            job.start(path.display().to_string());
        }
        settled(&job, &woken);
        let drawn = job.take();
        assert_eq!(drawn.iter().map(|ended| ended.number).collect::<Vec<_>>(), [1]);
        let rgba = drawn[0].outcome.as_ref().expect("drawn");
        assert_eq!(rgba.len(), (4 * PORTRAIT_SIDE * PORTRAIT_SIDE) as usize);
        assert_ne!(**rgba, portrait(&palpate_geometry::SurfaceMesh::default(), PORTRAIT_SIDE));
    }
}
