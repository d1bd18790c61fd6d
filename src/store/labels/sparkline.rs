//! Small plots of trials for lists.

/// Values per finger in a small plot.
pub const SPARKLINE_BINS: usize = 48;

/// Small plot of a trial: counts of the left and the right pad (of the strip, where the board has no pad there), each the
/// mean over its share of the time; none without readings. Empty for trials of early versions.
pub type Sparkline = [Vec<Option<f32>>; 2];
