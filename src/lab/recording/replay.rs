//! Replay of a stored trial or of captured bytes: the rows and the recognition of the live gripper, event by event.

use super::recent::RecentEvents;
use crate::grasping::{FeltRows, GraspController, GraspPlan, Identification, IdentifyError, Row};
use crate::gripper::{Gripper, GripperError, GripperEvent, ReplayedGripper, SerialGripper};
use crate::labelling::{SegmentEvent, Segmenter, SensorWatch};
use palpate_device::protocol::BoardEvent;
use palpate_learn::{Model, StopRule};
use palpate_sim::gripper::Phase;
use palpate_sim::scene::Scene;
use palpate_store::{Serving, Store, StoreError};
use palpate_tactile::board::{Board, Reading, SensorList};
use palpate_tactile::calibration::Readout;
use palpate_tactile::trial::{Control, PhaseMark, Trial, TrialData, TrialId};
use palpate_tactile::{Channel, LayoutError, SensorLayout, Sensors};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Readings before the closing from which the zeros are taken (s).
pub(crate) const REST_S: f64 = 0.6;
/// Longest wait for captured bytes.
const PATIENCE: Duration = Duration::from_millis(20);

/// Reason why a stored trial cannot be opened or replayed.
#[derive(Debug, thiserror::Error)]
pub enum OpenTrialError {
    /// The store.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The gripper of the trial does not fit the layout of its rows.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The replay of a trial stopped.
    #[error("trial {id} cannot be replayed: {cause}")]
    Replay {
        /// The trial.
        id: TrialId,
        /// Cause.
        cause: GripperError,
    },
}

/// A replay in progress.
pub struct Replay {
    gripper: Box<dyn Gripper>,
    controller: GraspController,
    reader: RowReader,
    channels: Vec<String>,
    /// None without a model.
    identification: Option<Identification>,
    off: Option<IdentifyError>,
}

/// Makes rows of events.
enum RowReader {
    Frames(Box<Sensors>),
    Signals,
    Board(Box<BoardReader>),
}

/// Makes rows of readings, with zeros from the rest before each closing.
struct BoardReader {
    serving: Serving,
    readout: Readout,
    /// Channels that the sensors of the board give.
    channels: Vec<Channel>,
    recent: RecentEvents,
    /// Commanded line pressure (bar).
    line_bar: Option<f64>,
    /// Phases of the trial that are still to come.
    marks: VecDeque<PhaseMark>,
    /// Detects the phases where the trial has none.
    segmenter: Option<Segmenter>,
    felt: FeltRows,
    /// A sensor failed in the newest reading.
    failed: bool,
}

impl Replay {
    /// Replays a stored trial of any source; without a model nothing is recognised.
    pub fn of_trial(store: &Store, id: TrialId, model: Option<Arc<Model>>) -> Result<Self, OpenTrialError> {
        Self::of_loaded(store, id, store.load(id)?, model)
    }

    /// Replays a trial that was loaded from this store under this number.
    pub fn of_loaded(
        store: &Store,
        id: TrialId,
        mut trial: Trial,
        model: Option<Arc<Model>>,
    ) -> Result<Self, OpenTrialError> {
        let plan = GraspPlan::simulated(&trial.header.scene);
        Ok(match &mut trial.data {
            TrialData::Recorded(log) => {
                let (serving, marks) =
                    (store.calibrations().serving(Some(id), &[])?, std::mem::take(&mut log.course.phases));
                Self::of_board(Box::new(ReplayedGripper::new(trial)), serving, marks.into(), model)
            }
            TrialData::Imported(signals) => {
                let names = signals.channels.clone();
                Self::of_rows(ReplayedGripper::new(trial), plan, RowReader::Signals, names, identification(model))
            }
            TrialData::Simulated(data) => {
                let palm = data.world_from_gripper.position;
                let (gripper, identification) = (&trial.header.scene.gripper, identification(model));
                let more = identification.as_ref().and_then(|own| own.channels_on(gripper).ok()).unwrap_or_default();
                // All channels use the model's definition of the signals, so that a name means one channel.
                let signals = more.first().map(|channel| channel.signals).unwrap_or_default();
                let mut reader = Sensors::new(&SensorLayout::named("C1+F")?, gripper, signals)?.with_palm(palm);
                reader.add(&more);
                let names = reader.channels().iter().map(Channel::name).collect();
                Self::of_rows(
                    ReplayedGripper::new(trial),
                    plan,
                    RowReader::Frames(Box::new(reader)),
                    names,
                    identification,
                )
            }
        })
    }

    /// Replays captured bytes, read by the calibrations of the mounted parts.
    pub fn of_capture(
        gripper: SerialGripper,
        store: Option<&Store>,
        model: Option<Arc<Model>>,
    ) -> Result<Self, OpenTrialError> {
        let serving = store.map(|store| store.calibrations().serving(None, &[])).transpose()?.unwrap_or_default();
        Ok(Self::of_board(Box::new(gripper), serving, VecDeque::new(), model))
    }

    fn of_board(
        gripper: Box<dyn Gripper>,
        serving: Serving,
        marks: VecDeque<PhaseMark>,
        model: Option<Arc<Model>>,
    ) -> Self {
        let segmenter = marks.is_empty().then(|| Segmenter::new(&Board::default()));
        let (readout, recent) = (Readout::default(), RecentEvents::default());
        let channels = SensorList::default().channels();
        let names = channels.iter().map(Channel::name).collect();
        let felt = FeltRows::default();
        let reader =
            BoardReader { serving, readout, channels, recent, line_bar: None, marks, segmenter, felt, failed: false };
        Self {
            controller: untimed(gripper.now_s()),
            gripper,
            reader: RowReader::Board(Box::new(reader)),
            channels: names,
            identification: identification(model),
            off: None,
        }
    }

    /// Samples with their channels: one grasp from the first to the last.
    fn of_rows(
        gripper: ReplayedGripper,
        plan: GraspPlan,
        reader: RowReader,
        channels: Vec<String>,
        mut identification: Option<Identification>,
    ) -> Self {
        let begun = identification.as_mut().map(|own| own.begin_grasp(channels.iter().cloned().enumerate()));
        let off = begun.and_then(Result::err);
        let controller = GraspController::new(plan, gripper.now_s());
        Self { gripper: Box::new(gripper), controller, reader, channels, identification, off }
    }

    /// The channels of its rows.
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// The recogniser's answers so far; none without a model.
    pub fn identification(&self) -> Option<&Identification> {
        self.identification.as_ref()
    }

    /// Why captured bytes could not be read to their end.
    pub fn cut_short(&self) -> Option<String> {
        self.gripper.cut_short()
    }

    /// True for readings of a real gripper.
    pub fn is_of_board(&self) -> bool {
        matches!(self.reader, RowReader::Board(_))
    }

    /// Reason why nothing is recognised.
    pub fn why_off(&self) -> Option<&IdentifyError> {
        self.off.as_ref()
    }

    /// The next row; none after the last.
    pub fn next_row(&mut self) -> Result<Option<Row>, GripperError> {
        loop {
            let row = match (self.gripper.next_event(PATIENCE)?, &self.reader) {
                (GripperEvent::Sampled(frame), RowReader::Frames(sensors)) => Row::of_frame(&frame, sensors),
                (GripperEvent::Signals { t_s, values }, _) => {
                    Row { t_s, line_bar: f64::NAN, phase: None, values: values.into() }
                }
                (GripperEvent::Board(event), _) => match self.take_event(&event) {
                    Some(row) => row,
                    None => continue,
                },
                (GripperEvent::Tick | GripperEvent::Sampled(_), _) => continue,
                (GripperEvent::Finished, _) => {
                    self.end_grasp();
                    return Ok(None);
                }
            };
            self.recognise(row.clone());
            self.recognise_anew();
            return Ok(Some(row));
        }
    }

    fn recognise(&mut self, row: Row) {
        if let Some(closing_s) = self.controller.closing_s().filter(|closing_s| row.t_s >= *closing_s)
            && let Some(identification) = &mut self.identification
        {
            let t = row.t_s - closing_s;
            let row = match &mut self.reader {
                RowReader::Board(reader) => reader.felt.push(t, row, &reader.channels),
                RowReader::Frames(_) | RowReader::Signals => row,
            };
            identification.push(t, &row);
        }
    }

    /// Recognises the running grasp anew where a sensor has failed.
    fn recognise_anew(&mut self) {
        let (RowReader::Board(reader), Some(identification)) = (&mut self.reader, &mut self.identification) else {
            return;
        };
        if std::mem::take(&mut reader.failed) && identification.view().listening {
            self.off = identification.begin_grasp(reader.columns(&self.channels)).err();
            reader.felt.anew(&reader.channels).iter().for_each(|(t, row)| _ = identification.push(*t, row));
        }
    }

    fn end_grasp(&mut self) {
        if let Some(identification) = &mut self.identification {
            identification.end_grasp();
        }
    }

    fn take_event(&mut self, event: &BoardEvent) -> Option<Row> {
        let RowReader::Board(reader) = &mut self.reader else { return None };
        reader.recent.push(event);
        match event {
            BoardEvent::Board(board) => {
                reader.set_board(board);
                self.channels = board.sensors.channels().iter().map(Channel::name).collect();
                // A raw sensor without a unit is called like its counts.
                let counts = |name: &String| match self.channels.contains(name) {
                    true => format!("{name} [counts]"),
                    false => name.clone(),
                };
                let counts: Vec<String> = board.channels.iter().map(counts).collect();
                self.channels.extend(counts);
                None
            }
            BoardEvent::Reading(reading) => {
                let (began, marks) = reader.phases_until(reading);
                if began {
                    self.controller = untimed(reading.t_s);
                }
                for mark in marks {
                    match self.controller.observe_phase(&mark) {
                        Some(Phase::Close) => self.begin_grasp(mark.from_s, reading.t_s),
                        Some(Phase::Release) => self.end_grasp(),
                        Some(Phase::Hold) | None => {}
                    }
                }
                let RowReader::Board(reader) = &mut self.reader else { return None };
                let (estimate, line_bar) = (reader.readout.estimate(reading), reading.line_bar.or(reader.line_bar));
                reader.failed = reader.felt.watch.add(reading, &estimate, line_bar);
                Some(reader.row(reading))
            }
            BoardEvent::Gap(_) | BoardEvent::Reply(_) | BoardEvent::Captured(_) => None,
        }
    }

    /// Begins to recognise a grasp, with the readings from its closing to the present one.
    fn begin_grasp(&mut self, closing_s: f64, now_s: f64) {
        let RowReader::Board(reader) = &mut self.reader else { return };
        let rest = reader.recent.between(closing_s - REST_S, closing_s);
        reader.readout = reader.readout.clone().with_zero(reader.readout.zero_from(&rest));
        reader.felt.begin();
        if let Some(identification) = &mut self.identification {
            identification.start_over();
            self.off = identification.begin_grasp(reader.columns(&self.channels)).err();
        }
        let rows: Vec<Row> =
            reader.recent.between(closing_s, now_s).iter().map(|reading| reader.row(reading)).collect();
        rows.into_iter().for_each(|row| self.recognise(row));
    }
}

impl BoardReader {
    fn set_board(&mut self, board: &Board) {
        // Calibrations that do not fit this board give no values; its counts still do.
        self.readout = Readout::new(board, &self.serving.calibrations).unwrap_or_default();
        self.channels = board.sensors.channels();
        self.felt.watch = SensorWatch::new(board);
        if let Some(segmenter) = &mut self.segmenter {
            segmenter.set_board(board);
        }
    }

    /// Those of these channels that are calibrated, with their columns.
    fn columns(&self, channels: &[String]) -> Vec<(usize, String)> {
        let calibrated: Vec<String> = self.readout.channels().iter().map(Channel::name).collect();
        channels.iter().cloned().enumerate().filter(|(_, name)| calibrated.contains(name)).collect()
    }

    /// Whether a trial began, and the phases that began, up to this reading.
    fn phases_until(&mut self, reading: &Reading) -> (bool, Vec<PhaseMark>) {
        let due = self.marks.iter().take_while(|mark| mark.from_s <= reading.t_s).count();
        let mut marks: Vec<PhaseMark> = self.marks.drain(..due).collect();
        self.line_bar = marks.last().map_or(self.line_bar, |mark| mark.line_bar);
        let events = self.segmenter.as_mut().map(|segmenter| segmenter.push(reading)).unwrap_or_default();
        let began = events.iter().any(|event| matches!(event, SegmentEvent::Began { .. }));
        marks.extend(events.into_iter().filter_map(|event| match event {
            SegmentEvent::Phase(mark) => Some(mark),
            SegmentEvent::Began { .. } | SegmentEvent::Ended { .. } => None,
        }));
        (began, marks)
    }

    fn row(&self, reading: &Reading) -> Row {
        Row::of_reading(reading, self.line_bar, &self.readout.estimate(reading), &self.channels, reading.counts.len())
    }
}

fn untimed(now_s: f64) -> GraspController {
    GraspController::new(GraspPlan::recorded(&Scene::default(), Control::Free), now_s)
}

fn identification(model: Option<Arc<Model>>) -> Option<Identification> {
    Some(Identification::new(model?, StopRule::default()))
}
