//! Calibrating from a window: a thread "calibrate" that holds the link to the board, drives the procedure, and publishes
//! where it stands. It sleeps until something is wished for, and gives the port back as soon as it is done.

use super::latest::Latest;
use super::messages::Wake;
use crate::board::{Board, Reading, Sensor};
use crate::recording::Store;
use crate::rig::serial::{LinkEvent, LinkOptions, SerialLink};
use crate::sensing::calibration::{Calibration, Point, Procedure};
use crate::wire::Heard;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvError, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// A board that is listened to.
pub trait BoardStream {
    /// What has come since the last call; if nothing has, waits for it up to a time.
    fn take(&mut self, patience: Duration) -> Vec<Reading>;

    /// What is known of the board.
    fn board(&self) -> Board;

    /// How it stands, in a sentence.
    fn state(&self) -> String;
}

impl BoardStream for SerialLink {
    fn take(&mut self, patience: Duration) -> Vec<Reading> {
        let reading = |event| match event {
            LinkEvent::Heard(Heard::Reading(reading)) => Some(reading),
            LinkEvent::Heard(Heard::Gap(_) | Heard::Board(_) | Heard::Said(_)) | LinkEvent::Captured(_) => None,
        };
        Self::take(self, patience).into_iter().filter_map(reading).collect()
    }

    fn board(&self) -> Board {
        self.status().board
    }

    fn state(&self) -> String {
        self.status().state.sentence()
    }
}

/// Opens what is to be listened to: a port, a file of captured bytes, or the only likely port; or says why it cannot.
pub type Listen = Arc<dyn Fn(Option<&Path>) -> Result<Box<dyn BoardStream>, String> + Send + Sync>;

/// Listens to a serial port.
pub fn listen_to_port(port: Option<&Path>) -> Result<Box<dyn BoardStream>, String> {
    let options = LinkOptions { path: port.map(Path::to_owned), ..LinkOptions::default() };
    let link = SerialLink::open(&options).map_err(|error| error.to_string())?;
    Ok(Box::new(link))
}

/// What the user wants of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationWish {
    /// Begin with a part in its place.
    Begin(CalibrationPlan),
    /// Take the settled reading as that of an angle (rad) or force (N).
    Take(f64),
    /// Leave out what is next.
    Skip,
    /// Take the last point back.
    Undo,
    /// Store what came out.
    Keep,
    /// Forget it and give the port back.
    Stop,
}

/// What is calibrated, and where it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationPlan {
    /// Where it sits.
    pub sensor: Sensor,
    /// Name of the part.
    pub part: String,
    /// The port, or a file of captured bytes; the only likely port where nothing is named.
    pub port: Option<PathBuf>,
}

/// Where a calibration stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationView {
    /// What is being calibrated; none while nothing is.
    pub running: Option<RunningCalibration>,
    /// How the last one ended, in a sentence.
    pub ended: Option<Result<String, String>>,
}

/// A calibration that goes on.
#[derive(Clone, Debug, PartialEq)]
pub struct RunningCalibration {
    /// What is calibrated.
    pub plan: CalibrationPlan,
    /// State of the link, in a sentence.
    pub link: String,
    /// What to do next.
    pub instruction: String,
    /// The angle (rad) or force (N) to set next; none when all are done.
    pub next: Option<f64>,
    /// The newest reading (counts).
    pub latest: Option<f64>,
    /// The settled reading (counts), or why there is none yet.
    pub settled: Result<f64, String>,
    /// The points so far.
    pub points: Vec<Point>,
    /// What they come to, or why they come to nothing yet.
    pub fit: Result<Arc<Calibration>, String>,
}

/// A handle on the thread. Dropping it ends the thread.
#[derive(Debug)]
pub struct Calibrator {
    /// Absent once the thread is being ended.
    wishes: Option<Sender<CalibrationWish>>,
    view: Arc<Latest<CalibrationView>>,
    thread: Option<JoinHandle<()>>,
}

impl Calibrator {
    /// Starts the thread; calibrations go into the store at `store`.
    pub fn start(store: PathBuf, listen: Listen, wake: Wake) -> std::io::Result<Self> {
        let (wishes, inbox) = channel();
        let view = Arc::new(Latest::default());
        let mut desk = Desk { store, listen, wake, view: Arc::clone(&view), inbox };
        let thread =
            std::thread::Builder::new().name("calibrate".to_owned()).spawn(move || while desk.work().is_ok() {})?;
        Ok(Self { wishes: Some(wishes), view, thread: Some(thread) })
    }

    /// Asks for something.
    pub fn wish(&self, wish: CalibrationWish) {
        if let Some(wishes) = &self.wishes {
            // A thread that has died of a fault of ours has said so on standard error; the rest of the window works.
            let _heard = wishes.send(wish);
        }
    }

    /// Where it stands; nothing before anything was wished for.
    pub fn view(&self) -> Option<Arc<CalibrationView>> {
        self.view.get()
    }
}

impl Drop for Calibrator {
    fn drop(&mut self) {
        self.wishes = None;
        if let Some(thread) = self.thread.take() {
            let _ended = thread.join();
        }
    }
}

/// How long the thread waits for readings before it looks for wishes again.
const PATIENCE: Duration = Duration::from_millis(60);

/// What the thread owns.
struct Desk {
    store: PathBuf,
    listen: Listen,
    wake: Wake,
    view: Arc<Latest<CalibrationView>>,
    inbox: Receiver<CalibrationWish>,
}

/// How one calibration ended.
type End = Result<String, String>;

impl Desk {
    /// Waits for a calibration and goes through it; fails when the handle is gone.
    fn work(&mut self) -> Result<(), RecvError> {
        let CalibrationWish::Begin(plan) = self.inbox.recv()? else { return Ok(()) };
        let ended = match self.calibrate(&plan) {
            Ok(Some(end)) => Some(Ok(end)),
            Ok(None) => None,
            Err(cause) => Some(Err(cause)),
        };
        self.publish(CalibrationView { running: None, ended });
        Ok(())
    }

    fn publish(&self, view: CalibrationView) {
        self.view.publish(Arc::new(view));
        (self.wake)();
    }

    /// One calibration; ends with what was stored, or with nothing where it was given up.
    fn calibrate(&self, plan: &CalibrationPlan) -> Result<Option<String>, String> {
        let mut link = (self.listen)(plan.port.as_deref())?;
        let mut procedure: Option<Procedure> = None;
        loop {
            for reading in link.take(PATIENCE) {
                if procedure.is_none() {
                    procedure = Some(begin(plan, &link.board())?);
                }
                if let Some(procedure) = &mut procedure {
                    procedure.feed(&reading);
                }
            }
            match self.inbox.try_recv() {
                Ok(CalibrationWish::Stop | CalibrationWish::Begin(_)) | Err(TryRecvError::Disconnected) => {
                    return Ok(None);
                }
                Ok(CalibrationWish::Keep) => {
                    if let Some(end) = procedure.as_ref().map(|procedure| self.keep(procedure)) {
                        return end.map(Some);
                    }
                }
                Ok(wish) => {
                    if let Some(procedure) = &mut procedure {
                        grant(procedure, &wish);
                    }
                }
                Err(TryRecvError::Empty) => {}
            }
            let running = running(plan, procedure.as_ref(), link.state());
            self.publish(CalibrationView { running: Some(running), ended: None });
        }
    }

    /// Stores what came out, and that the part sits where it was calibrated.
    fn keep(&self, procedure: &Procedure) -> End {
        let calibration = procedure.fit().map_err(|fault| fault.to_string())?;
        let sensor = procedure.sensor();
        let stored = Store::open(&self.store).and_then(|mut store| {
            let stored = store.add_calibration(&calibration.record)?;
            store.mount_part(sensor, &stored.record.part)?;
            Ok(stored)
        });
        let stored = stored.map_err(|error| error.to_string())?;
        let (id, version, part) = (stored.id, stored.version, &stored.record.part);
        Ok(format!("calibration {id} stored: version {version} of \"{part}\", the {}", sensor.label()))
    }
}

fn begin(plan: &CalibrationPlan, board: &Board) -> Result<Procedure, String> {
    Procedure::new(board, plan.sensor, &plan.part, None).ok_or_else(|| {
        let (wanted, has) = (plan.sensor.channel(), board.channels.join(", "));
        format!("the board has no channel \"{wanted}\"; it has {has}")
    })
}

fn grant(procedure: &mut Procedure, wish: &CalibrationWish) {
    match wish {
        CalibrationWish::Take(stimulus) => {
            // One that came before the reading had settled is to be made again; the view says why.
            let _taken = procedure.take(*stimulus);
        }
        CalibrationWish::Skip => procedure.skip(),
        CalibrationWish::Undo => {
            procedure.undo();
        }
        CalibrationWish::Begin(_) | CalibrationWish::Keep | CalibrationWish::Stop => {}
    }
}

fn running(plan: &CalibrationPlan, procedure: Option<&Procedure>, link: String) -> RunningCalibration {
    let waiting = || Err("no readings yet".to_owned());
    RunningCalibration {
        plan: plan.clone(),
        instruction: procedure.map_or_else(|| link.clone(), Procedure::instruction),
        link,
        next: procedure.and_then(Procedure::next),
        latest: procedure.and_then(Procedure::latest),
        settled: procedure
            .map_or_else(waiting, |procedure| procedure.settled().map(|p| p.counts).map_err(|why| why.to_string())),
        points: procedure.map(|procedure| procedure.record().points.clone()).unwrap_or_default(),
        fit: procedure.map_or_else(
            || Err("no points yet".to_owned()),
            |procedure| procedure.fit().map(Arc::new).map_err(|fault| fault.to_string()),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensing::calibration::Kind;
    use std::sync::Mutex;

    /// A board whose left strip reads what the test sets, fifty readings at a time.
    struct Scripted {
        counts: Arc<Mutex<f32>>,
        t_s: f64,
    }

    impl BoardStream for Scripted {
        fn take(&mut self, _: Duration) -> Vec<Reading> {
            std::thread::sleep(Duration::from_millis(1));
            let counts = vec![Some(*self.counts.lock().expect("whole")), Some(900.0), Some(0.0), Some(0.0)];
            let times = (1..=50).map(|k| self.t_s + 0.02 * f64::from(k)).collect::<Vec<f64>>();
            self.t_s += 1.0;
            let reading = |t_s| Reading { t_s, arrived_s: t_s, seq: None, counts: counts.clone(), line_bar: None };
            times.into_iter().map(reading).collect()
        }

        fn board(&self) -> Board {
            Board::default()
        }

        fn state(&self) -> String {
            "Listening".to_owned()
        }
    }

    /// Waits until the calibration stands as wanted.
    fn until(
        desk: &Calibrator,
        woken: &Receiver<()>,
        wanted: impl Fn(&CalibrationView) -> bool,
    ) -> Arc<CalibrationView> {
        loop {
            if let Some(view) = desk.view().filter(|view| wanted(view)) {
                return view;
            }
            woken.recv_timeout(Duration::from_secs(60)).expect("the thread is alive");
        }
    }

    #[test]
    fn a_calibration_is_made_from_outside_and_stored() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let store = folder.path().join("s.sqlite");
        let counts = Arc::new(Mutex::new(0.0));
        let (told, woken) = channel();
        let wake: Wake = Arc::new(move || {
            // The test may have stopped listening.
            let _heard = told.send(());
        });
        let read = Arc::clone(&counts);
        let listen: Listen = Arc::new(move |port| match port {
            Some(port) => Err(format!("there is no {}", port.display())),
            None => Ok(Box::new(Scripted { counts: Arc::clone(&read), t_s: 0.0 })),
        });
        let desk = Calibrator::start(store.clone(), listen, wake)?;
        assert!(desk.view().is_none());
        let begin = |port: Option<&str>| {
            let port = port.map(PathBuf::from);
            desk.wish(CalibrationWish::Begin(CalibrationPlan {
                sensor: Sensor::FlexLeft,
                part: "A7".to_owned(),
                port,
            }));
        };
        begin(Some("nowhere"));
        let failed = until(&desk, &woken, |view| view.ended.is_some());
        assert_eq!(failed.ended, Some(Err("there is no nowhere".to_owned())));
        begin(None);
        // 25 and 50 kOhm below 47.
        for (number, (degrees, ohm)) in [(0.0, 25e3), (90.0, 50e3)].into_iter().enumerate() {
            *counts.lock().expect("whole") = (4096.0 * ohm / (ohm + 47e3)) as f32;
            let settled = 4096.0 * ohm / (ohm + 47e3);
            let ready = |view: &CalibrationView| {
                let running = view.running.as_ref();
                running.is_some_and(|r| {
                    r.points.len() == number && r.settled.as_ref().is_ok_and(|c| (c - settled).abs() < 1.0)
                })
            };
            until(&desk, &woken, ready);
            desk.wish(CalibrationWish::Take(Kind::Flex.stimulus(degrees)));
            // Before the strip is bent on: a reading on its way would not be taken.
            until(&desk, &woken, |view| view.running.as_ref().is_some_and(|r| r.points.len() == number + 1));
        }
        let fitted = until(&desk, &woken, |view| view.running.as_ref().is_some_and(|running| running.fit.is_ok()));
        assert_eq!(fitted.running.as_ref().map(|running| running.points.len()), Some(2));
        desk.wish(CalibrationWish::Keep);
        let ended = until(&desk, &woken, |view| view.running.is_none() && view.ended.is_some());
        assert!(matches!(&ended.ended, Some(Ok(text)) if text.contains("version 1 of \"A7\"")), "{ended:?}");
        let serving = Store::open(&store)?.serving(None, &[])?;
        assert_eq!((serving.ids, serving.calibrations[0].0), (vec![1], Sensor::FlexLeft));
        Ok(())
    }
}
