//! Records what a link hears as a trial. Whoever holds the link hands over its events and calls
//! [`BoardRecorder::flush_if_due`] after each, so that a kill loses at most a second.

use crate::labelling::{Decimated, Observed, flags_of, sparkline};
use palpate_device::serial::{LinkEvent, LinkStatus};
use palpate_device::wire::Heard;
use palpate_geometry::Pose;
use palpate_sim::frame::{Plan, Quality};
use palpate_store::{BOARD_RIG, BoardChunk, BoardInfo, Serving, Store, StoreError, check_space};
use palpate_tactile::board::{Gap, Sensor};
use palpate_tactile::cadence::Cadence;
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::{PhaseMark, TrialId, TrialInfo};
use std::time::{Duration, Instant};

/// What waits to be written is never older than this.
const FLUSH_AFTER: Duration = Duration::from_millis(800);
/// How often the end of a trial is offered to a store that another program writes to. Each waits for ten seconds.
const MOST_ENDS: u32 = 6;
/// How often what waits is offered to a store that another program writes to; together as long as others wait for it.
const MOST_OFFERS: u32 = 12;
/// Bytes a second that a trial may need: readings and bytes of 1 kHz with 8 channels, twice over.
const BYTES_PER_S: f64 = 400e3;
/// A board that was silent for longer than this before the end left a gap there (s).
const SILENCE_S: f64 = 1.0;
/// Gaps that are told of, at most; a line that loses every other reading has one to each.
const MOST_GAPS: usize = 100;
/// A trial of unknown length is given this long (s).
const UNKNOWN_LENGTH_S: f64 = 600.0;

/// A trial of a real gripper that is being recorded.
#[derive(Debug)]
pub struct BoardRecorder {
    id: TrialId,
    about: BoardInfo,
    chunk: BoardChunk,
    /// When what waits was last offered to the store, and how often that was in vain.
    offered: (Instant, u32),
    samples: u64,
    lost: u64,
    gaps: u64,
    interrupted: Vec<String>,
    /// What its flags and its small picture are made from.
    kept: Decimated,
    newest_s: Option<f64>,
    missing: Vec<Gap>,
    /// The newest reading's time (s), and why none has come since, where that is known.
    last: Option<(f64, Option<String>)>,
    /// Counts of the link when the trial began.
    before: (Cadence, u32),
}

/// What a trial came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Its number.
    pub id: TrialId,
    /// What is known of it.
    pub about: BoardInfo,
    /// What should be known of it, in sentences.
    pub warnings: Vec<String>,
}

/// What is known of a trial of a real gripper before it begins.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardTrialPlan {
    /// Name of the object; empty where nobody has said yet what it is of.
    pub object: String,
    /// The scene as TOML: the gripper as it is modelled, and its programme.
    pub scene: String,
    /// How long it will take (s), where that is known.
    pub seconds: Option<f64>,
}

impl BoardTrialPlan {
    /// What the store is told of such a trial at its beginning.
    pub fn info(&self) -> TrialInfo {
        TrialInfo {
            rig: BOARD_RIG.to_owned(),
            object: self.object.clone(),
            seed: 0,
            collection: None,
            scene: self.scene.clone(),
            world_from_gripper: Pose::IDENTITY,
            plan: Plan::default(),
            quality: Quality::default(),
            warnings: Vec::new(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }
}

impl BoardRecorder {
    /// Begins a trial. What the link has heard before is not part of it.
    pub fn begin(
        store: &mut Store,
        plan: &BoardTrialPlan,
        status: &LinkStatus,
        began_s: f64,
    ) -> Result<Self, StoreError> {
        check_space(store.path(), plan.seconds.unwrap_or(UNKNOWN_LENGTH_S) * BYTES_PER_S)?;
        let info = plan.info();
        let about = BoardInfo {
            port: format!("{}, {}", status.port.path.display(), status.port.title),
            board: status.board.clone(),
            detected: status.detected.clone(),
            began_s,
            ..BoardInfo::default()
        };
        Ok(Self {
            id: store.begin_board(&info, &about)?,
            about,
            chunk: BoardChunk::default(),
            offered: (Instant::now(), 0),
            samples: 0,
            lost: 0,
            gaps: 0,
            interrupted: Vec::new(),
            kept: Decimated::default(),
            newest_s: None,
            missing: Vec::new(),
            last: None,
            before: (status.cadence.clone(), status.reconnects),
        })
    }

    /// Its number.
    pub fn id(&self) -> TrialId {
        self.id
    }

    /// Readings so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Takes in the next event of the link.
    pub fn take(&mut self, event: LinkEvent) {
        match event {
            LinkEvent::Captured(piece) => {
                if let Captured::Interrupted { cause, .. } = &piece {
                    self.interrupted.push(cause.clone());
                    self.last = self.last.take().map(|(t_s, _)| (t_s, Some(cause.clone())));
                }
                self.chunk.bytes.push(piece);
            }
            LinkEvent::Heard(Heard::Reading(reading)) => {
                self.samples += 1;
                self.last = Some((reading.t_s, None));
                self.kept.push(&reading);
                self.newest_s = Some(reading.t_s);
                self.chunk.readings.push(reading);
            }
            LinkEvent::Heard(Heard::Gap(gap)) => {
                self.lost += gap.lost.unwrap_or(0);
                self.note_gap(gap);
            }
            LinkEvent::Heard(Heard::Board(board)) => self.about.board = board,
            LinkEvent::Heard(Heard::Said(_)) => {}
        }
    }

    /// Something cut the grasp short, though the board was heard all the time.
    pub fn interrupt(&mut self, cause: &str) {
        self.interrupted.push(cause.to_owned());
    }

    /// The control box does something else from now on.
    pub fn mark(&mut self, mark: PhaseMark) {
        self.about.phases.push(mark);
    }

    /// Writes what waits, where it is time. Whoever holds the link has fingers under pressure to look after, and does not
    /// wait here for another program that writes: what waits is offered again later, and an error after ten seconds.
    /// True where it was time.
    pub fn flush_if_due(&mut self, store: &mut Store) -> Result<bool, StoreError> {
        let due = self.offered.0.elapsed() >= FLUSH_AFTER;
        if due {
            self.offer(store)?;
        }
        Ok(due)
    }

    pub(super) fn offer(&mut self, store: &mut Store) -> Result<(), StoreError> {
        let refused = self.offered.1 + 1;
        self.offered = (Instant::now(), refused);
        match store.at_once(|store| self.flush(store)) {
            Err(StoreError::Busy) if refused < MOST_OFFERS => Ok(()),
            outcome => outcome,
        }
    }

    /// Writes what waits, now.
    pub fn flush(&mut self, store: &mut Store) -> Result<(), StoreError> {
        store.append_board(self.id, &self.about, &self.chunk)?;
        self.chunk = BoardChunk::default();
        self.offered = (Instant::now(), 0);
        Ok(())
    }

    /// Ends the trial; `notes` are what its rig has to say. Another program that writes to the store is waited for, for a
    /// minute.
    pub fn finish(
        mut self,
        store: &mut Store,
        status: &LinkStatus,
        notes: Vec<String>,
    ) -> Result<Recorded, StoreError> {
        self.close(status);
        stubbornly(|| self.flush(store))?;
        let (before, reconnects) = &self.before;
        self.about.reconnects = status.reconnects - reconnects;
        self.about.detected.clone_from(&status.detected);
        self.about.cadence = Cadence {
            samples: self.samples,
            lost: self.lost,
            gaps: self.gaps,
            bad_lines: status.cadence.bad_lines.saturating_sub(before.bad_lines),
            ..status.cadence.clone()
        };
        self.examine(store);
        let mut warnings = self.warnings(status);
        warnings.extend(notes);
        stubbornly(|| store.finish_board(self.id, &self.about, &warnings))?;
        Ok(Recorded { id: self.id, about: self.about, warnings })
    }

    /// What was not heard up to the end is a gap as well.
    fn close(&mut self, status: &LinkStatus) {
        let live = status.baud.is_some();
        let Some((from_s, cause)) = self.last.take().filter(|(t_s, _)| live && status.now_s - t_s > SILENCE_S) else {
            return;
        };
        let cause = cause.unwrap_or_else(|| "nothing came any more".to_owned());
        self.note_gap(Gap { from_s, to_s: status.now_s, lost: None, cause });
    }

    fn note_gap(&mut self, gap: Gap) {
        self.gaps += 1;
        if self.missing.len() < MOST_GAPS {
            self.missing.push(gap.clone());
        }
        self.chunk.gaps.push(gap);
    }

    /// What a finished trial is flagged with, and its small picture.
    fn examine(&mut self, store: &Store) {
        // Without calibrations counts are judged: a damaged record is no reason not to end a trial.
        let serving = store.serving(Some(self.id), &[]).unwrap_or_else(|error| {
            tracing::warn!("the flags of trial {} are found without calibrations: {error}", self.id);
            Serving::default()
        });
        let readings = self.kept.readings();
        let observed = Observed {
            board: &self.about.board,
            readings,
            gaps: &self.missing,
            interruptions: &self.interrupted,
            cadence: &self.about.cadence,
            phases: &self.about.phases,
            calibrations: &serving.calibrations,
        };
        self.about.flags = flags_of(&observed);
        self.about.sparkline = sparkline(&self.about.board, readings);
        self.about.seconds = self.newest_s.map_or(0.0, |newest| (newest - self.about.began_s).max(0.0));
    }

    fn warnings(&self, status: &LinkStatus) -> Vec<String> {
        let cadence = &self.about.cadence;
        let mut warnings: Vec<String> = self.interrupted.iter().map(|cause| format!("interrupted: {cause}")).collect();
        if cadence.samples == 0 {
            warnings.push(format!("nothing was recorded: {}", status.state.sentence()));
        }
        let (lost, gaps) = (cadence.lost, cadence.gaps);
        if gaps > 0 {
            warnings.push(format!("{lost} reading(s) are missing for certain, in {gaps} gap(s)"));
        }
        warnings.extend(status.wiring_remarks());
        let assumed = Sensor::ALL.iter().any(|sensor| self.about.board.channel_of(*sensor).is_none());
        if assumed && cadence.samples > 0 {
            let names = self.about.board.channels.join(", ");
            warnings.push(format!("the board has not all of flexL, flexR, fsrL, fsrR, but {names}"));
        }
        warnings
    }
}

/// What must not be lost is tried again while another program writes.
fn stubbornly<T>(mut write: impl FnMut() -> Result<T, StoreError>) -> Result<T, StoreError> {
    for _ in 1..MOST_ENDS {
        match write() {
            Err(StoreError::Busy) => {}
            outcome => return outcome,
        }
    }
    write()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_busy_store_is_asked_again_and_not_for_ever() {
        let tried = |free_after: u32| {
            let mut tries = 0;
            let outcome = stubbornly(|| {
                tries += 1;
                if tries > free_after { Ok(tries) } else { Err(StoreError::Busy) }
            });
            (outcome.ok(), tries)
        };
        assert_eq!((tried(0), tried(3), tried(99)), ((Some(1), 1), (Some(4), 4), (None, 6)));
    }
}
