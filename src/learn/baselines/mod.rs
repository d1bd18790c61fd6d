//! Baselines for the paper's networks: those of the paper (section III-A) and later ones. Trees and their ensembles,
//! nearest neighbours and support vector machines on features, dynamic time warping, and a convolutional network; the geometry encoder and
//! what starts from it.

mod answering;
mod candle_network;
mod convolution;
mod feature_rows;
mod felt_steps;
mod geometry;
mod geometry_network;
#[cfg(test)]
mod guide_network;
mod kept_grasps;
mod measures;
mod neighbours;
mod other;
mod smo;
mod svm;
mod tabular;
mod warping;

pub(super) use candle_network::Candle;
pub(super) use convolution::Convolution;
pub use geometry::{GeometryEncoder, Shipped};
pub(super) use geometry_network::GeometryNetwork;
pub use measures::{Geometry, GeometryScores, Measure, MeasureEstimate, MeasureScore, Measured, Touch};
pub(super) use tabular::{Tabular, TabularKind};
pub(super) use warping::Warping;
