//! What the paper's networks are compared with (section III-A, and what later work found as good): trees and their
//! ensembles, neighbours, support vectors, hand-made measures, time warping, and a small convolutional network in plain
//! candle.

mod convolution;
mod neighbours;
mod svm;
mod tabular;
mod warping;

pub(super) use convolution::Convolution;
pub(super) use tabular::{Tabular, TabularKind};
pub(super) use warping::Warping;
