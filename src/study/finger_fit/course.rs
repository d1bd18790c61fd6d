//! Recorded and fitted curvature over time, for a plot.

use super::fitted_model::FittedModel;
use super::observation::Observation;
use palpate_sim::gripper::Side;

/// Curvature of one finger over a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct FingerMotion {
    /// The recording.
    pub name: String,
    /// Finger.
    pub side: Side,
    /// Times since the first command (s).
    pub t_s: Vec<f64>,
    /// Recorded curvature (1/m).
    pub recorded: Vec<f64>,
    /// Curvature of the fitted model, read by the strip (1/m).
    pub fitted: Vec<f64>,
}

/// Courses from residuals in the order of the fitted model's places.
pub(super) fn courses(observations: &[Observation], fitted: &FittedModel<'_>, residuals: &[f64]) -> Vec<FingerMotion> {
    let mut courses: Vec<FingerMotion> = Vec::new();
    let mut last = None;
    for ((number, track, k), residual) in fitted.places().zip(residuals).filter(|((_, track, _), _)| !track.is_force) {
        let Observation { name, signals, .. } = &observations[number];
        if last.replace((number, track.side)) != Some((number, track.side)) {
            let (name, side) = (name.clone(), track.side);
            courses.push(FingerMotion { name, side, t_s: Vec::new(), recorded: Vec::new(), fitted: Vec::new() });
        }
        let recorded = f64::from(signals.row(k)[track.column]);
        if let Some(course) = courses.last_mut() {
            course.t_s.push(signals.t_s[k]);
            course.recorded.push(recorded);
            course.fitted.push(recorded + residual * track.deviation(recorded).unwrap_or(0.0));
        }
    }
    courses
}
