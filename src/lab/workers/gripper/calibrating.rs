//! Calibration session: readings and applied values in, a curve out. The terminal feeds it from its own link, the gripper
//! thread from the shared one.

use crate::workers::job::JobError;
use palpate_store::{Store, StoreError, StoredCalibration};
use palpate_tactile::board::{Board, KNOWN_AFTER, Reading, Sensor};
use palpate_tactile::calibration::{Calibration, EmptyClose, Procedure, Record};
use std::path::PathBuf;

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
    procedure: Procedure,
    /// Readings of a board without such a channel so far.
    early: u32,
    /// The newest description of the board.
    board: Option<Board>,
    closing: Option<EmptyClose>,
    not_taken: Option<String>,
}

impl CalibrationSession {
    /// Begins; the first readings tell which channels the board has.
    pub fn new(plan: CalibrationPlan, setup: CalibrationSetup) -> Self {
        let procedure = match &setup.record {
            Some(record) => Procedure::after(plan.sensor, record.clone()),
            None => Procedure::new(plan.sensor, &plan.part, setup.resistor_ohm),
        };
        let procedure = if setup.stimuli.is_empty() { procedure } else { procedure.with_plan(&setup.stimuli) };
        Self { plan, setup, procedure, early: 0, board: None, closing: None, not_taken: None }
    }

    /// What is calibrated, and where.
    pub fn plan(&self) -> &CalibrationPlan {
        &self.plan
    }

    /// True once the board is known.
    pub fn is_begun(&self) -> bool {
        self.board.is_some()
    }

    /// Points and readings so far.
    pub fn procedure(&self) -> &Procedure {
        &self.procedure
    }

    /// The empty close that is being watched.
    pub fn closing(&self) -> Option<&EmptyClose> {
        self.closing.as_ref()
    }

    /// What to do next.
    pub fn instruction(&self) -> String {
        self.closing.as_ref().map_or_else(|| self.procedure.instruction(), EmptyClose::instruction)
    }

    /// The present reading, and whether it has settled.
    pub fn state(&self) -> String {
        let counts = self.procedure.latest().map_or_else(|| "–".to_owned(), |counts| format!("{counts:.0}"));
        let state = match self.procedure.settled() {
            _ if self.closing.is_some() => "watching the empty close".to_owned(),
            _ if !self.is_begun() => "no readings yet".to_owned(),
            Ok(_) => "settled".to_owned(),
            Err(why) => why.to_string(),
        };
        format!("{counts} counts, {state}")
    }

    /// Reason why the last point or empty close was not taken.
    pub fn not_taken(&self) -> Option<&str> {
        self.not_taken.as_deref()
    }

    /// The same; forgotten with this call.
    pub fn take_refusal(&mut self) -> Option<String> {
        self.not_taken.take()
    }

    /// True where all points are taken, and the empty close is still missing.
    pub fn awaits_close(&self) -> bool {
        self.setup.close_s.is_some() && self.procedure.left() == 0 && self.closing.is_none() && !self.has_bending()
    }

    /// True if the setup is complete.
    pub fn is_complete(&self) -> bool {
        self.procedure.left() == 0 && self.closing.is_none() && (self.setup.close_s.is_none() || self.has_bending())
    }

    fn has_bending(&self) -> bool {
        self.procedure.record().bending.is_some()
    }

    /// Takes in a reading; fails, with a sentence, where the board has no such channel.
    pub fn feed(&mut self, reading: &Reading, board: &Board) -> Result<(), String> {
        // The description of the board may change after its first readings.
        if self.board.as_ref() != Some(board) {
            if !self.procedure.see(board) {
                self.early += 1;
                let (channel, channels) = (self.plan.sensor.channel(), board.channels.join(", "));
                let missing = format!(
                    "the board has no channel \"{channel}\"; it has {channels}. Name its channels in the sketch, or in a header \
                     line"
                );
                return if self.early < KNOWN_AFTER { Ok(()) } else { Err(missing) };
            }
            self.board = Some(board.clone());
        }
        if self.setup.automatic && self.awaits_close() {
            self.handle(&CalibrationCommand::EmptyClose);
        }
        if let Some(closing) = &mut self.closing {
            if closing.feed(reading) {
                match closing.bending() {
                    Ok(bending) => self.procedure.set_bending(bending),
                    Err(fault) => self.not_taken = Some(fault.to_string()),
                }
                self.closing = None;
            }
            return Ok(());
        }
        self.procedure.feed(reading);
        let next = self.procedure.next().filter(|_| self.setup.automatic);
        if let Some(next) = next.filter(|_| self.procedure.has_changed() && self.procedure.settled().is_ok()) {
            self.handle(&CalibrationCommand::Take(next));
        }
        Ok(())
    }

    /// Begins to watch an empty close, with the calibrations of the other parts.
    fn close_empty(&mut self) {
        let Some(board) = &self.board else { return };
        let seconds = self.setup.close_s.unwrap_or(EmptyClose::SECONDS);
        let begin = |pad| EmptyClose::begin(board, (self.plan.sensor, pad), &self.setup.serving, seconds);
        match self.procedure.fit().and_then(begin) {
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
        if self.closing.is_some() {
            match command {
                // The board may have fallen silent: what was measured before is kept.
                CalibrationCommand::Undo => self.closing = None,
                _ => self.not_taken = Some("not possible during an empty close".to_owned()),
            }
            return;
        }
        self.not_taken = None;
        match command {
            CalibrationCommand::Take(stimulus) => {
                self.not_taken = self.procedure.take(*stimulus).err().map(|why| format!("not taken: {why}"));
            }
            CalibrationCommand::Skip => self.procedure.skip(),
            CalibrationCommand::Undo => {
                self.procedure.undo();
            }
            CalibrationCommand::EmptyClose => self.close_empty(),
            CalibrationCommand::Begin(_) | CalibrationCommand::Keep | CalibrationCommand::Stop => {}
        }
    }

    /// Stores the calibration, and says so; none before the first reading, and during an empty close.
    pub(super) fn keep(&self, store: &mut Store) -> Option<Result<String, JobError>> {
        (self.is_begun() && self.closing.is_none()).then(|| {
            let sensor = self.plan.sensor;
            let StoredCalibration { id, version, record, .. } =
                keep_calibration(store, sensor, &self.procedure.fit()?)?;
            Ok(format!("calibration {id} stored: version {version} of \"{}\", the {}", record.part, sensor.label()))
        })
    }
}

/// Stores a calibration, and mounts its part at the sensor.
pub fn keep_calibration(
    store: &mut Store,
    sensor: Sensor,
    calibration: &Calibration,
) -> Result<StoredCalibration, StoreError> {
    let stored = store.calibrations().add(&calibration.record)?;
    if store.calibrations().part_in(sensor)?.as_ref() != Some(&stored.record.part) {
        store.calibrations().mount(sensor, &stored.record.part)?;
    }
    Ok(stored)
}
