//! Guided calibration with the board connected: asks for the next angle or weight, waits until the reading has settled, and
//! records the point on Enter or automatically.

use super::super::Failure;
use super::super::link;
use super::super::setup::within;
use super::super::terminal::{note, typed_lines, warn};
use super::CalibrateArguments;
use palpate_device::protocol::DecodedEvent;
use palpate_device::serial::{LinkEvent, LinkOptions, LinkState, SerialLink};
use palpate_store::Store;
use palpate_tactile::board::{Board, KNOWN_AFTER, KNOWN_AFTER_S, Reading, Sensor};
use palpate_tactile::calibration::{
    BendingZero, Calibration, EmptyClose, Point, Procedure, Record, SensorKind, Unsettled,
};
use std::collections::VecDeque;
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

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

/// How long to wait for the first readings (s).
const PATIENCE_S: f64 = 8.0;

/// How long an automatic procedure waits for a change (s).
const AUTO_PATIENCE_S: f64 = 60.0;

/// The board and the keyboard.
struct Bench {
    link: SerialLink,
    keys: Receiver<String>,
    shows_progress: bool,
    state: LinkState,
    /// Readings received and not yet processed.
    pending: VecDeque<Reading>,
}

/// A typed command.
enum Input {
    Take(Option<f64>),
    Skip,
    Undo,
    Quit,
}

pub(super) fn record(
    arguments: &CalibrateArguments,
    sensor: Sensor,
    part: &str,
    store: Option<&Store>,
) -> Result<Record, Failure> {
    let live = &arguments.live;
    let mut bench = Bench::open(live.port.as_deref(), live.auto)?;
    let board = bench.board()?;
    let mut procedure = Procedure::new(&board, sensor, part, arguments.resistor).ok_or_else(|| {
        let (wanted, has) = (sensor.channel(), board.channels.join(", "));
        format!(
            "the board has no channel \"{wanted}\"; it has {has}. Name its channels in the sketch, or in a header line"
        )
    })?;
    if !live.plan.is_empty() {
        let plan: Vec<f64> = live.plan.iter().map(|shown| SensorKind::of(sensor).stimulus(*shown)).collect();
        procedure = procedure.with_plan(&plan);
    }
    note(&format!(
        "Calibrating \"{part}\", the {}. Enter records a point; a number records it as that angle or weight;",
        sensor.label()
    ));
    note("s skips it, u undoes the last one, q quits.");
    while procedure.next().is_some() {
        bench.one_point(&mut procedure, live.auto)?;
    }
    let record = procedure.record().clone();
    match live.empty_close {
        Some(seconds) => with_empty_close(&mut bench, record, sensor, store, live.auto, seconds),
        None => Ok(record),
    }
}

/// Reads a pad under a known weight (kg): on Enter, or as soon as it has settled.
pub(in crate::cli) fn weigh(port: Option<&Path>, sensor: Sensor, kg: f64, auto: bool) -> Result<Point, Failure> {
    let mut bench = Bench::open(port, auto)?;
    let board = bench.board()?;
    let force = SensorKind::Pad.stimulus(kg);
    let procedure = Procedure::new(&board, sensor, "weighed", None);
    let mut procedure =
        procedure.ok_or_else(|| format!("the board has no channel \"{}\"", sensor.channel()))?.with_plan(&[force]);
    if !auto {
        note(&format!("Press Enter once the weight lies on the {}.", sensor.label()));
    }
    while procedure.next().is_some() {
        bench.one_point(&mut procedure, auto)?;
    }
    Ok(*procedure.record().points.last().ok_or("no weight was measured")?)
}

/// Adds an empty close to a pad whose points come from a file.
pub(super) fn watch_empty_close(
    live: &LiveArguments,
    seconds: f64,
    sensor: Sensor,
    record: Record,
    store: Option<&Store>,
) -> Result<Record, Failure> {
    let mut bench = Bench::open(live.port.as_deref(), live.auto)?;
    bench.board()?;
    with_empty_close(&mut bench, record, sensor, store, live.auto, seconds)
}

fn with_empty_close(
    bench: &mut Bench,
    record: Record,
    sensor: Sensor,
    store: Option<&Store>,
    auto: bool,
    seconds: f64,
) -> Result<Record, Failure> {
    let pad = Calibration::fit(record.clone())?;
    let serving = store.map(|store| store.calibrations().serving(None, &[])).transpose()?;
    let serving = serving.map(|serving| serving.calibrations).unwrap_or_default();
    let close = EmptyClose::begin(&bench.link.status().board, (sensor, pad), &serving, seconds)?;
    Ok(Record { bending: Some(bench.empty_close(close, auto)?), ..record })
}

/// Listens for some seconds; returns the board and its readings.
pub(super) fn watch(port: Option<&Path>, seconds: f64) -> Result<(Board, Vec<Reading>), Failure> {
    let mut bench = Bench::open(port, true)?;
    bench.board()?;
    let mut readings: Vec<Reading> = Vec::new();
    let start = Instant::now();
    while readings.last().zip(readings.first()).is_none_or(|(last, first)| last.t_s - first.t_s < seconds) {
        if start.elapsed().as_secs_f64() > seconds + PATIENCE_S {
            return Err(format!("the board stopped sending. {}", bench.state.sentence()).into());
        }
        bench.listen()?;
        readings.extend(bench.pending.drain(..));
    }
    Ok((bench.link.status().board, readings))
}

impl Bench {
    fn open(port: Option<&Path>, hands_free: bool) -> Result<Self, Failure> {
        let captured = port.is_some_and(Path::is_file);
        let replay_speed = if captured && hands_free { f64::INFINITY } else { 1.0 };
        let path = port.map(Path::to_owned);
        let link =
            link::open(&LinkOptions { path, replay_speed, ..LinkOptions::default() }, link::USUAL_WAIT_S, || false)?;
        let keys = if hands_free { channel().1 } else { typed_lines()? };
        Ok(Self {
            link,
            keys,
            shows_progress: std::io::stderr().is_terminal(),
            state: LinkState::Waiting,
            pending: VecDeque::new(),
        })
    }

    /// Waits until the channels of the board are known.
    fn board(&mut self) -> Result<Board, Failure> {
        let start = Instant::now();
        loop {
            self.listen()?;
            let over = self.link.is_over() && !self.pending.is_empty();
            let span_s =
                self.pending.back().zip(self.pending.front()).map_or(0.0, |(last, first)| last.t_s - first.t_s);
            if over || (self.pending.len() >= KNOWN_AFTER as usize && span_s >= KNOWN_AFTER_S) {
                return Ok(self.link.status().board);
            }
            if start.elapsed().as_secs_f64() > PATIENCE_S {
                let state = self.link.status().state.sentence();
                return Err(format!("no readings from the board within {PATIENCE_S:.0} s. {state}").into());
            }
        }
    }

    /// Receives readings; reports changes of the link.
    fn listen(&mut self) -> Result<(), Failure> {
        let events = self.link.take(Duration::from_millis(100));
        let state = self.link.status().state;
        if state != self.state {
            if !matches!(state, LinkState::Listening | LinkState::Ended { .. }) {
                note(&state.sentence());
            }
            self.state = state;
        }
        if events.is_empty() && self.pending.is_empty() && self.link.is_over() {
            return Err(format!("the stream ended before all points were recorded. {}", self.state.sentence()).into());
        }
        let reading = |event| match event {
            LinkEvent::Decoded(DecodedEvent::Reading(reading)) => Some(reading),
            LinkEvent::Decoded(DecodedEvent::Gap(_) | DecodedEvent::Board(_) | DecodedEvent::Reply(_))
            | LinkEvent::Captured(_) => None,
        };
        self.pending.extend(events.into_iter().filter_map(reading));
        Ok(())
    }

    fn input(&self) -> Result<Option<Input>, Failure> {
        let line = match self.keys.try_recv() {
            Ok(line) => line,
            Err(TryRecvError::Empty) => return Ok(None),
            Err(TryRecvError::Disconnected) => {
                return Err("standard input has ended; use --auto to record without a keyboard".into());
            }
        };
        Ok(match line.trim() {
            "" => Some(Input::Take(None)),
            "s" => Some(Input::Skip),
            "u" => Some(Input::Undo),
            "q" => Some(Input::Quit),
            text => match text.parse::<f64>() {
                Ok(number) => Some(Input::Take(Some(number))),
                Err(_) => {
                    warn(&format!("unknown input \"{text}\": press Enter, or type a number, s, u or q"));
                    None
                }
            },
        })
    }

    /// Runs one step of the procedure: records, skips or undoes a point.
    fn one_point(&mut self, procedure: &mut Procedure, auto: bool) -> Result<(), Failure> {
        let Some(planned) = procedure.next() else { return Ok(()) };
        let kind = procedure.record().kind;
        note(&format!("{} ({} left)", procedure.instruction(), procedure.left()));
        let start = Instant::now();
        loop {
            // One by one, so that an automatic procedure sees each plateau however fast the stream is.
            self.listen()?;
            procedure.see(&self.link.status().board);
            while let Some(reading) = self.pending.pop_front() {
                procedure.feed(&reading);
                if auto && procedure.has_changed() && procedure.settled().is_ok() {
                    return Ok(self.take(procedure, planned)?);
                }
            }
            self.show(procedure);
            if auto {
                if start.elapsed().as_secs_f64() > AUTO_PATIENCE_S {
                    let why = procedure
                        .settled()
                        .err()
                        .map_or_else(|| "the reading did not change".to_owned(), |e| e.to_string());
                    return Err(format!("no point at {}: {why}", kind.with_unit(planned)).into());
                }
                continue;
            }
            match self.input()? {
                None => {}
                Some(Input::Take(number)) => {
                    let stimulus = number.map_or(planned, |number| kind.stimulus(number));
                    match self.take(procedure, stimulus) {
                        Ok(()) => return Ok(()),
                        Err(why) => {
                            self.clear_line();
                            warn(&format!("{} not recorded: {why}", kind.with_unit(stimulus)));
                        }
                    }
                }
                Some(Input::Skip) => {
                    procedure.skip();
                    return Ok(());
                }
                Some(Input::Undo) => {
                    let undone = procedure.undo().map(|point| kind.with_unit(point.stimulus));
                    note(
                        &undone.map_or_else(
                            || "no point to undo".to_owned(),
                            |at| format!("{at} removed: record it again"),
                        ),
                    );
                    return Ok(());
                }
                Some(Input::Quit) => return Err("cancelled; nothing was stored".into()),
            }
        }
    }

    fn take(&self, procedure: &mut Procedure, stimulus: f64) -> Result<(), Unsettled> {
        let point = procedure.take(stimulus)?;
        self.clear_line();
        let at = procedure.record().kind.with_unit(stimulus);
        note(&format!("  {at}: {:.1} counts, noise {:.1}, {} readings", point.counts, point.spread, point.readings));
        Ok(())
    }

    /// Shows the present reading on a line that is overwritten, on a terminal only.
    fn show(&self, procedure: &Procedure) {
        if !self.shows_progress {
            return;
        }
        let counts = procedure.latest().map_or_else(|| "–".to_owned(), |counts| format!("{counts:.0}"));
        let state = match procedure.settled() {
            Ok(point) => format!("settled at {:.1}: press Enter", point.counts),
            Err(why) => why.to_string(),
        };
        let _unseen = write!(std::io::stderr(), "\r\x1b[K  {counts} counts, {state}");
    }

    fn clear_line(&self) {
        if self.shows_progress {
            let _unseen = write!(std::io::stderr(), "\r\x1b[K");
        }
    }

    /// Measures how bending shifts the zero of a pad.
    fn empty_close(&mut self, mut close: EmptyClose, auto: bool) -> Result<BendingZero, Failure> {
        note(&close.instruction());
        if !auto {
            note("Press Enter, then close the hand");
            while self.input()?.is_none() {
                self.listen()?;
            }
            self.pending.clear();
        }
        loop {
            self.listen()?;
            while let Some(reading) = self.pending.pop_front() {
                if close.feed(&reading) {
                    return Ok(close.bending()?);
                }
            }
        }
    }
}
