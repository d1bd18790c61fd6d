//! Recording one trial of the real gripper from beginning to end, as `palpate record` does.

use super::board_trial::{BoardTrialRecording, TrialRequest, reading_time};
use super::board_writer::RecordedTrial;
use super::recent::RecentEvents;
use super::recorder::{Recorder, RecorderNotice};
use crate::gripper::{Gripper, GripperError, GripperEvent, SerialGripper};
use palpate_device::serial::{LinkState, LinkStatus};
use palpate_sim::scene::Scene;
use palpate_tactile::trial::TrialId;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// Longest single wait for events of the board.
const PATIENCE: Duration = Duration::from_millis(20);
/// Time for the first reading.
const FIRST_READING: Duration = Duration::from_secs(20);
/// Time for the first reading if bytes come but cannot be decoded: all baud rates are tried.
const UNREADABLE: Duration = Duration::from_secs(10);
/// Readings before the trial begins (s): until then it is unknown how late the first ones arrived.
const SETTLE_S: f64 = 0.5;
/// Time between two progress reports.
const PROGRESS: Duration = Duration::from_millis(250);

/// A trial that could not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The gripper failed.
    #[error(transparent)]
    Gripper(#[from] GripperError),
    /// The recorder's thread could not be started.
    #[error("the recorder could not be started: {0}")]
    Recorder(#[from] std::io::Error),
    /// Nothing was read, or nothing stored.
    #[error("{0}")]
    Failed(String),
}

/// Progress of a recording.
#[derive(Clone, Copy, Debug)]
pub struct RecordProgress<'a> {
    /// Number of the trial; none before the store has given one.
    pub id: Option<TrialId>,
    /// Readings so far.
    pub samples: u64,
    /// The link.
    pub status: &'a LinkStatus,
}

/// A recorded trial, and what ended it.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The trial in the store.
    pub trial: RecordedTrial,
    /// The link at its end.
    pub status: LinkStatus,
    /// Why it ended early: a driven grasp was aborted, or no more readings came.
    pub aborted: Option<String>,
}

/// Records a trial into the store at `store`, from the first settled reading to the end of the request or until `stop`.
pub fn record(
    gripper: &mut SerialGripper,
    scene: &Scene,
    request: TrialRequest,
    store: PathBuf,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(RecordProgress<'_>),
) -> Result<Recording, RecordError> {
    let recent = wait_for_readings(gripper, stop)?;
    let (sender, notices) = channel();
    let recorder = Recorder::start(store, move |notice| {
        // This function ends after the recorder.
        let _heard = sender.send(notice);
    })?;
    let live = gripper.stream().status().baud.is_some();
    let from_s = (!live).then_some(f64::NEG_INFINITY);
    let mut recording = BoardTrialRecording::begin(&recorder, gripper, &recent, scene, request, from_s);
    let (mut id, mut failed, mut reported) = (None, None, Instant::now());
    while failed.is_none() && !stop.load(Ordering::Relaxed) && !recording.is_over(gripper) {
        match gripper.next_event(PATIENCE) {
            Ok(GripperEvent::Board(event)) => recording.take(&recorder, event),
            Ok(GripperEvent::Finished) => break,
            Ok(GripperEvent::Tick | GripperEvent::Sampled(_) | GripperEvent::Signals { .. }) => {
                recording.drive(&recorder, gripper);
            }
            Err(error) => recording.controller.abort(error.to_string()),
        }
        for notice in notices.try_iter() {
            match notice {
                RecorderNotice::Begun(begun) => id = Some(begun),
                RecorderNotice::Failed(cause) => failed = Some(cause),
                _ => {}
            }
        }
        if reported.elapsed() >= PROGRESS {
            reported = Instant::now();
            progress(RecordProgress { id, samples: recording.samples, status: &gripper.stream().status() });
        }
    }
    let missing = live && !recording.is_complete() && !stop.load(Ordering::Relaxed);
    let lost = missing.then(|| format!("readings came no longer. {}", gripper.stream().status().state.sentence()));
    let aborted = recording.controller.abort_cause().map(str::to_owned).or(lost);
    recording.finish(&recorder, gripper, false, None);
    let status = gripper.stream().status();
    let aborted = aborted.or_else(|| status.state.cut_short().map(str::to_owned));
    drop(recorder);
    for notice in notices.try_iter() {
        match notice {
            RecorderNotice::Recorded(trial) => return Ok(Recording { trial: *trial, status, aborted }),
            RecorderNotice::Failed(cause) => failed = Some(cause),
            _ => {}
        }
    }
    Err(RecordError::Failed(failed.unwrap_or_else(|| "the trial was not stored".to_owned())))
}

/// Waits until the board sends readings and their times have settled.
fn wait_for_readings(gripper: &mut SerialGripper, stop: &AtomicBool) -> Result<RecentEvents, RecordError> {
    let start = Instant::now();
    let mut recent = RecentEvents::default();
    let mut first_s = None;
    loop {
        let event = gripper.next_event(PATIENCE)?;
        let mut finished = matches!(event, GripperEvent::Finished);
        if let GripperEvent::Board(event) = event {
            recent.push(&event);
            if let Some(t_s) = reading_time(&event) {
                let live = gripper.stream().status().baud.is_some();
                if !live || t_s >= *first_s.get_or_insert(t_s) + SETTLE_S {
                    return Ok(recent);
                }
            }
            continue;
        }
        let LinkStatus { state, port, baud, cadence, .. } = gripper.stream().status();
        finished |= matches!(state, LinkState::Unreadable { .. }) && start.elapsed() > UNREADABLE;
        if finished || start.elapsed() > FIRST_READING || stop.load(Ordering::Relaxed) {
            let (path, bad_lines) = (port.path.display(), cadence.bad_lines);
            return Err(RecordError::Failed(match baud {
                None => format!(
                    "\"{path}\" has no reading ({bad_lines} unreadable line(s)): it should hold bytes as a board sent them, \
                     such as `palpate trials export --labelled` writes"
                ),
                Some(_) => format!("no reading from \"{path}\": {}", state.sentence()),
            }));
        }
    }
}
