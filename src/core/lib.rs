//! Palpate's core: everything but the window and the graphics card. It builds alone, on a cluster node too.
//!
//! # The words
//!
//! A **finger** is a chain of N joints, bent by **line pressure** in its chamber; its inner side is a soft **pad** tiled
//! with **taxels**. Two fingers make a gripper. A **scene** says what is grasped and how; a **grasp** closes, holds and
//! releases; what was sampled meanwhile is a **trial**. A **layout** (C1 .. C8) says which **channels** of curvature,
//! pressure and force are derived from a trial. A recogniser answers them: **stage one** says size and shape, stage two
//! gives a **PMF** over classes, and what successive grasps of one object come to is a **belief**.
//!
//! # The map, lowest layer first
//!
//! A module imports only from layers above its own in this list; a test reads the sources and checks it.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | [`units`], [`palette`] | conversions at the edges (SI inside), colours and colour maps |
//! | 1 | [`geometry`] | poses, circle fit, hulls, meshes and their repair, signed distance, mass properties |
//! | 2 | [`drawing`] | what can be drawn: a plain [`drawing::DrawList`], and the camera |
//! | 2 | [`objects`], [`gripper`] | URDF, OBJ, STL and the sixteen; what a finger, a pad and a programme are |
//! | 3 | [`trial`], [`board`] | plain frames and trials; what a sensor board sends |
//! | 4 | [`scene`] | the scene file: everything a user may set |
//! | 4 | [`wire`] | bytes of a sensor board to stamped readings and gaps |
//! | 5 | [`physics`] | the convex implicit step, contact, placement, resting faces, and a simulation on a clock of whole ticks |
//! | 6 | [`sensing`] | layouts, curvature and pressure, from a trial's raw frames; what real sensors make of them |
//! | 7 | [`rig`] | a gripper that can be told a pressure and read: simulated, or replayed |
//! | 7 | [`labelling`] | what to record next, where a grasp begins and ends, what is wrong with a trial, what to look at again |
//! | 8 | [`recording`] | the SQLite store, CSV in and out |
//! | 9 | [`recognition`] | PMFs, the macro-layer on a kernel of our own, DS-LSTM and iDS-LSTM, rivals, metrics, models on disk |
//! | 10 | [`grasping`] | one grasp on any rig, random poses, data sets, grasp after grasp until it is clear what is held |
//! | 11 | [`pretended`] | a gripper that is not there: its firmware, its hidden parts, its pseudo-terminal, its faults |
//! | 11 | [`doctor`] | what is wrong between board and computer, with cause and fix |
//! | 12 | [`study`] | measurements and comparisons as functions |
//! | 13 | [`picture`] | scene and frame to [`drawing::DrawList`] |
//! | 14 | [`workers`] | named threads: commands in, snapshots and rows out |
//!
//! # A grasp in six lines
//!
//! ```
//! use palpate_core::{grasping::{GraspSummary, grasp}, scene::Scene};
//!
//! let mut scene = Scene::default();
//! scene.object.source = "lemon".to_owned();
//! let object = scene.load_object()?;
//! let trial = grasp(&scene, object.as_ref(), 0);
//! let summary = GraspSummary::new(&trial, &scene);
//! assert!(summary.converged && summary.contact_onset_s.is_some());
//! # Ok::<(), palpate_sim::objects::ObjectError>(())
//! ```
//!
//! # What holds everywhere
//!
//! - SI units inside, [`f64`] in the physics; another unit is in the name. Poses are called `outer_from_inner`.
//! - Record raw, derive later: a trial keeps what was felt, never what some layout makes of it.
//! - Time is counted in whole ticks ([`scene::Clock`]); the same seed gives the same bytes, whatever the threads.
//! - What comes from outside is checked where it comes in; after that, a wrong number is our own bug.

pub mod board;
pub mod doctor;
pub mod drawing;
pub mod geometry;
pub mod grasping;
pub mod gripper;
pub mod labelling;
pub mod objects;
pub mod palette;
pub mod physics;
pub mod picture;
pub mod pretended;
pub mod recognition;
pub mod recording;
pub mod rig;
pub mod scene;
pub mod sensing;
pub mod study;
pub mod trial;
pub mod units;
pub mod wire;
pub mod workers;
