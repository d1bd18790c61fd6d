//! Simulated time compared with real time.

use std::time::{Duration, Instant};

/// Time over which the actual speed is measured.
const SPEED_WINDOW: Duration = Duration::from_millis(500);

/// Keeps simulated time in step with real time, at some speed.
pub(super) struct Pace {
    wall: Instant,
    simulated: f64,
    measured_from: (Instant, f64),
}

impl Pace {
    /// From a simulated time (s) on.
    pub(super) fn starting_at(simulated: f64) -> Self {
        let now = Instant::now();
        Self { wall: now, simulated, measured_from: (now, simulated) }
    }

    /// Simulated time that should have been reached by now (s).
    pub(super) fn due(&self, speed: f64) -> f64 {
        self.simulated + self.wall.elapsed().as_secs_f64() * speed
    }

    /// Continues from a simulated time (s) reached too late, without catching up.
    pub(super) fn give_way(&mut self, simulated: f64) {
        self.wall = Instant::now();
        self.simulated = simulated;
    }

    /// Speed since the last measurement, as a multiple of real time; `None` while that is too short ago.
    pub(super) fn measured(&mut self, simulated: f64) -> Option<f64> {
        let (wall, from) = self.measured_from;
        let passed = wall.elapsed();
        (passed >= SPEED_WINDOW).then(|| {
            self.measured_from = (Instant::now(), simulated);
            (simulated - from) / passed.as_secs_f64()
        })
    }
}
