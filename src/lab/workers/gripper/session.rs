//! Session of the gripper thread: owns the link, distributes its readings and handles commands.

mod adapting;
mod pressing;
mod recognising;
mod sensors;
mod trials;

use super::guided::{CalibrationView, CrosstalkView};
use super::messages::{EndedTrial, GripperCommand, GripperSetup, GripperView, LatestReading};
use super::observing::Observing;
use super::plotted::Plotted;
use crate::grasping::{FeltRows, GraspController, Row};
use crate::gripper::{Gripper, GripperEvent, Listen, NotOpened, SerialGripper};
use crate::labelling::Segmenter;
use crate::recording::{BoardTrialRecording, RecentEvents, Recorder, RecorderNotice, TrialRequest};
use crate::workers::job::JobError;
use crate::workers::live_recognition::LiveRecognition;
use crate::workers::own_store::OwnStore;
use crate::workers::worker::{Inbox, Publisher};
use crate::workers::{Notice, TraceRow};
use palpate_device::protocol::BoardEvent;
use palpate_device::serial::{PortInfo, list_ports};
use palpate_sim::scene::Scene;
use palpate_tactile::Channel;
use palpate_tactile::board::{Board, Reading, SensorList};
use palpate_tactile::calibration::{Drift, Readout};
use palpate_tactile::trial::TrialId;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest wait for readings before commands are handled; also the timing error of line pressure.
const PATIENCE: Duration = Duration::from_millis(10);
/// Interval between attempts on a port that another program has open.
const RETRY: Duration = Duration::from_secs(1);
/// Shortest interval between two views.
const CALM: Duration = Duration::from_millis(33);

/// Open connection to a board.
struct Connection {
    gripper: SerialGripper,
    board: Board,
    recent: RecentEvents,
    /// The board's readings by the calibrations of its parts, with the zeros taken last.
    readout: Readout,
    remarks: Vec<String>,
    drift: Vec<Drift>,
    /// Number of reconnects at which the hand was last seen at rest, and what its sensors read there that no drift explains.
    rested: Option<u32>,
    misfit: Option<String>,
    latest: Option<LatestReading>,
    plotted: Plotted,
    /// Opened for a calibration or a test, and closed after the last of them.
    borrowed: bool,
    /// Detects begin and end of grasps.
    segmenter: Segmenter,
    /// Detects sensors that fail, and keeps what they felt.
    felt: FeltRows,
    /// It was vented or driven since it was opened.
    taken_over: bool,
}

/// State of the thread.
pub(super) struct GripperSession {
    publisher: Publisher<GripperView>,
    listen: Listen,
    store: OwnStore,
    scene: Scene,
    recognition: Option<LiveRecognition>,
    model: Option<String>,
    grasps: u32,
    ports: Vec<PortInfo>,
    refused: Option<NotOpened>,
    /// Port that another program has open; opened as soon as it is free.
    retried: Option<Option<PathBuf>>,
    connection: Option<Connection>,
    /// Absent where its thread could not be started.
    recorder: Option<Recorder>,
    recorded: Receiver<RecorderNotice>,
    recording: Option<BoardTrialRecording>,
    /// Number of the trial that is recorded, once the store has given one.
    recording_id: Option<TrialId>,
    /// Requests of trials whose end the recorder has not reported yet; whether they were discarded, and are complete.
    ending: VecDeque<(TrialRequest, bool, bool)>,
    /// Keeps a line pressure outside of driven trials.
    pressing: Option<GraspController>,
    /// The trial that is recorded is a close of the empty hand, to adapt to.
    adapting: bool,
    /// Number of trials begun so far.
    begun: u64,
    watching: Option<TrialRequest>,
    ended: Option<Arc<EndedTrial>>,
    calibration: CalibrationView,
    crosstalk: CrosstalkView,
    observing: Vec<Observing>,
    /// Which stretch of rows is being sent, and the time that counts as its zero (s).
    stretch: (u64, f64),
    /// The first stretch with the present calibrations.
    calibrated: u64,
    /// Sensors of the gripper that the store remembers, and their channels.
    sensors: SensorList,
    channels: Arc<[Channel]>,
    revision: u64,
    handled: u64,
    published: Instant,
}

impl GripperSession {
    pub(super) fn new(setup: GripperSetup, publisher: Publisher<GripperView>) -> Self {
        let GripperSetup { scene, store, model, grasps, listen, wake: _ } = setup;
        let (sender, recorded) = channel();
        let recorder = Recorder::start(store.clone(), move |notice| {
            // The thread may have ended; the trial is safe.
            let _sent = sender.send(notice);
        });
        let recorder = publisher.or_notice("trials cannot be stored", recorder);
        let mut session = Self {
            publisher,
            listen,
            store: OwnStore::new(store),
            scene,
            recognition: None,
            model: None,
            grasps,
            ports: Vec::new(),
            refused: None,
            retried: None,
            connection: None,
            recorder,
            recorded,
            recording: None,
            recording_id: None,
            ending: VecDeque::new(),
            pressing: None,
            adapting: false,
            begun: 0,
            watching: None,
            ended: None,
            calibration: CalibrationView::default(),
            crosstalk: CrosstalkView::default(),
            observing: Vec::new(),
            stretch: (0, 0.0),
            calibrated: 0,
            sensors: SensorList::default(),
            channels: SensorList::default().channels().into(),
            revision: 0,
            handled: 0,
            published: Instant::now(),
        };
        session.set_model(model);
        session.read_sensors();
        session
    }

    /// Runs until the window is closed.
    pub(super) fn run(mut self, inbox: &Inbox<GripperCommand>) {
        self.publish();
        while let Ok(command) = inbox.next(self.patience()) {
            match command {
                Some(command) => {
                    // Observations are internal, not commands of the window.
                    self.handled += u64::from(!matches!(command, GripperCommand::Observe(_)));
                    self.handle(command);
                    self.publish();
                }
                None if self.connection.is_none() => {
                    self.take_recorded();
                    self.try_again();
                }
                None => self.take_events(),
            }
        }
        self.disconnect("the window was closed");
        // Dropping the recorder waits until everything is written.
        self.recorder = None;
        self.take_recorded();
    }

    /// Time to wait for a command; `None` until one comes.
    fn patience(&self) -> Option<Duration> {
        match &self.connection {
            // The wait is for events of the link.
            Some(_) => Some(Duration::ZERO),
            None if self.retried.is_some() => Some(RETRY),
            // The recorder still has to report the end of a trial.
            None => (!self.ending.is_empty()).then_some(PATIENCE),
        }
    }

    fn handle(&mut self, command: GripperCommand) {
        match command {
            GripperCommand::SetSensors(sensors) => self.set_sensors(sensors),
            GripperCommand::ListPorts => self.ports = list_ports(),
            GripperCommand::Connect(port) => {
                self.disconnect("another port was chosen");
                self.connect(port.as_deref());
            }
            GripperCommand::Disconnect => self.disconnect("the port was closed"),
            GripperCommand::Vent => self.vent(),
            GripperCommand::Tare => self.tare(),
            GripperCommand::SetScene(scene) => self.scene = *scene,
            GripperCommand::SetModel(model) => self.set_model(model),
            GripperCommand::SetThreshold(threshold) => {
                if let Some(recognition) = &mut self.recognition {
                    recognition.set_threshold(threshold);
                }
            }
            GripperCommand::AnotherObject => self.start_over(),
            GripperCommand::Press(bar) => self.press(bar),
            GripperCommand::Begin(request) => self.begin(request, None),
            GripperCommand::Adapt(control) => self.adapt(control),
            GripperCommand::Watch(request) => self.set_watching(request),
            GripperCommand::End => self.end(false, None),
            GripperCommand::Discard => self.end(true, None),
            // Without a connection the requester notices that its channel closed and opens the port directly.
            GripperCommand::Observe(request) => {
                let status = self.connection.as_ref().map(|connection| connection.gripper.stream().status());
                self.observing.extend(status.map(|status| Observing::new(request, status)));
            }
            GripperCommand::Calibrate(command) => self.calibrate(&command),
            GripperCommand::Crosstalk(command) => self.look_for_crosstalk(command),
        }
    }

    fn connect(&mut self, port: Option<&Path>) {
        self.refused = None;
        if let Err(mut refused) = self.open_stream(port) {
            if refused.may_pass {
                self.retried = Some(port.map(Path::to_owned));
                refused.text.push_str("; retrying each second");
            }
            self.publisher.notify(Notice::Failed(refused.text.clone()));
            self.refused = Some(refused);
            self.ports = list_ports();
        }
    }

    /// Tries again to open a port that another program had open; reports only a new failure.
    fn try_again(&mut self) {
        let Some(port) = self.retried.take() else { return };
        match self.open_stream(port.as_deref()) {
            Ok(()) => self.refused = None,
            Err(NotOpened { may_pass: true, .. }) => return self.retried = Some(port),
            Err(refused) => self.refused = Some(refused),
        }
        self.publish();
    }

    fn open_stream(&mut self, port: Option<&Path>) -> Result<(), NotOpened> {
        self.read_sensors();
        let mut gripper = SerialGripper::new((self.listen)(port, self.sensors)?);
        // A board with our protocol answers with a handshake; others ignore the line.
        let _sent = gripper.send("?");
        self.connection = Some(Connection {
            board: gripper.stream().status().board,
            gripper,
            recent: RecentEvents::default(),
            readout: Readout::default(),
            remarks: Vec::new(),
            drift: Vec::new(),
            rested: None,
            misfit: None,
            latest: None,
            plotted: Plotted::new(Vec::new(), 0),
            borrowed: false,
            segmenter: Segmenter::new(&Board { sensors: self.sensors, ..Board::default() }),
            felt: FeltRows::default(),
            taken_over: false,
        });
        self.read_calibrations();
        self.begin_stretch(0.0);
        self.start_over();
        Ok(())
    }

    fn disconnect(&mut self, why: &str) {
        self.end(false, Some(format!("ended early: {why}")));
        if self.calibration.running.take().is_some() {
            self.calibration.ended = Some(Err(JobError::from(format!("nothing was stored: {why}")).into()));
        }
        self.end_crosstalk(Ok(()));
        self.observing.clear();
        self.pressing = None;
        self.connection = None;
        self.retried = None;
    }

    /// Handles the events of the link, then sets the pressure that is due.
    fn take_events(&mut self) {
        // All waiting events come before the pressure.
        let mut patience = PATIENCE;
        while let Some(connection) = &mut self.connection {
            match connection.gripper.next_event(patience) {
                Ok(GripperEvent::Board(event)) => self.take_event(event),
                Ok(_) => break,
                Err(error) => {
                    let driving = self.recording.iter_mut().map(|recording| &mut recording.controller);
                    driving.chain(&mut self.pressing).for_each(|controller| controller.abort(error.to_string()));
                    break;
                }
            }
            patience = Duration::ZERO;
        }
        self.drive();
        self.keep_pressure();
        self.take_recorded();
        self.end_observations();
        let over = self.connection.as_ref().is_some_and(|connection| connection.gripper.stream().is_over());
        if over {
            let why =
                self.connection.as_ref().map(|c| c.gripper.stream().status().state.sentence()).unwrap_or_default();
            self.disconnect(&why);
            self.publisher.notify(Notice::Warning(why.clone()));
            self.refused = Some(why.into());
            self.publish();
        } else if self.published.elapsed() >= CALM || self.connection.is_none() {
            self.judge_rest();
            // Without a board there are no later readings to publish with.
            self.publish();
        }
    }

    /// Finishes observations whose time is over.
    fn end_observations(&mut self) {
        let Some(connection) = &self.connection else { return };
        for observing in self.observing.extract_if(.., |observing| observing.is_over()) {
            observing.finish(connection.gripper.stream());
        }
    }

    fn take_event(&mut self, event: BoardEvent) {
        let Some(connection) = &mut self.connection else { return };
        let begun = self.begun;
        connection.recent.push(&event);
        match &event {
            BoardEvent::Reading(reading) => {
                let reading = reading.clone();
                self.take_reading(&reading);
            }
            BoardEvent::Board(board) if connection.board != *board => {
                connection.board = board.clone();
                self.read_calibrations();
            }
            BoardEvent::Gap(gap) => {
                let rows = connection.plotted.gap(gap.from_s);
                self.plot(rows);
            }
            BoardEvent::Board(_) | BoardEvent::Reply(_) | BoardEvent::Captured(_) => {}
        }
        if let Some(pressing) = &mut self.pressing {
            pressing.observe(&GripperEvent::Board(event.clone()));
        }
        // An event that began a trial is already part of it.
        if begun == self.begun
            && let (Some(recording), Some(recorder)) = (&mut self.recording, &self.recorder)
        {
            recording.take(recorder, event);
            self.end_aborted();
        }
    }

    fn take_reading(&mut self, reading: &Reading) {
        let Some(connection) = &mut self.connection else { return };
        let estimate = connection.readout.estimate(reading);
        let driving = self.recording.as_ref().map(|recording| &recording.controller).into_iter().chain(&self.pressing);
        let commanded = driving.filter_map(GraspController::line_bar).next();
        self.observing.iter_mut().for_each(|observing| observing.add(reading));
        let row = connection.plotted.row(reading, &estimate, commanded);
        let rows = connection.plotted.push(row.clone());
        let failed = connection.felt.watch.add(reading, &estimate, reading.line_bar.or(commanded));
        let (counts, beyond) = (reading.counts.clone(), connection.readout.beyond(&estimate));
        connection.latest = Some(LatestReading { counts, estimate, beyond, line_bar: reading.line_bar.or(commanded) });
        self.plot(rows);
        self.watch(reading);
        self.recognise(row);
        if failed {
            self.recognise_anew();
        }
        if let (Some(calibrating), Some(connection)) = (&mut self.calibration.running, &self.connection)
            && let Err(cause) = calibrating.feed(reading, &connection.board)
        {
            self.end_calibration(Some(Err(cause.into())));
        }
        self.cross(reading);
    }

    fn plot(&self, rows: Vec<Row>) {
        let (grasp, from_s) = self.stretch;
        let rolling = self.recording.is_none();
        let answer = self.recognition.as_ref().and_then(LiveRecognition::view);
        let closing_s = self.recording.as_ref().and_then(|recording| recording.controller.closing_s());
        let closing_s = closing_s.map_or(0.0, |closing_s| closing_s - from_s);
        for row in rows {
            let sample = Row { t_s: row.t_s - from_s, ..row };
            let (errors, answer) = (Box::default(), answer.clone());
            self.publisher.row(TraceRow { grasp, rolling, sample, closing_s, errors, frame: None, answer });
        }
    }

    /// Starts a new stretch of rows, with time counted from `from_s`.
    fn begin_stretch(&mut self, from_s: f64) {
        let rows = self.connection.as_mut().map(|connection| connection.plotted.flush()).unwrap_or_default();
        self.plot(rows);
        self.stretch = (self.stretch.0 + 1, from_s);
    }

    fn publish(&mut self) {
        self.published = Instant::now();
        self.revision += 1;
        let connection = self.connection.as_ref();
        let link = connection.map(|connection| connection.gripper.stream().status());
        let trial =
            self.recording.as_ref().zip(connection).map(|(recording, c)| self.trial_view(recording, c.gripper.now_s()));
        self.publisher.publish(GripperView {
            revision: self.revision,
            handled: self.handled,
            link,
            refused: self.refused.clone(),
            ports: self.ports.clone(),
            latest: connection.and_then(|connection| connection.latest.clone()),
            sensors: self.sensors,
            channels: Arc::clone(&self.channels),
            drift: connection.map(|connection| connection.drift.clone()).unwrap_or_default(),
            remarks: connection.map(|c| c.misfit.iter().chain(&c.remarks).cloned().collect()).unwrap_or_default(),
            kept_bar: self.pressing.as_ref().map(|pressing| pressing.plan().programme.peak_bar),
            driven_only: connection.is_some_and(|connection| connection.taken_over && connection.board.emulated),
            trial,
            watching: self.watching.clone(),
            ended: self.ended.clone(),
            grasp: self.stretch.0,
            calibrated: self.calibrated,
            identification: self.recognition.as_ref().and_then(LiveRecognition::view),
            recognition_off: self.recognition.as_ref().and_then(LiveRecognition::why_off),
            failed: self.failed_sensors(),
            model: self.model.clone(),
            calibration: self.calibration.clone(),
            crosstalk: self.crosstalk.clone(),
            console: connection.map(|c| c.gripper.stream().console()).unwrap_or_default().into(),
        });
    }
}
