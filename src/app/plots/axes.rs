//! Axes of plots: round marks, numbers, seconds.

use crate::app::theme::colour;
use egui_plot::{AxisHints, GridInput, GridMark, Plot};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::{SPACE, true_minus};

/// A round value at an axis, with all of its digits: `150.5`.
fn plain(value: f64) -> String {
    true_minus(&format!("{}", (value * 1e6).round() / 1e6))
}

/// Time at the axis of a plot. Empty near the end of the axis, where it would be cut off.
pub(super) fn seconds_at(mark: GridMark, shown: &std::ops::RangeInclusive<f64>) -> String {
    let left = (shown.end() - mark.value) / (shown.end() - shown.start());
    if left < 0.02 { String::new() } else { format!("{}{SPACE}s", plain(mark.value)) }
}

/// Marks of time at the axis of a plot so many points wide.
pub(super) fn time_marks(low: f64, high: f64, width: f64) -> Vec<GridMark> {
    round_marks(low, high, width / BETWEEN_TIMES)
}

/// Value at the axis of a plot so many points high. Empty where it would stand on the first time below.
pub(super) fn value_at(mark: GridMark, shown: &std::ops::RangeInclusive<f64>, height: f64) -> String {
    let above = (mark.value - shown.start()) / (shown.end() - shown.start()) * height;
    if above < LEAST_ABOVE { String::new() } else { plain(mark.value) }
}

/// Least height of a value above the axis of time (points).
const LEAST_ABOVE: f64 = 2.5;
/// Least distance of times at their axis (points).
const BETWEEN_TIMES: f64 = 56.0;
/// Distance of values at their axis in large plots, and the least one (points).
const BETWEEN_VALUES: f64 = 42.0;
const LEAST_BETWEEN: f64 = 14.0;

/// Plot without interaction, its axes as wide as those of the others.
pub(in crate::app) fn static_plot(
    theme: Theme,
    id: &str,
    height: f32,
    y_label: &str,
    below: AxisHints<'static>,
    air_beside: f32,
) -> Plot<'static> {
    Plot::new(id.to_owned())
        .height(height)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .show_background(false)
        .grid_color(colour(theme.colours().border))
        .grid_spacing(10.0..=44.0)
        .y_axis_min_width(44.0)
        .y_axis_label(y_label.to_owned())
        .y_grid_spacer(move |grid: GridInput| value_marks(grid.bounds.0, grid.bounds.1, f64::from(height)))
        .y_axis_formatter(|mark: GridMark, _| plain(mark.value))
        .custom_x_axes(vec![below.label_spacing(egui::Rangef::new(24.0, 40.0))])
        .set_margin_fraction(egui::vec2(air_beside, 0.12))
}

/// Marks at round values along so many points: about four, fewer where they would touch, more where there is room.
pub(in crate::app) fn value_marks(low: f64, high: f64, room: f64) -> Vec<GridMark> {
    round_marks(low, high, (room / BETWEEN_VALUES).max(4.0).min(room / LEAST_BETWEEN))
}

/// At most so many marks and one, at round values.
fn round_marks(low: f64, high: f64, most: f64) -> Vec<GridMark> {
    let rough = (high - low) / most.max(1.0);
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * decade).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * decade);
    let between = |step: f64| ((low / step).ceil() as i64, (high / step).floor() as i64);
    // One mark alone tells no scale.
    let is_lonely = |(first, last): (i64, i64)| first == last && first != 0 && most >= 2.0;
    let step = if is_lonely(between(step)) { 0.5 * step } else { step };
    let (first, last) = between(step);
    // A step of a whole range makes all marks equally strong.
    (first..=last).map(|k| GridMark { value: k as f64 * step, step_size: high - low }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_few_and_round() {
        for (low, high, want) in [
            (-0.5, 9.0, vec![0.0, 5.0]),
            (-1.3, 23.0, vec![0.0, 10.0, 20.0]),
            (0.0, 0.4, vec![0.0, 0.1, 0.2, 0.3, 0.4]),
        ] {
            let marks: Vec<f64> = value_marks(low, high, 100.0).iter().map(|m| m.value).collect();
            assert!(
                marks.len() == want.len() && marks.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-9),
                "{marks:?}"
            );
        }
        // One mark away from zero is none.
        let of = |low: f64, high: f64, room| value_marks(low, high, room).iter().map(|m| m.value).collect::<Vec<_>>();
        assert_eq!(of(1010.0, 1990.0, 100.0), [1250.0, 1500.0, 1750.0]);
        assert!(of(1.0, 1.0, 100.0).is_empty() && of(f64::NAN, 1.0, 100.0).is_empty());
        // Large plots have more of them.
        assert_eq!(of(-0.5, 9.0, 320.0), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!([of(-1.0, 16.0, 80.0).len(), of(-1.0, 16.0, 36.0).len()], [4, 2]);
    }

    #[test]
    fn a_value_does_not_stand_on_the_first_time() {
        let zero = |height: f64| value_at(GridMark { value: 0.0, step_size: 1.0 }, &(-0.6..=12.0), height);
        assert_eq!((zero(120.0).as_str(), zero(50.0).as_str()), ("0", ""));
    }

    #[test]
    fn times_far_from_zero_keep_their_halves() {
        let texts =
            [150.0, 150.5, -0.1 * 3.0].map(|value| seconds_at(GridMark { value, step_size: 4.0 }, &(-1.0..=154.0)));
        assert_eq!(texts.map(|text| text.replace(SPACE, " ")), ["150 s", "150.5 s", "−0.3 s"]);
    }

    #[test]
    fn times_at_the_axis_never_crowd() {
        let labels = |width: f64| -> Vec<String> {
            let marks = time_marks(0.0, 4.0, width);
            marks.into_iter().map(|mark| seconds_at(mark, &(0.0..=4.0))).filter(|text| !text.is_empty()).collect()
        };
        let seconds = |texts: &[&str]| texts.iter().map(|text| format!("{text}{SPACE}s")).collect::<Vec<_>>();
        // All but the last, which would be cut off.
        assert_eq!(labels(500.0), seconds(&["0", "0.5", "1", "1.5", "2", "2.5", "3", "3.5"]));
        assert_eq!(labels(260.0), seconds(&["0", "1", "2", "3"]));
        assert_eq!(labels(60.0), seconds(&["0"]));
        // In a window that moves, one at least.
        assert!((0..100).all(|k| !time_marks(f64::from(k), f64::from(k) + 8.0, 120.0).is_empty()));
    }
}
