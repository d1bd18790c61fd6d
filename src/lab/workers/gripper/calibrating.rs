//! Calibration session: readings and applied values in, a curve out. The terminal feeds it from its own link, the gripper
//! thread from the shared one.

use crate::gripper::NotOpened;
use palpate_device::doctor::CrosstalkError;
use palpate_store::{Store, StoreError};
use palpate_tactile::board::{Board, KNOWN_AFTER, Reading, Sensor};
use palpate_tactile::calibration::{Calibration, CalibrationFault, EmptyClose, Procedure, Record};
use std::path::PathBuf;
use std::sync::Arc;

/// Error of a job that shares the link with the live view: a calibration or crosstalk test.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SensorJobError {
    /// The port could not be opened.
    #[error(transparent)]
    Port(#[from] NotOpened),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] Arc<StoreError>),
    /// The points do not make a calibration.
    #[error(transparent)]
    Calibration(#[from] CalibrationFault),
    /// The board has too few sensors for a crosstalk test.
    #[error(transparent)]
    Crosstalk(#[from] CrosstalkError),
    /// The fingers are in use, or the board sends too little.
    #[error("{0}")]
    Failed(String),
}

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
    /// Port or file of captured bytes to open if none is open yet; without a name, the only likely port.
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
#[derive(Clone, Debug)]
pub struct RunningCalibration {
    /// The plan.
    pub plan: CalibrationPlan,
    /// What to do next; before the first readings the state of the link.
    pub instruction: String,
    /// Points and readings so far; none before the first readings.
    pub procedure: Option<Procedure>,
    /// Fit of the points.
    pub fit: Option<Result<Arc<Calibration>, CalibrationFault>>,
    /// An empty close is being watched; until it is over, only stopping is possible.
    pub closing: bool,
    /// Reason why the last point was not taken.
    pub not_taken: Option<String>,
}

/// Setup of a calibration, and the steps that it takes without commands.
#[derive(Clone, Debug, Default)]
pub struct CalibrationSetup {
    /// Resistor beside the sensor (ohm), if it differs from the one that the board reports.
    pub resistor_ohm: Option<f64>,
    /// Angles (rad) or forces (N) to set; empty for the usual ones.
    pub stimuli: Vec<f64>,
    /// Points that were measured elsewhere.
    pub record: Option<Record>,
    /// Take each point, and begin the empty close, without a command.
    pub automatic: bool,
    /// Duration of the empty close (s) that is part of it, if any.
    pub close_s: Option<f64>,
    /// Calibrations of the other parts, for the empty close.
    pub serving: Vec<(Sensor, Calibration)>,
}

/// Calibration of a part, fed with readings. Terminal and window show it.
#[derive(Clone, Debug)]
pub struct CalibrationSession {
    plan: CalibrationPlan,
    setup: CalibrationSetup,
    /// Set once the board is known.
    procedure: Option<Procedure>,
    /// Readings before that.
    early: Vec<Reading>,
    /// The newest description of the board.
    board: Option<Board>,
    closing: Option<EmptyClose>,
    not_taken: Option<String>,
}

impl CalibrationSession {
    /// Begins; the first readings tell which channels the board has.
    pub fn new(plan: CalibrationPlan, setup: CalibrationSetup) -> Self {
        Self { plan, setup, procedure: None, early: Vec::new(), board: None, closing: None, not_taken: None }
    }

    /// Points and readings so far; none before the board is known.
    pub fn procedure(&self) -> Option<&Procedure> {
        self.procedure.as_ref()
    }

    /// The empty close that is being watched.
    pub fn closing(&self) -> Option<&EmptyClose> {
        self.closing.as_ref()
    }

    /// Reason why the last point or empty close was not taken; forgotten with this call.
    pub fn take_refusal(&mut self) -> Option<String> {
        self.not_taken.take()
    }

    /// True where all points are taken, and the empty close is still missing.
    pub fn awaits_close(&self) -> bool {
        self.setup.close_s.is_some() && self.closing.is_none() && self.has_all_points() && !self.has_bending()
    }

    /// True if the setup is complete.
    pub fn is_complete(&self) -> bool {
        self.has_all_points() && self.closing.is_none() && (self.setup.close_s.is_none() || self.has_bending())
    }

    fn has_all_points(&self) -> bool {
        self.procedure.as_ref().is_some_and(|procedure| procedure.next().is_none())
    }

    fn has_bending(&self) -> bool {
        self.procedure.as_ref().is_some_and(|procedure| procedure.record().bending.is_some())
    }

    /// Takes in a reading; fails where the board has no such channel.
    pub fn feed(&mut self, reading: &Reading, board: &Board) -> Result<(), SensorJobError> {
        if self.procedure.is_none() {
            self.early.push(reading.clone());
            if self.early.len() < KNOWN_AFTER as usize {
                return Ok(());
            }
            self.procedure = Some(self.begin(board)?);
            let early = std::mem::take(&mut self.early);
            early.iter().for_each(|reading| self.take_reading(reading, board));
            return Ok(());
        }
        self.take_reading(reading, board);
        Ok(())
    }

    fn take_reading(&mut self, reading: &Reading, board: &Board) {
        let Some(procedure) = &mut self.procedure else { return };
        // The description of the board may change after its first readings.
        if self.board.as_ref() != Some(board) {
            procedure.see(board);
            self.board = Some(board.clone());
        }
        if self.setup.automatic && self.awaits_close() {
            self.handle(&CalibrationCommand::EmptyClose);
        }
        let Some(procedure) = &mut self.procedure else { return };
        if let Some(closing) = &mut self.closing {
            if closing.feed(reading) {
                match closing.bending() {
                    Ok(bending) => procedure.set_bending(bending),
                    Err(fault) => self.not_taken = Some(fault.to_string()),
                }
                self.closing = None;
            }
            return;
        }
        procedure.feed(reading);
        let next = procedure.next().filter(|_| self.setup.automatic);
        if let Some(next) = next.filter(|_| procedure.has_changed() && procedure.settled().is_ok()) {
            self.handle(&CalibrationCommand::Take(next));
        }
    }

    /// Begins to watch an empty close, with the calibrations of the other parts.
    fn close_empty(&mut self) {
        let (Some(procedure), Some(board)) = (&self.procedure, &self.board) else { return };
        let seconds = self.setup.close_s.unwrap_or(EmptyClose::SECONDS);
        let begin = |pad| EmptyClose::begin(board, (procedure.sensor(), pad), &self.setup.serving, seconds);
        match procedure.fit().and_then(begin) {
            Ok(closing) => self.closing = Some(closing),
            Err(cause) => self.not_taken = Some(cause.to_string()),
        }
    }

    /// Sets the calibrations of the other parts, for the empty close.
    pub fn set_serving(&mut self, serving: Vec<(Sensor, Calibration)>) {
        self.setup.serving = serving;
    }

    /// Takes, skips or removes a point, or begins the empty close.
    pub fn handle(&mut self, command: &CalibrationCommand) {
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
            CalibrationCommand::EmptyClose => self.close_empty(),
            CalibrationCommand::Begin(_) | CalibrationCommand::Keep | CalibrationCommand::Stop => {}
        }
    }

    /// Stores the calibration and mounts the part at its sensor; none before the first reading.
    pub(super) fn keep(&self, store: &mut Store) -> Option<Result<String, SensorJobError>> {
        let procedure = self.procedure.as_ref().filter(|_| self.closing.is_none())?;
        Some(keep(procedure, store))
    }

    pub(super) fn view(&self, link: String) -> RunningCalibration {
        let instruction = self.procedure.as_ref().map_or(link, Procedure::instruction);
        RunningCalibration {
            plan: self.plan.clone(),
            instruction: self.closing.as_ref().map_or(instruction, EmptyClose::instruction),
            fit: self.procedure.as_ref().map(|procedure| procedure.fit().map(Arc::new)),
            procedure: self.procedure.clone(),
            closing: self.closing.is_some(),
            not_taken: self.not_taken.clone(),
        }
    }

    fn begin(&self, board: &Board) -> Result<Procedure, SensorJobError> {
        let CalibrationPlan { sensor, part, .. } = &self.plan;
        let CalibrationSetup { record, resistor_ohm, stimuli, .. } = &self.setup;
        let procedure = match record {
            Some(record) => Procedure::after(board, *sensor, record.clone()),
            None => Procedure::new(board, *sensor, part, *resistor_ohm),
        };
        let missing = || {
            SensorJobError::Failed(format!(
                "the board has no channel \"{}\"; it has {}. Name its channels in the sketch, or in a header line",
                sensor.channel(),
                board.channels.join(", ")
            ))
        };
        let procedure = procedure.ok_or_else(missing)?;
        Ok(if stimuli.is_empty() { procedure } else { procedure.with_plan(stimuli) })
    }
}

fn keep(procedure: &Procedure, store: &mut Store) -> Result<String, SensorJobError> {
    let calibration = procedure.fit()?;
    let stored = store.calibrations().add(&calibration.record).map_err(Arc::new)?;
    let (id, version, part) = (stored.id, stored.version, &stored.record.part);
    store.calibrations().mount(procedure.sensor(), part).map_err(Arc::new)?;
    Ok(format!("calibration {id} stored: version {version} of \"{part}\", the {}", procedure.sensor().label()))
}
