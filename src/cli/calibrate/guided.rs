//! Guided calibration with the board connected: asks for the next angle or weight, waits until the reading has settled, and
//! records the point on Enter or automatically.

use super::super::link::{self, Listener};
use super::super::prelude::*;
use super::super::terminal::CLEAR_LINE;
use super::CalibrateArguments;
use palpate_lab::workers::{CalibrationCommand, CalibrationPlan, CalibrationSession, CalibrationSetup};
use palpate_tactile::board::{Board, KNOWN_AFTER_S, Reading, Sensor, SensorList};
use palpate_tactile::calibration::{Point, Record, SensorKind};
use std::io::{IsTerminal as _, Write as _};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Instant;

/// Source of the readings, and how points are recorded.
#[derive(Debug, clap::Args)]
pub(super) struct LiveArguments {
    /// Port, or file of captured bytes (default: the only likely port).
    #[arg(long, value_name = "PORT|FILE")]
    port: Option<PathBuf>,
    /// Angles (degrees) or weights (kg), separated by commas (default: 0, 30, 60, 90 degrees; weights up to 0.5 kg).
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', conflicts_with = "points")]
    plan: Vec<f64>,
    /// Record each point automatically once the reading has changed and settled, instead of on Enter.
    #[arg(long)]
    auto: bool,
    /// Pads only: then record an empty close of this duration, to measure how bending shifts the zero. The strip of the same
    /// finger must be calibrated.
    #[arg(long, value_name = "S", value_parser = within(1.0..=600.0))]
    pub(super) empty_close: Option<f64>,
}

impl LiveArguments {
    /// Refuses live arguments where points come from a file and there is no empty close.
    pub(super) fn refuse_beside_points(&self) -> Result<(), Failure> {
        let given = [("--port", self.port.is_some()), ("--auto", self.auto)].into_iter().find(|(_, given)| *given);
        given.map_or(Ok(()), |(name, _)| {
            Err(format!("{name} has no effect: the points come from a file. Leave it out, or add --empty-close").into())
        })
    }
}

/// How long an automatic procedure waits for a change (s).
const AUTO_PATIENCE_S: f64 = 60.0;

/// Error of a stream that ended too early.
const ENDED: &str = "the stream ended before all points were recorded";

/// Opens a port or a file. Where nobody presses a key, captured bytes come without a pause.
fn listen(port: Option<&Path>, hands_free: bool, sensors: SensorList) -> Result<Listener, Failure> {
    Listener::open(&link::options(port, hands_free, sensors), &AtomicBool::new(false))
}

/// Calibrates a part; `points` were measured before, and only the empty close is missing.
pub(super) fn record(
    arguments: &CalibrateArguments,
    sensor: Sensor,
    part: &str,
    points: Option<Record>,
    store: Option<&Store>,
) -> Result<Record, Failure> {
    let live = &arguments.live;
    let close_s = live.empty_close;
    let serving = store.filter(|_| close_s.is_some()).map(|store| store.calibrations().serving(None, &[]));
    let setup = CalibrationSetup {
        resistor_ohm: arguments.resistor,
        stimuli: live.plan.iter().map(|shown| sensor.kind().stimulus(*shown)).collect(),
        record: points,
        automatic: live.auto,
        close_s,
        serving: serving.transpose()?.map(|serving| serving.calibrations).unwrap_or_default(),
    };
    let board = listen(live.port.as_deref(), live.auto, sensor.list())?;
    if setup.record.is_none() {
        let place = sensor.label();
        note(&format!(
            "Calibrating \"{part}\", the {place}. Enter records a point; a number records it as that angle or weight;"
        ));
        note("s skips it, u undoes the last one, q quits.");
    }
    guide(board, sensor, part, setup)
}

/// Reads a pad under a known weight (kg): on Enter, or as soon as it has settled.
pub(in crate::cli) fn weigh(port: Option<&Path>, sensor: Sensor, kg: f64, auto: bool) -> Result<Point, Failure> {
    let board = listen(port, auto, sensor.list())?;
    if !auto {
        note(&format!("Press Enter once the weight lies on the {}.", sensor.label()));
    }
    let stimuli = vec![SensorKind::Pad.stimulus(kg)];
    let setup = CalibrationSetup { stimuli, automatic: auto, ..CalibrationSetup::default() };
    let record = guide(board, sensor, "weighed", setup)?;
    Ok(*record.points.last().ok_or("no weight was measured")?)
}

/// Runs a calibration to its end.
fn guide(mut board: Listener, sensor: Sensor, part: &str, setup: CalibrationSetup) -> Result<Record, Failure> {
    let auto = setup.automatic;
    let points = setup.record.as_ref().map_or(0, |record| record.points.len());
    let keys = if auto { channel().1 } else { typed_lines()? };
    let plan = CalibrationPlan { sensor, part: part.to_owned(), port: None };
    let mut session = CalibrationSession::new(plan, setup);
    let mut screen = Screen::new(sensor.kind(), points, auto);
    while !session.is_complete() {
        let readings = board.next()?.ok_or_else(|| format!("{ENDED}. {}", board.sentence()))?;
        let known = board.board();
        for reading in readings {
            if !session.is_complete() {
                session.feed(&reading, &known)?;
                screen.tell(&mut session)?;
            }
        }
        screen.show_reading(&session);
        screen.check_patience(&session)?;
        if !auto
            && session.is_begun()
            && let Some(command) = typed(&keys, &session, screen.kind)?
        {
            let before = screen.points;
            session.handle(&command);
            if command == CalibrationCommand::Undo && before == 0 {
                note("no point to undo");
            }
            screen.tell(&mut session)?;
        }
    }
    Ok(session.procedure().record().clone())
}

/// The command that was typed, if any.
fn typed(
    keys: &Receiver<String>,
    session: &CalibrationSession,
    kind: SensorKind,
) -> Result<Option<CalibrationCommand>, Failure> {
    let line = match keys.try_recv() {
        Ok(line) => line,
        Err(TryRecvError::Empty) => return Ok(None),
        Err(TryRecvError::Disconnected) => {
            return Err("standard input has ended; use --auto to record without a keyboard".into());
        }
    };
    Ok(match line.trim() {
        "" if session.awaits_close() => Some(CalibrationCommand::EmptyClose),
        "" => session.procedure().next().map(CalibrationCommand::Take),
        "s" => Some(CalibrationCommand::Skip),
        "u" => Some(CalibrationCommand::Undo),
        "q" => return Err("cancelled; nothing was stored".into()),
        text => {
            let number = text.parse::<f64>().ok();
            if number.is_none() {
                warn(&format!("unknown input \"{text}\": press Enter, or type a number, s, u or q"));
            }
            number.map(|number| CalibrationCommand::Take(kind.stimulus(number)))
        }
    })
}

/// Listens for some seconds; returns the board and its readings.
pub(super) fn watch(port: Option<&Path>, seconds: f64, sensors: SensorList) -> Result<(Board, Vec<Reading>), Failure> {
    let mut board = listen(port, true, sensors)?;
    let (mut readings, start): (Vec<Reading>, _) = (Vec::new(), Instant::now());
    let mut span_s = -1.0;
    // Within the first, a board tells what it is.
    while span_s < KNOWN_AFTER_S.max(seconds) {
        if start.elapsed().as_secs_f64() > seconds + link::PATIENCE_S {
            return Err(format!("no readings from the board for {seconds} s. {}", board.sentence()).into());
        }
        match board.next()? {
            Some(more) => readings.extend(more),
            None if span_s < seconds => return Err(format!("{ENDED}. {}", board.sentence()).into()),
            None => break,
        }
        span_s = readings.last().zip(readings.first()).map_or(-1.0, |(last, first)| last.t_s - first.t_s);
    }
    Ok((board.board(), readings))
}

/// What the terminal has told of a calibration.
struct Screen {
    kind: SensorKind,
    auto: bool,
    /// A line that is overwritten shows the present reading, on a terminal only.
    shows_reading: bool,
    instruction: String,
    /// The hand closes.
    closes: bool,
    points: usize,
    /// When the last point was taken.
    since: Instant,
}

impl Screen {
    fn new(kind: SensorKind, points: usize, auto: bool) -> Self {
        let shows_reading = std::io::stderr().is_terminal();
        Self { kind, auto, shows_reading, instruction: String::new(), closes: false, points, since: Instant::now() }
    }

    /// Prints changes: the last point, what was not taken, and what to do next.
    fn tell(&mut self, session: &mut CalibrationSession) -> Result<(), Failure> {
        if let Some(why) = session.take_refusal() {
            if self.auto {
                return Err(why.into());
            }
            self.clear_line();
            warn(&why);
        }
        if !session.is_begun() {
            return Ok(());
        }
        let (procedure, instruction) = (session.procedure(), session.instruction());
        let points = &procedure.record().points;
        if points.len() != self.points {
            self.clear_line();
            match points.last().filter(|_| points.len() > self.points) {
                Some(Point { stimulus, counts, spread, readings }) => {
                    let at = self.kind.with_unit(*stimulus);
                    note(&format!("  {at}: {counts:.1} counts, noise {spread:.1}, {readings} readings"));
                }
                None => {
                    let at = self.kind.with_unit(procedure.next().unwrap_or_default());
                    note(&format!("{at} removed: record it again"));
                }
            }
            (self.points, self.since) = (points.len(), Instant::now());
        }
        let instruction = match session.closing() {
            // It counts down.
            Some(_) if !self.closes => instruction,
            None if procedure.left() > 0 => format!("{instruction} ({} left)", procedure.left()),
            None if session.awaits_close() && !self.auto => "Press Enter, then close the empty hand".to_owned(),
            _ => return Ok(()),
        };
        self.closes = session.closing().is_some();
        if instruction != self.instruction {
            note(&instruction);
            self.instruction = instruction;
        }
        Ok(())
    }

    /// Ends an automatic calibration that waits for a change.
    fn check_patience(&self, session: &CalibrationSession) -> Result<(), Failure> {
        let waits = self.auto && self.since.elapsed().as_secs_f64() > AUTO_PATIENCE_S && session.closing().is_none();
        if !waits {
            return Ok(());
        }
        let procedure = session.procedure();
        let why = procedure.settled().map_or_else(|why| why.to_string(), |_| "the reading did not change".into());
        let at = procedure.next().map(|next| self.kind.with_unit(next)).unwrap_or_default();
        Err(format!("no point at {at}: {why}").into())
    }

    fn show_reading(&self, session: &CalibrationSession) {
        if !self.shows_reading {
            return;
        }
        let hint = if session.procedure().settled().is_ok() && !self.auto { ": press Enter" } else { "" };
        let _unseen = write!(std::io::stderr(), "{CLEAR_LINE}  {}{hint}", session.state());
    }

    fn clear_line(&self) {
        if self.shows_reading {
            let _unseen = write!(std::io::stderr(), "{CLEAR_LINE}");
        }
    }
}
