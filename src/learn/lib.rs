//! Recognition: labelled grasps in, probability mass functions (PMFs) over object classes out.
//!
//! This package knows arrays and class names only: no scenes, no stores, no sensors. A [`Recogniser`] is fitted to a
//! [`Dataset`] by a [`Method`] and answers a [`Sequence`] of readings with a [`Verdict`]. The verdicts on several
//! grasps of one object accumulate in a [`Belief`]; [`StopRule`] decides when to stop grasping.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers. Most are private; their items stand at the root of the crate.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | `data` | sequences, labels, data sets |
//! | 0 | `pmf`, `mirror`, `arrays` | probabilities; channels of the mirrored gripper; named parameters of a model |
//! | 0 | [`metrics`] | confusion, calibration, intervals, tests of differences |
//! | 1 | `belief`, `fitting` | belief after several grasps, rejection, stop rule; options and errors of a fit |
//! | 1 | `split`, `learned` | splits into training and test trials; the grasps that a model learned |
//! | 1 | `temperature` | calibration of probabilities |
//! | 1 | `tensor_file` | safetensors files |
//! | 1 | `rows` | training rows of features, and models that classify them |
//! | 1 | `gaps` | readings that are not finite numbers |
//! | 1 | `signatures` | mean and spread of each class over time |
//! | 2 | `sound` | what channels tell of each other, to find and replace a sensor that fails |
//! | 2 | `features` | a grasp as a row of features |
//! | 2 | `recogniser` | the interface of recognisers |
//! | 2 | `forest` | decision trees and their ensembles |
//! | 2 | `answer_sets` | classes that are left, with a promise |
//! | 3 | `leaks` | whether labels can be told by something else than touch |
//! | 3 | `model`, [`evaluation`] | a trained model with its card; its results on test grasps |
//! | 4 | `hub_card` | card of a model for hubs |
//! | 4 | [`network`] | the paper's networks: LSTM kernel, macro-layer, training, dual-stage LSTM |
//! | 5 | `baselines` | methods for comparison: features with trees, SVM or KNN; DTW; convolution. The geometry encoder |
//! | 6 | `methods` | table of all methods |
//! | 7 | [`comparison`], [`search`] | methods fitted and judged on the same grasps; a grid search for settings |
//! | 7 | `model_file` | model files; the shipped models |
//!
//! To add a recogniser, write its file and add one line to [`METHODS`].
//!
//! # Example
//!
//! ```
//! use palpate_learn::{Class, Dataset, Example, Fitting, Labels, Sequence, method};
//! use std::sync::{Arc, atomic::AtomicBool};
//!
//! // Two classes that differ in the level of one channel.
//! let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
//! let grasp = |level: f32| {
//!     Arc::new(Sequence { t_s: (0..300).map(|k| k as f32 / 75.0).collect(), values: vec![level; 300] })
//! };
//! let data = Dataset {
//!     channels: vec!["pressure_left".to_owned()],
//!     labels: Labels { classes: vec![class("ball"), class("cube")], ..Labels::default() },
//!     examples: (0..20)
//!         .map(|k| Example { id: k, class: k as usize % 2, grasp: grasp((k % 2) as f32), ..Example::default() })
//!         .collect(),
//!     ..Dataset::default()
//! };
//! let stop = AtomicBool::new(false);
//! let model = method("decision-tree").expect("in METHODS").train(&data, &Fitting::new(1, true, &stop))?;
//! let verdict = model.recogniser.recognise(&grasp(1.0), None);
//! assert_eq!(verdict.pmf.top().0, 1);
//! # Ok::<(), palpate_learn::LearnError>(())
//! ```

mod answer_sets;
mod arrays;
mod baselines;
mod belief;
pub mod comparison;
#[cfg(test)]
mod conformance_tests;
mod data;
pub mod evaluation;
mod features;
mod fitting;
mod forest;
mod gaps;
mod hub_card;
mod leaks;
mod learned;
mod methods;
pub mod metrics;
mod mirror;
mod model;
mod model_file;
pub mod network;
mod pmf;
mod recogniser;
mod rows;
pub mod search;
mod signatures;
mod sound;
mod split;
#[cfg(test)]
mod split_tests;
mod temperature;
mod tensor_file;

pub use answer_sets::{AnswerSets, CalibratedBy, ROUNDS_OF_A_CLASS, StopLevel};
pub use arrays::{Array, Arrays, ModelError, Numbers};
pub use baselines::{
    Geometry, GeometryEncoder, GeometryScores, Measure, MeasureEstimate, MeasureScore, Measured, Shipped, Touch,
};
pub use belief::{Belief, Rejection, Round, StopReason, StopRule};
pub use data::{Class, DataCard, Dataset, Example, Labels, OTHER, Sequence, counted};
pub use fitting::{Fitting, LearnError};
pub use leaks::{LEAK_REST_S, LeakCheck, LeakSource};
pub use learned::LearnedGrasps;
pub use methods::{METHODS, Method, MethodKind, method};
pub use mirror::mirror;
pub use model::{Lesson, Model, ModelCard, REMOVED_METHODS};
pub use model_file::Models;
pub use pmf::Pmf;
pub use recogniser::{LiveRecogniser, Properties, Pupil, Recogniser, Verdict};
pub use signatures::{SIGNATURE_STEPS, Signatures};
pub use sound::{SOUND_WINDOW_S, SoundChannels};
pub use split::{Split, SplitError, SplitPlan, check_apart};
pub use tensor_file::{TensorFile, encode};
