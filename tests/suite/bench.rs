//! A workbench without a window, for tests: it stands still until told, so that pictures and numbers repeat.

use crate::scripted;
use egui_kittest::kittest::Queryable as _;
use egui_kittest::{Harness, TestRenderer};
use palpate::app::{App, GripperToolsSetup, PanelKind, ViewState, Workbench, WorkbenchSetup};
use palpate_geometry::palette::Theme;
use palpate_lab::gripper::{Listen, listen_to_port};
use palpate_lab::workers::{Command, Examine, Snapshot, examine_port};
use palpate_learn::{ModelError, Models};
use palpate_sim::objects::ObjectError;
use palpate_sim::scene::Scene;
use palpate_store::Store;
use palpate_study::jobs::{FitTrials, explain_scene, fit_trials};
use palpate_study::{Explanation, Measuring};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// What a test starts from.
pub(crate) struct BenchSetup {
    pub(crate) object: &'static str,
    pub(crate) theme: Theme,
    pub(crate) size: [f32; 2],
    /// Draw this panel alone instead of the whole window.
    pub(crate) panel: Option<&'static PanelKind>,
    pub(crate) render_state: Option<egui_wgpu::RenderState>,
    /// What recognises, or why nothing does.
    pub(crate) models: Result<Models, ModelError>,
    /// Listens to the board of a real gripper.
    pub(crate) listen: Listen,
    /// Looks at its port for the doctor.
    pub(crate) examine: Examine,
    /// Fits the finger to recorded trials.
    pub(crate) fit: FitTrials,
    /// Puts something into the store before the window opens it.
    pub(crate) fill: fn(&mut Store),
}

impl Default for BenchSetup {
    fn default() -> Self {
        Self {
            object: "lemon",
            theme: Theme::Dark,
            size: [1280.0, 820.0],
            panel: None,
            render_state: None,
            models: Ok(scripted::models(&scripted::model())),
            listen: Arc::new(listen_to_port),
            examine: Arc::new(examine_port),
            fit: Arc::new(fit_trials),
            fill: |_| (),
        }
    }
}

/// Measures as the window does, but for times, which are made up so that pictures repeat.
fn explain_steadily(scene: &Scene, how: &Measuring<'_>) -> Result<Option<Explanation>, ObjectError> {
    let steady = |mut explanation: Explanation| {
        explanation.cpu_ms = 12.3;
        for (k, effect) in explanation.effects.iter_mut().enumerate() {
            effect.cost_share = [0.41, 0.01, 0.12, 0.30, -0.08, 0.04, 0.0, 0.0, 0.01][k % 9];
        }
        explanation
    };
    Ok(explain_scene(scene, how)?.map(steady))
}

/// After this long something hangs, however busy the machine is.
pub(crate) const HANG: Duration = Duration::from_secs(300);

/// The workbench and the harness that drives it.
pub(crate) struct Bench {
    pub(crate) harness: Harness<'static, Option<Workbench>>,
    woken: Receiver<()>,
    store: tempfile::TempDir,
}

impl Bench {
    pub(crate) fn new(setup: BenchSetup, renderer: impl TestRenderer + 'static) -> Self {
        let store = tempfile::tempdir().unwrap();
        let path = store.path().join("trials.sqlite");
        let (wake, woken) = channel();
        let mut scene = Scene::default();
        setup.object.clone_into(&mut scene.object.source);
        let BenchSetup { theme, panel, render_state, size, models, listen, examine, fit, fill, .. } = setup;
        fill(&mut Store::open(&path).unwrap());
        let draw = move |ui: &mut egui::Ui, workbench: &mut Option<Workbench>| {
            let ctx = ui.ctx().clone();
            let workbench = workbench.get_or_insert_with(|| {
                let wake = wake.clone();
                let setup = WorkbenchSetup {
                    scene: scene.clone(),
                    store: path.clone(),
                    view: ViewState { theme, ..ViewState::default() },
                    models: models.clone(),
                    explain: Arc::new(explain_steadily),
                    listen: Arc::clone(&listen),
                    tools: GripperToolsSetup {
                        examine: Arc::clone(&examine),
                        fit: Arc::clone(&fit),
                        models: path.with_file_name("models"),
                    },
                    playing: false,
                    wake: Arc::new(move || {
                        // The test may have stopped listening.
                        let _heard = wake.send(());
                    }),
                    render_state: render_state.as_ref(),
                    cleared: false,
                };
                Workbench::new(&ctx, setup).unwrap()
            });
            // The harness leaves a margin that a window does not have.
            let whole = ctx.content_rect();
            let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(whole));
            ui.set_clip_rect(whole);
            match panel {
                Some(panel) => workbench.panel_ui(&mut ui, panel),
                None => workbench.ui(&mut ui),
            }
        };
        let harness = Harness::builder().with_size(size).renderer(renderer).build_ui_state(draw, None);
        let mut bench = Self { harness, woken, store };
        bench.until(|snapshot| snapshot.status.loading.is_none());
        bench
    }

    /// Draws until the simulation is as wanted.
    pub(crate) fn until(&mut self, wanted: impl Fn(&Snapshot) -> bool) -> Arc<Snapshot> {
        let began = Instant::now();
        loop {
            self.harness.step();
            if let Some(snapshot) = self.workbench().snapshot().filter(|s| wanted(s)) {
                // Once more, so that what has just come is on the screen.
                self.harness.step();
                return snapshot;
            }
            assert!(began.elapsed() < HANG, "the simulation is never as wanted: {:?}", self.workbench().messages());
            self.woken.recv_timeout(HANG).expect("the simulation is alive");
        }
    }

    pub(crate) fn workbench(&self) -> &Workbench {
        self.harness.state().as_ref().expect("made in the first frame")
    }

    pub(crate) fn tell(&mut self, action: impl FnOnce(&mut App)) {
        self.harness.state_mut().as_mut().expect("made in the first frame").act(action);
    }

    /// Draws until the effects of the scene at hand have been measured.
    pub(crate) fn until_effects_are_measured(&mut self) {
        while self.harness.query_by_label_contains("costs are shares of").is_none() {
            self.woken.recv_timeout(HANG).expect("the measurement is alive");
            self.harness.step();
        }
    }

    /// Draws until something is on the screen, or is there no more.
    pub(crate) fn until_shown(&mut self, shown: bool, text: &str) {
        // What has just been clicked or told takes effect here.
        self.harness.step();
        let began = Instant::now();
        while began.elapsed() < HANG {
            if self.harness.query_all_by_label_contains(text).next().is_some() == shown {
                return;
            }
            self.wait();
        }
        panic!("\"{text}\" is {}there; said: {:?}", if shown { "not " } else { "" }, self.workbench().messages());
    }

    /// Draws until the user has been told something.
    pub(crate) fn until_told(&mut self, text: &str) {
        let began = Instant::now();
        while began.elapsed() < HANG {
            if self.workbench().messages().iter().any(|message| message.contains(text)) {
                return;
            }
            self.wait();
        }
        panic!("\"{text}\" was never said: {:?}", self.workbench().messages());
    }

    /// The window, drawn until its layout stands still: axes of plots have their width in the second frame.
    pub(crate) fn picture(&mut self) -> image::RgbaImage {
        self.harness.run_steps(2);
        self.harness.render().unwrap()
    }

    /// Waits until something has happened, and draws.
    pub(crate) fn wait(&mut self) {
        self.woken.recv_timeout(HANG).expect("the window is woken");
        self.harness.step();
    }

    /// The store, opened beside the window.
    pub(crate) fn store(&self) -> Store {
        Store::open(&self.store_folder().join("trials.sqlite")).unwrap()
    }

    pub(crate) fn store_folder(&self) -> &Path {
        self.store.path()
    }

    /// What the plan has next.
    pub(crate) fn next_object(&self) -> String {
        let store = self.store();
        let trials = store.labels().trials().unwrap();
        let last = trials.iter().rev().find(|trial| trial.counts()).and_then(|trial| trial.object.as_deref());
        store.labels().plan().unwrap().progress(&trials).next(last).unwrap().object
    }

    /// Runs the grasp up to `t` seconds and leaves it standing there.
    pub(crate) fn advance_to(&mut self, t: f64) {
        loop {
            let now = self.workbench().snapshot().expect("loaded").frame.t;
            if now > t - 1e-9 {
                return;
            }
            self.tell(|app| app.simulation.send(Command::Step));
            self.until(|snapshot| snapshot.frame.t > now);
        }
    }
}
