//! Playback: a cursor on the time of a stored trial, or of the running grasp's past. Plots, 3-D view and bars all show that
//! time.

/// Speeds that can be chosen, as multiples of real time.
pub(super) const SPEEDS: [f64; 9] = [1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// Cursor on a time, and how it moves.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Playback {
    /// Time shown (s); none for the newest sample of a live gripper.
    pub(super) cursor_s: Option<f64>,
    /// The cursor moves.
    pub(super) playing: bool,
    /// Speed, as a multiple of real time.
    pub(super) speed: f64,
    /// Span that is repeated (s).
    pub(super) repeated: Option<[f64; 2]>,
    /// Marks A and B (s).
    pub(super) marks: [Option<f64>; 2],
}

impl Default for Playback {
    fn default() -> Self {
        Self { cursor_s: None, playing: false, speed: 1.0, repeated: None, marks: [None; 2] }
    }
}

/// Where the cursor goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seek {
    /// To the sample nearest to a time (s).
    To(f64),
    /// By a time (s), to the nearest sample, one at least.
    By(f64),
    /// By so many samples.
    Samples(isize),
    /// To the first sample.
    Start,
    /// To the last sample; of a live gripper, back to live.
    End,
}

impl Playback {
    /// Moves the cursor within the samples at `t_s`; `live` follows the newest sample at the end.
    pub(super) fn seek(&mut self, to: Seek, t_s: &[f64], live: bool) {
        let (Some(first), Some(last)) = (t_s.first().copied(), t_s.last().copied()) else { return };
        let now = self.cursor_s.unwrap_or(last);
        let wanted = match to {
            Seek::To(t) => nearest(t_s, t),
            Seek::By(by) => match nearest(t_s, now + by) {
                there if there == nearest(t_s, now) => step(t_s, now, by.signum() as isize),
                there => there,
            },
            Seek::Start => first,
            Seek::End if live => return *self = Self { cursor_s: None, playing: false, ..self.clone() },
            Seek::End => last,
            Seek::Samples(by) => step(t_s, now, by),
        };
        if wanted.is_finite() {
            self.cursor_s = Some(wanted.clamp(first, last));
        }
    }

    /// Starts, or stops where it runs. From the end it starts over.
    pub(super) fn toggle(&mut self, [first, last]: [f64; 2]) {
        self.playing = !self.playing;
        if self.playing && self.cursor_s.is_none_or(|now| now >= last - 1e-9) && self.repeated.is_none() {
            self.cursor_s = Some(first);
        }
    }

    /// Moves on by `elapsed_s` of real time, within a span of samples or the part that is repeated.
    pub(super) fn advance(&mut self, elapsed_s: f64, span: [f64; 2]) {
        if !self.playing {
            return;
        }
        let [from, to] = self.repeated.unwrap_or(span);
        let now = self.cursor_s.unwrap_or(to) + elapsed_s.max(0.0) * self.speed;
        self.cursor_s = Some(if now < to {
            now.max(from)
        } else if self.repeated.is_some() && to > from {
            from + (now - from).rem_euclid(to - from)
        } else {
            self.playing = false;
            to
        });
    }

    /// Next faster or slower speed.
    pub(super) fn change_speed(&mut self, by: isize) {
        self.speed = next_speed(self.speed, by);
    }

    /// Repeats the part between the marks, or all of it, or stops repeating.
    pub(super) fn toggle_repeat(&mut self, span: [f64; 2]) {
        self.repeated = match (self.repeated, self.marks) {
            (Some(_), _) => None,
            (None, [Some(a), Some(b)]) if a != b => Some([a.min(b), a.max(b)]),
            (None, _) => Some(span),
        };
    }
}

/// The time so many samples after the one shown at `now`.
fn step(t_s: &[f64], now: f64, by: isize) -> f64 {
    let shown = t_s.partition_point(|t| *t <= now + 1e-9).saturating_sub(1);
    t_s[shown.saturating_add_signed(by).min(t_s.len() - 1)]
}

/// The time of a sample that is nearest to `t`; not finite where `t` is not.
fn nearest(t_s: &[f64], t: f64) -> f64 {
    let after = t_s.partition_point(|sample| *sample < t);
    let beside = t_s[after.saturating_sub(1)..].iter().take(2).copied();
    beside.min_by(|a, b| (a - t).abs().total_cmp(&(b - t).abs())).filter(|_| t.is_finite()).unwrap_or(t)
}

/// Speed that many places further in [`SPEEDS`].
pub(super) fn next_speed(now: f64, by: isize) -> f64 {
    let nearest = (0..SPEEDS.len()).min_by(|a, b| (SPEEDS[*a] - now).abs().total_cmp(&(SPEEDS[*b] - now).abs()));
    SPEEDS[nearest.unwrap_or(0).saturating_add_signed(by).min(SPEEDS.len() - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: [f64; 5] = [0.0, 0.1, 0.2, 0.3, 0.4];

    #[test]
    fn the_cursor_steps_by_samples_and_stays_within_them() {
        let mut playback = Playback { cursor_s: Some(0.15), ..Playback::default() };
        let mut after = |to| {
            playback.seek(to, &T, false);
            playback.cursor_s.unwrap()
        };
        assert_eq!(after(Seek::Samples(1)), 0.2);
        assert_eq!(after(Seek::Samples(-1)), 0.1);
        assert_eq!(after(Seek::Samples(-9)), 0.0);
        assert_eq!(after(Seek::Samples(9)), 0.4);
        assert_eq!([after(Seek::By(-0.22)), after(Seek::By(0.01)), after(Seek::By(-0.01))], [0.2, 0.3, 0.2]);
        assert_eq!([after(Seek::To(0.16)), after(Seek::To(0.14)), after(Seek::To(-7.0))], [0.2, 0.1, 0.0]);
        assert_eq!(after(Seek::To(7.0)), 0.4);
        assert_eq!(after(Seek::To(f64::NAN)), 0.4);
        assert_eq!(after(Seek::Start), 0.0);
        assert_eq!(after(Seek::End), 0.4);
        playback.seek(Seek::End, &T, true);
        assert_eq!(playback.cursor_s, None, "a live gripper is followed");
        playback.seek(Seek::Samples(-1), &T, true);
        assert_eq!(playback.cursor_s, Some(0.3));
        playback.seek(Seek::Start, &[], true);
        assert_eq!(playback.cursor_s, Some(0.3), "nothing to seek in");
    }

    #[test]
    fn playing_ends_at_the_end_or_repeats() {
        let span = [0.0, 4.0];
        let mut playback = Playback { cursor_s: Some(4.0), speed: 0.5, ..Playback::default() };
        playback.toggle(span);
        playback.advance(1.0, span);
        assert_eq!((playback.cursor_s, playback.playing), (Some(0.5), true));
        playback.advance(100.0, span);
        assert_eq!((playback.cursor_s, playback.playing), (Some(4.0), false));
        playback.marks = [Some(2.0), Some(1.0)];
        playback.toggle_repeat(span);
        assert_eq!(playback.repeated, Some([1.0, 2.0]));
        playback.toggle(span);
        playback.cursor_s = Some(1.5);
        playback.advance(1.5, span);
        assert!(playback.cursor_s.is_some_and(|t| (t - 1.25).abs() < 1e-12) && playback.playing);
        playback.toggle_repeat(span);
        assert_eq!(playback.repeated, None);
    }

    #[test]
    fn speeds_go_from_a_thirty_second_to_eight() {
        assert_eq!(next_speed(1.0, 1), 2.0);
        assert_eq!(next_speed(8.0, 1), 8.0);
        assert_eq!(next_speed(1.0 / 32.0, -1), 1.0 / 32.0);
        assert_eq!(next_speed(0.3, -1), 1.0 / 8.0);
    }
}
