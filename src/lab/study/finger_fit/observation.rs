//! Observation of a real grasp for a fit: curvature and force over time, and the line pressure.

use palpate_sim::gripper::Side;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::Signals;

/// One recorded grasp, an empty close or a press against something held in place.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Name in messages: `trial 3`.
    pub name: String,
    /// Channels of layout C1 or C1+F; time counts from the first command (s).
    pub signals: Signals,
    /// Line pressure: time (s), rising, and pressure from then on (bar).
    pub line: Vec<(f64, f64)>,
    /// Scene of the grasp; the fit starts at its gripper.
    pub scene: Scene,
    /// Grasped object; none for an empty close.
    pub object: Option<ObjectModel>,
}

/// Force below which a real pad is ignored (N): its threshold, and a margin for where it begins to conduct.
const LEAST_FORCE: f64 = 0.2;

/// A force is known to this share of itself besides its noise: the repeatability of such pads (data sheet).
const FORCE_SHARE: f64 = 0.02;

/// Least deviation of a curvature (1/m): a tenth of a degree over the strip. Below it the model is the worse one.
const LEAST_CURVATURE_ERROR: f64 = 0.03;

/// One channel of an observation that is fitted.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// Column of the channel in the signals.
    pub(super) column: usize,
    pub(super) side: Side,
    /// Force, else curvature.
    pub(super) is_force: bool,
    /// Deviation of the noise, in the channel's unit.
    noise: f64,
}

impl Track {
    /// Deviation of a sample of some value; none where it is not to be used.
    pub(super) fn deviation(&self, value: f64) -> Option<f64> {
        if self.is_force {
            (value >= LEAST_FORCE).then(|| self.noise.hypot(FORCE_SHARE * value))
        } else {
            Some(self.noise)
        }
    }
}

impl Observation {
    /// From the programme of a scene: what a control box did that followed it.
    pub fn line_of(scene: &Scene) -> Vec<(f64, f64)> {
        let hz = f64::from(scene.timing.actuation_hz.max(1));
        let ticks = (scene.timing.duration_s * hz).ceil().clamp(0.0, 1e5) as u32;
        (0..ticks).map(|tick| (f64::from(tick) / hz, scene.programme.command(tick).0)).collect()
    }

    /// The channels that can be fitted. Forces only count where something is pressed or the fingers may meet.
    pub(super) fn tracks(&self) -> Vec<Track> {
        let named = |name: &str| self.signals.channels.iter().position(|own| own == name);
        let mut tracks = Vec::new();
        for side in Side::BOTH {
            for (quantity, is_force) in [("curvature", false), ("force", true)] {
                let Some(column) = named(&format!("{quantity}_{}", side.name())) else { continue };
                let least = if is_force { 0.01 } else { LEAST_CURVATURE_ERROR };
                tracks.push(Track { column, side, is_force, noise: self.noise(column).max(least) });
            }
        }
        tracks
    }

    /// Deviation of the noise of a channel, from its second differences, which motion hardly has: the middle one of
    /// their sizes, so that touches do not count.
    fn noise(&self, column: usize) -> f64 {
        let width = self.signals.channels.len();
        let values: Vec<f64> = self.signals.values.chunks_exact(width).map(|row| f64::from(row[column])).collect();
        let mut sizes: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // The middle size of a normal number is 0.6745 deviations, and second differences have sqrt(6) times as much.
        sizes.get(sizes.len() / 2).map_or(0.0, |middle| middle / (0.6745 * 6f64.sqrt()))
    }

    /// Highest line pressure (bar).
    pub(super) fn peak_bar(&self) -> f64 {
        self.line.iter().map(|(_, bar)| *bar).fold(0.0, f64::max)
    }

    /// Duration (s).
    pub(super) fn duration(&self) -> f64 {
        self.signals.t_s.last().copied().unwrap_or(0.0)
    }
}
