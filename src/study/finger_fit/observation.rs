//! Observation of a real grasp for a fit: curvature and force over time, and the line pressure.

use palpate_sim::gripper::Side;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::Signals;

/// Recorded grasp: an empty close, or a press against a fixed object.
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

/// Force below which a real pad is ignored (N): its threshold with a margin.
const LEAST_FORCE: f64 = 0.2;

/// Repeatability of a pad as a share of the force (data sheet).
const FORCE_SHARE: f64 = 0.02;

/// Least deviation of a curvature (1/m): a tenth of a degree over the strip, about the error of the model.
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
    /// Deviation of a sample with this value; none if it is not used.
    pub(super) fn deviation(&self, value: f64) -> Option<f64> {
        if self.is_force {
            (value >= LEAST_FORCE).then(|| self.noise.hypot(FORCE_SHARE * value))
        } else {
            Some(self.noise)
        }
    }
}

impl Observation {
    /// Line pressure of a control box that follows the programme of a scene.
    pub fn line_of(scene: &Scene) -> Vec<(f64, f64)> {
        let hz = f64::from(scene.timing.actuation_hz.max(1));
        let ticks = (scene.timing.duration_s * hz).ceil().clamp(0.0, 1e5) as u32;
        (0..ticks).map(|tick| (f64::from(tick) / hz, scene.programme.command(tick).0)).collect()
    }

    /// Channels that can be fitted.
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

    /// Deviation of the noise of a channel, from the median size of its second differences, which neither slow motion nor
    /// a few contacts change.
    fn noise(&self, column: usize) -> f64 {
        let width = self.signals.channels.len();
        let values: Vec<f64> = self.signals.values.chunks_exact(width).map(|row| f64::from(row[column])).collect();
        let mut sizes: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // The median size of a normal variable is 0.6745 deviations; second differences have sqrt(6) times the deviation.
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
