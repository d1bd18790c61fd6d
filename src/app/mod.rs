//! The window. [`Workbench`] is its contents, so that tests can drive it without a window; this file opens the window around
//! it.
//!
//! Panels, bars and keys read a [`PanelContext`] and push [`Action`]s. The workbench hands each action to the feature that
//! owns it. Simulation, gripper, store and tools run in threads of their own (see `workers` in the core): nothing here
//! steps physics or waits for a disk.
//!
//! # Layers
//!
//! A file imports only from rows above its own; a test reads this table. A folder stands for its files that have no row.
//!
//! | layer | files | content |
//! |---|---|---|
//! | base | `theme.rs` `icons.rs` `viewport.rs` `frame_rate.rs` `startup.rs` `traces.rs` `playback.rs` `derived.rs` `modes/mode.rs` `export.rs` `thumbnails.rs` | look, graphics, time shown |
//! | messages | `notices.rs` | messages to the user |
//! | source | `view_source.rs` `files.rs` | source shown, questions of the file dialog |
//! | view | `features/view.rs` `features/tools.rs` | view state; doctor, fit and training |
//! | inspect | `features/inspect.rs` | stored trials that are open or compared |
//! | shown | `shown.rs` | simulated, real or stored data at the time shown |
//! | simulation | `features/simulation.rs` | simulated gripper and its scene |
//! | gripper | `features/gripper.rs` `features/files.rs` | real gripper; opening and saving |
//! | workflow | `features/labelling.rs` `features/library.rs` `features/recognition.rs` `features/presenter.rs` `features/studies.rs` | labelling session; trial library; recognition by both grippers; presenter mode; studies of the paper |
//! | actions | `actions.rs` `features/` | actions of all features |
//! | context | `context.rs` | read-only context of panels |
//! | parts | `widgets.rs` `plots/` `figure_plot.rs` `heat_map.rs` `keys/binding.rs` | building blocks of panels and modes |
//! | curves | `channel_curves.rs` `shown_grasp.rs` `modes/` | curves of channels, heat maps of a grasp; layout and keys of each mode |
//! | layers | `contact_path.rs` `small_pads.rs` | layers of the 3-D view |
//! | panels | `panels/` `bars/` `keys/` | one file per panel |
//! | tiles | `tiling.rs` `palette.rs` `path_dialog.rs` `presenter/` | panels beside each other; command palette; file dialog; presenter mode |
//! | workbench | `workbench.rs` | owner of all features |
//! | picture | `offscreen.rs` | the window as a picture, without a display, and what its frames cost |
//! | window | `mod.rs` | the window |
//!
//! | to add | write | and register in |
//! |---|---|---|
//! | a panel | a file in `panels/` | `panels/mod.rs`, and the layout of a mode |
//! | a mode | its name in `modes/mode.rs`, its layout and keys in a file of `modes/` | `modes/mod.rs` |
//! | a feature | its state, actions and their application in a file of `features/` | `actions.rs`, `workbench.rs` |

mod actions;
mod bars;
mod channel_curves;
mod contact_path;
mod context;
mod derived;
mod export;
mod features;
mod figure_plot;
mod files;
mod frame_rate;
mod heat_map;
mod icons;
mod keys;
mod modes;
mod notices;
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
mod view_source;
mod viewport;
mod widgets;
mod workbench;

pub use actions::{Action, Actions};
pub use context::PanelContext;
pub use derived::Derivation;
pub use export::{ExportRequest, FileExportError};
pub use features::files::FileAction;
pub use features::gripper::GripperAction;
pub use features::inspect::{ComparedTrace, InspectAction, Inspected, Pinned};
pub use features::library::{LibraryAction, LibrarySelection, Reach};
pub use features::recognition::RecognitionAction;
pub use features::simulation::SimulationAction;
pub use features::studies::{Studies, StudyAction};
pub use features::tools::{GripperTools, GripperToolsSetup, ToolAction};
pub use features::view::{PathLayer, ViewAction, ViewState};
pub use modes::mode::Mode;
pub use notices::UserMessage;
pub use offscreen::{FrameCosts, OffscreenError, OffscreenWindow, film_presentation, frame_costs, window_picture};
pub use panels::{ALL as ALL_PANELS, PanelKind};
pub use playback::Seek;
pub use startup::{Surroundings, ThreadError, WindowError, check_surroundings};
pub use view_source::ViewSource;
pub use viewport::Viewport;
pub use workbench::{Workbench, WorkbenchSetup};

use palpate_lab::workers::GripperCommand;
use palpate_sim::scene::Scene;
use std::path::PathBuf;
use std::sync::Arc;

/// Options that the window opens with.
#[derive(Clone, Debug)]
pub struct WindowOptions {
    /// First scene.
    pub scene: Scene,
    /// Store of trials.
    pub store: PathBuf,
    /// Port of a real gripper to connect to.
    pub port: Option<PathBuf>,
    /// Recognition model for the real gripper; the last one used where none is named.
    pub model: Option<PathBuf>,
}

/// First and smallest size of the window (points).
const FIRST_SIZE: [f32; 2] = [1280.0, 820.0];
const LEAST_SIZE: [f32; 2] = [720.0, 480.0];

/// Opens the window and returns when it is closed.
pub fn open_window(options: WindowOptions) -> Result<(), WindowError> {
    let surroundings = check_surroundings()?;
    surroundings.apply();
    let native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Palpate")
            .with_app_id("palpate")
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
            workbench.act(&creation.egui_ctx, GripperCommand::Connect(Some(port)));
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
