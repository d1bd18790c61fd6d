//! Sensors of the session: calibrations of the parts, running calibrations, zeros and the crosstalk test.

use super::{Connection, GripperSession};
use crate::gripper::Gripper;
use crate::labelling::SensorWatch;
use crate::recording::REST_S;
use crate::workers::Notice;
use crate::workers::gripper::calibrating::{CalibrationCommand, CalibrationPlan, CalibrationSession, CalibrationSetup};
use crate::workers::gripper::guided::{CrosstalkCommand, Guided};
use crate::workers::gripper::plotted::Plotted;
use crate::workers::job::JobError;
use palpate_device::doctor::{CrosstalkTest, DoctorError};
use palpate_geometry::units::true_minus;
use palpate_tactile::board::{Reading, SensorList};
use palpate_tactile::calibration::{Drift, DriftLevel, Readout, Zero};
use std::path::Path;

/// Readings older than this are stale (s).
const STALE_S: f64 = 2.0;

impl GripperSession {
    /// Reads which sensors the gripper has. What is wrong with the store, the calibrations tell.
    pub(super) fn read_sensors(&mut self) {
        if let Ok(sensors) = self.store.open().and_then(|store| store.calibrations().sensors()) {
            (self.sensors, self.channels) = (sensors, sensors.channels().into());
        }
    }

    /// Sets which sensors the gripper has; a board that is connected is connected anew.
    pub(super) fn set_sensors(&mut self, sensors: SensorList) {
        if let Some(occupied) = self.occupied() {
            return self.publisher.notify(Notice::Warning(occupied.to_owned()));
        }
        if let Err(cause) = self.store.open().and_then(|store| store.calibrations().set_sensors(sensors)) {
            return self.publisher.notify(Notice::Failed(format!("sensors not set: {cause}")));
        }
        self.publisher.notify(Notice::Info(format!("Sensors of the gripper: {}.", sensors.names())));
        let port = self.connection.as_ref().map(|connection| connection.gripper.stream().status().port.path);
        self.read_sensors();
        if let Some(port) = port {
            self.disconnect("the sensors were set anew");
            self.connect(Some(&port));
        }
    }

    /// Reads the board through the newest calibrations of its parts.
    pub(super) fn read_calibrations(&mut self) {
        let Some(connection) = &self.connection else { return };
        let board = connection.board.clone();
        let read = self.store.open().and_then(|store| {
            let tare = store.calibrations().tare()?;
            Ok((store.calibrations().serving(None, &[])?, tare.map(|tare| tare.zero)))
        });
        let (readout, remarks, zero) = match read {
            Ok((serving, zero)) => match Readout::new(&board, &serving.calibrations) {
                Ok(readout) => {
                    let remarks = serving.warnings.into_iter().chain(readout.warnings().iter().cloned()).collect();
                    (readout, remarks, zero)
                }
                Err(fault) => (Readout::default(), vec![fault.to_string()], zero),
            },
            Err(cause) => (Readout::default(), vec![cause.to_string()], None),
        };
        if let Some(connection) = &mut self.connection {
            connection.plotted = Plotted::new(self.channels.to_vec(), board.channels.len());
            connection.segmenter.set_board(&board);
            connection.felt.watch = SensorWatch::new(&board);
            connection.readout = readout;
            connection.remarks = remarks;
            connection.drift.clear();
            (connection.rested, connection.misfit) = (None, None);
            if let Some(zero) = zero {
                connection.set_zero(zero);
            }
        }
    }

    /// Reads the board through new calibrations; what was read before, the last trial among it, is no longer comparable.
    pub(super) fn calibrated_anew(&mut self) {
        self.read_calibrations();
        self.begin_stretch(0.0);
        self.calibrated = self.stretch.0;
        self.ended = None;
    }

    // Zeros.

    /// Takes the zeros of a trial from the readings just before its closing.
    pub(super) fn zero_from_rest(&mut self, closing_s: f64) {
        let Some(connection) = &mut self.connection else { return };
        let zero = connection.readout.zero_from(&connection.recent.between(closing_s - REST_S, closing_s));
        connection.set_zero(zero);
    }

    /// Once after each connection, with open fingers: says where the calibrations are those of another hand.
    pub(super) fn judge_rest(&mut self) {
        let Some(connection) = &mut self.connection else { return };
        let reconnects = connection.gripper.stream().status().reconnects;
        if connection.rested == Some(reconnects) || self.recording.is_some() {
            return;
        }
        let readings = connection.recent.last(2.0 * REST_S);
        // Without a line pressure the fingers may be closed.
        let open = readings.iter().all(|reading| reading.line_bar.is_some());
        if !open || connection.readout.tare(&readings).is_err() {
            return;
        }
        let drift = connection.readout.drift(&connection.readout.zero_from(&readings));
        let far = drift.iter().filter(|drift| drift.level == DriftLevel::TooFar);
        let far: Vec<String> =
            far.map(|drift| format!("{} {}", drift.sensor.label(), true_minus(&drift.with_unit()))).collect();
        connection.rested = Some(reconnects);
        connection.misfit = (!far.is_empty()).then(|| {
            format!("not the hand that was calibrated? At rest it reads {}: adapt, or calibrate again", far.join(", "))
        });
        if let Some(misfit) = connection.misfit.clone() {
            self.publisher.notify(Notice::Warning(misfit));
        }
    }

    /// Tares: takes the zeros from the present readings of the open, untouched hand.
    pub(super) fn tare(&mut self) {
        if self.recording.is_some() {
            let text = "not tared: a trial is running; its zeros are taken before it closes";
            return self.publisher.notify(Notice::Warning(text.to_owned()));
        }
        // The zero is stored for the present calibrations, so they are read first.
        self.read_calibrations();
        let Some(connection) = &mut self.connection else { return };
        let mut readings = connection.recent.last(2.0 * REST_S);
        // Readings from before the board fell silent are stale; captured bytes have a clock of their own.
        let since_s = if connection.gripper.stream().status().baud.is_some() {
            connection.gripper.now_s() - STALE_S
        } else {
            0.0
        };
        readings.retain(|reading| reading.t_s > since_s);
        let zero = match connection.readout.tare(&readings) {
            Ok(zero) if !zero.is_none() => zero,
            Ok(_) => {
                let text = "not tared: no calibrated sensor has been read yet";
                return self.publisher.notify(Notice::Warning(text.to_owned()));
            }
            Err(unrest) => return self.publisher.notify(Notice::Warning(format!("not tared: {unrest}"))),
        };
        connection.set_zero(zero.clone());
        let far: Vec<String> = connection
            .drift
            .iter()
            .filter(|drift| drift.level == DriftLevel::TooFar)
            .filter_map(Drift::remark)
            .collect();
        for text in far {
            self.publisher.notify(Notice::Warning(text));
        }
        let stored = self.store.open().and_then(|store| store.calibrations().add_tare(&zero));
        match stored {
            Ok(_) => {
                self.publisher.notify(Notice::Info("Tared.".to_owned()));
            }
            Err(cause) => {
                self.publisher
                    .notify(Notice::Failed(format!("Tare not saved: it applies until you disconnect: {cause}")));
            }
        }
    }

    // Calibration.

    pub(super) fn calibrate(&mut self, command: &CalibrationCommand) {
        match command {
            CalibrationCommand::Begin(plan) => return self.begin_calibration(plan),
            CalibrationCommand::Stop => return self.end_calibration(None),
            _ => {}
        }
        let Some(calibrating) = &mut self.calibration.running else { return };
        match command {
            CalibrationCommand::Keep => {
                let kept = match self.store.open() {
                    Ok(store) => calibrating.keep(store),
                    Err(cause) => Some(Err(cause.into())),
                };
                if let Some(kept) = kept {
                    self.end_calibration(Some(kept));
                    self.calibrated_anew();
                }
            }
            CalibrationCommand::EmptyClose => {
                match self.store.open().and_then(|store| store.calibrations().serving(None, &[])) {
                    Ok(serving) => {
                        calibrating.set_serving(serving.calibrations);
                        calibrating.handle(command);
                    }
                    Err(cause) => self.publisher.notify(Notice::Warning(cause.to_string())),
                }
            }
            _ => calibrating.handle(command),
        }
    }

    fn begin_calibration(&mut self, plan: &CalibrationPlan) {
        match self.borrow_port(plan.port.as_deref()) {
            Err(cause) => self.calibration.ended = Some(Err(cause.into())),
            Ok(()) => {
                self.calibration.running = Some(CalibrationSession::new(plan.clone(), CalibrationSetup::default()));
            }
        }
    }

    /// Job that uses the fingers now, in a sentence.
    pub(super) fn occupied(&self) -> Option<&'static str> {
        match (&self.recording, &self.calibration.running, &self.crosstalk.running) {
            (Some(_), _, _) => Some("a trial is running: end it first"),
            (None, Some(_), _) => Some("a calibration is running: end it first, in the panel Calibration"),
            (None, None, Some(_)) => Some("a crosstalk test is running: end it first, in the panel Doctor"),
            (None, None, None) => None,
        }
    }

    /// Takes the fingers for a calibration or test; opens a port where none is open.
    fn borrow_port(&mut self, port: Option<&Path>) -> Result<(), JobError> {
        if let Some(occupied) = self.occupied() {
            return Err(occupied.into());
        }
        if self.connection.is_some() {
            return Ok(());
        }
        self.refused = None;
        if let Err(refused) = self.open_stream(port) {
            self.publisher.notify(Notice::Failed(refused.text.clone()));
            self.refused = Some(refused.clone());
            return Err(refused.into());
        }
        // A port that the user connected stays open.
        let borrowed = self.retried.take().is_none();
        self.connection.iter_mut().for_each(|connection| connection.borrowed = borrowed);
        Ok(())
    }

    /// Closes a port that was opened only for a calibration or test that has ended.
    fn return_port(&mut self, why: &str) {
        let unused = self.occupied().is_none();
        if unused && self.connection.as_ref().is_some_and(|connection| connection.borrowed) {
            self.disconnect(why);
        }
    }

    pub(super) fn end_calibration(&mut self, ended: Option<Result<String, JobError>>) {
        self.calibration = Guided { running: None, ended: ended.map(|ended| ended.map_err(Into::into)) };
        self.return_port("the calibration has ended");
    }

    // The doctor's crosstalk test.

    pub(super) fn look_for_crosstalk(&mut self, command: CrosstalkCommand) {
        match command {
            CrosstalkCommand::Begin(port) => match self.borrow_port(port.as_deref()) {
                Err(cause) => self.crosstalk.ended = Some(Err(cause.into())),
                Ok(()) => self.crosstalk.running = Some(CrosstalkTest::default()),
            },
            CrosstalkCommand::Skip => {
                self.crosstalk.running.iter_mut().for_each(CrosstalkTest::skip);
                self.end_complete_crosstalk();
            }
            CrosstalkCommand::Stop => self.end_crosstalk(Ok(())),
        }
    }

    /// Passes a reading to the running test; ends the test when it is complete.
    pub(super) fn cross(&mut self, reading: &Reading) {
        let (Some(test), Some(connection)) = (&mut self.crosstalk.running, &self.connection) else { return };
        match test.feed(reading, &connection.board) {
            Ok(()) => self.end_complete_crosstalk(),
            failed => self.end_crosstalk(failed),
        }
    }

    fn end_complete_crosstalk(&mut self) {
        if self.crosstalk.running.as_ref().is_some_and(CrosstalkTest::is_over) {
            self.end_crosstalk(Ok(()));
        }
    }

    pub(super) fn end_crosstalk(&mut self, outcome: Result<(), DoctorError>) {
        let Some(test) = self.crosstalk.running.take() else { return };
        self.crosstalk.ended = Some(match outcome {
            Err(cause) => Err(JobError::from(cause).into()),
            Ok(()) if test.is_begun() => Ok(test),
            Ok(()) => Err(JobError::from("no readings from the board").into()),
        });
        self.return_port("the crosstalk test has ended");
    }
}

impl Connection {
    /// Sets the zero and its drift since calibration.
    fn set_zero(&mut self, zero: Zero) {
        self.drift = self.readout.drift(&zero);
        self.readout = self.readout.clone().with_zero(zero);
    }
}
