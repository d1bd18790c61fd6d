//! Small pictures of trials for lists.

/// Numbers to a finger in a small picture.
pub const SPARKLINE_BINS: usize = 48;

/// A small picture of a trial: counts of the left and the right pad (of the strip, where the board has no pad there), each
/// the mean of its share of the time. A stretch without readings has none; it is empty for trials from before it was kept.
pub type Sparkline = [Vec<Option<f32>>; 2];
