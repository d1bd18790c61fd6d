//! Palpate: a workbench for soft grippers that recognise what they hold.
//!
//! # The tour
//!
//! ```text
//!  scene file, URDF / OBJ / STL
//!        |
//!   palpate_core   physics: state -> next state        (the convex step, written beside its equations)
//!        |         rig -> grasping -> trial -> store   (raw frames, append-only)
//!        |         trial + layout -> channels          (curvature, pressure, force; perfect sensors or real ones)
//!        |         channels -> verdict -> belief       (stage one: size, shape; stage two: class; the next grasp?)
//!        |         frame + view -> DrawList            (plain data, no graphics card)
//!        |
//!   palpate_render DrawList -> pixels                  (wgpu, the same in window, test and file)
//!        |
//!   palpate        app: the window;  cli: everything without it
//! ```
//!
//! Read in this order to understand a grasp:
//!
//! 1. [`palpate_sim::scene::Scene`], everything that can be set, and [`palpate_sim::objects::load`].
//! 2. [`palpate_sim::gripper`], what a finger and its pad are; [`palpate_sim::physics`], how they move.
//! 3. [`palpate_lab::grasping::grasp`], which runs a programme on a [`palpate_lab::gripper::Rig`] and returns a
//!    [`palpate_tactile::trial::Trial`].
//! 4. [`palpate_tactile::Sensors`], which reads channels off its frames.
//! 5. [`palpate_learn`], which answers them, and [`palpate_lab::grasping::Identification`], which adds up
//!    grasp after grasp until it is clear what is in the hand.
//! 6. [`palpate_lab::picture::Stage`], which turns a frame into a [`palpate_geometry::drawing::DrawList`], and
//!    [`palpate_render::Renderer`], which draws that.
//! 7. [`palpate_lab::workers::SimWorker`], the thread in which all this happens live,
//!    [`palpate_lab::workers::GripperWorker`], its like for the real gripper, and [`app::Workbench`], which shows both.
//!
//! # Where to add what
//!
//! | what | the one place |
//! |---|---|
//! | a built-in object | a function in `src/cli/workshop/sixteen.rs`; `palpate workshop` writes its folder |
//! | a panel | a file in `src/app/panels/` and a line in [`app::ALL_PANELS`]; its place in `src/app/modes.rs` |
//! | a mode of the window | a line and a layout in `src/app/modes.rs` |
//! | a key | a line in `src/app/keys.rs` |
//! | a headless command | a file in `src/cli/` and a line in its `Command` |
//! | a setting | a field of a struct below [`palpate_sim::scene::Scene`], and its range in `scene/check.rs` |
//! | a sensor layout | a line in `src/core/sensing/layout.rs` |
//! | a kind of thing to draw | a file in `src/render/passes/`, the shader of the same name, a line in `passes::ALL` |
//! | a recogniser | a file in `src/core/recognition/` and a line in [`palpate_learn::METHODS`] |
//! | a rig | a file in `src/core/rig/` that implements [`palpate_lab::gripper::Rig`] |
//! | a file format for objects | `src/core/objects/load.rs` |
//!
//! # What is deliberately absent
//!
//! The window steps no physics and waits for no disk: it sends commands and draws the newest snapshot. The renderer
//! knows no gripper: it draws meshes, soft fingers and arrows. Core knows no window and no graphics card. There is no
//! global state.

pub mod app;
pub mod cli;
