//! Tests of the pad's curve: closed forms, and every fault.

use super::pad_curve::*;
use super::*;
use crate::board::{Board, Sensor};
use crate::electronics::Divider;

fn input() -> Input {
    Input::on(&Board::default(), Sensor::PAD_LEFT)
}

const WEIGHTS: [f64; 7] = [0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5];

/// Points of a pad with a resistance at 1 N and an exponent, silent below 15 g, behind some input.
fn points(ohm_at_1_n: f64, exponent: f64, kilograms: &[f64], input: &Input) -> Vec<Point> {
    let counts = |force: f64| match force < 0.15 {
        true => 0.0,
        false => input.counts(ohm_at_1_n / force.powf(exponent)),
    };
    let point = |&kg: &f64| {
        let stimulus = SensorKind::Pad.stimulus(kg);
        Point { stimulus, counts: counts(stimulus), spread: 2.0, readings: 50 }
    };
    kilograms.iter().map(point).collect()
}

fn fault(points: &[Point]) -> String {
    PadCurve::fit(points, &input()).expect_err("refused").to_string()
}

#[test]
fn a_power_law_is_found_exactly() -> Result<(), CalibrationFault> {
    for (ohm, exponent) in [(6e3, 0.9), (3e3, 1.0), (9e3, 0.8)] {
        let (curve, words) = PadCurve::fit(&points(ohm, exponent, &WEIGHTS, &input()), &input())?;
        assert!((curve.gain * ohm - 1.0).abs() < 1e-9 && (curve.exponent - exponent).abs() < 1e-9);
        assert!(words.is_empty(), "{words:?}");
        for force in [0.2, 0.3, 1.0, 4.9] {
            assert!((curve.force(curve.siemens(force)) / force - 1.0).abs() < 1e-9);
        }
        // The 0.15 N of the data sheet lie between the bare pad and 20 g.
        assert!((curve.threshold - 0.15).abs() < 1e-12);
        assert_eq!((curve.force(0.0), curve.force(-1.0), curve.force(curve.siemens(0.1))), (0.0, 0.0, 0.0));
        assert_eq!(curve.residuals[0], None);
    }
    Ok(())
}

#[test]
fn the_reading_at_rest_is_subtracted() -> Result<(), CalibrationFault> {
    let pinched = |point: &Point| {
        let siemens = input().siemens(point.counts) + 20e-6;
        Point { counts: input().counts(1.0 / siemens), ..*point }
    };
    let points: Vec<Point> = points(6e3, 0.9, &WEIGHTS, &input()).iter().map(pinched).collect();
    let (curve, _) = PadCurve::fit(&points, &input())?;
    assert!((curve.idle_siemens - 20e-6).abs() < 1e-9 && (curve.exponent - 0.9).abs() < 1e-9);
    Ok(())
}

#[test]
fn too_few_too_close_and_too_light_weights_are_refused() {
    let of = |kilograms: &[f64]| points(6e3, 0.9, kilograms, &input());
    assert!(fault(&of(&[0.0, 0.05, 0.1, 0.2, 0.5])).contains("4 of at least 5"));
    assert!(fault(&of(&[0.001, 0.002, 0.005, 0.008, 0.01])).contains("0 of at least 5"));
    assert!(fault(&of(&[0.1, 0.12, 0.14, 0.16, 0.2])).contains("four times"));
    assert!(fault(&of(&[0.1, 0.2, 0.3, 0.4, 50.0])).contains("outside"));
}

#[test]
fn wrong_resistors_wiring_units_and_weights_are_named() {
    let behind =
        |resistor_ohm: f64| points(6e3, 0.9, &WEIGHTS, &Input { divider: Divider::of_pad(resistor_ohm), ..input() });
    // 47 kΩ where 4.7 is entered: the pad looks ten times too conductive.
    let text = fault(&behind(47e3));
    assert!(text.contains("0.600 kΩ") && text.contains("is not the 4.70 kΩ"), "{text}");
    assert!(fault(&behind(330.0)).contains("is not the 4.70 kΩ"));
    let swapped = Input { divider: Divider::of_strip(4.7e3), ..input() };
    let text = fault(&points(6e3, 0.9, &WEIGHTS[2..], &swapped));
    assert!(text.contains("falls") && text.contains("the other way round"), "{text}");
    let mut mixed = points(6e3, 0.9, &WEIGHTS, &input());
    (mixed[3].counts, mixed[4].counts) = (mixed[4].counts, mixed[3].counts);
    assert!(fault(&mixed).contains("mixed up"));
    assert!(fault(&points(6e3, 0.4, &WEIGHTS, &input())).contains("partly beside the pad"));
    // 1 kΩ under 1 N fills the range at 0.5 kg and more.
    let text = fault(&points(3.0, 0.9, &WEIGHTS, &input()));
    assert!(text.contains("saturates") && text.contains("3.3 kΩ"), "{text}");
}

#[test]
fn a_weight_beside_the_pad_is_named() -> Result<(), CalibrationFault> {
    let shifted = |share: f64| {
        let mut points = points(6e3, 0.9, &WEIGHTS, &input());
        let force = points[4].stimulus * share;
        points[4].counts = input().counts(6e3 / force.powf(0.9));
        points
    };
    let (_, words) = PadCurve::fit(&shifted(0.8), &input())?;
    assert!(words.len() == 1 && words[0].contains("0.200 kg"), "{words:?}");
    assert!(fault(&shifted(0.51)).contains("0.200 kg"), "{}", fault(&shifted(0.51)));
    Ok(())
}

#[test]
fn the_zero_follows_the_bending() -> Result<(), CalibrationFault> {
    let (curve, _) = PadCurve::fit(&points(6e3, 0.9, &WEIGHTS, &input()), &input())?;
    // Bending loads the pad with 0.03 N m of curvature, silent below 0.15 N; something is touched in the middle.
    let close: Vec<(f64, f64)> = (0..300)
        .map(|i| {
            let kappa = 0.05 * f64::from(i);
            let load = 0.03 * kappa + if (140..145).contains(&i) { 1.0 } else { 0.0 };
            (kappa, if load < 0.15 { 0.0 } else { curve.siemens(load) })
        })
        .collect();
    let zero = BendingZero::from_empty_close(&close)?;
    for kappa in [1.0, 4.0, 7.0, 12.0, 14.0] {
        let preload = zero.preload(&curve, kappa);
        assert!((preload - 0.03 * kappa).abs() < 0.02, "{preload} at {kappa}");
    }
    assert_eq!((zero.preload(&curve, -5.0), zero.preload(&curve, 0.0)), (0.0, 0.0));
    // Beyond what was tried it stays.
    assert_eq!(zero.preload(&curve, 99.0), zero.preload(&curve, zero.reaches()));
    assert!((13.5..15.0).contains(&zero.reaches()));
    assert_eq!(BendingZero::default().preload(&curve, 3.0), 0.0);
    let text = BendingZero::from_empty_close(&close[..40]).expect_err("too short").to_string();
    assert!(text.contains("at least 5 1/m"), "{text}");
    Ok(())
}
