//! Calibration on the shared link: readings and applied values in, a curve out.

use palpate_store::Store;
use palpate_tactile::board::{Board, KNOWN_AFTER, Reading, Sensor};
use palpate_tactile::calibration::{Calibration, EmptyClose, Point, Procedure};
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
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationView {
    /// Running calibration.
    pub running: Option<RunningCalibration>,
    /// Result of the last one, in a sentence.
    pub ended: Option<Result<String, String>>,
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
    /// The settled reading (counts), or the reason why there is none yet.
    pub settled: Result<f64, String>,
    /// Reason why the last point was not taken.
    pub not_taken: Option<String>,
    /// The points so far.
    pub points: Vec<Point>,
    /// An empty close is being watched; until it is over, only stopping is possible.
    pub closing: bool,
    /// An empty close can be watched: a pad is calibrated, and none is being watched.
    pub can_close: bool,
    /// Fit of the points, or the reason why there is none yet.
    pub fit: Result<Arc<Calibration>, String>,
}

/// Reason why other commands are refused meanwhile.
const WATCHED: &str = "the empty close is being watched";

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
    pub(super) fn feed(&mut self, reading: &Reading, board: &Board) -> Result<(), String> {
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
        let begun = procedure.fit().map_err(|fault| fault.to_string()).and_then(|pad| {
            let serving = store.calibrations().serving(None, &[]).map_err(|error| error.to_string())?;
            let pad = (procedure.sensor(), pad);
            EmptyClose::begin(board, pad, &serving.calibrations, EmptyClose::SECONDS).map_err(|fault| fault.to_string())
        });
        match begun {
            Ok(closing) => (self.closing, self.not_taken) = (Some(closing), None),
            Err(cause) => self.not_taken = Some(cause),
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
            self.not_taken = Some(WATCHED.to_owned());
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
    pub(super) fn keep(&self, store: &mut Store) -> Option<Result<String, String>> {
        let procedure = self.procedure.as_ref().filter(|_| self.closing.is_none())?;
        let stored = procedure.fit().map_err(|fault| fault.to_string()).and_then(|calibration| {
            let stored = store.calibrations().add(&calibration.record).map_err(|error| error.to_string())?;
            store.calibrations().mount(procedure.sensor(), &stored.record.part).map_err(|error| error.to_string())?;
            Ok(stored)
        });
        Some(stored.map(|stored| {
            let (id, version, part) = (stored.id, stored.version, &stored.record.part);
            format!("calibration {id} stored: version {version} of \"{part}\", the {}", procedure.sensor().label())
        }))
    }

    pub(super) fn view(&self, link: String) -> RunningCalibration {
        let procedure = self.procedure.as_ref();
        let waiting = || Err("no readings yet".to_owned());
        let fit = procedure.map_or_else(
            || Err("no points yet".to_owned()),
            |procedure| procedure.fit().map(Arc::new).map_err(|fault| fault.to_string()),
        );
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
            settled: match procedure {
                _ if self.closing.is_some() => Err(WATCHED.to_owned()),
                Some(procedure) => procedure.settled().map(|p| p.counts).map_err(|why| why.to_string()),
                None => waiting(),
            },
            closing: self.closing.is_some(),
            not_taken: self.not_taken.clone(),
            points: procedure.map(|procedure| procedure.record().points.clone()).unwrap_or_default(),
            can_close: !self.plan.sensor.is_flex() && self.closing.is_none() && fit.is_ok(),
            fit,
        }
    }
}

fn begin(plan: &CalibrationPlan, board: &Board) -> Result<Procedure, String> {
    Procedure::new(board, plan.sensor, &plan.part, None).ok_or_else(|| {
        let (wanted, has) = (plan.sensor.channel(), board.channels.join(", "));
        format!("the board has no channel \"{wanted}\"; it has {has}")
    })
}
