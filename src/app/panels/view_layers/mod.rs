//! Layers over the 3-D view: the contact path on the object, and small pads in a corner.

mod path;
mod small_pads;

pub(super) use path::{path_colour, path_mesh};
pub(super) use small_pads::small_pads;
