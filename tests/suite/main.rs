//! Everything that takes more than one module to test, in one binary because linking is slow.
//!
//! - `architecture`: packages, layers, import cycles and the homes of third-party crates, read from the sources.
//! - `architecture_app`: the layers of the window's files.
//! - `physics`: whole grasps of every object; no allocation in a step.
//! - `determinism`: the same seed gives the same bytes.
//! - `files`: objects and scenes from elsewhere, sound and malformed.
//! - `frozen`: JSON, help pages, studies, answers of the shipped models, frames and columns of exports, as texts.
//! - `decoder_fuzz`: random bytes through the protocol decoder.
//! - `fuzz`: random scenes through the scene file.
//! - `trust`: trials that did not converge stay out of data sets.
//! - `adapting`: a gripper recognises without labels, after one close of its empty hand.
//! - `emulator`: the emulated gripper, with every fault, recorded and diagnosed.
//! - `serial`: a board on a pseudo-terminal, recorded, unplugged, killed.
//! - `serving`: the gripper controlled by other programs: every request, errors, lost connections, slow readers, random lines.
//! - `store`: kills and second programs.
//! - `command_line`: exit codes, messages, JSON.
//! - `checking`: golden signals of `palpate check`.
//! - `exports`: trials as MCAP, NPZ, figures, movies and pictures of the window.
//! - `outputs`: what is written replaces nothing else, and is what its name says.
//! - `packaging`: packages of a release, and the sources of the documentation site.
//! - `labelling`: trials of the real gripper flagged, labelled, undone, exported, learned from.
//! - `library`: all trials found and changed, in the window and on the command line.
//! - `datasets`: each grasp once, nothing mixed in silence, few and foreign trials judged.
//! - `learning`: collect, train, evaluate, recognise, and anybody's data.
//! - `calibration`: the emulated gripper calibrated and fitted.
//! - `gripper`: the thread that shares the real gripper's board between trials, recognition and calibration.
//! - `gripper_tools`: doctor and fit in the window.
//! - `training`: training on labelled trials of the board, in the window.
//! - `lab_day`: a day in a lab with a gripper of its own, from the doctor to taxels for another program.
//! - `desk`: a labelling afternoon in the window, by keys alone.
//! - `one_path`: the same fault recorded from the command line and from the window.
//! - `one_signal`: pads and strips measure the same in simulated, physical-like, emulated and recorded grasps.
//! - `studies`: stored results of studies, and what is made from them.
//! - `study_mode`: studies of the paper run, stopped, resumed and looked at in the window.
//! - `inspect`: stored trials opened, replayed and compared, as they were live.
//! - `panels`: the window by its labels, and small pictures of its panels.
//! - `keyboard`: every control by Tab, and keys of the widget that has the keyboard.
//! - `typing`: words typed into every text field.
//! - `window`: command palette, undo, keys without effect, files without a system dialog, sizes.
//! - `recognition_panel`: live recognition in the window, with a recogniser that follows a script.
//! - `signatures`: pads and heat maps over time in the window, clicked and switched.
//! - `pictures`: golden pictures of the off-screen view and of the window.
//!
//! Golden pictures and frozen texts are made anew by `UPDATE_SCREENSHOTS=1 cargo test --test suite`.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on stops where it stands")]

mod adapting;
mod allocations;
mod architecture;
mod architecture_app;
mod bench;
mod calibration;
mod cases;
mod checking;
mod command_line;
mod cpu_renderer;
mod datasets;
mod decoder_fuzz;
mod desk;
mod determinism;
mod emulator;
mod exports;
mod files;
mod frozen;
mod fuzz;
mod golden;
mod gripper;
mod gripper_file;
mod gripper_tools;
mod imports;
mod inspect;
mod keyboard;
mod lab_day;
mod labelling;
mod learning;
mod library;
mod one_path;
mod one_signal;
mod outputs;
mod packaging;
mod panels;
mod peers;
mod physics;
mod pictures;
mod presenter;
mod program;
mod reader_fuzz;
mod recognition_panel;
mod scripted;
mod serial;
mod serving;
mod signatures;
mod store;
mod streams;
mod studies;
mod study_mode;
mod training;
mod trust;
mod typing;
mod why;
mod window;
