//! Choice of the next grasp: the move of the gripper after which the uncertainty about the object in the hand is
//! expected to be least.
//!
//! A library holds grasps of known objects in known poses, and the recogniser's answer to each. Every one of them is a
//! hypothesis: the object is this one, and it was gripped like this. The readings of the grasps so far weigh the
//! hypotheses; the probabilities of the objects stay those of the recogniser. After a move of the gripper each hypothesis
//! predicts the answers of the library's grasps in the nearest poses. The best move has the least expected entropy of the
//! belief after such answers.

mod advisor;
mod guide;
mod known;
mod library;
mod stance;

pub use advisor::{Advisor, ObjectMove};
pub use guide::Guide;
pub use known::{KnownTouches, TouchesError};
pub use library::TouchLibrary;
pub use stance::{GripperMove, Stance};
