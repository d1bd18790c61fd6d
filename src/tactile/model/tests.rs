//! The whole chain on a grasp whose clean signals are simple.

use super::{PhysicalLike, SAMPLE_HZ, SensorModel};
use crate::Signals;
use crate::electronics::PadPart;
use proptest::prelude::*;

const NAMES: [&str; 6] =
    ["curvature_left", "curvature_right", "pressure_left", "pressure_right", "force_left", "force_right"];

type Switch = (&'static str, fn(&mut PhysicalLike) -> &mut bool);

const SWITCHES: [Switch; 11] = [
    ("stepping", |s| &mut s.stepping),
    ("jitter", |s| &mut s.jitter),
    ("asymmetry", |s| &mut s.asymmetry),
    ("parts", |s| &mut s.parts),
    ("slip", |s| &mut s.slip),
    ("hysteresis", |s| &mut s.hysteresis),
    ("drift", |s| &mut s.drift),
    ("threshold", |s| &mut s.threshold),
    ("saturation", |s| &mut s.saturation),
    ("noise", |s| &mut s.noise),
    ("counts", |s| &mut s.counts),
];

/// Four seconds at 75 Hz: both fingers close to 14 1/m by 2 s, touch at 1 s, press up to 4 N, hold, and let go.
fn grasp() -> Signals {
    let mut clean = Signals { channels: NAMES.map(str::to_owned).to_vec(), ..Signals::default() };
    for sample in 0..=300 {
        let t = f64::from(sample) / 75.0;
        let bend = (t / 2.0).min(1.0).min(4.0 - t) as f32;
        let press = (t - 1.0).min(1.0).min((3.5 - t) / 0.5).max(0.0) as f32;
        let (kappa, force) = (14.0 * bend, 4.0 * press);
        let pressure = force / PadPart::ACTIVE_AREA as f32;
        clean.push(t, &[kappa, kappa, pressure, pressure, force, force]);
    }
    clean
}

/// Signals of fewer channels.
fn only(clean: &Signals, names: &[&str]) -> Signals {
    let columns: Vec<usize> =
        names.iter().map(|n| clean.channels.iter().position(|c| c == n).expect("a channel")).collect();
    let mut some = Signals { channels: names.iter().map(|&n| n.to_owned()).collect(), ..Signals::default() };
    for sample in 0..clean.len() {
        let row: Vec<f32> = columns.iter().map(|&c| clean.row(sample)[c]).collect();
        some.push(clean.t_s[sample], &row);
    }
    some
}

fn column(signals: &Signals, name: &str) -> Vec<f32> {
    only(signals, &[name]).values
}

#[test]
fn names_lead_back_to_models() {
    for model in SensorModel::ALL {
        assert_eq!(SensorModel::named(model.name()), Some(model));
        let written = serde_json::to_string(&model).expect("plain");
        assert_eq!(written, format!("\"{}\"", model.name()));
    }
    assert_eq!(SensorModel::named("Virtual "), Some(SensorModel::Virtual));
    assert_eq!(SensorModel::named("real"), None);
}

#[test]
fn virtual_sensors_change_nothing() {
    assert_eq!(SensorModel::Virtual.apply(&grasp(), 7), grasp());
}

#[test]
fn noisy_sensors_read_nearly_what_perfect_ones_do() {
    let clean = PhysicalLike::OFF.apply(&grasp(), 7);
    let [a, b] = [7, 8].map(|seed| SensorModel::Noisy.apply(&grasp(), seed));
    assert_ne!(a, b);
    assert_eq!(a.t_s, clean.t_s, "no jitter, no steps");
    for name in NAMES {
        let [noisy, clean] = [&a, &clean].map(|signals| column(signals, name));
        let most = clean.iter().fold(0.0, |a: f32, b| a.max(b.abs()));
        let apart = noisy.iter().zip(&clean).map(|(a, b)| (a - b).abs()).sum::<f32>() / clean.len() as f32;
        // Pads read 4 N, far above where the drift of their conductance is small.
        assert!(apart > 0.0 && apart < 0.2 * most, "{name}: {apart} of {most}");
    }
}

#[test]
fn with_everything_off_clean_signals_are_read_at_50_hz() {
    let clean = grasp();
    let read = PhysicalLike::OFF.apply(&clean, 7);
    assert_eq!((read.len(), &read.channels), (201, &clean.channels));
    for (k, &t) in read.t_s.iter().enumerate() {
        assert!((t - k as f64 / SAMPLE_HZ).abs() < 1e-12);
        // Every second reading falls on a clean sample, for 50 is two thirds of 75.
        if k % 2 == 0 {
            for (got, want) in read.row(k).iter().zip(clean.row(k / 2 * 3)) {
                assert!((got - want).abs() <= 1e-6 * want.abs() + 1e-9, "{got} {want} at {t}");
            }
        }
    }
}

#[test]
fn every_switch_does_something_alone_and_leaves_something_out() {
    let mut clean = grasp();
    // A little backwards at first, and more than a fold in the end, so that strips meet both limits.
    clean.values[0] = -1.0;
    let last = clean.values.len() - NAMES.len();
    clean.values[last] = 60.0;
    let (all, none) = (PhysicalLike::default(), PhysicalLike::OFF);
    for (name, switch) in SWITCHES {
        let (mut alone, mut without) = (none, all);
        *switch(&mut alone) = true;
        *switch(&mut without) = false;
        assert_ne!(alone.apply(&clean, 7).values, none.apply(&clean, 7).values, "{name} alone");
        assert_ne!(without.apply(&clean, 7).values, all.apply(&clean, 7).values, "all but {name}");
    }
}

#[test]
fn switches_take_away_no_more_than_their_own() {
    let clean = grasp();
    let read = |settings: PhysicalLike, name: &str| column(&settings.apply(&clean, 7), name);
    let off = PhysicalLike::OFF;
    let ideal = read(off, "curvature_right");
    let spread = |changed: Vec<f32>, by: fn(f32, f32) -> f32| {
        let pairs = changed.iter().zip(&ideal).filter(|(_, ideal)| **ideal > 1.0);
        let effect: Vec<f32> = pairs.map(|(changed, ideal)| by(*changed, *ideal)).collect();
        let (least, most) = effect.iter().fold((f32::MAX, f32::MIN), |(l, m), &e| (l.min(e), m.max(e)));
        (least, most - least)
    };
    // Mounting, parts and slip are gains of a strip, drift is a shift.
    let (ratio, scatter) = spread(read(PhysicalLike { asymmetry: true, ..off }, "curvature_right"), |a, b| a / b);
    assert!((ratio - 0.681).abs() < 1e-3 && scatter < 1e-5);
    for gain in [PhysicalLike { parts: true, ..off }, PhysicalLike { slip: true, ..off }] {
        let (ratio, scatter) = spread(read(gain, "curvature_right"), |a, b| a / b);
        assert!((ratio - 1.0).abs() < 0.05 && ratio != 1.0 && scatter < 1e-5);
    }
    let (shift, scatter) = spread(read(PhysicalLike { drift: true, ..off }, "curvature_right"), |a, b| a - b);
    assert!(shift.abs() < 0.4 && shift != 0.0 && scatter < 1e-5);
    // The left is the measure of the asymmetry, and a forward bend reaches neither threshold nor saturation.
    assert_eq!(read(PhysicalLike { asymmetry: true, ..off }, "curvature_left"), read(off, "curvature_left"));
    assert_eq!(read(PhysicalLike { threshold: true, saturation: true, ..off }, "curvature_right"), ideal);
    // The threshold takes readings away and leaves the others; saturation cuts the peaks.
    let full = read(off, "force_left");
    let sensed = read(PhysicalLike { threshold: true, ..off }, "force_left");
    assert!(sensed.iter().zip(&full).all(|(f, all)| if *all < 0.15 { *f == 0.0 } else { f == all }));
    let cut = read(PhysicalLike { saturation: true, ..off }, "force_left");
    assert!(cut.iter().zip(&full).all(|(c, all)| (c - all.min(PhysicalLike::OFF.full_force as f32)).abs() < 1e-6));
}

#[test]
fn a_pressed_pad_knows_three_levels() {
    let read = SensorModel::PhysicalLike.apply(&grasp(), 7);
    let force = PhysicalLike::OFF.full_force as f32;
    let pressure = force / PadPart::ACTIVE_AREA as f32;
    let channels =
        [("force_left", force), ("force_right", force), ("pressure_left", pressure), ("pressure_right", pressure)];
    for (name, full) in channels {
        let values = column(&read, name);
        let idle = values.iter().filter(|&&v| v < 0.05 * full).count();
        let saturated = values.iter().filter(|&&v| v > 0.98 * full).count();
        let between = values.len() - idle - saturated;
        assert!(idle > 40 && saturated > 40, "{name}: {idle} idle, {saturated} saturated");
        // A step or two on the way in and out, of eleven.
        assert!(between < values.len() / 3, "{name}: {between} between");
    }
}

#[test]
fn a_pad_is_read_once_whatever_its_columns() {
    let clean = grasp();
    let both = SensorModel::PhysicalLike.apply(&clean, 7);
    let mut felt = 0;
    for side in ["left", "right"] {
        let [force, pressure] = ["force", "pressure"].map(|quantity| format!("{quantity}_{side}"));
        let alone = SensorModel::PhysicalLike.apply(&only(&clean, &[&pressure]), 7).values;
        for ((force, pressure), alone) in column(&both, &force).iter().zip(column(&both, &pressure)).zip(alone) {
            assert!((pressure * PadPart::ACTIVE_AREA as f32 - force).abs() <= 1e-6 * force);
            assert!((alone - pressure).abs() <= 1e-3 * pressure.abs() + 1.0, "{alone} {pressure}");
            felt += u32::from(*force > 0.0);
        }
    }
    assert!(felt > 100, "{felt} readings of a load");
    // What no part measures stays as it is.
    let contact = Signals { channels: vec!["contact_pressure_left".to_owned()], ..only(&clean, &["pressure_left"]) };
    let read = PhysicalLike { stepping: false, jitter: false, ..PhysicalLike::default() }.apply(&contact, 7);
    assert_eq!(read, PhysicalLike::OFF.apply(&contact, 7));
}

#[test]
fn the_right_hand_side_reads_less() {
    let peaks = |seed| {
        let read = SensorModel::PhysicalLike.apply(&grasp(), seed);
        ["curvature_left", "curvature_right"].map(|name| column(&read, name).into_iter().fold(0.0, f32::max))
    };
    for seed in 0..10 {
        let [left, right] = peaks(seed);
        assert!((left - 14.0).abs() < 1.5, "{left}");
        assert!((right / left - 0.68).abs() < 0.08, "{}", right / left);
    }
}

#[test]
fn closing_shows_as_stairs() {
    let values = column(&SensorModel::PhysicalLike.apply(&grasp(), 7), "curvature_left");
    let rises: Vec<bool> = values[..100].windows(2).map(|w| w[1] - w[0] > 1.0).collect();
    // Steps every 0.37 s of a closing of 2 s.
    assert_eq!(rises.iter().filter(|rise| **rise).count(), 5);
}

#[test]
fn a_seed_names_a_grasp_and_a_number_a_gripper() {
    let clean = grasp();
    let model = PhysicalLike::default();
    assert_eq!(model.apply(&clean, 7), model.apply(&clean, 7));
    assert_ne!(model.apply(&clean, 7), model.apply(&clean, 8));
    let other = PhysicalLike { gripper: model.gripper + 1, ..model };
    assert_ne!(model.apply(&clean, 7), other.apply(&clean, 7));
    // Without what varies from grasp to grasp, only the gripper's own faults are left.
    let fixed = PhysicalLike { jitter: false, slip: false, drift: false, noise: false, ..model };
    assert_eq!(fixed.apply(&clean, 7), fixed.apply(&clean, 8));
}

#[test]
fn a_channel_reads_the_same_whatever_stands_beside_it() {
    let clean = grasp();
    let all = SensorModel::PhysicalLike.apply(&clean, 7);
    let some = ["force_right", "curvature_left"];
    assert_eq!(SensorModel::PhysicalLike.apply(&only(&clean, &some), 7), only(&all, &some));
}

#[test]
fn nothing_in_is_nothing_out() {
    for clean in [Signals::default(), Signals { channels: vec!["force_left".to_owned()], ..Signals::default() }] {
        assert_eq!(SensorModel::PhysicalLike.apply(&clean, 7), clean);
    }
    let no_channels = Signals { t_s: vec![0.0, 1.0], ..Signals::default() };
    assert_eq!(SensorModel::PhysicalLike.apply(&no_channels, 7).len(), 51);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_comes_in_finite_numbers_come_out(
        values in proptest::collection::vec(prop_oneof![
            -1e2f32..1e2,
            any::<f32>(),
            Just(1e12),
            Just(-1e12),
            Just(f32::MAX),
            Just(f32::INFINITY),
            Just(f32::NAN),
        ], 1..40),
        gap in prop_oneof![0.0..0.1f64, Just(0.0), Just(1e6)],
        switched in 0..2048_u32,
        full_force in prop_oneof![Just(1.0), Just(0.0), Just(-1.0), Just(f64::NAN)],
        seed: u64,
    ) {
        let mut settings = PhysicalLike { gripper: seed, full_force, ..PhysicalLike::OFF };
        for (i, (_, switch)) in SWITCHES.iter().enumerate() {
            *switch(&mut settings) = switched >> i & 1 == 1;
        }
        let mut clean = Signals { channels: NAMES.map(str::to_owned).to_vec(), ..Signals::default() };
        for (sample, value) in values.iter().enumerate() {
            clean.push(sample as f64 * gap, &[*value; 6]);
        }
        let read = settings.apply(&clean, seed);
        prop_assert_eq!(read.values.len(), read.len() * 6);
        prop_assert!(read.values.iter().all(|v| v.is_finite()));
        prop_assert!(read.t_s.windows(2).all(|w| w[0] < w[1]));
    }
}
