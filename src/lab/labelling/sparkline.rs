//! Small pictures of trials, and long trials decimated to a bounded number of readings.

use palpate_sim::gripper::Side;
use palpate_store::labels::{SPARKLINE_BINS, Sparkline};
use palpate_store::{Store, StoreError};
use palpate_tactile::Signals;
use palpate_tactile::board::{Board, Reading, SensorKind};
use palpate_tactile::trial::{Trial, TrialData, TrialId};

/// Readings that flags and pictures are made from, at most.
const MOST: usize = 8192;

/// Every reading of a short trial; of a longer one every second, fourth, .. so that at most `MOST` are left.
pub fn decimated(readings: &[Reading]) -> Vec<Reading> {
    let mut step = 1;
    while readings.len().div_ceil(step) > MOST {
        step *= 2;
    }
    readings.iter().step_by(step).cloned().collect()
}

/// Sparkline of a trial: the mean count of each finger in each bin of its time.
pub fn sparkline(board: &Board, readings: &[Reading]) -> Sparkline {
    Side::BOTH.map(|side| {
        let on = |kind| board.sensors.on(kind, side.name());
        match on(SensorKind::Pad).chain(on(SensorKind::Flex)).find_map(|sensor| board.channel_of(sensor)) {
            Some(column) => bins(readings, column),
            None => Vec::new(),
        }
    })
}

fn bins(readings: &[Reading], column: usize) -> Vec<Option<f32>> {
    let samples = readings.iter().map(|reading| (reading.t_s, reading.counts.get(column).copied().flatten()));
    // Tenths of a count are more than a picture of a few pixels shows.
    means(samples).into_iter().map(|mean| mean.map(|mean| (10.0 * mean).round() / 10.0)).collect()
}

/// Mean value in each bin of the time from the first to the last sample.
fn means(samples: impl DoubleEndedIterator<Item = (f64, Option<f32>)> + Clone) -> Vec<Option<f32>> {
    let (Some((first_s, _)), Some((last_s, _))) = (samples.clone().next(), samples.clone().next_back()) else {
        return Vec::new();
    };
    let span = last_s - first_s;
    let mut sums = [(0.0f64, 0u32); SPARKLINE_BINS];
    for (t_s, value) in samples {
        let share = if span > 0.0 { (t_s - first_s) / span } else { 0.0 };
        let bin = ((share * SPARKLINE_BINS as f64) as usize).min(SPARKLINE_BINS - 1);
        if let Some(value) = value {
            sums[bin].0 += f64::from(value);
            sums[bin].1 += 1;
        }
    }
    sums.into_iter().map(|(sum, n)| (n > 0).then(|| (sum / f64::from(n)) as f32)).collect()
}

/// Sparkline of a stored trial: of a simulated trial the forces on the pads (N), of a recorded trial the counts, of an
/// imported trial the channels of the left and right pad, or its first two channels.
pub fn stored_sparkline(store: &Store, id: TrialId) -> Result<Sparkline, StoreError> {
    if let Some(info) = store.board_info(id)?.filter(|info| !info.sparkline.iter().all(Vec::is_empty)) {
        return Ok(info.sparkline);
    }
    let Trial { header, data } = store.load(id)?;
    Ok(match data {
        TrialData::Simulated(data) => {
            let taxels = header.scene.gripper.taxels().count();
            Side::BOTH.map(|side| {
                means(data.frames.iter().map(|frame| (frame.t, Some(frame.normal_force(side, taxels) as f32))))
            })
        }
        TrialData::Recorded(log) => sparkline(&log.course.board, &decimated(&log.readings)),
        TrialData::Imported(signals) => [0, 1].map(|place| imported_channel(&signals, place)),
    })
}

fn imported_channel(signals: &Signals, place: usize) -> Vec<Option<f32>> {
    let named = |side: &str| signals.channels.iter().position(|name| name.contains("pressure") && name.contains(side));
    let column = named(["left", "right"][place]).unwrap_or(place);
    if column >= signals.channels.len() {
        return Vec::new();
    }
    means((0..signals.len()).map(|sample| (signals.t_s[sample], signals.row(sample).get(column).copied())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(t_s: f64, pad: f32) -> Reading {
        let counts = vec![Some(1400.0), None, Some(pad), None];
        Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None }
    }

    #[test]
    fn short_trials_stay_whole_and_long_ones_are_decimated_evenly() {
        let readings: Vec<Reading> = (0..100_000).map(|k| reading(f64::from(k), 0.0)).collect();
        assert_eq!(decimated(&readings[..MOST]).len(), MOST);
        let kept = decimated(&readings);
        assert!(kept.len() <= MOST && kept.len() > MOST / 2, "{}", kept.len());
        assert!(kept.windows(2).all(|pair| pair[1].t_s - pair[0].t_s == 16.0));
    }

    #[test]
    fn a_small_picture_holds_means_and_keeps_gaps() {
        // A second at 480 Hz: ten readings to a bin; nothing in the second half but its last reading.
        let readings: Vec<Reading> = (0..=480)
            .filter(|k| *k < 240 || *k == 480)
            .map(|k| reading(f64::from(k) / 480.0, (k / 10) as f32))
            .collect();
        let [left, right] = sparkline(&Board::default(), &readings);
        assert_eq!((left.len(), right.iter().flatten().count()), (SPARKLINE_BINS, 0));
        for (k, value) in left.iter().enumerate() {
            let want = if k < 24 { Some(k as f32) } else { None };
            assert_eq!(*value, if k == 47 { Some(48.0) } else { want }, "bin {k}");
        }
        let strips = Board { channels: vec!["flexL".to_owned()], ..Board::default() };
        assert_eq!(sparkline(&strips, &readings)[0][0], Some(1400.0));
        assert_eq!(sparkline(&strips, &[]), [Vec::new(), Vec::new()]);
    }
    #[test]
    fn stored_trials_of_every_source_have_a_sparkline() -> Result<(), Box<dyn std::error::Error>> {
        use palpate_sim::{run::SimRun, scene::Scene};
        use palpate_store::ImportedTrial;
        use palpate_tactile::trial::{SimulatedData, TrialHeader};
        let folder = tempfile::tempdir()?;
        let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
        let mut scene = Scene::default();
        scene.object.source = "lemon".to_owned();
        let (mut run, placement) = SimRun::new(&scene, scene.load_object()?.as_ref());
        let frames = run.run_programme(&scene.programme)?;
        let (plan, quality) = (run.plan().clone(), run.quality());
        let data = SimulatedData { world_from_gripper: placement.world_from_gripper, plan, quality, frames };
        let simulated = store.insert(&Trial { header: TrialHeader::new("lemon", scene), data })?.id();
        for finger in stored_sparkline(&store, simulated)? {
            let force: Vec<f32> = finger.into_iter().flatten().collect();
            assert_eq!((force.len(), force[0]), (SPARKLINE_BINS, 0.0), "no force before the contact");
            assert!(force.iter().copied().fold(0.0, f32::max) > 0.3, "{force:?}");
        }
        let channels = ["grip", "pressure_right", "pressure_left"].map(str::to_owned).to_vec();
        let signals = Signals { channels, t_s: vec![0.0, 1.0], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
        let (name, label) = (String::new(), "mug".to_owned());
        store.insert_imported(
            "mine",
            &[ImportedTrial { name, label, size: None, shape: None, session: None, signals }],
        )?;
        let [left, right] = stored_sparkline(&store, simulated + 1)?;
        assert_eq!((left[0], left[47], right[0], right[47]), (Some(3.0), Some(6.0), Some(2.0), Some(5.0)));
        assert!(stored_sparkline(&store, 99).is_err());
        Ok(())
    }
}
