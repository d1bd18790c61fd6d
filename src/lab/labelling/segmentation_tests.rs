//! Segmentation of synthetic streams, random streams and streams of the emulated gripper.

use super::segmentation::*;
use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts, parse_faults, parse_script};
use palpate_device::protocol::{BoardEvent, Decoder};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_tactile::board::{Board, Reading};
use palpate_tactile::model::Stream;
use proptest::prelude::*;

/// All events of a stream.
fn events(board: &Board, readings: impl IntoIterator<Item = Reading>) -> Vec<SegmentEvent> {
    let mut segmenter = Segmenter::new(board);
    readings.into_iter().flat_map(|reading| segmenter.push(&reading)).collect()
}

/// Detected grasp: start, phases and end (s).
#[derive(Debug, PartialEq)]
struct Told {
    from_s: f64,
    phases: Vec<(Phase, f64)>,
    at_s: f64,
}

/// Groups events into grasps. Starts and ends must alternate, with the phases between them.
fn grasps(events: &[SegmentEvent]) -> Vec<Told> {
    let mut found = Vec::new();
    let mut open: Option<Told> = None;
    for event in events {
        match event {
            SegmentEvent::Began { from_s } => {
                assert!(open.is_none(), "begins twice: {events:?}");
                open = Some(Told { from_s: *from_s, phases: Vec::new(), at_s: f64::NAN });
            }
            SegmentEvent::Phase(mark) => {
                let open = open.as_mut().expect("a phase belongs to a grasp");
                assert!(mark.from_s >= open.phases.last().map_or(open.from_s, |last| last.1), "{events:?}");
                open.phases.push((mark.phase, mark.from_s));
            }
            SegmentEvent::Ended { at_s } => {
                let open = open.take().expect("what ends has begun");
                assert!(*at_s >= open.from_s, "{events:?}");
                found.push(Told { at_s: *at_s, ..open });
            }
        }
    }
    found
}

/// Bend of a strip at a time after the start of a closing (share): 2 s up, 1 s hold, 1 s back.
fn bend(t: f64) -> f64 {
    (t / 2.0).min(4.0 - t).clamp(0.0, 1.0)
}

/// Stream at a given rate with grasps that begin at `starts`; the right strip bends half as far as the left, and
/// drifts.
fn stream(rate_hz: f64, seconds: f64, starts: &[f64], rise: f64) -> Vec<Reading> {
    let mut noise = Stream::new(7, "segmenter", "noise");
    let reading = |k: u32| {
        let t_s = f64::from(k) / rate_hz;
        let way = rise * starts.iter().map(|start| bend(t_s - start)).sum::<f64>();
        let counts = [1400.0 + way, 1450.0 + 0.5 * way + 0.5 * t_s];
        let mut counts: Vec<Option<f32>> =
            counts.iter().map(|count| Some((count + 2.0 * noise.normal()).round() as f32)).collect();
        counts.extend([Some(0.0), Some(0.0)]);
        Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None }
    };
    (0..(seconds * rate_hz) as u32).map(reading).collect()
}

#[test]
fn grasps_are_found_at_any_rate_by_the_strips_alone() {
    for rate_hz in [10.0, 50.0, 200.0, 1000.0] {
        let found = grasps(&events(&Board::default(), stream(rate_hz, 20.0, &[3.0, 11.0], 600.0)));
        assert_eq!(found.len(), 2, "{rate_hz} Hz: {found:?}");
        for (found, start) in found.iter().zip([3.0, 11.0]) {
            let near = |t: f64, want: f64, before: f64, after: f64| t > want - before && t < want + after;
            assert!(near(found.from_s, start - PRE_ROLL_S, 0.1, 0.3), "{rate_hz} Hz: {found:?}");
            let phases: Vec<Phase> = found.phases.iter().map(|(phase, _)| *phase).collect();
            assert_eq!(phases, [Phase::Close, Phase::Hold, Phase::Release], "{rate_hz} Hz");
            assert!(near(found.phases[1].1, start + 2.0, 0.3, 0.3), "{rate_hz} Hz: {found:?}");
            assert!(near(found.phases[2].1, start + 3.0, 0.1, 0.5), "{rate_hz} Hz: {found:?}");
            assert!(near(found.at_s, start + 4.0, 0.3, 0.6), "{rate_hz} Hz: {found:?}");
        }
    }
}

#[test]
fn the_phases_of_the_first_whole_grasp_are_measured() {
    let board = Board::default();
    let times = |readings: &[Reading]| -> Vec<(Phase, f64)> {
        let marks = measured_phases(&board, readings);
        // No pressure was commanded.
        assert!(marks.iter().all(|mark| mark.line_bar.is_none()));
        marks.iter().map(|mark| (mark.phase, mark.from_s)).collect()
    };
    let near = |found: &[(Phase, f64)], want: [f64; 3]| {
        let phases: Vec<Phase> = found.iter().map(|(phase, _)| *phase).collect();
        assert_eq!(phases, [Phase::Close, Phase::Hold, Phase::Release]);
        assert!(found.iter().zip(want).all(|((_, t), want)| (t - want).abs() < 0.35), "{found:?}");
    };
    let mut readings = stream(50.0, 12.0, &[2.0, 7.0], 600.0);
    near(&times(&readings), [2.0, 4.0, 5.0]);
    assert_eq!(times(&stream(50.0, 12.0, &[], 600.0)), []);
    // The line pressure decides where it is read: two steps with a pause, a hold, and a release.
    let bar = |t: f64| match t {
        t if !(2.5..6.0).contains(&t) => 0.0,
        t if t < 3.5 => 0.4,
        _ => 0.8,
    };
    readings.iter_mut().for_each(|reading| reading.line_bar = Some(bar(reading.t_s)));
    near(&times(&readings), [2.5, 3.5, 6.0]);
    assert!(shows_grasps(&board, &readings) && !shows_grasps(&board, &[]));
    // A grasp whose beginning is missing is not taken for one.
    let later: Vec<Reading> = readings.iter().filter(|reading| reading.t_s > 3.0).cloned().collect();
    assert_eq!(times(&later), []);
}

#[test]
fn a_beginning_is_told_in_time_for_its_pre_roll() {
    let mut segmenter = Segmenter::new(&Board::default());
    for reading in stream(50.0, 10.0, &[3.0], 300.0) {
        for event in segmenter.push(&reading) {
            if let SegmentEvent::Began { from_s } = event {
                assert!(reading.t_s - from_s < PRE_ROLL_S + 1.0, "at {} from {from_s}", reading.t_s);
            }
        }
    }
    assert!(!segmenter.in_grasp());
}

#[test]
fn noise_drift_and_knocks_are_no_grasp() {
    // Ten minutes at 50 Hz in which a strip drifts by 300 counts, and a minute at 1 kHz.
    for (rate_hz, seconds) in [(50.0, 600.0), (1000.0, 60.0), (10.0, 600.0)] {
        assert_eq!(events(&Board::default(), stream(rate_hz, seconds, &[], 0.0)), [], "{rate_hz} Hz");
    }
    let mut knocked = stream(50.0, 60.0, &[], 0.0);
    for knock in knocked.iter_mut().step_by(97) {
        knock.counts[0] = Some(4000.0);
    }
    assert_eq!(events(&Board::default(), knocked), []);
}

#[test]
fn a_dead_strip_missing_numbers_and_gaps_are_survived() {
    let mut readings = stream(50.0, 20.0, &[3.0, 11.0], 600.0);
    for (k, reading) in readings.iter_mut().enumerate() {
        reading.counts[0] = None;
        if k % 5 == 0 {
            reading.counts[1] = Some(f32::NAN);
        }
    }
    // One second is missing during the hold, four between the grasps.
    readings.retain(|reading| !(5.1..5.9).contains(&reading.t_s) && !(7.5..9.5).contains(&reading.t_s));
    let found = grasps(&events(&Board::default(), readings));
    assert_eq!(found.len(), 2, "{found:?}");
    // A grasp followed by a long gap ends where the gap begins.
    let mut cut = stream(50.0, 30.0, &[3.0, 22.0], 600.0);
    cut.retain(|reading| !(5.5..15.0).contains(&reading.t_s));
    let found = grasps(&events(&Board::default(), cut));
    assert!(found.len() == 2 && (found[0].at_s - 5.5).abs() < 0.05, "{found:?}");
    // A board without strips and without pressure yields no events.
    let blind = Board { channels: vec!["fsrL".to_owned()], ..Board::default() };
    assert_eq!(events(&blind, stream(50.0, 10.0, &[3.0], 600.0)), []);
}

#[test]
fn pressure_says_it_to_the_reading() {
    let bar = |t: f64| (20.0 * bend(t - 3.0)).round() / 20.0;
    let mut readings = stream(50.0, 12.0, &[3.0], 600.0);
    readings.iter_mut().for_each(|reading| reading.line_bar = Some(bar(reading.t_s)));
    let at = |wanted: &dyn Fn(f64) -> bool| readings.iter().find(|r| wanted(r.t_s)).map_or(f64::NAN, |r| r.t_s);
    let (closes, holds) = (at(&|t| bar(t) > 0.0), at(&|t| bar(t) > 0.99));
    let releases = at(&|t| t > 5.5 && bar(t) < 1.0);
    let found = grasps(&events(&Board::default(), readings));
    assert_eq!(found.len(), 1, "{found:?}");
    let want = [(Phase::Close, closes), (Phase::Hold, holds), (Phase::Release, releases)];
    for ((phase, t), (want, want_t)) in found[0].phases.iter().zip(want) {
        assert!(*phase == want && (t - want_t).abs() < 0.021, "{want:?} at {want_t}: {found:?}");
    }
    assert!((found[0].from_s - (closes - PRE_ROLL_S)).abs() < 0.021 && found[0].at_s < 7.5, "{found:?}");
    // Without strips the line pressure suffices, and a rise before the line is vented starts another grasp.
    let blind = Board { channels: vec!["fsrL".to_owned()], ..Board::default() };
    let twice = (0..600).map(|k| {
        let t_s = 0.02 * f64::from(k);
        let line_bar = Some(bend(t_s - 1.0).max(0.3 * f64::from(t_s > 2.0 && t_s < 5.2)).max(bend(t_s - 5.1)));
        Reading { t_s, arrived_s: t_s, seq: None, counts: vec![Some(0.0)], line_bar }
    });
    let found = grasps(&events(&blind, twice));
    assert!(found.len() == 2 && found[1].from_s >= found[0].at_s, "{found:?}");
}

/// Output of a board while it runs a script, decoded as the host decodes it.
fn emulated(script: &str, faults: &str, seconds: f64) -> (Board, Vec<Reading>) {
    let mut scene = Scene::default();
    scene.solver.accuracy = Accuracy::Draft;
    let script = parse_script(script).expect("sound");
    let hand = HandPlan {
        sensors: palpate_tactile::board::SensorList::default(),
        scene,
        objects: vec![EMPTY.to_owned()],
        seed: 5,
        grasp_every_s: None,
        script,
    };
    let (parts, faults) = (HiddenParts::drawn(5), parse_faults(faults).expect("sound"));
    let (rate_hz, channels, most_steps, clock_start_us) = (50, 4, 30, 0);
    let setup = EmulatorSetup { hand, parts, rate_hz, channels, most_steps, clock_start_us, faults, seed: 5 };
    let mut gripper = EmulatedGripper::new(setup).expect("it knows them");
    let (mut decoder, mut decoded) = (Decoder::default(), Vec::new());
    for k in 1..=(seconds / 0.005) as u32 {
        let now = 0.005 * f64::from(k);
        gripper.advance(now);
        decoder.push(&gripper.take_bytes(), now, &mut decoded);
    }
    (decoder.board(), decoded.into_iter().filter_map(BoardEvent::into_reading).collect())
}

#[test]
fn the_emulated_gripper_is_followed_with_and_without_its_pressure() {
    let script = "rest=3; grasp lemon; rest=3; close empty; rest=3; grasp button bar=0.8; rest=3";
    let (board, with) = emulated(script, "loss=0.2@5/1", 26.0);
    let pressed: Vec<f64> = with
        .windows(2)
        .filter(|pair| pair[0].line_bar == Some(0.0) && pair[1].line_bar > Some(0.0))
        .map(|pair| pair[1].t_s)
        .collect();
    assert_eq!(pressed.len(), 3);
    let mut without = with.clone();
    without.iter_mut().for_each(|reading| reading.line_bar = None);
    for (readings, late_s) in [(with, 0.03), (without, 0.6)] {
        let found = grasps(&events(&board, readings));
        assert_eq!(found.len(), 3, "{found:?}");
        for (found, pressed) in found.iter().zip(&pressed) {
            let late = found.from_s + PRE_ROLL_S - pressed;
            assert!((-0.03..late_s).contains(&late), "{late} s late: {found:?}");
            assert_eq!(found.phases.first().map(|first| first.0), Some(Phase::Close));
            let release = found.phases.iter().find(|(phase, _)| *phase == Phase::Release).expect("it opens");
            assert!(release.1 > pressed + 2.3 && release.1 < pressed + 3.7, "{found:?} {pressed}");
            assert!(found.at_s > release.1 && found.at_s < pressed + 6.5, "{found:?} {pressed}");
        }
    }
}

fn any_reading() -> impl Strategy<Value = (f64, [Option<f32>; 2], Option<f64>)> {
    let step = prop_oneof![
        20 => 0.001..0.2f64, 1 => Just(f64::NAN), 1 => -10.0..0.0f64, 1 => 1.0..20.0f64, 1 => Just(f64::INFINITY),
    ];
    let count = || prop::option::of(prop_oneof![8 => 1390.0..1410.0f32, 3 => 0.0..4096.0f32, 1 => Just(f32::NAN)]);
    let bar = prop::option::weighted(0.2, prop_oneof![Just(0.0), 0.0..1.5f64, Just(f64::NAN)]);
    (step, [count(), count()], bar)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn beginnings_and_ends_take_turns_whatever_comes(steps in prop::collection::vec((any_reading(), 1..40usize), 1..60)) {
        let mut segmenter = Segmenter::new(&Board::default());
        let (mut t, mut events) = (0.0, Vec::new());
        for ((step, counts, line_bar), times) in steps {
            for _ in 0..times {
                // A single bad time stamp must not stop the segmentation.
                let t_s = t + step;
                t = if t_s.is_finite() { t_s } else { t };
                let reading = Reading { t_s, arrived_s: t, seq: None, counts: counts.to_vec(), line_bar };
                events.extend(segmenter.push(&reading));
                prop_assert!(segmenter.held() <= 128);
            }
        }
        let mut open = false;
        for event in &events {
            match event {
                SegmentEvent::Began { from_s } => prop_assert!(!std::mem::replace(&mut open, true) && from_s.is_finite()),
                SegmentEvent::Phase(mark) => prop_assert!(open && mark.from_s.is_finite()),
                SegmentEvent::Ended { at_s } => prop_assert!(std::mem::replace(&mut open, false) && at_s.is_finite()),
            }
        }
        prop_assert_eq!(open, segmenter.in_grasp());
    }
}
