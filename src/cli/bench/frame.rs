//! `palpate bench frame`: what a frame of the window costs.

use super::super::Failure;
use super::super::output::TemporaryFolder;
use super::super::terminal::{say, say_json, table};
use crate::app::{Mode, OffscreenWindow, frame_costs};
use cpu_time::ThreadTime;
use palpate_geometry::palette::Theme;
use palpate_sim::scene::Scene;

pub(super) fn run(size: [u32; 2], seconds: f64, json: bool) -> Result<(), Failure> {
    let folder = TemporaryFolder::new()?;
    let (scene, store) = (Scene::default(), folder.path().join("trials.sqlite"));
    let window = OffscreenWindow { scene, store, mode: Mode::Demo, theme: Theme::Dark, size, trial: None, at_s: 0.0 };
    let began = ThreadTime::now();
    let costs = frame_costs(&window, seconds, &|| began.elapsed().as_secs_f64())?;
    if json {
        return say_json(&costs);
    }
    let [width, height] = costs.size;
    let rows = [
        ("live frame outside the rasteriser, p95", format!("{:.2} ms", costs.live_ms_p95)),
        ("paused frame outside the rasteriser, p95", format!("{:.2} ms", costs.paused_ms_p95)),
        ("frames per second with the rasteriser", format!("{:.1}", costs.frames_per_s)),
        ("from the start to the first frame", format!("{:.0} ms", costs.start_ms)),
    ];
    table(&["of the window", ""], &rows.map(|(what, value)| vec![what.to_owned(), value]))?;
    say(format!("{width} x {height} pixels, {} live frames, drawn by {}", costs.frames, costs.driver))
}
