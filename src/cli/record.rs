//! `palpate record`: what the real gripper's board sends, as a trial in the store.

use super::Failure;
use super::interrupt::stop_flag;
use super::setup::open_store;
use super::terminal::{say, say_json, table, warn};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_core::objects::EMPTY;
use palpate_core::recording::{BoardRecorder, BoardTrialPlan, Recorded, Store};
use palpate_core::rig::serial::{Baud, LinkEvent, LinkOptions, LinkState, LinkStatus, SerialLink, list_ports};
use palpate_core::scene::Scene;
use palpate_core::wire::Heard;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Arguments of `palpate record`.
#[derive(Debug, clap::Args)]
pub(super) struct RecordArguments {
    /// The port, a link to one, or a file of captured bytes; without it the only port that looks like the board.
    #[arg(long, value_name = "PORT|FILE")]
    port: Option<PathBuf>,
    /// How long to record (s); without it until Ctrl+C.
    #[arg(long, value_name = "N", value_parser = parse_seconds)]
    seconds: Option<f64>,
    /// What is in the hand.
    #[arg(long, value_name = "NAME", default_value = EMPTY)]
    object: String,
    /// The speed of the port; without it the usual ones are tried.
    #[arg(long, value_name = "BAUD", value_parser = parse_baud)]
    baud: Option<Baud>,
    /// End the trial where the board vanishes, instead of waiting for it.
    #[arg(long)]
    no_reconnect: bool,
    /// How fast a file is played; 0 for as fast as it can be read.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    speed: f64,
    /// A scene file that says which gripper this is and what its control box does.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// List the ports and what is plugged into them, and record nothing.
    #[arg(long)]
    list: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s: &f64| (0.1..=86_400.0).contains(s));
    seconds.ok_or_else(|| "write a number of seconds from 0.1 to 86400".to_owned())
}

fn parse_baud(text: &str) -> Result<Baud, String> {
    Baud::try_from(text.parse::<u32>().map_err(|e| e.to_string())?)
}

/// How long the board may take to send its first readings before the trial begins.
const FIRST_READING: Duration = Duration::from_secs(20);
/// How often the link is asked.
const PATIENCE: Duration = Duration::from_millis(50);

/// What `--json` prints.
#[derive(Serialize)]
struct Told {
    trial_id: i64,
    object: String,
    port: String,
    samples: u64,
    lost: u64,
    bad_lines: u64,
    gaps: u64,
    rate_hz: f64,
    jitter_p95_ms: f64,
    delay_p95_ms: f64,
    drift_ppm: Option<f64>,
    reconnects: u32,
    /// Bytes and readings that this computer was too slow to take.
    dropped: [u64; 2],
    format: Option<String>,
    channels: Vec<String>,
    warnings: Vec<String>,
}

pub(super) fn run(arguments: &RecordArguments, store: Option<&Path>) -> Result<(), Failure> {
    if arguments.list {
        return list(arguments.json);
    }
    let scene = match &arguments.scene {
        Some(path) => Scene::from_file(path)?,
        None => Scene::default(),
    };
    let mut store = open_store(store)?;
    let stop = stop_flag()?;
    let link = SerialLink::open(&LinkOptions {
        path: arguments.port.clone(),
        baud: arguments.baud,
        reconnect: !arguments.no_reconnect,
        replay_speed: if arguments.speed > 0.0 { arguments.speed } else { f64::INFINITY },
    })?;
    // The board says what it is when it starts, and again when it is asked; one that does not listen minds nothing.
    if let Err(error) = link.send("?") {
        tracing::debug!("{error}");
    }
    let first = wait_for_readings(&link, &stop)?;
    let plan = BoardTrialPlan { object: arguments.object.clone(), scene: scene.to_toml(), seconds: arguments.seconds };
    let (recorded, status) = record(&mut store, &plan, &link, first, &stop)?;
    tell(recorded, &plan.object, &status, arguments.json)
}

/// Everything heard up to the first readings; the trial begins with them.
fn wait_for_readings(link: &SerialLink, stop: &AtomicBool) -> Result<Vec<LinkEvent>, Failure> {
    let start = Instant::now();
    let mut events = Vec::new();
    loop {
        events.extend(link.take(PATIENCE));
        if events.iter().any(|event| matches!(event, LinkEvent::Heard(Heard::Reading(_)))) {
            return Ok(events);
        }
        let status = link.status();
        let given_up = start.elapsed() > FIRST_READING || stop.load(Ordering::Relaxed) || link.is_over();
        if given_up {
            let port = status.port.path.display();
            return Err(format!("nothing was recorded from \"{port}\": {}", status.state.sentence()).into());
        }
        // A board that is not there, or cannot be understood, has had its chance by then.
        if matches!(status.state, LinkState::Unreadable { .. }) && start.elapsed() > FIRST_READING / 2 {
            return Err(status.state.sentence().into());
        }
    }
}

fn record(
    store: &mut Store,
    plan: &BoardTrialPlan,
    link: &SerialLink,
    first: Vec<LinkEvent>,
    stop: &AtomicBool,
) -> Result<(Recorded, LinkStatus), Failure> {
    let time = |event: &LinkEvent| match event {
        LinkEvent::Heard(Heard::Reading(reading)) => Some(reading.t_s),
        LinkEvent::Heard(_) | LinkEvent::Captured(_) => None,
    };
    let began_s = first.iter().find_map(time).unwrap_or(0.0);
    let mut recorder = BoardRecorder::begin(store, plan, &link.status(), began_s)?;
    // It draws on standard error, and only on a terminal.
    let bar = ProgressBar::new_spinner().with_style(ProgressStyle::with_template("{elapsed} {msg}")?);
    let end_s = plan.seconds.map_or(f64::INFINITY, |seconds| began_s + seconds);
    let mut events = first;
    let mut over = false;
    loop {
        for event in events {
            // The bytes of the reading that ends it are in; what follows is not part of it.
            over |= time(&event).is_some_and(|t_s| t_s >= end_s);
            if !over {
                recorder.take(event);
            }
        }
        if recorder.is_due() {
            recorder.flush(store)?;
            bar.set_message(progress(&recorder, &link.status()));
        }
        // A board that is silent to the end must not keep the trial open.
        over |= link.is_over()
            || stop.load(Ordering::Relaxed)
            || (link.status().baud.is_some() && link.now_s() >= end_s + 0.5);
        if over {
            break;
        }
        events = link.take(PATIENCE);
    }
    bar.finish_and_clear();
    let status = link.status();
    Ok((recorder.finish(store, &status)?, status))
}

fn progress(recorder: &BoardRecorder, status: &LinkStatus) -> String {
    let cadence = &status.cadence;
    let state = match &status.state {
        LinkState::Listening => String::new(),
        state => format!(" {}", state.sentence()),
    };
    format!(
        "trial {}: {} samples, {:.1} Hz, jitter {:.1} ms, {} lost, {} bad lines{state}",
        recorder.id(),
        recorder.samples(),
        cadence.rate_hz,
        cadence.jitter_p95_ms,
        cadence.lost,
        cadence.bad_lines
    )
}

fn tell(recorded: Recorded, object: &str, status: &LinkStatus, json: bool) -> Result<(), Failure> {
    let cadence = recorded.about.cadence;
    let told = Told {
        trial_id: recorded.id,
        object: object.to_owned(),
        port: recorded.about.port,
        samples: cadence.samples,
        lost: cadence.lost,
        bad_lines: cadence.bad_lines,
        gaps: cadence.gaps,
        rate_hz: cadence.rate_hz,
        jitter_p95_ms: cadence.jitter_p95_ms,
        delay_p95_ms: cadence.delay_p95_ms,
        drift_ppm: cadence.drift_ppm,
        reconnects: recorded.about.reconnects,
        dropped: status.dropped,
        format: recorded.about.detected.as_ref().map(|detected| detected.format.label().to_owned()),
        channels: recorded.about.board.channels,
        warnings: recorded.warnings,
    };
    if json {
        return say_json(&told);
    }
    for warning in &told.warnings {
        warn(warning);
    }
    say(format!("trial {}      {} from {}", told.trial_id, told.object, told.port))?;
    say(format!("samples       {} of {}", told.samples, told.channels.join(", ")))?;
    if let Some(detected) = &recorded.about.detected {
        say(format!("format        {}: {}", detected.format.label(), detected.why))?;
    }
    let (rate, jitter, delay) = (told.rate_hz, told.jitter_p95_ms, told.delay_p95_ms);
    say(format!("cadence       {rate:.2} Hz, jitter {jitter:.2} ms, delay {delay:.2} ms [95th percentiles]"))?;
    if let Some(drift) = told.drift_ppm {
        say(format!("clock         the board's runs {drift:+.0} ppm against this computer's"))?;
    }
    let (lost, bad, gaps) = (told.lost, told.bad_lines, told.gaps);
    say(format!("lost          {lost} readings in {gaps} gaps, {bad} bad lines, {} reconnects", told.reconnects))
}

fn list(json: bool) -> Result<(), Failure> {
    let ports = list_ports();
    if json {
        return say_json(&ports);
    }
    if ports.is_empty() {
        return say("no serial ports: is the board plugged in?");
    }
    let cells: Vec<Vec<String>> =
        ports.iter().map(|port| vec![port.path.display().to_string(), port.title.clone()]).collect();
    table(&["port", "what"], &cells)
}
