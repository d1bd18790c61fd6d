//! The window. [`Workbench`] is its contents, so that tests can drive it without a window; this file opens the window around
//! it.
//!
//! Panels and bars read, and push actions: functions of the [`App`], which run after the frame. Simulation, gripper, store
//! and tools run in threads of their own (see `workers` in the core): nothing here steps physics or waits for a disk.
//!
//! # Layers
//!
//! A file imports only from rows above its own; a test reads this table. A folder stands for its files that have no row.
//!
//! | layer | files | content |
//! |---|---|---|
//! | base | `theme.rs` `icons.rs` `viewport.rs` `frame_rate.rs` `startup.rs` `traces.rs` `playback.rs` `export.rs` `thumbnails.rs` | look, graphics, time shown |
//! | view | `features/view.rs` `features/tools.rs` | view state; doctor, fit and training |
//! | shown | `shown.rs` | simulated, real or stored data at the time shown |
//! | features | `features/` | state of the window, and what can be done with it |
//! | actions | `actions.rs` | functions of the state, some with a name and a key |
//! | widgets | `widgets.rs` | widgets that several parts share |
//! | parts | `plots/` `figure_plot.rs` `heat_map.rs` | building blocks of panels |
//! | maps | `shown_grasp.rs` | heat maps of a grasp |
//! | layers | `contact_path.rs` `small_pads.rs` | layers of the 3-D view |
//! | modes | `modes/` | layout and keys of each mode |
//! | panels | `panels/` | one file per panel |
//! | bars | `bars/` | bars above and below the panels |
//! | keys | `keys/` | keys of all modes, and their sheet |
//! | tiles | `tiling.rs` `palette.rs` `path_dialog.rs` `import_dialog.rs` `manual.rs` `presenter/` | panels beside each other; command palette; file and import dialogs; manual; presenter mode |
//! | workbench | `workbench.rs` | draws the window |
//! | picture | `offscreen.rs` | the window as a picture, without a display, and what its frames cost |
//! | window | `mod.rs` | the window |
//!
//! | to add | write | and register in |
//! |---|---|---|
//! | a panel | a file in `panels/` | `panels/mod.rs`, and the layout of a mode |
//! | a mode | its name in `features/view.rs`, its layout and keys in a file of `modes/` | `modes/mod.rs` |
//! | an action | a method of `App` or of a feature, in `features/` | with a key: `keys/common.rs` or the mode |
//! | a feature | its state and methods in a file of `features/` | `features/mod.rs`, `workbench.rs` |

mod actions;
mod bars;
mod contact_path;
mod export;
mod features;
mod figure_plot;
mod frame_rate;
mod heat_map;
mod icons;
mod import_dialog;
mod keys;
mod manual;
mod modes;
mod offscreen;
mod palette;
mod panels;
mod path_dialog;
mod playback;
mod plots;
mod presenter;
mod shown;
mod shown_grasp;
mod small_pads;
mod startup;
mod theme;
mod thumbnails;
mod tiling;
mod traces;
mod viewport;
mod widgets;
mod workbench;

pub use actions::Actions;
pub use export::ExportRequest;
pub use features::App;
pub use features::library::{LibrarySelection, Reach};
pub use features::studies::Studies;
pub use features::tools::{GripperTools, GripperToolsSetup};
pub use features::view::{Derivation, Mode, PathLayer, ViewSource, ViewState};
pub use offscreen::{FrameCosts, OffscreenError, OffscreenWindow, film_presentation, frame_costs, window_picture};
pub use panels::{ALL as ALL_PANELS, PanelKind};
pub use playback::Seek;
pub use shown::{ComparedTrace, Inspected, Pinned};
pub use startup::{Surroundings, ThreadError, WindowError, check_surroundings};
pub use viewport::Viewport;
pub use workbench::{Workbench, WorkbenchSetup};

use palpate_geometry::palette::Theme;
use palpate_serve::{Clients, DeskSetup};
use palpate_sim::scene::Scene;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Options that the window opens with.
pub struct WindowOptions {
    /// First scene.
    pub scene: Scene,
    /// Store of trials.
    pub store: PathBuf,
    /// Port of a real gripper to connect to.
    pub port: Option<PathBuf>,
    /// Recognition model for the real gripper; the last one used where none is named.
    pub model: Option<PathBuf>,
    /// Other programs that may control the real gripper.
    pub serve: Option<(DeskSetup, Clients)>,
    /// Takes what closes the window when the program is asked to stop.
    pub on_stop: OnStop,
}

/// Arranges for the window to be closed by Ctrl+C or a termination request.
pub type OnStop = Box<dyn FnOnce(Box<dyn Fn() + Send>)>;

/// First and smallest size of the window (points).
const FIRST_SIZE: [f32; 2] = [1280.0, 820.0];
const LEAST_SIZE: [f32; 2] = [720.0, 480.0];
/// Height of what desktops put around windows: title bar, bars at the edges (points).
const AROUND: f32 = 80.0;
/// Icon of the window where the desktop has none (PNG).
const ICON: &[u8] = include_bytes!("../../assets/desktop/palpate-128.png");

/// Opens the window and returns when it is closed.
pub fn open_window(options: WindowOptions) -> Result<(), WindowError> {
    let surroundings = check_surroundings()?;
    surroundings.apply();
    let icon = eframe::icon_data::from_png_bytes(ICON).map_err(|error| WindowError::Other(error.to_string()))?;
    let native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Palpate")
            .with_app_id("palpate")
            .with_icon(icon)
            .with_inner_size(FIRST_SIZE)
            .with_min_inner_size(LEAST_SIZE),
        wgpu_options: viewport::wgpu_options(None),
        event_loop_builder: surroundings.event_loop_hook(),
        // Elsewhere, the last position is used if it is on a screen; here it is not checked.
        centered: cfg!(target_os = "linux"),
        // Full screen belongs to presenter mode, which ends with the window.
        window_builder: Some(Box::new(|builder| builder.with_fullscreen(false))),
        ..Default::default()
    };
    let failed: Arc<Mutex<Option<ThreadError>>> = Arc::default();
    let failure = Arc::clone(&failed);
    let creator: eframe::AppCreator<'_> = Box::new(move |creation| {
        let render_state = creation.wgpu_render_state.clone().ok_or("the window has no graphics device")?;
        let mut view: ViewState = creation.storage.and_then(|s| eframe::get_value(s, VIEW_KEY)).unwrap_or_default();
        view.gripper_model = options.model.or(view.gripper_model);
        let [wake_context, closed_context] = [(); 2].map(|()| creation.egui_ctx.clone());
        (options.on_stop)(Box::new(move || {
            closed_context.send_viewport_cmd_to(egui::ViewportId::ROOT, egui::ViewportCommand::Close);
            closed_context.request_repaint();
        }));
        let wake = Arc::new(move || wake_context.request_repaint());
        let theme = view.theme;
        let start = move |ctx: &egui::Context| {
            let setup = WorkbenchSetup {
                render_state: Some(&render_state),
                cleared: true,
                ..WorkbenchSetup::new(options.scene, options.store, view, wake)
            };
            let mut workbench = Workbench::new(ctx, setup)?;
            if let Some(port) = options.port {
                workbench.act(|app| app.connect(Some(port)));
            }
            if let Some((desk, clients)) = options.serve {
                workbench.act(|app| app.serve(desk, clients));
            }
            Ok(workbench)
        };
        theme::apply(&creation.egui_ctx, theme);
        Ok(Box::new(Window { workbench: None, start: Some(Box::new(start)), frames: 0, theme, failure }))
    });
    eframe::run_native("palpate", native, creator).map_err(|error| surroundings.explain(&error))?;
    let failed = failed.lock().unwrap_or_else(PoisonError::into_inner).take();
    failed.map_or(Ok(()), |error| Err(WindowError::Other(error.to_string())))
}

/// True where the window with what is around it is larger than the screen: maximised, the desktop makes it fit.
fn overflows(size: egui::Vec2, screen: egui::Vec2) -> bool {
    size.x > screen.x || size.y + AROUND > screen.y
}

/// Key of the view state in eframe's storage.
const VIEW_KEY: &str = "view";

type Start = Box<dyn FnOnce(&egui::Context) -> Result<Workbench, ThreadError>>;

/// Frames with a line in place of the workbench, so that the line is seen while shaders are compiled.
const FIRST_FRAMES: u32 = 2;

struct Window {
    /// None before the first frames.
    workbench: Option<Workbench>,
    start: Option<Start>,
    frames: u32,
    theme: Theme,
    /// Why the workbench could not be started.
    failure: Arc<Mutex<Option<ThreadError>>>,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.frames += 1;
        let screen = ui.input(|input| input.viewport().monitor_size);
        if self.frames == 1 && screen.is_some_and(|screen| overflows(ui.ctx().content_rect().size(), screen)) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Maximized(true));
        }
        if let Some(start) = self.start.take_if(|_| self.frames > FIRST_FRAMES) {
            match start(ui.ctx()) {
                Ok(workbench) => self.workbench = Some(workbench),
                Err(error) => {
                    *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                    ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
                }
            }
        }
        match &mut self.workbench {
            Some(workbench) => workbench.ui(ui),
            None => {
                let ink = theme::colour(self.theme.colours().quiet_text);
                let (middle, font) = (ui.max_rect().center(), egui::FontId::proportional(16.0));
                ui.painter().text(middle, egui::Align2::CENTER_CENTER, "Palpate: preparing the graphics …", font, ink);
                ui.ctx().request_repaint();
            }
        }
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::colour(self.workbench.as_ref().map_or(self.theme, |own| own.view().theme).colours().background)
            .to_normalized_gamma_f32()
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        if let Some(workbench) = &self.workbench {
            eframe::set_value(storage, VIEW_KEY, &workbench.kept_view());
        }
    }

    /// Little is lost where the program is killed.
    fn auto_save_interval(&self) -> std::time::Duration {
        std::time::Duration::from_secs(5)
    }

    /// The layout is stored in the view state, not in egui's memory.
    fn persist_egui_memory(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_that_does_not_fit_the_screen_is_maximised() {
        let overflows = |screen: [f32; 2]| overflows(FIRST_SIZE.into(), screen.into());
        assert!(overflows([1280.0, 800.0]) && overflows([1366.0, 768.0]) && overflows([1024.0, 1200.0]));
        assert!(!overflows([1920.0, 1080.0]));
    }
}
