//! Objects to grasp: what the rest of Palpate needs to know of one, however it was made.

mod model;

pub use model::{ObjectClass, ObjectModel, Resting, RestingBall, ShapeClass, SizeClass};
