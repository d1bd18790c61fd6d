//! Palpate: a workbench for soft grippers that recognise objects by touch.
//!
//! # Packages, lowest first
//!
//! A package uses only those that its row names; the compiler and a test check it. Each package lists its own modules
//! the same way. `most lines` is the largest number of production lines allowed; blank lines, comments, tests and
//! examples do not count. A test checks it. Lower the number when code goes; a commit that raises it gives the reason.
//!
//! | package | folder | holds | uses | most lines |
//! |---|---|---|---|---|
//! | [`palpate-geometry`](palpate_geometry) | `src/geometry` | meshes, solids, distance grids, mass; draw list, camera, colours, units | | 3194 |
//! | [`palpate-sim`](palpate_sim) | `src/sim` | a scene in, frames out: objects, gripper, scene files, physics, poses | `geometry` | 9856 |
//! | [`palpate-tactile`](palpate_tactile) | `src/tactile` | simulated frames or raw converter counts in, sensor channels (curvature, pressure, force) out: trials, layouts, sensor models, calibration | `geometry` `sim` | 3680 |
//! | [`palpate-learn`](palpate_learn) | `src/learn` | arrays in, class probabilities (PMF: probability mass function) out: networks, baselines, training, metrics, model files, comparison of methods | | 9735 |
//! | [`palpate-device`](palpate_device) | `src/device` | bytes in, readings out: serial protocol, ports, doctor, emulator | `geometry` `sim` `tactile` | 5625 |
//! | [`palpate-store`](palpate_store) | `src/store` | trials, labels and calibrations in SQLite | `geometry` `sim` `tactile` | 4185 |
//! | [`palpate-lab`](palpate_lab) | `src/lab` | grippers behind one interface, grasping, recording, labelling, background threads | `geometry` `sim` `tactile` `learn` `device` `store` | 14434 |
//! | [`palpate-exchange`](palpate_exchange) | `src/exchange` | trials as files of other programs: CSV, MCAP, NPZ, Parquet, LeRobot, glTF | `geometry` `sim` `tactile` `learn` `store` `lab` | 5573 |
//! | [`palpate-study`](palpate_study) | `src/study` | a grid of factors in, tables, figures and claims out: the frame of all studies, the studies, and their background tasks | `geometry` `sim` `tactile` `learn` `device` `store` `lab` | 13200 |
//! | [`palpate-render`](palpate_render) | `src/render` | a draw list in, pixels out (wgpu; the same in window, test and file); figures with axes | `geometry` | 3123 |
//! | [`palpate-serve`](palpate_serve) | `src/serve` | requests of other programs in, what the gripper says out: messages, clients, the emulated gripper in place of a port | `sim` `tactile` `device` `store` `lab` | 1083 |
//! | `palpate` | `src/app` `src/cli` | [`app`]: the window; [`cli`]: all commands | `geometry` `sim` `tactile` `learn` `device` `store` `lab` `exchange` `study` `render` `serve` | 24645 |
//! | `palpate-workshop` | `src/workshop` | development only: makes shipped models, thumbnails and generated tables | `geometry` `sim` `tactile` `learn` `store` `lab` `study` `render` | 508 |
//!
//! # One path for every grasp
//!
//! ```text
//! Gripper (sim | serial | replay) --events--> GraspController --rows--> plots, recogniser
//!               ^------ line pressure -----------'    '--trial--> Recorder (own thread) --> store --> flags
//! ```
//!
//! | question | the one place |
//! |---|---|
//! | Where are bytes of the board parsed? | [`palpate_device::protocol`] |
//! | Where does a grasp run? | [`palpate_lab::grasping::GraspController`] |
//! | Where is a trial recorded? | [`palpate_lab::recording`] |
//! | Which grasp comes next? | [`palpate_lab::grasping::Advisor`] |
//! | Where does a model learn a new object? | [`palpate_lab::grasping::Lessons`] |
//!
//! # Four roads through the code
//!
//! Read them in order, each from its first row to its last. The [`manual`] has a chapter for each topic of
//! `palpate help`, among them [`manual::contributing`].
//!
//! ## From a scene to pixels
//!
//! | step | what happens |
//! |---|---|
//! | [`palpate_sim::scene::Scene`] | every setting of a grasp; a TOML file |
//! | [`palpate_sim::objects::load`] | the object: mesh, mass, distance grid |
//! | [`palpate_sim::gripper`], [`palpate_sim::physics`] | finger and pad, and their motion; one file per effect |
//! | [`palpate_lab::gripper::Gripper`] | events out, line pressure in: here the simulated one |
//! | [`palpate_lab::grasping::GraspController`] | rest, close, hold, release; [`palpate_lab::grasping::grasp`] runs them to the end |
//! | [`palpate_lab::workers::SimWorker`] | the thread that publishes the newest frame |
//! | [`palpate_lab::picture::Stage`] | scene and frame to a [`palpate_geometry::drawing::DrawList`] |
//! | [`palpate_render::Renderer`] | the list to pixels, for [`app::Workbench`], files and tests alike |
//!
//! ## From a byte to a plot
//!
//! | step | what happens |
//! |---|---|
//! | [`palpate_device::serial::SerialLink`] | bytes of the port, with the times at which they came |
//! | [`palpate_device::protocol::Decoder`] | bytes to [`palpate_device::protocol::BoardEvent`]: readings, gaps, replies |
//! | [`palpate_lab::gripper::SerialGripper`] | the same events as those of the simulated gripper |
//! | [`palpate_tactile::calibration::Readout`] | counts of a reading to curvature and force |
//! | [`palpate_lab::grasping::Row`] | one value per channel, for plots and recognisers |
//! | [`palpate_lab::workers::GripperWorker`] | the thread that publishes rows, which `src/app/traces.rs` keeps and `src/app/plots` draws |
//!
//! ## From a trial to a figure
//!
//! | step | what happens |
//! |---|---|
//! | [`palpate_lab::recording::Recorder`] | a simulated trial into the store at its end; bytes and readings of a board while the grasp runs |
//! | [`palpate_store::Store`] | trials on disk; [`palpate_lab::labelling`]: flags, and where a grasp begins and ends |
//! | [`palpate_tactile::Sensors`] | channels of a frame, derived when the trial is read |
//! | [`palpate_lab::inspection::OpenTrial`] | a trial opened: channels, phases, answers over time |
//! | [`palpate_lab::inspection::comparison_figure`] | trials as a figure, which [`palpate_render::figure_svg`] and the window draw |
//!
//! ## From a study to a claim
//!
//! | step | what happens |
//! |---|---|
//! | [`palpate_lab::grasping::collect()`], [`palpate_lab::datasets`] | grasps: simulated for the study, or chosen from a store |
//! | [`palpate_study::paper::StudyPlan`] | what a study runs on: size, preset, sensors, trials, seed; a study lists its cells from it (one combination of factors, tested on one part of the grasps) |
//! | [`palpate_learn::METHODS`], [`palpate_learn::evaluation`] | a recogniser fitted on some grasps and judged on others |
//! | [`palpate_study::Experiment`] | what all studies have: a grid of cells, how one is measured, the report on all |
//! | [`palpate_study::Finding`] | a claim: a sentence of the paper, a verdict, the intervals that decide |
//! | `assets/studies`, [`palpate_study::generated_sections`] | stored results, and the tables that the manual prints of them |
//!
//! # Programs to begin with
//!
//! | program | shows |
//! |---|---|
//! | `src/exchange/examples/grasp_to_csv.rs` | a simulated grasp of an object, as a table |
//! | `src/lab/examples/recognise_trial.rs` | the answer of the shipped model to a stored trial |
//! | `src/study/examples/own_study.rs` | a study of your own: a grid of grasps in parallel, kept, resumed, as a table |
//! | `src/learn/examples/plain_candle.rs` | a network in plain candle, judged like the built-in recognisers |
//! | `src/device/examples/read_board.rs` | readings of a board on a serial port |
//! | `src/render/examples/draw_trial.rs` | a picture of a stored trial |
//!
//! Each runs with `cargo run --release -p PACKAGE --example NAME`.
//!
//! # Where to add what
//!
//! | what | the one place |
//! |---|---|
//! | a built-in object | a folder of `assets/objects`: URDF, meshes, facts; `cargo run -p palpate-workshop -- thumbnails` draws its picture |
//! | a panel | a file in `src/app/panels/` and a line in [`app::ALL_PANELS`]; its place in a layout of `src/app/modes/` |
//! | a mode of the window | a file in `src/app/modes/` and its name in `src/app/features/view.rs` |
//! | an action of the window | a method in `src/app/features/`; with a name, a line in `src/app/keys/common.rs` or in its mode |
//! | a feature of the window | a file in `src/app/features/`, and a field of its [`app::App`] |
//! | a command | a file in `src/cli/` and a line in its `Command` |
//! | a chapter of the manual | a file in `assets/help/` and a line in `src/manual.rs` |
//! | a setting | a field of a struct below [`palpate_sim::scene::Scene`], and its range in `src/sim/scene/check.rs` |
//! | a physical effect | a file in `src/sim/physics/effects/` and a line in its `mod.rs` |
//! | a file format for objects | `src/sim/objects/load.rs` |
//! | a sensor layout | a line in `src/tactile/layout.rs` |
//! | a sensor model | a file in `src/tactile/model/` |
//! | a recogniser | a file in `src/learn/` and a line in [`palpate_learn::METHODS`] |
//! | a format of the text lines that boards send | `src/device/protocol/fields.rs` |
//! | a check of `palpate doctor` (diagnostics of board and connection) | a function, and a line in `src/device/doctor/checks.rs` |
//! | a gripper | a file in `src/lab/gripper/` that implements [`palpate_lab::gripper::Gripper`] |
//! | a flag of recorded trials | `src/store/labels/flag.rs` and its rule in `src/lab/labelling/flags.rs` |
//! | a filter or column of the trial library | `src/store/library/`, its option in `src/cli/trials/selection.rs` |
//! | an edit of many trials | `src/store/labels/edit.rs` and `src/store/label_repository.rs` |
//! | a column of CSV files of trials | `src/exchange/csv_files/` |
//! | a table of the store | `TABLES` in `src/store/schema.rs`, another `SCHEMA_VERSION`, and a repository beside it |
//! | another file format for exported trials (MCAP, NPZ, ..) | a file in `src/exchange/` and a line in [`palpate_exchange::FORMATS`] |
//! | a request of other programs | `src/serve/messages.rs`, and what it does in `src/serve/desk.rs` |
//! | a background task of the window | a function in `src/lab/workers/` or `src/study/jobs/` that returns a `Job`, and the feature that owns it |
//! | a study | an `Experiment` in a file of `src/study/`, a line in `src/study/all.rs` for the window, and its arguments in `src/cli/study/` |
//! | a study of the paper | a file in `src/study/paper/` and a line in `PAPER_STUDIES`; command line and window show it |
//! | full results of a study, and its tables in the manual | its file in `assets/studies/`, a line in `src/study/frame/shipped.rs` and in `src/study/generated.rs` |
//! | a surface finish (metal, rubber, ..) | a variant in `src/geometry/finish.rs`, and its shading in `src/render/passes/solid.rs` |
//! | a kind of thing to draw | a file in `src/render/passes/`, the shader of the same name, a line in `passes::ALL` |
//!
//! # What is deliberately absent
//!
//! The window steps no physics and waits for no disk: it sends commands and draws the newest snapshot. The renderer
//! knows no gripper: it draws meshes, soft fingers and arrows. No package below `palpate-render` and `palpate` needs a
//! window or a graphics card. There is no global state but built-in objects, which are loaded once.

pub mod app;
pub mod cli;
pub mod manual;
