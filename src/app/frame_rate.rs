//! Frames per second while the 3-D view moves, and the resolution at which a slow rasteriser keeps them up.

use std::time::{Duration, Instant};

/// Frames per second below which a view has fewer pixels, and above which it has more again. Between them it stays, so
/// that it does not swing.
const WANTED: [f64; 2] = [16.5, 30.0];
/// Share of the pixels along each side: at first in software, the least, and the steps between.
const FIRST: f32 = 0.5;
const LEAST: f32 = 0.35;
const STEP: f32 = 0.85;
/// Time over which frames are counted.
const OVER: Duration = Duration::from_millis(500);
/// A pause of this length between two frames is no slowness.
const PAUSE: Duration = Duration::from_secs(2);

/// Frame rate and resolution of the moving 3-D view.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FrameRate {
    /// The processor draws.
    software: bool,
    /// Beginning of the count, and frames since.
    counted: Option<(Instant, u32)>,
    last: Option<Instant>,
    per_second: Option<f64>,
    share: f32,
}

impl FrameRate {
    /// For a graphics card, or for the processor.
    pub(super) fn new(software: bool) -> Self {
        Self { software, share: if software { FIRST } else { 1.0 }, ..Self::default() }
    }

    /// Counts a frame; `moves` while the view changes from frame to frame.
    pub(super) fn count(&mut self, now: Instant, moves: bool) {
        let paused = self.last.is_none_or(|last| now - last > PAUSE);
        self.last = moves.then_some(now);
        if !moves || paused {
            self.counted = moves.then_some((now, 0));
            self.per_second = self.per_second.filter(|_| moves);
            return;
        }
        let Some((since, frames)) = &mut self.counted else { return };
        *frames += 1;
        let passed = now - *since;
        if passed < OVER {
            return;
        }
        let rate = f64::from(*frames) / passed.as_secs_f64();
        self.counted = Some((now, 0));
        self.per_second = Some(rate);
        if self.software {
            let factor = if rate < WANTED[0] {
                STEP
            } else if rate > WANTED[1] {
                STEP.recip()
            } else {
                1.0
            };
            self.share = (self.share * factor).clamp(LEAST, 1.0);
        }
    }

    /// Frames per second; none while nothing moves.
    pub(super) fn per_second(&self) -> Option<f64> {
        self.per_second
    }

    /// Share of the pixels along each side of the moving view; 1 where a graphics card draws.
    pub(super) fn share(&self) -> f32 {
        self.share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(rate: &mut FrameRate, from: Instant, seconds: f64, per_second: f64) -> Instant {
        let frames = (seconds * per_second) as u32;
        (1..=frames).for_each(|k| rate.count(from + Duration::from_secs_f64(f64::from(k) / per_second), true));
        from + Duration::from_secs_f64(seconds)
    }

    #[test]
    fn a_slow_rasteriser_draws_fewer_pixels_and_a_fast_one_all() {
        let start = Instant::now();
        let mut slow = FrameRate::new(true);
        slow.count(start, true);
        let then = run(&mut slow, start, 6.0, 9.0);
        assert!((slow.per_second().expect("moves") - 9.0).abs() < 1.0);
        assert_eq!(slow.share(), LEAST);
        let then = run(&mut slow, then, 3.0, 22.0);
        assert_eq!(slow.share(), LEAST, "fast enough, not fast enough for more");
        let then = run(&mut slow, then, 9.0, 60.0);
        assert_eq!(slow.share(), 1.0);
        slow.count(then, false);
        assert_eq!(slow.per_second(), None);
        let mut card = FrameRate::new(false);
        run(&mut card, start, 3.0, 5.0);
        assert_eq!(card.share(), 1.0);
    }
}
