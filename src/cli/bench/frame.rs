//! `palpate bench frame`: what a frame of the window costs.

use super::super::Failure;
use super::super::output::TemporaryFolder;
use super::super::terminal::{Page, Report};
use crate::app::{FrameCosts, Mode, OffscreenWindow, frame_costs};
use cpu_time::ThreadTime;
use palpate_geometry::palette::Theme;
use palpate_render::DriverChoice;
use palpate_sim::scene::Scene;

pub(super) fn measure(size: [u32; 2], seconds: f64) -> Result<FrameCosts, Failure> {
    let folder = TemporaryFolder::new()?;
    let (scene, store) = (Scene::default(), folder.path().join("trials.sqlite"));
    let window = OffscreenWindow {
        scene,
        store,
        mode: Mode::Demo,
        theme: Theme::Dark,
        size,
        trial: None,
        at_s: 0.0,
        driver: DriverChoice::Any,
    };
    let began = ThreadTime::now();
    Ok(frame_costs(&window, seconds, &|| began.elapsed().as_secs_f64())?)
}

impl Report for FrameCosts {
    fn text(&self, page: &mut Page) {
        let [width, height] = self.size;
        let rows = [
            ("live frame outside the rasteriser, p95", format!("{:.2} ms", self.live_ms_p95)),
            ("paused frame outside the rasteriser, p95", format!("{:.2} ms", self.paused_ms_p95)),
            ("frames per second with the rasteriser", format!("{:.1}", self.frames_per_s)),
            ("from the start to the first frame", format!("{:.0} ms", self.start_ms)),
        ];
        page.table(&["of the window", ""], rows.map(|(what, value)| [what.to_owned(), value]));
        page.line(format!("{width} x {height} pixels, {} live frames, drawn by {}", self.frames, self.driver));
    }
}
