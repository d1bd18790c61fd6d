//! Writer of a trial of the real gripper: pending data, and statistics for its header.

use crate::grasping::PressureFault;
use crate::labelling::{Observed, decimated, flags_of, measured_phases, shows_grasps, sparkline};
use palpate_device::protocol::BoardEvent;
use palpate_device::serial::LinkStatus;
use palpate_sim::scene::Scene;
use palpate_store::{BoardChunk, BoardInfo, Serving, Store, StoreError, check_space};
use palpate_tactile::board::Gap;
use palpate_tactile::cadence::Cadence;
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::{BoardCourse, Control, PhaseMark, TrialHeader, TrialId};

/// Bytes a second that a trial may need: readings and bytes of 1 kHz with 8 channels, twice over.
const BYTES_PER_S: f64 = 400e3;
/// A silence of the board before the end that is longer than this is a gap (s).
const SILENCE_S: f64 = 1.0;
/// Length that is reserved for a trial of unknown length (s).
const UNKNOWN_LENGTH_S: f64 = 600.0;

/// Plan of a trial of the real gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardTrialPlan {
    /// Class of the object; empty where it is labelled later.
    pub object: String,
    /// Scene: the gripper as modelled, and its programme.
    pub scene: Scene,
    /// Length (s), where known.
    pub seconds: Option<f64>,
    /// Link at the beginning.
    pub status: LinkStatus,
    /// First reading (s, on the clock of the readings).
    pub began_s: f64,
    /// Who actuates. By hand, phases are what a person was told to do: those measured replace them, where there are any.
    pub control: Control,
}

/// A recorded trial of the real gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedTrial {
    /// Its number.
    pub id: TrialId,
    /// Its board, cadence, phases and flags.
    pub about: BoardInfo,
    /// Warnings, in sentences.
    pub warnings: Vec<String>,
}

/// A trial that is being recorded.
#[derive(Debug)]
pub(super) struct BoardWriter {
    id: TrialId,
    about: BoardInfo,
    control: Control,
    chunk: BoardChunk,
    samples: u64,
    /// Number of these that are written.
    written: u64,
    lost: u64,
    gaps: u64,
    interruptions: Vec<String>,
    newest_s: Option<f64>,
    /// The newest reading's time (s), and the reason why none followed, where known.
    last: Option<(f64, Option<String>)>,
    /// Counts of the link when the trial began.
    before: (Cadence, u32),
}

impl BoardWriter {
    /// Begins a trial in the store, where there is room for it.
    pub(super) fn begin(store: &mut Store, plan: &BoardTrialPlan) -> Result<Self, StoreError> {
        check_space(store.path(), plan.seconds.unwrap_or(UNKNOWN_LENGTH_S) * BYTES_PER_S)?;
        let status = &plan.status;
        let about = BoardInfo {
            port: format!("{}, {}", status.port.path.display(), status.port.title),
            course: BoardCourse {
                board: status.board.clone(),
                detected: status.detected.clone(),
                began_s: plan.began_s,
                ..BoardCourse::default()
            },
            ..BoardInfo::default()
        };
        Ok(Self {
            id: store.begin_board(&TrialHeader::new(&plan.object, plan.scene.clone()), &about)?,
            about,
            control: plan.control,
            chunk: BoardChunk::default(),
            samples: 0,
            written: 0,
            lost: 0,
            gaps: 0,
            interruptions: Vec::new(),
            newest_s: None,
            last: None,
            before: (status.cadence.clone(), status.reconnects),
        })
    }

    /// Its number.
    pub(super) fn id(&self) -> TrialId {
        self.id
    }

    /// Handles an event of the link.
    pub(super) fn take(&mut self, event: BoardEvent) {
        match event {
            BoardEvent::Captured(piece) => {
                if let Captured::Interrupted { cause, .. } = &piece {
                    self.interruptions.push(cause.clone());
                    self.last = self.last.take().map(|(t_s, _)| (t_s, Some(cause.clone())));
                }
                self.chunk.bytes.push(piece);
            }
            BoardEvent::Reading(reading) => {
                self.samples += 1;
                self.last = Some((reading.t_s, None));
                self.newest_s = Some(reading.t_s);
                self.chunk.readings.push(reading);
            }
            BoardEvent::Gap(gap) => {
                self.lost += gap.lost.unwrap_or(0);
                self.add_gap(gap);
            }
            BoardEvent::Board(board) => self.about.course.board = board,
            BoardEvent::Reply(_) => {}
        }
    }

    /// Notes an interruption of the grasp, though the board kept sending.
    pub(super) fn interrupt(&mut self, cause: String) {
        if !self.interruptions.contains(&cause) {
            self.interruptions.push(cause);
        }
    }

    /// Notes a change of the control box.
    pub(super) fn mark(&mut self, mark: PhaseMark) {
        self.about.course.phases.push(mark);
    }

    /// Writes the waiting data.
    pub(super) fn flush(&mut self, store: &mut Store) -> Result<(), StoreError> {
        store.append_board(self.id, &self.about, &self.chunk)?;
        self.chunk = BoardChunk::default();
        self.written = self.samples;
        Ok(())
    }

    /// What is kept of a trial that cannot be written any further.
    pub(super) fn kept(&self) -> String {
        format!("{} of {} samples are kept as trial {} (cut short)", self.written, self.samples, self.id)
    }

    /// Writes the rest and closes the trial. Its flags are derived from the stored data.
    pub(super) fn finish(
        &mut self,
        store: &mut Store,
        status: &LinkStatus,
        notes: &[String],
    ) -> Result<RecordedTrial, StoreError> {
        self.close(status);
        self.flush(store)?;
        let (before, reconnects) = &self.before;
        self.about.course.reconnects = status.reconnects - reconnects;
        self.about.course.detected.clone_from(&status.detected);
        self.about.seconds = self.newest_s.map_or(0.0, |newest| (newest - self.about.course.began_s).max(0.0));
        self.about.course.cadence =
            Cadence { samples: self.samples, lost: self.lost, gaps: self.gaps, ..status.cadence.since(before) };
        self.judge(store)?;
        let mut warnings = self.warnings(status);
        warnings.extend_from_slice(notes);
        store.finish_board(self.id, &self.about, &warnings)?;
        Ok(RecordedTrial { id: self.id, about: self.about.clone(), warnings })
    }

    /// A silence up to the end is a gap as well.
    fn close(&mut self, status: &LinkStatus) {
        self.interruptions.extend(status.state.cut_short().map(str::to_owned));
        let live = status.baud.is_some();
        let Some((from_s, cause)) = self.last.take().filter(|(t_s, _)| live && status.now_s - t_s > SILENCE_S) else {
            return;
        };
        let cause = cause.unwrap_or_else(|| "the board fell silent".to_owned());
        self.add_gap(Gap { from_s, to_s: status.now_s, lost: None, cause });
    }

    fn add_gap(&mut self, gap: Gap) {
        self.gaps += 1;
        self.chunk.gaps.push(gap);
    }

    /// Phases, flags and sparkline of the stored trial. Without calibrations the flags are derived from raw counts.
    fn judge(&mut self, store: &Store) -> Result<(), StoreError> {
        let Some(trial) = store.board_log(self.id)? else { return Ok(()) };
        let serving = store.calibrations().serving(Some(self.id), &[]).unwrap_or_else(|error| {
            tracing::warn!("trial {} is flagged without calibrations: {error}", self.id);
            Serving::default()
        });
        if self.control == Control::ByHand {
            let measured = measured_phases(&self.about.course.board, &trial.readings);
            // Phases that were asked for stay where nothing measures them.
            if !measured.is_empty() || shows_grasps(&self.about.course.board, &trial.readings) {
                self.about.course.phases = measured;
            }
        }
        let readings = decimated(&trial.readings);
        self.about.flags = flags_of(&Observed {
            board: &self.about.course.board,
            readings: &readings,
            gaps: &trial.gaps,
            interruptions: &self.interruptions,
            cadence: &self.about.course.cadence,
            phases: &self.about.course.phases,
            control: self.control,
            calibrations: &serving.calibrations,
        });
        self.about.sparkline = sparkline(&self.about.course.board, &readings);
        Ok(())
    }

    fn warnings(&self, status: &LinkStatus) -> Vec<String> {
        let cadence = &self.about.course.cadence;
        let mut warnings: Vec<String> =
            self.interruptions.iter().map(|cause| format!("interrupted: {cause}")).collect();
        if cadence.samples == 0 {
            warnings.push(format!("nothing was recorded: {}", status.state.sentence()));
        }
        let Cadence { lost, gaps, restarts, .. } = *cadence;
        // Whether the restart that ended a grasp is counted depends on when the fingers were vented.
        let ended_by_one = self.interruptions.contains(&PressureFault::Restarted.to_string());
        if restarts > 0 && !ended_by_one {
            warnings.push(format!(
                "the board restarted {restarts} time(s), and what it took meanwhile is missing: check its supply and its cable"
            ));
        }
        if lost > 0 {
            warnings.push(format!("{lost} reading(s) are missing for certain, in {gaps} gap(s)"));
        } else if gaps > restarts {
            warnings.push(format!("readings are missing in {} gap(s), how many is not known", gaps - restarts));
        }
        warnings.extend(status.wiring_remarks());
        let board = &self.about.course.board;
        if cadence.samples > 0 && board.sensors.iter().any(|sensor| board.channel_of(sensor).is_none()) {
            let (wanted, names) = (board.sensors.names(), board.channels.join(", "));
            warnings.push(format!("the board has not all of {wanted}, but {names}"));
        }
        warnings
    }
}
