//! The programme of a grasp: line pressure at every actuation tick (paper, section IV-A: hard-coded closing and
//! releasing, f_a = 10 Hz). By default +0.05 bar per tick to 1.0 bar (2 s), hold 1 s, -0.10 bar per tick (1 s).

use serde::{Deserialize, Serialize};

/// Phase of the pressure programme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// Pressure rises.
    Close,
    /// Pressure stays at its peak.
    Hold,
    /// Pressure falls, or has fallen to zero.
    Release,
}

impl Phase {
    /// The name used in files and on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Close => "close",
            Self::Hold => "hold",
            Self::Release => "release",
        }
    }
}

/// Description of a grasp's pressure over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Programme {
    /// Pressure at which closing stops (bar).
    pub peak_bar: f64,
    /// Rise per actuation tick while closing (bar).
    pub close_bar_per_tick: f64,
    /// Actuation ticks at the peak after the closing has ended.
    pub hold_ticks: u32,
    /// Fall per actuation tick while releasing (bar).
    pub release_bar_per_tick: f64,
}

impl Default for Programme {
    fn default() -> Self {
        Self { peak_bar: 1.0, close_bar_per_tick: 0.05, hold_ticks: 10, release_bar_per_tick: 0.10 }
    }
}

impl Programme {
    /// Actuation ticks the closing takes.
    pub fn close_ticks(&self) -> u32 {
        // A hair less than whole, so that 1.0 / 0.05 counts twenty.
        (self.peak_bar / self.close_bar_per_tick - 1e-9).ceil().max(0.0) as u32
    }

    /// Actuation ticks the releasing takes.
    pub fn release_ticks(&self) -> u32 {
        (self.peak_bar / self.release_bar_per_tick - 1e-9).ceil().max(0.0) as u32
    }

    /// Actuation ticks until the pressure is back at zero.
    pub fn total_ticks(&self) -> u32 {
        self.close_ticks().saturating_add(self.hold_ticks).saturating_add(self.release_ticks())
    }

    /// Commanded pressure (bar) during actuation tick `tick` (the first is 0), and the phase it belongs to.
    pub fn command(&self, tick: u32) -> (f64, Phase) {
        let closed_at = self.close_ticks();
        let released_from = closed_at.saturating_add(self.hold_ticks);
        if tick < closed_at {
            let bar = self.close_bar_per_tick * f64::from(tick + 1);
            (bar.min(self.peak_bar), Phase::Close)
        } else if tick < released_from {
            (self.peak_bar, Phase::Hold)
        } else {
            let fall = self.release_bar_per_tick * f64::from(tick - released_from + 1);
            // The last step of a fall may leave a rounding error of the peak.
            let bar = (self.peak_bar - fall).max(0.0);
            (if bar < 1e-9 { 0.0 } else { bar }, Phase::Release)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_programme_lasts_four_seconds() {
        let programme = Programme::default();
        assert_eq!((programme.close_ticks(), programme.total_ticks()), (20, 40));
        let bar = |tick| programme.command(tick).0;
        assert!((bar(0) - 0.05).abs() < 1e-12);
        assert!((bar(19) - 1.0).abs() < 1e-12 && bar(25) == 1.0);
        assert!((bar(30) - 0.9).abs() < 1e-12);
        assert_eq!((bar(39), bar(1000)), (0.0, 0.0));
        let phases: Vec<_> = [0, 19, 20, 29, 30].map(|t| programme.command(t).1.name()).into();
        assert_eq!(phases, ["close", "close", "hold", "hold", "release"]);
    }

    #[test]
    fn a_hold_without_end_never_releases() {
        let programme = Programme { hold_ticks: u32::MAX, ..Programme::default() };
        assert_eq!(programme.command(1_000_000), (1.0, Phase::Hold));
    }
}
