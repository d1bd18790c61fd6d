//! Work with a gripper: grasp, record, recognise, label.
//!
//! # Terms
//!
//! A **gripper** (simulated, on a serial port, or replayed) emits events and takes a line pressure. The **grasp
//! controller** steps it through rest, closing, hold and release. Each sample becomes a **row** for plots and the
//! recogniser; the **recorder** thread stores the trial. After a trial, **flags** mark what to check. Grasps repeat
//! until the **belief** is certain: an **identification**.
//!
//! ```text
//! Gripper (sim | serial | replay) --events--> GraspController --rows--> plots, recogniser
//!               ^------ line pressure -----------'    '--trial--> Recorder (own thread) --> store --> flags
//! ```
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | [`gripper`] | the trait [`gripper::Gripper`]; simulated, serial and replayed grippers |
//! | 0 | [`labelling`] | flags of a trial, begin and end of a grasp, sensors that fail, trials to review |
//! | 0 | [`picture`] | scene and frame to a draw list; frames to heat maps |
//! | 1 | [`datasets`] | trials of a store as a data set; training on labelled trials; saved models |
//! | 2 | [`grasping`] | the grasp controller, runs, computing again, cost and error, collections, identification, error bands |
//! | 3 | [`recording`] | the recorder thread; recording of a real grasp |
//! | 4 | [`inspection`] | a stored trial opened: channels, fingers, phases and answers over time |
//! | 5 | [`why`] | why a model gave its answer: class signatures, evidence, nearest trials |
//! | 6 | [`workers`] | threads for the window: commands in, snapshots and rows out |
//!
//! # A grasp in six lines
//!
//! ```
//! use palpate_lab::grasping::{GraspSummary, grasp};
//! use palpate_sim::scene::Scene;
//!
//! let mut scene = Scene::default();
//! scene.object.source = "lemon".to_owned();
//! let object = scene.load_object()?;
//! let trial = grasp(&scene, object.as_ref(), 0);
//! let summary = GraspSummary::new(&trial, &scene);
//! assert!(summary.converged && summary.contact_onset_s.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//!
//! - Record raw, derive later: a trial keeps raw samples; layouts and calibrations are applied when it is read.
//! - Time is counted in whole ticks ([`palpate_sim::scene::Clock`]); equal seeds give equal bytes, on any number of
//!   threads.

pub mod datasets;
pub mod grasping;
pub mod gripper;
pub mod inspection;
pub mod labelling;
pub mod picture;
pub mod recording;
pub mod why;
pub mod workers;
