//! `palpate record`: what the real gripper's board sends, as a trial in the store.

use super::Failure;
use super::interrupt::stop_flag;
use super::link;
use super::setup::open_store;
use super::terminal::{say, say_json, table, warn};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_device::serial::{Baud, LinkOptions, LinkState, LinkStatus, list_ports};
use palpate_lab::grasping::record_board;
use palpate_lab::gripper::{SerialPlan, SerialRig};
use palpate_lab::recording::{BoardRecorder, BoardTrialPlan, Recorded};
use palpate_sim::scene::Scene;
use palpate_store::labels::{FlagRemark, class_name, flaws, shown_name};
use palpate_tactile::trial::Control;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// Arguments of `palpate record`.
#[derive(Debug, clap::Args)]
pub(super) struct RecordArguments {
    /// The port, a link to one, or a file of captured bytes; without it the only port that looks like the board.
    #[arg(long, value_name = "PORT|FILE")]
    port: Option<PathBuf>,
    /// How long to record (s); without it until Ctrl+C, or for as long as the programme takes.
    #[arg(long, value_name = "N", value_parser = parse_seconds)]
    seconds: Option<f64>,
    /// What is in the hand; "empty" for nothing. Without it `palpate trials label` says so later, and until then no data set
    /// takes the trial.
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Let the board drive the control box through the programme of the scene: P, K and V lines, as our firmware takes them.
    #[arg(long, conflicts_with = "by_hand")]
    drive: bool,
    /// You drive the control box by hand, in the phases of the programme, beginning with the first reading.
    #[arg(long)]
    by_hand: bool,
    /// The speed of the port; without it the usual ones are tried.
    #[arg(long, value_name = "BAUD", value_parser = parse_baud)]
    baud: Option<Baud>,
    /// How long to wait for a port that another program has (s).
    #[arg(long, value_name = "S", default_value_t = link::USUAL_WAIT_S, value_parser = parse_wait)]
    wait: f64,
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

fn parse_wait(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s: &f64| (0.0..=86_400.0).contains(s));
    seconds.ok_or_else(|| "write a number of seconds from 0 to 86400".to_owned())
}

pub(super) fn parse_baud(text: &str) -> Result<Baud, String> {
    Baud::try_from(text.parse::<u32>().map_err(|e| e.to_string())?).map_err(|e| e.to_string())
}

/// What `--json` prints.
#[derive(Serialize)]
struct Told {
    trial_id: i64,
    /// Its label, unless it has none yet.
    object: Option<String>,
    port: String,
    /// The speed in use (bit/s); none for captured bytes.
    baud: Option<u32>,
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
    flags: Vec<FlagRemark>,
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
    let object = arguments.object.as_deref().map(class_name).transpose()?;
    let mut store = open_store(store)?;
    let stop = stop_flag()?;
    let options = LinkOptions {
        path: arguments.port.clone(),
        baud: arguments.baud,
        reconnect: !arguments.no_reconnect,
        replay_speed: if arguments.speed > 0.0 { arguments.speed } else { f64::INFINITY },
    };
    let link = link::open(&options, arguments.wait, || stop.load(Ordering::Relaxed))?;
    let control = match (arguments.drive, arguments.by_hand) {
        (true, _) => Control::Driven,
        (false, true) => Control::ByHand,
        (false, false) => Control::Free,
    };
    let actuation_hz = f64::from(scene.timing.actuation_hz);
    let programme_s = f64::from(scene.programme.total_ticks()) / actuation_hz;
    let seconds = arguments.seconds.or((control != Control::Free).then_some(programme_s));
    let rig = SerialRig::begin(link, SerialPlan { control, actuation_hz, seconds }, stop)?;
    let plan = BoardTrialPlan { object: object.clone().unwrap_or_default(), scene: scene.to_toml(), seconds };
    // It draws on standard error, and only on a terminal.
    let bar = ProgressBar::new_spinner().with_style(ProgressStyle::with_template("{elapsed} {msg}")?);
    let outcome = record_board(rig, &scene.programme, &plan, &mut store, &mut |recorder, status| {
        bar.set_message(progress(recorder, status));
        bar.tick();
    });
    bar.finish_and_clear();
    let grasp = outcome?;
    tell(grasp.recorded, object, &grasp.status, arguments.json)?;
    if grasp.cut {
        Err("the fingers did not do what they were told, so the trial ended early; it is stored".into())
    } else {
        Ok(())
    }
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

fn tell(recorded: Recorded, object: Option<String>, status: &LinkStatus, json: bool) -> Result<(), Failure> {
    let cadence = recorded.about.cadence;
    let told = Told {
        trial_id: recorded.id,
        flags: flaws(recorded.about.flags, object.as_deref()),
        object,
        port: recorded.about.port,
        baud: status.baud,
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
    let object = shown_name(told.object.as_deref().unwrap_or_default());
    say(format!("trial {}      {object} from {}", told.trial_id, told.port))?;
    for found in &told.flags {
        say(format!("flagged       {}: {}", found.flag.label(), found.remark))?;
    }
    say(format!("samples       {} of {}", told.samples, told.channels.join(", ")))?;
    if let Some(detected) = &recorded.about.detected {
        let speed = told.baud.map(|baud| format!(" at {baud} baud")).unwrap_or_default();
        say(format!("format        {}{speed}: {}", detected.format.label(), detected.why))?;
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
