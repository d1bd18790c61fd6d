//! From line pressure to joint torque: the pressure in the bellows acts as the same bending moment on every joint.

use serde::{Deserialize, Serialize};

/// One measured point of the pressure-torque curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TorquePoint {
    /// Line pressure (bar).
    pub bar: f64,
    /// Torque on every joint (N m).
    pub torque: f64,
}

/// Description of the pneumatics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Actuation {
    /// Pressure-torque curve, straight between its points and beyond them; pressures must rise.
    pub curve: Vec<TorquePoint>,
    /// Highest line pressure (bar).
    pub max_bar: f64,
    /// Resolution of the control box (bar): commands are multiples of it (paper, section IV-B).
    pub step_bar: f64,
    /// Time in which the difference between line and chamber pressure falls to 1/e of itself (s); 0: at once.
    pub filling_time: f64,
}

impl Default for Actuation {
    fn default() -> Self {
        // 0.06 N m at 1 bar bends the default finger by 0.143 rad per joint, 82 degrees in all, which is what
        // SoMo's calibrated finger does.
        let point = |bar: f64| TorquePoint { bar, torque: 0.06 * bar };
        Self { curve: vec![point(0.0), point(1.5)], max_bar: 1.5, step_bar: 0.05, filling_time: 0.0 }
    }
}

impl Actuation {
    /// Torque on every joint (N m) at a line pressure (bar).
    pub fn torque(&self, bar: f64) -> f64 {
        let line =
            |a: &TorquePoint, b: &TorquePoint| a.torque + (b.torque - a.torque) * (bar - a.bar) / (b.bar - a.bar);
        match self.curve.as_slice() {
            [] => 0.0,
            [only] => only.torque,
            points => {
                let last = points.len() - 1;
                let upper = points.iter().position(|p| p.bar >= bar).unwrap_or(last).clamp(1, last);
                line(&points[upper - 1], &points[upper])
            }
        }
    }

    /// The nearest command that the control box can give (bar).
    pub fn nearest_command(&self, bar: f64) -> f64 {
        // Count whole steps, so that 0.05 added twenty times is 1.
        (bar / self.step_bar).round().clamp(0.0, (self.max_bar / self.step_bar).floor()) * self.step_bar
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_is_read_off_the_curve() {
        let curve = [(0.0, 0.0), (0.5, 0.01), (1.0, 0.05)];
        let actuation = Actuation {
            curve: curve.iter().map(|&(bar, torque)| TorquePoint { bar, torque }).collect(),
            ..Actuation::default()
        };
        for (bar, want) in [(0.0, 0.0), (0.25, 0.005), (0.5, 0.01), (0.75, 0.03), (1.0, 0.05), (1.5, 0.09)] {
            assert!((actuation.torque(bar) - want).abs() < 1e-15, "{bar}");
        }
    }

    #[test]
    fn commands_are_multiples_of_the_step() {
        let actuation = Actuation::default();
        assert!((actuation.nearest_command(0.123) - 0.1).abs() < 1e-12);
        assert!((actuation.nearest_command(9.0) - 1.5).abs() < 1e-12);
        assert_eq!(actuation.nearest_command(-1.0), 0.0);
    }
}
