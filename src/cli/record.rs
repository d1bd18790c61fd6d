//! `palpate record`: records a trial of the real gripper.

use super::link;
use super::prelude::*;
use palpate_device::serial::{Baud, LinkOptions, LinkState, LinkStatus, PortInfo, list_ports};
use palpate_lab::gripper::SerialGripper;
use palpate_lab::recording::{RecordProgress, RecordedTrial, TrialRequest, record};
use palpate_sim::objects::class_of;
use palpate_sim::scene::Scene;
use palpate_store::labels::{FlagRemark, class_name, flaws, shown_title};
use palpate_tactile::board::Detected;
use palpate_tactile::trial::{BoardCourse, Control};

/// Arguments of `palpate record`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate record --list
  palpate record --object lemon --seconds 5
  palpate record --object lemon --drive --scene scene.toml
  palpate record --port grasp.bytes --speed 0 --json

Exit codes: 0 recorded, 1 failed or cut short, 2 wrong use

See also: palpate help gripper")]
pub(super) struct RecordArguments {
    /// Port, or file of captured bytes (default: the only likely port).
    #[arg(long, value_name = "PORT|FILE")]
    port: Option<PathBuf>,
    /// Duration (s) (default: until Ctrl+C, or as long as the programme takes).
    #[arg(long, value_name = "N", value_parser = within(0.1..=86_400.0))]
    seconds: Option<f64>,
    /// Label: the object in the hand, or "empty". Without it the trial stays unlabelled, and out of data sets, until
    /// `palpate trials label`.
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Drive the control box through the programme of the scene; needs Palpate's firmware.
    #[arg(long, conflicts_with = "by_hand")]
    drive: bool,
    /// You drive the control box by hand, in the phases of the programme, from the first reading on.
    #[arg(long)]
    by_hand: bool,
    /// Baud rate (default: try the usual ones).
    #[arg(long, value_name = "BAUD", value_parser = parse_baud)]
    baud: Option<Baud>,
    /// How long to wait while another program has the port (s).
    #[arg(long, value_name = "S", default_value_t = link::USUAL_WAIT_S, value_parser = within(0.0..=86_400.0))]
    wait: f64,
    /// End the trial when the board disappears, instead of waiting for it.
    #[arg(long)]
    no_reconnect: bool,
    /// Replay speed of a file; 0: as fast as possible.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    speed: f64,
    /// Scene file with the gripper and its programme.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// List ports and the devices on them, then exit.
    #[arg(long)]
    list: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn parse_baud(text: &str) -> Result<Baud, String> {
    Baud::try_from(text.parse::<u32>().map_err(|e| e.to_string())?).map_err(|e| e.to_string())
}

/// Output of `--json`.
#[derive(Serialize)]
struct RecordReport {
    trial_id: i64,
    /// Label; none for an unlabelled trial.
    object: Option<String>,
    port: String,
    /// Baud rate in use; none for captured bytes.
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
    /// Bytes and readings lost because this computer was too slow.
    dropped: [u64; 2],
    format: Option<String>,
    channels: Vec<String>,
    flags: Vec<FlagRemark>,
    warnings: Vec<String>,
    #[serde(skip)]
    detected: Option<Detected>,
}

pub(super) fn run(arguments: &RecordArguments, store: Option<&Path>) -> Result<(), Failure> {
    if arguments.list {
        return PortsReport(list_ports()).print(arguments.json);
    }
    let scene = match &arguments.scene {
        Some(path) => Scene::named_or_from_file(path)?,
        None => Scene::default(),
    };
    let object = arguments.object.as_deref().map(|name| class_name(class_of(name))).transpose()?;
    // Opened once here: a store that cannot be used is reported before the board is.
    let store = open_store(store)?;
    let sensors = store.calibrations().sensors()?;
    let store = store.path().to_owned();
    let stop = stop_flag()?;
    let options = LinkOptions {
        path: arguments.port.clone(),
        baud: arguments.baud,
        reconnect: !arguments.no_reconnect,
        sensors,
        replay_speed: if arguments.speed > 0.0 { arguments.speed } else { f64::INFINITY },
    };
    let link = link::open(&options, arguments.wait, &stop)?;
    let control = match (arguments.drive, arguments.by_hand) {
        (true, _) => Control::Driven,
        (false, true) => Control::ByHand,
        (false, false) => Control::Free,
    };
    let request = TrialRequest { object: object.clone(), control, length_s: arguments.seconds, adds: false };
    let bar = Progress::new("{elapsed} {msg}");
    let mut gripper = SerialGripper::new(Box::new(link));
    let outcome = record(&mut gripper, &scene, request, store, &stop, &mut |progress| {
        bar.0.set_message(progress_line(&progress));
        bar.0.tick();
    });
    drop(bar);
    let recording = outcome?;
    RecordReport::new(recording.trial, object, &recording.status).print(arguments.json)?;
    match recording.aborted {
        Some(cause) => Err(format!("the trial ended early, and is stored: {cause}").into()),
        None => Ok(()),
    }
}

fn progress_line(progress: &RecordProgress<'_>) -> String {
    let LinkStatus { cadence, state, .. } = progress.status;
    let state = match state {
        LinkState::Listening => String::new(),
        state => format!(" {}", state.sentence()),
    };
    let trial = progress.id.map_or_else(|| "trial".to_owned(), |id| format!("trial {id}"));
    format!(
        "{trial}: {} samples, {:.1} Hz, jitter {:.1} ms, {} lost, {} bad lines{state}",
        progress.samples, cadence.rate_hz, cadence.jitter_p95_ms, cadence.lost, cadence.bad_lines
    )
}

impl RecordReport {
    fn new(recorded: RecordedTrial, object: Option<String>, status: &LinkStatus) -> Self {
        let BoardCourse { cadence, reconnects, detected, board, .. } = recorded.about.course;
        Self {
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
            reconnects,
            dropped: status.dropped,
            format: detected.as_ref().map(|detected| detected.format.label().to_owned()),
            channels: board.channels,
            warnings: recorded.warnings,
            detected,
        }
    }
}

impl Report for RecordReport {
    fn text(&self, page: &mut Page) {
        self.warnings.iter().for_each(|warning| page.warn(warning));
        let object = shown_title(self.object.as_deref().unwrap_or_default());
        page.fact(format!("trial {}", self.trial_id), format!("{object} from {}", self.port));
        for found in &self.flags {
            page.fact("flagged", format!("{}: {}", found.flag.label(), found.remark));
        }
        page.fact("samples", format!("{} of {}", self.samples, self.channels.join(", ")));
        let speed = self.baud.map(|baud| format!(" at {baud} baud")).unwrap_or_default();
        let detected = self.detected.as_ref();
        page.fact("format", detected.map(|detected| format!("{}{speed}: {}", detected.format.label(), detected.why)));
        let (rate, jitter, delay) = (self.rate_hz, self.jitter_p95_ms, self.delay_p95_ms);
        let cadence = format!("{rate:.2} Hz, jitter {jitter:.2} ms, delay {delay:.2} ms [95th percentiles]");
        page.fact("cadence", cadence);
        page.fact("clock", self.drift_ppm.map(|drift| format!("drifts by {drift:+.0} ppm against this computer")));
        let Self { lost, bad_lines, gaps, reconnects, .. } = self;
        let lost = format!("{lost} readings in {gaps} gaps, {bad_lines} bad lines, {reconnects} reconnects");
        page.fact("lost", lost);
    }
}

/// Output of `--list`.
#[derive(Serialize)]
struct PortsReport(Vec<PortInfo>);

impl Report for PortsReport {
    fn text(&self, page: &mut Page) {
        if self.0.is_empty() {
            return page.line("no serial ports: is the board connected?");
        }
        page.table(
            &["port", "device"],
            self.0.iter().map(|port| [port.path.display().to_string(), port.title.clone()]),
        );
    }
}
