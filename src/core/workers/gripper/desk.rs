//! The gripper's thread: it owns the link, hands what it hears to everybody who wants it, and does what it is told.

use super::calibrating::{Calibrating, CalibrationPlan, CalibrationView, CalibrationWish};
use super::messages::{EndedTrial, GripperView, GripperWish, LatestReading, TrialRequest};
use super::observing::Observing;
use super::plotted::{Plotted, Row};
use super::recent::Recent;
use super::running::{BEFORE_S, Running};
use super::stream::{BoardStream, Listen};
use super::worker::GripperSetup;
use crate::board::{Board, Reading};
use crate::gripper::Phase;
use crate::labelling::{SegmentEvent, Segmenter};
use crate::recording::Store;
use crate::rig::serial::{LinkEvent, PortInfo, VENT, list_ports};
use crate::scene::Scene;
use crate::sensing::Channel;
use crate::sensing::calibration::{Drift, DriftLevel, Felt, Readout, Zero};
use crate::sensing::whole_fingers;
use crate::wire::Heard;
use crate::workers::listener::Listener;
use crate::workers::{Latest, Notice, TraceRow, Wake};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TryRecvError, TrySendError};
use std::time::{Duration, Instant};

/// How long the thread waits for readings before it looks for wishes again: also how punctual the control box is told.
const PATIENCE: Duration = Duration::from_millis(10);
/// Views are published no more often than this.
const CALM: Duration = Duration::from_millis(33);
/// Readings before the closing from which the zeros are taken (s).
const REST_S: f64 = 0.6;

/// Where results go.
pub(super) struct Outlets {
    pub(super) view: Arc<Latest<GripperView>>,
    pub(super) rows: SyncSender<TraceRow>,
    pub(super) rows_lost: Arc<AtomicBool>,
    pub(super) notices: Sender<Notice>,
    pub(super) wake: Wake,
}

impl Outlets {
    fn tell(&self, notice: Notice) {
        // The window may have gone; then there is nobody to tell.
        let _heard = self.notices.send(notice);
        (self.wake)();
    }
}

/// What is known while something is listened to.
struct Connection {
    stream: Box<dyn BoardStream>,
    board: Board,
    recent: Recent,
    /// The board's readings by the calibrations of its parts, with the zeros taken last.
    readout: Readout,
    remarks: Vec<String>,
    drift: Vec<Drift>,
    latest: Option<LatestReading>,
    plotted: Plotted,
    /// Tells when a grasp begins and ends by itself.
    segmenter: Segmenter,
}

/// Everything the thread owns.
pub(super) struct Desk {
    outlets: Outlets,
    listen: Listen,
    path: PathBuf,
    store: Option<Store>,
    scene: Scene,
    listener: Option<Listener>,
    model: Option<String>,
    grasps: u32,
    ports: Vec<PortInfo>,
    refused: Option<String>,
    connection: Option<Connection>,
    running: Option<Running>,
    /// Trials that were begun so far.
    begun: u64,
    watching: Option<TrialRequest>,
    ended: Option<Arc<EndedTrial>>,
    calibrating: Option<Calibrating>,
    observing: Vec<Observing>,
    calibrated: Option<Result<String, String>>,
    /// Which stretch of rows is being sent, and the time that counts as its zero (s).
    stretch: (u64, f64),
    channels: Arc<[Channel]>,
    revision: u64,
    published: Instant,
}

impl Desk {
    pub(super) fn new(setup: GripperSetup, outlets: Outlets) -> Self {
        let GripperSetup { scene, store, model, grasps, listen, wake: _ } = setup;
        let mut desk = Self {
            outlets,
            listen,
            path: store,
            store: None,
            scene,
            listener: None,
            model: None,
            grasps,
            ports: Vec::new(),
            refused: None,
            connection: None,
            running: None,
            begun: 0,
            watching: None,
            ended: None,
            calibrating: None,
            observing: Vec::new(),
            calibrated: None,
            stretch: (0, 0.0),
            channels: whole_fingers().into(),
            revision: 0,
            published: Instant::now(),
        };
        desk.set_model(model);
        desk
    }

    /// Works until it is told to quit.
    pub(super) fn run(mut self, inbox: &Receiver<GripperWish>) {
        self.publish();
        loop {
            let wish = match &self.connection {
                Some(_) => match inbox.try_recv() {
                    Ok(wish) => Some(wish),
                    Err(TryRecvError::Empty) => None,
                    Err(TryRecvError::Disconnected) => break,
                },
                None => match inbox.recv() {
                    Ok(wish) => Some(wish),
                    Err(_closed) => break,
                },
            };
            match wish {
                Some(GripperWish::Quit) => break,
                Some(wish) => {
                    self.obey(wish);
                    self.publish();
                }
                None => self.listen_on(),
            }
        }
        self.disconnect("the window was closed");
    }

    fn obey(&mut self, wish: GripperWish) {
        match wish {
            GripperWish::ListPorts => self.ports = list_ports(),
            GripperWish::Connect(port) => {
                self.disconnect("another port was chosen");
                self.connect(port.as_deref());
            }
            GripperWish::Disconnect => self.disconnect("the port was given back"),
            GripperWish::Vent => self.vent(),
            GripperWish::Tare => self.tare(),
            GripperWish::SetScene(scene) => self.scene = *scene,
            GripperWish::SetModel(model) => self.set_model(model),
            GripperWish::SetThreshold(threshold) => {
                if let Some(listener) = &mut self.listener {
                    listener.set_threshold(threshold);
                }
            }
            GripperWish::SetGrasps(grasps) => {
                self.grasps = grasps.max(1);
                if let Some(listener) = &mut self.listener {
                    listener.set_most_grasps(self.grasps);
                }
            }
            GripperWish::AnotherObject => self.start_over(),
            GripperWish::Begin(request) => self.begin(request, None),
            GripperWish::Watch(request) => self.watching = request,
            GripperWish::End => self.end(false, None),
            GripperWish::Discard => self.end(true, None),
            GripperWish::Observe(request) if self.connection.is_some() => {
                self.observing.push(Observing::new(request));
            }
            // Whoever asked learns of it by the end of the request, and looks alone.
            GripperWish::Observe(_) => {}
            GripperWish::Calibrate(wish) => self.calibrate(&wish),
            GripperWish::Quit => {}
        }
    }

    // The link.

    fn connect(&mut self, port: Option<&Path>) {
        self.refused = None;
        match (self.listen)(port) {
            Ok(stream) => {
                // A board that speaks our language says who it is; to others it is a line they do not know.
                let mut stream = stream;
                let _told = stream.send("?");
                self.connection = Some(Connection {
                    board: stream.status().board,
                    stream,
                    recent: Recent::default(),
                    readout: Readout::default(),
                    remarks: Vec::new(),
                    drift: Vec::new(),
                    latest: None,
                    plotted: Plotted::new(Vec::new(), 0),
                    segmenter: Segmenter::new(&Board::default()),
                });
                self.read_calibrations();
                self.another_stretch(0.0);
                self.start_over();
            }
            Err(cause) => {
                self.outlets.tell(Notice::Failed(cause.clone()));
                self.refused = Some(cause);
                self.ports = list_ports();
            }
        }
    }

    fn disconnect(&mut self, why: &str) {
        self.end(false, Some(format!("ended early: {why}")));
        self.calibrating = None;
        self.observing.clear();
        self.connection = None;
    }

    /// Reads the board through the newest calibrations of its parts.
    fn read_calibrations(&mut self) {
        let Some(connection) = &self.connection else { return };
        let board = connection.board.clone();
        let read = self.store().and_then(|store| {
            let tare = store.tare().map_err(|error| error.to_string())?;
            let serving = store.serving(None, &[]).map_err(|error| error.to_string())?;
            Ok((serving, tare.map(|tare| tare.zero)))
        });
        let (read, zero) = match read {
            Ok((serving, zero)) => (Ok(serving), zero),
            Err(cause) => (Err(cause), None),
        };
        let (readout, remarks) = match read {
            Ok(serving) => match Readout::new(&board, &serving.calibrations) {
                Ok(readout) => {
                    let remarks = serving.warnings.into_iter().chain(readout.warnings().iter().cloned()).collect();
                    (readout, remarks)
                }
                Err(fault) => (Readout::default(), vec![fault.to_string()]),
            },
            Err(cause) => (Readout::default(), vec![cause]),
        };
        if let Some(connection) = &mut self.connection {
            connection.plotted = Plotted::new(self.channels.to_vec(), board.channels.len());
            connection.segmenter.set_board(&board);
            connection.readout = readout;
            connection.remarks = remarks;
            connection.drift.clear();
            if let Some(zero) = zero {
                connection.set_zero(zero);
            }
        }
    }

    /// Takes in what the link has heard, and does what is due.
    fn listen_on(&mut self) {
        let Some(connection) = &mut self.connection else { return };
        let events = connection.stream.take(PATIENCE);
        for event in events {
            self.hear(event);
        }
        self.conduct();
        self.end_looks();
        let over = self.connection.as_ref().is_some_and(|connection| connection.stream.is_over());
        if over {
            let why = self.connection.as_ref().map(|c| c.stream.status().state.sentence()).unwrap_or_default();
            self.disconnect(&why);
            self.outlets.tell(Notice::Warning(why.clone()));
            self.refused = Some(why);
            self.publish();
        } else if self.published.elapsed() >= CALM {
            self.publish();
        }
    }

    /// Hands over what the doctor has seen enough of.
    fn end_looks(&mut self) {
        let Some(connection) = &self.connection else { return };
        for observing in self.observing.extract_if(.., |observing| observing.is_over()) {
            observing.finish(connection.stream.status());
        }
    }

    fn hear(&mut self, event: LinkEvent) {
        let Some(connection) = &mut self.connection else { return };
        let begun = self.begun;
        connection.recent.push(&event);
        match &event {
            LinkEvent::Heard(Heard::Reading(reading)) => {
                let reading = reading.clone();
                self.hear_reading(&reading);
            }
            LinkEvent::Heard(Heard::Board(board)) if connection.board != *board => {
                connection.board = board.clone();
                self.read_calibrations();
            }
            LinkEvent::Heard(Heard::Gap(gap)) => {
                let rows = connection.plotted.gap(gap.from_s);
                self.plot(rows);
            }
            LinkEvent::Heard(Heard::Board(_) | Heard::Said(_)) | LinkEvent::Captured(_) => {}
        }
        // What began a trial just now is among what it was begun with.
        if begun == self.begun
            && let Some(running) = &mut self.running
        {
            running.take(event);
            self.write();
        }
    }

    fn hear_reading(&mut self, reading: &Reading) {
        let Some(connection) = &mut self.connection else { return };
        let felt = connection.readout.felt(reading);
        let commanded = self.running.as_ref().and_then(Running::line_bar);
        let line_bar = commanded.or(reading.line_bar);
        self.observing.iter_mut().for_each(|observing| observing.add(reading));
        let rows = connection.plotted.push(reading, &felt, line_bar);
        connection.latest = Some(LatestReading { counts: reading.counts.clone(), felt, line_bar });
        self.plot(rows);
        self.watch(reading);
        self.recognise(reading.t_s, &felt);
        if let (Some(calibrating), Some(connection)) = (&mut self.calibrating, &self.connection)
            && let Err(cause) = calibrating.feed(reading, &connection.board)
        {
            self.end_calibration(Some(Err(cause)));
        }
    }

    /// Begins and ends trials by what the fingers do, where that is wanted.
    fn watch(&mut self, reading: &Reading) {
        let Some(connection) = &mut self.connection else { return };
        let events = connection.segmenter.push(reading);
        let Some(request) = self.watching.clone() else { return };
        // A trial that was asked for goes its own way.
        if self.running.as_ref().is_some_and(|running| *running.request() != request) {
            return;
        }
        for event in events {
            match event {
                SegmentEvent::Began { from_s } => self.begin(request.clone(), Some(from_s)),
                SegmentEvent::Phase(mark) => {
                    let phase = self.running.as_mut().and_then(|running| running.mark(mark));
                    phase.into_iter().for_each(|phase| self.begin_phase(phase, reading.t_s));
                }
                SegmentEvent::Ended { .. } => self.end(false, None),
            }
        }
    }

    fn plot(&self, rows: Vec<Row>) {
        let (grasp, from_s) = self.stretch;
        let rolling = self.running.is_none();
        for row in rows {
            if let Err(TrySendError::Full(_)) = self.outlets.rows.try_send(row.placed(grasp, from_s, rolling)) {
                self.outlets.rows_lost.store(true, Ordering::Relaxed);
            }
        }
    }

    /// From now on rows belong to another stretch of time, which counts from `from_s`.
    fn another_stretch(&mut self, from_s: f64) {
        let rows = self.connection.as_mut().map(|connection| connection.plotted.flush()).unwrap_or_default();
        self.plot(rows);
        self.stretch = (self.stretch.0 + 1, from_s);
    }

    // The control box.

    fn vent(&mut self) {
        let Some(connection) = &mut self.connection else {
            return self.outlets.tell(Notice::Warning("no board is connected: vent at the control box".to_owned()));
        };
        let sent = connection.stream.send(VENT);
        match sent {
            Err(error) => self.outlets.tell(Notice::Failed(format!("{error}: vent at the control box"))),
            Ok(()) if connection.board.firmware.is_none() => self.outlets.tell(Notice::Warning(
                "told to vent, but this board has not said that it drives a control box: vent by hand".to_owned(),
            )),
            Ok(()) => self.outlets.tell(Notice::Warning("told to vent".to_owned())),
        }
        if let Some(running) = &mut self.running {
            running.interrupt("vented by the user");
        }
        self.end(false, None);
    }

    /// Tells the board what is due, and ends a trial whose programme is done.
    fn conduct(&mut self) {
        let (Some(connection), Some(running)) = (&mut self.connection, &mut self.running) else { return };
        let now_s = connection.stream.now_s();
        let (line, phase) = running.conduct(now_s);
        if let Some(line) = line
            && let Err(error) = connection.stream.send(&line)
        {
            running.note(format!("{line}: {error}"));
        }
        let over = running.is_over(now_s);
        if let Some(phase) = phase {
            self.begin_phase(phase, f64::INFINITY);
        }
        self.write();
        if over {
            self.end(false, None);
        }
    }

    /// What was heard before `until_s` has been passed over.
    fn begin_phase(&mut self, phase: Phase, until_s: f64) {
        match phase {
            Phase::Close => {
                let closing_s = self.running.as_ref().and_then(|running| running.closing_s).unwrap_or(f64::INFINITY);
                self.zero_from_rest(closing_s);
                self.begin_recognition();
                self.catch_up(closing_s, until_s);
            }
            Phase::Hold => {}
            Phase::Release => {
                if let Some(listener) = &mut self.listener {
                    listener.end_grasp();
                }
            }
        }
    }

    // Zeros.

    /// The zeros of a trial are what the sensors show just before its closing.
    fn zero_from_rest(&mut self, closing_s: f64) {
        let Some(connection) = &mut self.connection else { return };
        let zero = connection.readout.zero_from(&connection.recent.between(closing_s - REST_S, closing_s));
        connection.set_zero(zero);
    }

    /// Recognises what was heard since the closing began, where that was found out later.
    fn catch_up(&mut self, closing_s: f64, until_s: f64) {
        let Some(connection) = &self.connection else { return };
        let heard = connection.recent.between(closing_s, until_s);
        let felt: Vec<(f64, Felt)> =
            heard.iter().map(|reading| (reading.t_s, connection.readout.felt(reading))).collect();
        for (t_s, felt) in felt {
            self.recognise(t_s, &felt);
        }
    }

    fn tare(&mut self) {
        let Some(connection) = &mut self.connection else { return };
        let readings = connection.recent.last(REST_S);
        let zero = connection.readout.zero_from(&readings);
        if zero == Zero::default() {
            let text = "nothing was tared: no calibrated sensor has been read yet";
            return self.outlets.tell(Notice::Warning(text.to_owned()));
        }
        connection.set_zero(zero);
        let far: Vec<String> = connection
            .drift
            .iter()
            .filter(|drift| drift.level == DriftLevel::TooFar)
            .filter_map(Drift::remark)
            .collect();
        for text in far {
            self.outlets.tell(Notice::Warning(text));
        }
        let path = self.path.clone();
        let stored =
            open(&mut self.store, &path).and_then(|store| store.add_tare(&zero).map_err(|error| error.to_string()));
        match stored {
            Ok(_) => {
                self.outlets.tell(Notice::Told("tared: the zeros of now serve until they are taken again".to_owned()));
            }
            Err(cause) => {
                self.outlets.tell(Notice::Failed(format!("the tare serves until the port is given back: {cause}")));
            }
        }
    }

    // Trials.

    /// Begins a trial; one that goes on ends before it.
    fn begin(&mut self, request: TrialRequest, from_s: Option<f64>) {
        self.end(false, None);
        let Some(connection) = &self.connection else {
            let text = "no board is connected: connect the gripper first";
            return self.outlets.tell(Notice::Warning(text.to_owned()));
        };
        if connection.latest.is_none() {
            let text = format!("nothing is recorded yet: {}", connection.stream.status().state.sentence());
            return self.outlets.tell(Notice::Warning(text));
        }
        let now_s = connection.stream.now_s();
        let from_s = from_s.unwrap_or(now_s - BEFORE_S);
        let status = connection.stream.status();
        let adds = request.adds;
        let path = self.path.clone();
        let store = match open(&mut self.store, &path) {
            Ok(store) => store,
            Err(cause) => return self.outlets.tell(Notice::Failed(cause)),
        };
        let Some(connection) = &self.connection else { return };
        match Running::begin(store, request, &self.scene, &status, &connection.recent, [from_s, now_s]) {
            Ok(running) => {
                self.another_stretch(running.closing_s.unwrap_or(running.began_s));
                self.running = Some(running);
                self.begun += 1;
                let decided = self.listener.as_ref().is_some_and(|listener| listener.decision().is_some());
                if !adds || decided {
                    self.start_over();
                }
            }
            Err(error) => self.outlets.tell(Notice::Failed(format!("no trial was begun: {error}"))),
        }
    }

    /// Writes what waits of the trial; a store that fails ends it.
    fn write(&mut self) {
        let Some(running) = &mut self.running else { return };
        let path = self.path.clone();
        let written =
            open(&mut self.store, &path).and_then(|store| running.flush(store).map_err(|error| error.to_string()));
        if let Err(cause) = written {
            self.running = None;
            self.outlets.tell(Notice::Failed(format!("the trial was broken off, what was written is safe: {cause}")));
        }
    }

    /// Ends the trial that goes on, if any.
    fn end(&mut self, discarded: bool, note: Option<String>) {
        let Some(mut running) = self.running.take() else { return };
        if let Some(note) = note {
            running.note(note);
        }
        let Some(connection) = &mut self.connection else { return };
        if running.is_driven() && connection.stream.send(VENT).is_err() {
            running
                .note("the board could not be told to vent at the end; it vents by itself within a second".to_owned());
        }
        let status = connection.stream.status();
        if let Some(listener) = &mut self.listener {
            if discarded && !running.request().adds {
                listener.start_over();
            } else {
                listener.end_grasp();
            }
        }
        // What was felt before belongs to a guess that adds to it; such a guess says nothing of this trial alone.
        let alone = !discarded && !running.request().adds;
        let guess = self.listener.as_ref().filter(|_| alone && running.closing_s.is_some()).and_then(Listener::guess);
        let guess = guess.zip(self.model.clone());
        let path = self.path.clone();
        let finished = open(&mut self.store, &path).and_then(|store| {
            let ended = running.finish(store, &status, discarded).map_err(|error| error.to_string())?;
            if let Some((pmf, model)) = guess {
                store.set_guess(ended.id, &model, &pmf).map_err(|error| error.to_string())?;
            }
            Ok(ended)
        });
        match finished {
            Ok(ended) => {
                if !discarded {
                    self.outlets.tell(Notice::Stored(ended.id));
                }
                self.ended = Some(Arc::new(ended));
            }
            Err(cause) => self.outlets.tell(Notice::Failed(format!("the trial could not be ended: {cause}"))),
        }
        self.another_stretch(0.0);
    }

    // Recognition.

    fn set_model(&mut self, model: Option<Arc<crate::recognition::Model>>) {
        self.model = model.as_ref().map(|model| model.card.method.clone());
        self.listener = model.map(|model| Listener::new(model, self.grasps));
    }

    fn start_over(&mut self) {
        if let Some(listener) = &mut self.listener {
            listener.start_over();
        }
    }

    fn begin_recognition(&mut self) {
        let (Some(listener), Some(connection)) = (&mut self.listener, &self.connection) else { return };
        let channels: Vec<String> = connection.readout.channels().iter().map(Channel::name).collect();
        if let Some(warning) = listener.begin_grasp_of(&channels) {
            self.outlets.tell(Notice::Warning(warning));
        }
    }

    /// Lets the model hear a reading of the grasp that goes on.
    fn recognise(&mut self, t_s: f64, felt: &Felt) {
        let (Some(listener), Some(running)) = (&mut self.listener, &self.running) else { return };
        let Some(t) = running.closing_s.map(|closing_s| t_s - closing_s).filter(|t| *t >= 0.0) else { return };
        let names = listener.channels();
        let value =
            |name: &String| self.channels.iter().find(|channel| channel.name() == *name).and_then(|c| felt.of(c));
        // A reading in which a sensor is at an end of its range is passed over.
        let row: Option<Vec<f32>> = names.iter().map(|name| value(name).map(|value| value as f32)).collect();
        if let Some(row) = row {
            listener.push_row(t as f32, &row);
        }
    }

    // Calibration.

    fn calibrate(&mut self, wish: &CalibrationWish) {
        match wish {
            CalibrationWish::Begin(plan) => self.begin_calibration(plan),
            CalibrationWish::Stop => self.end_calibration(None),
            CalibrationWish::Keep => {
                let path = self.path.clone();
                let kept = match (&self.calibrating, open(&mut self.store, &path)) {
                    (None, _) => return,
                    (Some(calibrating), Ok(store)) => calibrating.keep(store),
                    (Some(_), Err(cause)) => Some(Err(cause)),
                };
                if let Some(kept) = kept {
                    self.end_calibration(Some(kept));
                    self.read_calibrations();
                }
            }
            CalibrationWish::Take(_) | CalibrationWish::Skip | CalibrationWish::Undo => {
                if let Some(calibrating) = &mut self.calibrating {
                    calibrating.grant(wish);
                }
            }
        }
    }

    fn begin_calibration(&mut self, plan: &CalibrationPlan) {
        let owns_port = self.connection.is_none();
        if owns_port {
            self.connect(plan.port.as_deref());
        }
        match (&self.connection, self.refused.take()) {
            (None, refused) => {
                self.calibrated = Some(Err(refused.clone().unwrap_or_else(|| "no board is connected".to_owned())));
                self.refused = refused;
            }
            (Some(_), _) => self.calibrating = Some(Calibrating::new(plan.clone(), owns_port)),
        }
    }

    fn end_calibration(&mut self, ended: Option<Result<String, String>>) {
        let owns_port = self.calibrating.take().is_some_and(|calibrating| calibrating.owns_port);
        self.calibrated = ended;
        if owns_port {
            self.disconnect("the calibration has ended");
        }
    }

    fn store(&mut self) -> Result<&mut Store, String> {
        open(&mut self.store, &self.path)
    }

    fn publish(&mut self) {
        self.published = Instant::now();
        self.revision += 1;
        let connection = self.connection.as_ref();
        let link = connection.map(|connection| connection.stream.status());
        let calibration = self
            .calibrating
            .as_ref()
            .map(|calibrating| calibrating.view(link.as_ref().map(|link| link.state.sentence()).unwrap_or_default()));
        let calibration = CalibrationView { running: calibration, ended: self.calibrated.clone() };
        let trial = self.running.as_ref().zip(connection).map(|(running, c)| running.view(c.stream.now_s()));
        self.outlets.view.publish(Arc::new(GripperView {
            revision: self.revision,
            link,
            refused: self.refused.clone(),
            ports: self.ports.clone(),
            latest: connection.and_then(|connection| connection.latest.clone()),
            channels: Arc::clone(&self.channels),
            drift: connection.map(|connection| connection.drift.clone()).unwrap_or_default(),
            remarks: connection.map(|connection| connection.remarks.clone()).unwrap_or_default(),
            trial,
            watching: self.watching.clone(),
            ended: self.ended.clone(),
            grasp: self.stretch.0,
            identification: self.listener.as_ref().and_then(Listener::view),
            recognition_off: self.listener.as_ref().and_then(Listener::why_off),
            model: self.model.clone(),
            calibration: Some(Arc::new(calibration)),
            console: connection.map(|c| c.stream.console()).unwrap_or_default().into(),
        }));
        (self.outlets.wake)();
    }
}

impl Connection {
    /// Subtracts a zero from now on, and judges how far it is from the calibrations.
    fn set_zero(&mut self, zero: Zero) {
        self.drift = self.readout.drift(&zero);
        self.readout = self.readout.clone().with_zero(zero);
    }
}

/// The store, opened when it is first needed.
fn open<'a>(store: &'a mut Option<Store>, path: &Path) -> Result<&'a mut Store, String> {
    match store {
        Some(store) => Ok(store),
        empty @ None => Ok(empty.insert(Store::open(path).map_err(|error| error.to_string())?)),
    }
}
