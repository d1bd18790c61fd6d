//! Calibration on the shared link: readings and applied values in, a curve out.

use super::sensor_job_error::SensorJobError;
use palpate_store::Store;
use palpate_tactile::board::{Board, KNOWN_AFTER, Reading, Sensor};
use palpate_tactile::calibration::{Calibration, CalibrationFault, EmptyClose, Point, Procedure, Unsettled};
use std::path::PathBuf;
use std::sync::Arc;

/// Command to the calibration.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationCommand {
    /// Begin with a part in its place.
    Begin(CalibrationPlan),
    /// Take the settled reading as that of an angle (rad) or force (N).
    Take(f64),
    /// Skip the next value.
    Skip,
    /// Remove the last point.
    Undo,
    /// Watch the empty hand close, to learn how the zero of a pad moves with bending; calibrations of the other parts are
    /// read for it.
    EmptyClose,
    /// Store the calibration.
    Keep,
    /// Stop without storing.
    Stop,
}

/// Part to calibrate, and its port.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationPlan {
    /// Sensor position of the part.
    pub sensor: Sensor,
    /// Name of the part.
    pub part: String,
    /// The port, or a file of captured bytes, where none is open yet; the only likely port where nothing is named.
    pub port: Option<PathBuf>,
}

/// State of the calibration.
#[derive(Clone, Debug, Default)]
pub struct CalibrationView {
    /// Running calibration.
    pub running: Option<RunningCalibration>,
    /// Result of the last one, in a sentence.
    pub ended: Option<Result<String, SensorJobError>>,
}

/// Running calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct RunningCalibration {
    /// The plan.
    pub plan: CalibrationPlan,
    /// State of the link, in a sentence.
    pub link: String,
    /// What to do next.
    pub instruction: String,
    /// The angle (rad) or force (N) to set next; none when all are done.
    pub next: Option<f64>,
    /// The newest reading (counts).
    pub latest: Option<f64>,
    /// The settled reading (counts); `None` before the first reading and during an empty close.
    pub settled: Option<Result<f64, Unsettled>>,
    /// Reason why the last point was not taken.
    pub not_taken: Option<String>,
    /// The points so far.
    pub points: Vec<Point>,
    /// An empty close is being watched; until it is over, only stopping is possible.
    pub closing: bool,
    /// An empty close can be watched: a pad is calibrated, and none is being watched.
    pub can_close: bool,
    /// Fit of the points; `None` before the first reading.
    pub fit: Option<Result<Arc<Calibration>, CalibrationFault>>,
}

/// Running calibration in the gripper thread.
pub(super) struct Calibrating {
    plan: CalibrationPlan,
    /// Set once the board is known.
    procedure: Option<Procedure>,
    readings: u32,
    /// The newest description of the board.
    board: Option<Board>,
    closing: Option<EmptyClose>,
    not_taken: Option<String>,
}

impl Calibrating {
    pub(super) fn new(plan: CalibrationPlan) -> Self {
        Self { plan, procedure: None, readings: 0, closing: None, not_taken: None, board: None }
    }

    /// Adds a reading; fails where the board has no such channel.
    pub(super) fn feed(&mut self, reading: &Reading, board: &Board) -> Result<(), SensorJobError> {
        self.readings = self.readings.saturating_add(1);
        if self.readings < KNOWN_AFTER {
            return Ok(());
        }
        let procedure = match &mut self.procedure {
            Some(procedure) => procedure,
            empty @ None => empty.insert(begin(&self.plan, board)?),
        };
        // The description of the board may change after its first readings.
        if self.board.as_ref() != Some(board) {
            procedure.see(board);
            self.board = Some(board.clone());
        }
        if let Some(closing) = &mut self.closing {
            if closing.feed(reading) {
                match closing.bending() {
                    Ok(bending) => procedure.set_bending(bending),
                    Err(fault) => self.not_taken = Some(fault.to_string()),
                }
                self.closing = None;
            }
            return Ok(());
        }
        procedure.feed(reading);
        Ok(())
    }

    /// Begins to watch an empty close, with the present calibrations.
    pub(super) fn close_empty(&mut self, board: &Board, store: &Store) {
        let Some(procedure) = &self.procedure else { return };
        let begin = || -> Result<EmptyClose, SensorJobError> {
            let pad = (procedure.sensor(), procedure.fit()?);
            let serving = store.calibrations().serving(None, &[]).map_err(Arc::new)?;
            Ok(EmptyClose::begin(board, pad, &serving.calibrations, EmptyClose::SECONDS)?)
        };
        match begin() {
            Ok(closing) => (self.closing, self.not_taken) = (Some(closing), None),
            Err(cause) => self.not_taken = Some(cause.to_string()),
        }
    }

    /// Takes, skips or removes a point.
    pub(super) fn handle(&mut self, command: &CalibrationCommand) {
        let Some(procedure) = &mut self.procedure else { return };
        if self.closing.is_some() && *command == CalibrationCommand::Undo {
            // The board may have fallen silent: what was measured before is kept.
            self.closing = None;
            return;
        }
        if self.closing.is_some() {
            self.not_taken = Some("not possible during an empty close".to_owned());
            return;
        }
        self.not_taken = None;
        match command {
            CalibrationCommand::Take(stimulus) => {
                self.not_taken = procedure.take(*stimulus).err().map(|why| format!("not taken: {why}"));
            }
            CalibrationCommand::Skip => procedure.skip(),
            CalibrationCommand::Undo => {
                procedure.undo();
            }
            CalibrationCommand::Begin(_)
            | CalibrationCommand::EmptyClose
            | CalibrationCommand::Keep
            | CalibrationCommand::Stop => {}
        }
    }

    /// Stores the calibration and mounts the part at its sensor; none before the first reading.
    pub(super) fn keep(&self, store: &mut Store) -> Option<Result<String, SensorJobError>> {
        let procedure = self.procedure.as_ref().filter(|_| self.closing.is_none())?;
        Some(keep(procedure, store))
    }

    pub(super) fn view(&self, link: String) -> RunningCalibration {
        let procedure = self.procedure.as_ref();
        let fit = procedure.map(|procedure| procedure.fit().map(Arc::new));
        let instruction = match (&self.closing, procedure) {
            (Some(closing), _) => closing.instruction(),
            (None, Some(procedure)) => procedure.instruction(),
            (None, None) => link.clone(),
        };
        RunningCalibration {
            plan: self.plan.clone(),
            instruction,
            link,
            next: procedure.and_then(Procedure::next),
            latest: procedure.and_then(Procedure::latest),
            settled: procedure
                .filter(|_| self.closing.is_none())
                .map(|procedure| procedure.settled().map(|point| point.counts)),
            closing: self.closing.is_some(),
            not_taken: self.not_taken.clone(),
            points: procedure.map(|procedure| procedure.record().points.clone()).unwrap_or_default(),
            can_close: !self.plan.sensor.is_flex() && self.closing.is_none() && matches!(fit, Some(Ok(_))),
            fit,
        }
    }
}

fn begin(plan: &CalibrationPlan, board: &Board) -> Result<Procedure, SensorJobError> {
    let missing = || SensorJobError::NoChannel { wanted: plan.sensor.channel(), has: board.channels.join(", ") };
    Procedure::new(board, plan.sensor, &plan.part, None).ok_or_else(missing)
}

fn keep(procedure: &Procedure, store: &mut Store) -> Result<String, SensorJobError> {
    let calibration = procedure.fit()?;
    let stored = store.calibrations().add(&calibration.record).map_err(Arc::new)?;
    let (id, version, part) = (stored.id, stored.version, &stored.record.part);
    store.calibrations().mount(procedure.sensor(), part).map_err(Arc::new)?;
    Ok(format!("calibration {id} stored: version {version} of \"{part}\", the {}", procedure.sensor().label()))
}
