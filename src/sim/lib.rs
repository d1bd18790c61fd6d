//! Soft-gripper simulation: a scene in, frames out.
//!
//! # Terms
//!
//! A **finger** is a chain of N joints, bent by **line pressure** in its chamber; its inner side is a soft **pad**
//! tiled with **taxels**. Two fingers make a **gripper**. A **scene** describes object, gripper, support, pressure
//! **programme**, physical **effects** and accuracy. A simulation of it gives **frames**: joint angles, object pose,
//! line pressure and taxel loads at each sample.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | `version` | version of the physics, hashes of grasps |
//! | 0 | [`gripper`] | description of finger, pad, taxels, actuation and programme; kinematics of a bent finger |
//! | 1 | [`objects`] | URDF, OBJ and STL files, the sixteen built-in objects |
//! | 2 | [`scene`] | scene files: every setting, with its range and default |
//! | 3 | [`frame`] | samples, plan of effects and numerical quality |
//! | 4 | [`physics`] | convex implicit step, contact, effects, placement; rapier as a second engine |
//! | 5 | [`run`] | a simulation on its clock: samples and actuation ticks in order |
//! | 6 | [`poses`] | random poses of gripper and object, named by a seed |
//! | 7 | `bench` | benchmark of the simulator alone, a program of its own |
//!
//! # Example
//!
//! ```
//! use palpate_sim::{run::SimRun, scene::Scene};
//!
//! let mut scene = Scene::default();
//! scene.object.source = "lemon".to_owned();
//! let object = scene.load_object()?;
//! let (mut run, _placement) = SimRun::new(&scene, object.as_ref());
//! let frames = run.run_programme(&scene.programme)?;
//! assert_eq!(frames.len(), 300); // 4 s at 75 Hz
//! assert!(run.quality().converged);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//!
//! - SI units and [`f64`]; another unit is in the name. Poses are called `outer_from_inner`.
//! - Time is counted in whole ticks ([`scene::Clock`]); equal scenes give equal frames, on any number of threads.
//! - Input is checked where it enters ([`scene::Scene::check`]); later, a wrong number is a bug.
//!
//! # Features
//!
//! `rapier` (on by default) adds the second engine and the resting faces of objects. Without it, scenes that need
//! either are refused. `bench` builds the benchmark: `cargo run --release
//! -p palpate-sim --no-default-features --features bench`.

pub mod frame;
pub mod gripper;
pub mod objects;
pub mod physics;
pub mod poses;
pub mod run;
pub mod scene;
mod version;

pub use version::{PHYSICS_VERSION, fingerprint};
