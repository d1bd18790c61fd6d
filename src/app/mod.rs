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
//! | panels | `panels/` `bars/` | one file per panel |
//! | keys | `keys/` | keys of all modes, and their sheet |
//! | tiles | `tiling.rs` `palette.rs` `path_dialog.rs` `import_dialog.rs` `presenter/` | panels beside each other; command palette; file and import dialogs; presenter mode |
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

use palpate_serve::{Clients, DeskSetup};
use palpate_sim::scene::Scene;
use std::path::PathBuf;
use std::sync::Arc;

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
}

/// First and smallest size of the window (points).
const FIRST_SIZE: [f32; 2] = [1280.0, 820.0];
const LEAST_SIZE: [f32; 2] = [720.0, 480.0];
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
        ..Default::default()
    };
    let creator: eframe::AppCreator<'_> = Box::new(move |creation| {
        let render_state = creation.wgpu_render_state.as_ref().ok_or("the window has no graphics device")?;
        let mut view: ViewState = creation.storage.and_then(|s| eframe::get_value(s, VIEW_KEY)).unwrap_or_default();
        view.gripper_model = options.model.or(view.gripper_model);
        let wake_context = creation.egui_ctx.clone();
        let wake = Arc::new(move || wake_context.request_repaint());
        let setup = WorkbenchSetup {
            render_state: Some(render_state),
            cleared: true,
            ..WorkbenchSetup::new(options.scene, options.store, view, wake)
        };
        let mut workbench = Workbench::new(&creation.egui_ctx, setup)?;
        if let Some(port) = options.port {
            workbench.act(|app| app.connect(Some(port)));
        }
        if let Some((desk, clients)) = options.serve {
            workbench.act(|app| app.serve(desk, clients));
        }
        Ok(Box::new(Window { workbench }))
    });
    eframe::run_native("palpate", native, creator).map_err(|error| surroundings.explain(&error))
}

/// Key of the view state in eframe's storage.
const VIEW_KEY: &str = "view";

struct Window {
    workbench: Workbench,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.workbench.ui(ui);
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::colour(self.workbench.view().theme.colours().background).to_normalized_gamma_f32()
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, VIEW_KEY, self.workbench.view());
    }

    /// The layout is stored in the view state, not in egui's memory.
    fn persist_egui_memory(&self) -> bool {
        false
    }
}
