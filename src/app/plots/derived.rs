//! Curves derived from others: sum and difference of both fingers, and the change over time.

use super::PlotCurve;
use crate::app::features::view::Derivation;
use std::rc::Rc;

/// The derived curves; those of one finger that has no other are left out of sums and differences.
pub(super) fn derive(derived: Derivation, curves: Vec<PlotCurve>) -> Vec<PlotCurve> {
    match derived {
        Derivation::Values => curves,
        Derivation::Sum => pairs(curves, "sum", |left, right| left + right),
        Derivation::Difference => pairs(curves, "difference", |left, right| left - right),
        Derivation::Derivative => curves.into_iter().map(change).collect(),
    }
}

fn pairs(curves: Vec<PlotCurve>, name: &str, join: fn(f64, f64) -> f64) -> Vec<PlotCurve> {
    let (left, mut right): (Vec<PlotCurve>, Vec<PlotCurve>) = curves.into_iter().partition(|curve| !curve.dashed);
    let mut joined = Vec::new();
    for curve in left {
        let other = curve.name.replace("left", "right");
        let Some(place) = right.iter().position(|own| own.name.starts_with(&other) || other.starts_with(&own.name))
        else {
            continue;
        };
        let other = right.remove(place);
        let (a, b) = (curve.values, other.values);
        joined.push(PlotCurve {
            name: curve.name.replace("left", name),
            values: Box::new(move |trace, k| Some(join(a(trace, k)?, b(trace, k)?))),
            half_width: Box::new(|_, _| None),
            trace: curve.trace,
            dashed: false,
            channel: None,
        });
    }
    joined
}

/// Slope of a curve, from the sample before to the one after.
fn change(curve: PlotCurve) -> PlotCurve {
    let values = Rc::new(curve.values);
    PlotCurve {
        values: Box::new(move |trace, k| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(trace.t.len().checked_sub(1)?));
            let span = trace.t[after] - trace.t[before];
            let rise = values(trace, after)? - values(trace, before)?;
            (span > 0.0).then_some(rise / span)
        }),
        half_width: Box::new(|_, _| None),
        channel: None,
        ..curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::traces::GraspTrace;
    use palpate_geometry::palette::Trace;

    fn curve(name: &str, column: usize, dashed: bool) -> PlotCurve {
        PlotCurve {
            name: name.to_owned(),
            trace: Trace::Pressure,
            dashed,
            values: Box::new(move |trace, k| Some(f64::from(*trace.channels.get(column)?.get(k)?))),
            half_width: Box::new(|_, _| None),
            channel: None,
        }
    }

    #[test]
    fn fingers_are_added_subtracted_and_differentiated() {
        let trace = GraspTrace {
            t: vec![0.0, 0.5, 1.0],
            channels: vec![vec![0.0, 1.0, 4.0], vec![0.0, 0.5, 1.0]],
            ..GraspTrace::default()
        };
        let curves = || vec![curve("left", 0, false), curve("right", 1, true)];
        let values = |derived: Derivation| -> Vec<Vec<f64>> {
            let all = |curve: &PlotCurve| (0..3).filter_map(|k| (curve.values)(&trace, k)).collect();
            derive(derived, curves()).iter().map(all).collect()
        };
        assert_eq!(values(Derivation::Sum), [[0.0, 1.5, 5.0]]);
        assert_eq!(values(Derivation::Difference), [[0.0, 0.5, 3.0]]);
        assert_eq!(values(Derivation::Derivative), [[2.0, 4.0, 6.0], [1.0, 1.0, 1.0]]);
        assert_eq!(values(Derivation::Values).len(), 2);
        assert_eq!(derive(Derivation::Sum, vec![curve("left", 0, false)]).len(), 0);
        assert_eq!(Derivation::Derivative.unit("kPa"), "kPa/s");
    }
}
