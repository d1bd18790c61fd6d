//! The whole window as a picture, without a display: the same workbench, drawn into a texture.

use crate::app::features::App;
use crate::app::features::view::{Mode, ViewState};
use crate::app::playback::Seek;
use crate::app::startup::ThreadError;
use crate::app::viewport::wgpu_options;
use crate::app::workbench::{Workbench, WorkbenchSetup};
use egui_wgpu::{RenderState, RendererOptions, ScreenDescriptor};
use palpate_geometry::palette::Theme;
use palpate_lab::workers::Command;
use palpate_render::{DriverChoice, Picture, PictureError, describe_adapter, wgpu};
use palpate_sim::scene::Scene;
use palpate_tactile::trial::TrialId;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A window to be drawn.
#[derive(Clone, Debug)]
pub struct OffscreenWindow {
    /// Scene of the simulation.
    pub scene: Scene,
    /// Store of trials.
    pub store: PathBuf,
    pub mode: Mode,
    pub theme: Theme,
    /// Width and height (pixels, which are points).
    pub size: [u32; 2],
    /// Stored trial to open.
    pub trial: Option<TrialId>,
    /// Time of the simulated grasp, or of the trial (s).
    pub at_s: f64,
    /// Driver that draws it.
    pub driver: DriverChoice,
}

/// Reason why there is no picture of the window.
#[derive(Debug, thiserror::Error)]
pub enum OffscreenError {
    #[error("no graphics driver can draw the window ({0}); install one, such as mesa-vulkan-drivers")]
    Driver(String),
    #[error(transparent)]
    Thread(#[from] ThreadError),
    #[error(transparent)]
    Picture(#[from] PictureError),
    #[error("the window did not show {wanted} within {seconds} s{}", said.as_ref().map(|s| format!("; it said: {s}")).unwrap_or_default())]
    Late {
        /// What was waited for.
        wanted: &'static str,
        /// How long (s).
        seconds: u64,
        /// Last message of the window.
        said: Option<String>,
    },
}

/// Longest wait for the simulation or the trial.
const PATIENCE: Duration = Duration::from_secs(120);
/// The window has settled when its threads were quiet for so long.
const QUIET: Duration = Duration::from_millis(400);
/// Frames that end its animations, and time between them (s).
const LAST_FRAMES: usize = 12;
const FRAME_S: f64 = 0.1;

/// Draws the window once it shows the grasp at its time, or the trial. Returns the driver's name, too.
pub fn window_picture(window: &OffscreenWindow) -> Result<(Picture, String), OffscreenError> {
    let mut drawn = start(window, RendererOptions::PREDICTABLE)?;
    drawn.show(window)?;
    drawn.settle();
    Ok((drawn.picture()?, describe_adapter(&drawn.state.adapter.get_info())))
}

/// Films presenter mode: so many pictures, `step_s` of its time apart. `add` receives their number and each picture; an error
/// of its own ends the film.
pub fn film_presentation<E: From<OffscreenError>>(
    window: &OffscreenWindow,
    pictures: usize,
    step_s: f64,
    mut add: impl FnMut(usize, &Picture) -> Result<(), E>,
) -> Result<(), E> {
    let mut drawn = start(window, RendererOptions::PREDICTABLE)?;
    drawn.until("its scene", |workbench| workbench.snapshot().is_some_and(|s| s.status.loading.is_none()))?;
    drawn.workbench.act(|app| app.present(true));
    drawn.frame();
    // It would run by the clock of the machine.
    drawn.workbench.act(|app| app.simulation.send(Command::Pause));
    drawn.settle();
    drawn.frame_s = 0.0;
    let mut due_s = 0.0;
    for number in 0..pictures {
        add(number, &drawn.picture()?)?;
        drawn.time_s += step_s;
        due_s = drawn.step_for(due_s + step_s)?;
        drawn.frame();
        // The next object would be grasped by that clock, too.
        if drawn.workbench.snapshot().is_some_and(|now| now.status.playing || now.status.finished) {
            drawn.workbench.act(|app| app.simulation.send(Command::Pause));
        }
    }
    Ok(())
}

/// Starts the window, which stands still.
fn start(window: &OffscreenWindow, drawing: RendererOptions) -> Result<Drawn, OffscreenError> {
    let state = render_state(window, drawing)?;
    let ctx = egui::Context::default();
    let (wake, woken) = channel();
    let wake = Arc::new(move || {
        // Threads may outlive the picture by a moment.
        let _heard = wake.send(());
    });
    let view = ViewState { theme: window.theme, ..ViewState::default() };
    let setup = WorkbenchSetup {
        playing: false,
        render_state: Some(&state),
        cleared: true,
        ..WorkbenchSetup::new(window.scene.clone(), window.store.clone(), view, wake)
    };
    let workbench = Workbench::new(&ctx, setup)?;
    Ok(Drawn { ctx, state, workbench, size: window.size, time_s: 0.0, frame_s: FRAME_S, shapes: Vec::new(), woken })
}

/// What the frames of a window cost.
#[derive(Clone, Debug, Serialize)]
pub struct FrameCosts {
    /// Driver that drew.
    pub driver: String,
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// From the start to the first frame with the gripper (ms).
    pub start_ms: f64,
    /// CPU time of a frame outside the rasteriser while grasps run, 95th percentile (ms).
    pub live_ms_p95: f64,
    /// The same while nothing moves (ms).
    pub paused_ms_p95: f64,
    /// Frames drawn one after the other while grasps run, each until the rasteriser is done (1/s).
    pub frames_per_s: f64,
    /// Number of live frames.
    pub frames: usize,
}

/// Frames that are drawn before any is measured, and paused ones that are.
const WARM_UP: usize = 20;
const PAUSED: usize = 100;

/// Measures the frames of a window whose simulation runs for some seconds, and then stands still. `cpu_s` reads the CPU time of
/// this thread (s).
pub fn frame_costs(
    window: &OffscreenWindow,
    seconds: f64,
    cpu_s: &dyn Fn() -> f64,
) -> Result<FrameCosts, OffscreenError> {
    let began = Instant::now();
    // As in a window on a screen.
    let mut drawn = start(window, RendererOptions::default())?;
    drawn.until("its scene", |workbench| workbench.snapshot().is_some_and(|s| s.status.loading.is_none()))?;
    drawn.cost(cpu_s)?;
    let start_ms = 1e3 * began.elapsed().as_secs_f64();
    drawn.workbench.act(|app| app.simulation.send(Command::Play));
    for _ in 0..WARM_UP {
        drawn.cost(cpu_s)?;
    }
    let (mut live, began) = (Vec::new(), Instant::now());
    while began.elapsed().as_secs_f64() < seconds {
        // Another object once this one is decided.
        if drawn.workbench.snapshot().is_some_and(|snapshot| snapshot.status.finished) {
            drawn.workbench.act(App::next_object);
        }
        live.push(drawn.cost(cpu_s)?);
    }
    let frames_per_s = live.len() as f64 / began.elapsed().as_secs_f64();
    drawn.workbench.act(|app| app.simulation.send(Command::Pause));
    drawn.settle();
    let paused = (0..PAUSED).map(|_| drawn.cost(cpu_s)).collect::<Result<Vec<f64>, _>>()?;
    let (driver, size, frames) = (describe_adapter(&drawn.state.adapter.get_info()), drawn.size, live.len());
    let [live_ms_p95, paused_ms_p95] = [live, paused].map(p95);
    Ok(FrameCosts { driver, size, start_ms, live_ms_p95, paused_ms_p95, frames_per_s, frames })
}

fn p95(mut costs: Vec<f64>) -> f64 {
    costs.sort_by(f64::total_cmp);
    costs.get((costs.len() * 95).div_ceil(100).saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

fn render_state(window: &OffscreenWindow, drawing: RendererOptions) -> Result<RenderState, OffscreenError> {
    let failed = |cause: &dyn std::fmt::Display| OffscreenError::Driver(cause.to_string());
    let create = async |backends| {
        let options = wgpu_options(backends);
        let instance = options.wgpu_setup.new_instance().await;
        RenderState::create(&options, &instance, None, drawing).await
    };
    let mut found = Err(failed(&"there is none"));
    for backends in window.driver.backends() {
        found = pollster::block_on(create(Some(backends))).map_err(|e| failed(&e));
        let allowed = |state: &RenderState| window.driver.allows(&state.adapter.get_info());
        if found.as_ref().is_ok_and(|state| !allowed(state)) {
            found = Err(failed(&"it is none of the kind asked for"));
        }
        if found.is_ok() {
            break;
        }
    }
    let state = found?;
    let most = state.device.limits().max_texture_dimension_2d;
    if window.size.iter().any(|side| *side > most) {
        return Err(failed(&format!("it draws at most {most} x {most} pixels")));
    }
    Ok(state)
}

/// A workbench that is drawn frame by frame.
struct Drawn {
    ctx: egui::Context,
    state: RenderState,
    workbench: Workbench,
    size: [u32; 2],
    /// Time on the window's own clock, so that animations do not depend on the machine, and from one frame to the next (s).
    time_s: f64,
    frame_s: f64,
    shapes: Vec<egui::epaint::ClippedShape>,
    woken: Receiver<()>,
}

impl Drawn {
    /// Draws one frame.
    fn frame(&mut self) {
        let [width, height] = self.size.map(|side| side as f32);
        let input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width, height))),
            time: Some(self.time_s),
            predicted_dt: FRAME_S as f32,
            max_texture_side: Some(self.state.device.limits().max_texture_dimension_2d as usize),
            ..egui::RawInput::default()
        };
        self.time_s += self.frame_s;
        let mut output = self.ctx.run_ui(input, |ui| self.workbench.ui(ui));
        let mut renderer = self.state.renderer.write();
        let mut set: Vec<_> = output.textures_delta.set.drain().collect();
        set.sort_by_key(|(id, _)| *id);
        for (id, deltas) in set {
            for delta in deltas {
                renderer.update_texture(&self.state.device, &self.state.queue, id, &delta);
            }
        }
        let mut free: Vec<_> = output.textures_delta.free.drain().collect();
        free.sort();
        free.iter().for_each(|id| renderer.free_texture(id));
        self.shapes = std::mem::take(&mut output.shapes);
    }

    /// Draws until something is so.
    fn until(&mut self, wanted: &'static str, is_so: impl Fn(&Workbench) -> bool) -> Result<(), OffscreenError> {
        let began = Instant::now();
        loop {
            self.frame();
            if is_so(&self.workbench) {
                return Ok(());
            }
            if began.elapsed() > PATIENCE {
                let said = self.workbench.messages().back().cloned();
                return Err(OffscreenError::Late { wanted, seconds: PATIENCE.as_secs(), said });
            }
            // Nothing came: look again all the same.
            let _quiet = self.woken.recv_timeout(Duration::from_millis(100));
        }
    }

    /// Brings the window to what is to be seen.
    fn show(&mut self, window: &OffscreenWindow) -> Result<(), OffscreenError> {
        self.until("its scene", |workbench| workbench.snapshot().is_some_and(|s| s.status.loading.is_none()))?;
        if window.mode != Mode::Demo {
            self.workbench.act(|app| app.set_mode(window.mode));
        }
        if let Some(id) = window.trial {
            self.workbench.act(|app| app.open_trial(id));
            self.until("the trial", |workbench| workbench.inspected().is_some_and(|open| open.trial.id == id))?;
            self.workbench.act(|app| app.seek(Seek::To(window.at_s)));
            return Ok(());
        }
        // Steps are recorded, so that only the mode of the simulation takes any.
        while let Some(now) = self.workbench.snapshot().filter(|_| window.mode == Mode::Demo) {
            if now.frame.t > window.at_s - 1e-9 || now.status.finished {
                break;
            }
            self.workbench.act(|app| app.simulation.send(Command::Step));
            let before = now.frame.t;
            self.until("the grasp", |workbench| {
                workbench.snapshot().is_some_and(|s| s.frame.t > before || s.status.finished)
            })?;
        }
        Ok(())
    }

    /// Steps the simulated grasp for some time (s), while it is not decided; returns the rest, shorter than a sample.
    fn step_for(&mut self, mut due_s: f64) -> Result<f64, OffscreenError> {
        self.until("the next object", |workbench| workbench.snapshot().is_some_and(|s| s.status.loading.is_none()))?;
        while let Some(now) = self.workbench.snapshot().filter(|now| !now.status.finished) {
            let sample_s = 1.0 / f64::from(now.scene.timing.sample_hz);
            if due_s < sample_s {
                return Ok(due_s);
            }
            self.workbench.act(|app| app.simulation.send(Command::Step));
            // The last step ends the grasp, without another sample.
            self.until("the grasp", |workbench| workbench.snapshot().is_some_and(|s| s.revision > now.revision))?;
            due_s -= sample_s;
        }
        Ok(0.0)
    }

    /// Draws until all threads are quiet and animations have ended.
    fn settle(&mut self) {
        let began = Instant::now();
        while began.elapsed() < PATIENCE {
            self.frame();
            if self.woken.recv_timeout(QUIET).is_err() {
                break;
            }
        }
        for _ in 0..LAST_FRAMES {
            self.frame();
        }
    }

    /// Draws a frame until the rasteriser is done; returns the CPU time of this thread before that (ms).
    fn cost(&mut self, cpu_s: &dyn Fn() -> f64) -> Result<f64, OffscreenError> {
        let began_s = cpu_s();
        self.frame();
        let (encoder, texture) = self.record();
        let commands = encoder.finish();
        let cost_ms = 1e3 * (cpu_s() - began_s);
        let Self { state, .. } = self;
        state.queue.submit([commands]);
        let done = state.device.poll(wgpu::PollType::wait_indefinitely());
        done.map_err(|cause| OffscreenError::Driver(cause.to_string()))?;
        drop(texture);
        Ok(cost_ms)
    }

    /// Draws the last frame into a texture and reads it back.
    fn picture(&mut self) -> Result<Picture, OffscreenError> {
        let (encoder, texture) = self.record();
        Ok(Picture::read_back(&self.state.device, &self.state.queue, encoder, &texture)?)
    }

    /// Records the drawing of the last frame into a texture.
    fn record(&mut self) -> (wgpu::CommandEncoder, wgpu::Texture) {
        let shapes = std::mem::take(&mut self.shapes);
        let Self { ctx, state, size, workbench, .. } = self;
        let size = *size;
        let [r, g, b] = workbench.view().theme.colours().background.to_unit().map(f64::from);
        let screen = ScreenDescriptor { pixels_per_point: 1.0, size_in_pixels: size };
        let jobs = ctx.tessellate(shapes, 1.0);
        let (device, queue) = (&state.device, &state.queue);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut renderer = state.renderer.write();
        let before = renderer.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("window"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: state.target_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        {
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }),
                        store: wgpu::StoreOp::Store,
                    },
                    depth_slice: None,
                })],
                ..Default::default()
            });
            renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        }
        queue.submit(before);
        (encoder, texture)
    }
}
