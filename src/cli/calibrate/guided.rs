//! Calibrating with the board connected: asks for the next angle or weight, watches until the reading has settled, and takes it
//! when told to, or by itself.

use super::super::Failure;
use super::super::link;
use super::super::terminal::{note, typed_lines, warn};
use super::CalibrateArguments;
use palpate_device::serial::{LinkEvent, LinkOptions, LinkState, SerialLink};
use palpate_device::wire::Heard;
use palpate_store::Store;
use palpate_tactile::board::{Board, KNOWN_AFTER, KNOWN_AFTER_S, Reading, Sensor};
use palpate_tactile::calibration::{BendingZero, Calibration, EmptyClose, Procedure, Record, SensorKind, Unsettled};
use std::collections::VecDeque;
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Where the readings come from, and who says when.
#[derive(Debug, clap::Args)]
pub(super) struct LiveArguments {
    /// The port of the board, or a file of captured bytes; the only likely port where it is left out.
    #[arg(long, value_name = "PORT|FILE")]
    port: Option<PathBuf>,
    /// Angles (degrees) or weights (kg) to set, separated by commas, instead of the usual ones.
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', conflicts_with = "points")]
    plan: Vec<f64>,
    /// Take each point by itself, as soon as the reading has changed and settled; without it, Enter takes it.
    #[arg(long)]
    auto: bool,
    /// Of a pad: watch the empty hand close for so many seconds afterwards, to learn how its zero moves with bending. The
    /// strip of the same finger must be calibrated.
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    pub(super) empty_close: Option<f64>,
}

impl LiveArguments {
    /// Where points come from a file, the board is only needed for an empty close.
    pub(super) fn refuse_beside_points(&self) -> Result<(), Failure> {
        let given = [("--port", self.port.is_some()), ("--auto", self.auto)].into_iter().find(|(_, given)| *given);
        given.map_or(Ok(()), |(name, _)| {
            Err(format!("{name} is of no use here: the points come from a file. Leave it out, or add --empty-close")
                .into())
        })
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s: &f64| (1.0..=600.0).contains(s));
    seconds.ok_or_else(|| "write a number of seconds from 1 to 600".to_owned())
}

/// How long a board may take to say what it is (s).
const PATIENCE_S: f64 = 8.0;

/// How long a hands-free procedure waits for a change (s).
const AUTO_PATIENCE_S: f64 = 60.0;

/// The board, and whoever sits at the keyboard.
struct Bench {
    link: SerialLink,
    keys: Receiver<String>,
    shows_progress: bool,
    state: LinkState,
    /// Readings that came and were not looked at yet.
    pending: VecDeque<Reading>,
}

/// What was typed.
enum Wish {
    Take(Option<f64>),
    Skip,
    Undo,
    Quit,
}

pub(super) fn record(
    arguments: &CalibrateArguments,
    sensor: Sensor,
    part: &str,
    store: &Store,
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
        "calibrating \"{part}\", the {}; Enter takes a point, a number takes it as that angle or weight,",
        sensor.label()
    ));
    note("s leaves it out, u takes the last one back, q ends");
    while procedure.next().is_some() {
        bench.one_point(&mut procedure, live.auto)?;
    }
    let record = procedure.record().clone();
    match live.empty_close {
        Some(seconds) => with_empty_close(&mut bench, record, sensor, store, live.auto, seconds),
        None => Ok(record),
    }
}

/// A pad whose points are known already, with the zero that bending gives it.
pub(super) fn watch_empty_close(
    live: &LiveArguments,
    seconds: f64,
    sensor: Sensor,
    record: Record,
    store: &Store,
) -> Result<Record, Failure> {
    let mut bench = Bench::open(live.port.as_deref(), live.auto)?;
    bench.board()?;
    with_empty_close(&mut bench, record, sensor, store, live.auto, seconds)
}

fn with_empty_close(
    bench: &mut Bench,
    record: Record,
    sensor: Sensor,
    store: &Store,
    auto: bool,
    seconds: f64,
) -> Result<Record, Failure> {
    let pad = Calibration::fit(record.clone())?;
    let serving = store.serving(None, &[])?.calibrations;
    let close = EmptyClose::begin(&bench.link.status().board, (sensor, pad), &serving, seconds)?;
    Ok(Record { bending: Some(bench.empty_close(close, auto)?), ..record })
}

/// The board, and what it sends for some seconds.
pub(super) fn watch(port: Option<&Path>, seconds: f64) -> Result<(Board, Vec<Reading>), Failure> {
    let mut bench = Bench::open(port, true)?;
    bench.board()?;
    let mut readings: Vec<Reading> = Vec::new();
    let start = Instant::now();
    while readings.last().zip(readings.first()).is_none_or(|(last, first)| last.t_s - first.t_s < seconds) {
        if start.elapsed().as_secs_f64() > seconds + PATIENCE_S {
            return Err(format!("the board fell silent. {}", bench.state.sentence()).into());
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

    /// What the board is, once enough was heard of it.
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
                let said = self.link.status().state.sentence();
                return Err(format!("no readings from the board within {PATIENCE_S:.0} s. {said}").into());
            }
        }
    }

    /// Takes in what has come since the last call; says when the link changes its state.
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
            return Err(
                format!("the board's stream is over before all points were taken. {}", self.state.sentence()).into()
            );
        }
        let reading = |event| match event {
            LinkEvent::Heard(Heard::Reading(reading)) => Some(reading),
            LinkEvent::Heard(Heard::Gap(_) | Heard::Board(_) | Heard::Said(_)) | LinkEvent::Captured(_) => None,
        };
        self.pending.extend(events.into_iter().filter_map(reading));
        Ok(())
    }

    fn wish(&self) -> Result<Option<Wish>, Failure> {
        let line = match self.keys.try_recv() {
            Ok(line) => line,
            Err(TryRecvError::Empty) => return Ok(None),
            Err(TryRecvError::Disconnected) => {
                return Err(
                    "standard input has ended: nobody is there to set angles or weights; --auto needs nobody".into()
                );
            }
        };
        Ok(match line.trim() {
            "" => Some(Wish::Take(None)),
            "s" => Some(Wish::Skip),
            "u" => Some(Wish::Undo),
            "q" => Some(Wish::Quit),
            text => match text.parse::<f64>() {
                Ok(number) => Some(Wish::Take(Some(number))),
                Err(_) => {
                    warn(&format!("\"{text}\" is not understood: Enter, a number, s, u or q"));
                    None
                }
            },
        })
    }

    /// One step of the procedure: a point taken, left out or taken back.
    fn one_point(&mut self, procedure: &mut Procedure, auto: bool) -> Result<(), Failure> {
        let Some(planned) = procedure.next() else { return Ok(()) };
        let kind = procedure.record().kind;
        note(&format!("{} ({} left)", procedure.instruction(), procedure.left()));
        let start = Instant::now();
        loop {
            // One by one, so that a hands-free procedure sees each plateau however fast the stream is.
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
                    let why =
                        procedure.settled().err().map_or_else(|| "nothing has changed".to_owned(), |e| e.to_string());
                    return Err(format!("{} was not seen: {why}", kind.with_unit(planned)).into());
                }
                continue;
            }
            match self.wish()? {
                None => {}
                Some(Wish::Take(number)) => {
                    let stimulus = number.map_or(planned, |number| kind.stimulus(number));
                    match self.take(procedure, stimulus) {
                        Ok(()) => return Ok(()),
                        Err(why) => {
                            self.clear_line();
                            warn(&format!("{} is not taken: {why}", kind.with_unit(stimulus)));
                        }
                    }
                }
                Some(Wish::Skip) => {
                    procedure.skip();
                    return Ok(());
                }
                Some(Wish::Undo) => {
                    let undone = procedure.undo().map(|point| kind.with_unit(point.stimulus));
                    note(
                        &undone.map_or_else(
                            || "there is no point yet".to_owned(),
                            |at| format!("{at} is to be taken again"),
                        ),
                    );
                    return Ok(());
                }
                Some(Wish::Quit) => return Err("ended by you; nothing was stored".into()),
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

    /// The reading as it stands, on a line that is written over; nothing where nobody looks.
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

    /// How the zero of a pad moves while its finger bends.
    fn empty_close(&mut self, mut close: EmptyClose, auto: bool) -> Result<BendingZero, Failure> {
        note(&close.instruction());
        if !auto {
            note("press Enter and begin");
            while self.wish()?.is_none() {
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
