//! Baselines for the paper's networks: those of the paper (section III-A) and later ones. Trees and their ensembles,
//! nearest neighbours and support vector machines on features, dynamic time warping, and a convolutional network.

mod candle_network;
mod convolution;
mod geometry;
#[cfg(test)]
mod guide_network;
mod measures;
mod neighbours;
mod row_model;
mod svm;
mod tabular;
mod warping;

pub(super) use candle_network::Candle;
pub(super) use convolution::Convolution;
pub use geometry::{GeometryEncoder, ShippedEncoder};
pub use measures::{Geometry, GeometryScores, Measure, MeasureEstimate, MeasureScore, Measured, Touch};
pub(super) use tabular::{Tabular, TabularKind};
pub(super) use warping::Warping;
