//! The window. [`Workbench`] is all of it but the window itself, so that tests can drive it; this file opens the window
//! around it and puts whatever the system lacks into words.
//!
//! Panels are given a read-only [`PanelContext`] and push [`Action`]s; [`Workbench`] alone applies them. The
//! simulation runs in its own thread (see [`palpate_lab::workers`]); nothing here steps physics or waits for a disk.

mod accuracy_dial;
mod actions;
mod bars;
mod files;
mod gripper_tools;
mod icons;
mod keys;
mod labelling;
mod modes;
mod panels;
mod plots;
mod startup;
mod theme;
mod tiling;
mod traces;
mod view_state;
mod viewport;
mod workbench;

pub use actions::{Action, DeskAction};
pub use gripper_tools::{GripperTools, GripperToolsSetup, ToolWish};
pub use modes::Mode;
pub use panels::{ALL as ALL_PANELS, PanelContext, PanelKind, Source};
pub use startup::{Surroundings, check_surroundings};
pub use view_state::ViewState;
pub use viewport::Viewport;
pub use workbench::{Workbench, WorkbenchSetup};

use palpate_lab::datasets::models_folder;
use palpate_lab::gripper::listen_to_port;
use palpate_lab::workers::{GripperWish, examine_port, explain_scene, fit_trials};
use palpate_learn::shipped_model;
use palpate_sim::scene::Scene;
use std::path::PathBuf;
use std::sync::Arc;

/// What the window opens with.
#[derive(Clone, Debug)]
pub struct WindowOptions {
    /// The first scene.
    pub scene: Scene,
    /// Where trials are stored.
    pub store: PathBuf,
    /// The port of a real gripper to connect to.
    pub port: Option<PathBuf>,
    /// The model that listens to the real gripper; the one of last time where none is named.
    pub model: Option<PathBuf>,
}

/// Size of the window when it is opened for the first time, and the smallest it can be made (points).
const FIRST_SIZE: [f32; 2] = [1280.0, 820.0];
const LEAST_SIZE: [f32; 2] = [720.0, 480.0];

/// Opens the window and returns when it is closed. The error is a text for the user.
pub fn open_window(options: WindowOptions) -> Result<(), String> {
    let surroundings = check_surroundings()?;
    surroundings.apply();
    let native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Palpate")
            .with_app_id("palpate")
            .with_inner_size(FIRST_SIZE)
            .with_min_inner_size(LEAST_SIZE),
        wgpu_options: wgpu_options(),
        event_loop_builder: surroundings.event_loop_hook(),
        ..Default::default()
    };
    let creator: eframe::AppCreator<'_> = Box::new(move |creation| {
        let render_state = creation.wgpu_render_state.as_ref().ok_or("the window has no graphics device")?;
        let mut view: ViewState = creation.storage.and_then(|s| eframe::get_value(s, VIEW_KEY)).unwrap_or_default();
        view.gripper_model = options.model.or(view.gripper_model);
        let wake_context = creation.egui_ctx.clone();
        let setup = WorkbenchSetup {
            scene: options.scene,
            store: options.store,
            view,
            model: shipped_model().map(Arc::new).map_err(|cause| cause.to_string()),
            explain: Arc::new(explain_scene),
            listen: Arc::new(listen_to_port),
            tools: GripperToolsSetup {
                examine: Arc::new(examine_port),
                fit: Arc::new(fit_trials),
                models: models_folder(),
            },
            playing: true,
            wake: Arc::new(move || wake_context.request_repaint()),
            render_state: Some(render_state),
        };
        let mut workbench = Workbench::new(&creation.egui_ctx, setup)?;
        if let Some(port) = options.port {
            workbench.act(&creation.egui_ctx, Action::Gripper(GripperWish::Connect(Some(port))));
        }
        Ok(Box::new(Window { workbench }))
    });
    eframe::run_native("palpate", native, creator).map_err(|error| surroundings.explain(&error))
}

/// The window asks for no more of the graphics driver than the renderer needs.
fn wgpu_options() -> egui_wgpu::WgpuConfiguration {
    let mut setup = egui_wgpu::WgpuSetupCreateNew::without_display_handle();
    setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("palpate window"),
        required_limits: palpate_render::wanted_limits(adapter),
        ..Default::default()
    });
    egui_wgpu::WgpuConfiguration { wgpu_setup: setup.into(), ..Default::default() }
}

use palpate_render::wgpu;

/// Where the view state lies in eframe's storage.
const VIEW_KEY: &str = "view";

struct Window {
    workbench: Workbench,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.workbench.ui(ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, VIEW_KEY, self.workbench.view());
    }

    /// Widths of panels and scroll positions come from the layout, not from egui's memory.
    fn persist_egui_memory(&self) -> bool {
        false
    }
}
