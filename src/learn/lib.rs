//! Recognition: labelled grasps in, probability mass functions (PMFs) over object classes out.
//!
//! This package knows arrays and class names only: no scenes, no stores, no sensors. A [`Recogniser`] is fitted to a
//! [`Dataset`] by a [`Method`] and answers a [`Sequence`] of readings with a [`Verdict`]. The verdicts on several
//! grasps of one object accumulate in a [`Belief`]; [`StopRule`] decides when to stop grasping.
//!
//! | file or folder | contents |
//! |---|---|
//! | `data.rs` | sequences, labels, data sets and their splits |
//! | `pmf.rs`, `belief.rs` | probabilities; belief after several grasps, rejection of unknown objects, stop rule |
//! | `recogniser.rs`, `fitting.rs` | the interface of recognisers; options and errors of a fit |
//! | `network/` | the paper's networks: LSTM kernel, macro-layer, training, dual-stage LSTM |
//! | `baselines/` | methods for comparison: features with trees, SVM or KNN; DTW; convolution |
//! | `forest/` | decision trees and their ensembles |
//! | `features.rs` | a grasp as a row of features |
//! | `methods.rs` | table of all methods |
//! | `model.rs`, `arrays.rs`, `model_file.rs` | a trained model, its parameters, its safetensors file |
//! | `evaluation.rs`, `metrics/` | test results of a model; confusion, calibration, intervals, tests |
//!
//! To add a recogniser, write its file and add one line to [`METHODS`].

mod arrays;
mod baselines;
mod belief;
#[cfg(test)]
mod conformance_tests;
mod data;
pub mod evaluation;
mod features;
mod fitting;
mod forest;
mod methods;
pub mod metrics;
mod mirror;
mod model;
mod model_file;
pub mod network;
mod pmf;
mod recogniser;

pub use arrays::{Array, ArrayError, Arrays, Numbers};
pub use belief::{Belief, Rejection, StopReason, StopRule};
pub use data::{Class, DataCard, Dataset, Example, Labels, Sequence};
pub use fitting::{Fitting, LearnError};
pub use methods::{METHODS, Method, MethodKind, method};
pub use model::{LoadError, Model, ModelCard, ModelError};
pub use model_file::shipped_model;
pub use pmf::Pmf;
pub use recogniser::{LiveRecogniser, Properties, Recogniser, Verdict};
