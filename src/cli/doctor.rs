//! `palpate doctor`: diagnoses the connection between the gripper's board and this computer.

use super::link::Listener;
use super::prelude::*;
use clap::builder::{PathBufValueParser, TypedValueParser};
use palpate_device::doctor::{
    Bleed, CheckFinding, CheckStatus, CrosstalkTest, SKETCH, USUAL_LISTEN_S, WIRING_PAGE, examine, findings,
    firmware_header, is_sound, not_checked, summary, write_sketch,
};
use palpate_device::serial::{Baud, LinkOptions};
use palpate_tactile::board::SensorList;
use std::process::ExitCode;
use std::time::Duration;

/// Arguments of `palpate doctor`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate doctor
  palpate doctor /dev/ttyACM0 --seconds 10
  palpate doctor --crosstalk
  palpate doctor --wiring
  palpate doctor --sketch due_gripper
  palpate doctor /dev/ttyACM0 --gripper-file > mine.toml

Exit codes: 0 no fault in what was seen, 1 something is wrong, 2 wrong use")]
pub(super) struct DoctorArguments {
    /// Port, or file of captured bytes (default: the only likely port).
    port: Option<PathBuf>,
    /// How long to listen (s). Bend each finger and press each pad meanwhile: what does not move is not checked. A file is
    /// read whole.
    #[arg(long, value_name = "S", default_value_t = USUAL_LISTEN_S, value_parser = within(1.0..=600.0))]
    seconds: f64,
    /// Baud rate (default: try the usual ones).
    #[arg(long, value_name = "BAUD", value_parser = super::record::parse_baud)]
    baud: Option<Baud>,
    /// Test for crosstalk instead, step by step: move one sensor at a time by hand while those of the other finger are
    /// watched. Enter skips a sensor; Ctrl+C ends the test and prints its results.
    #[arg(long, conflicts_with = "seconds")]
    crosstalk: bool,
    /// Print wiring, ports and protocol, then exit.
    #[arg(long, conflicts_with_all = ["crosstalk", "json"])]
    wiring: bool,
    /// Write the Arduino sketch to a folder, which must be named due_gripper, then exit.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["crosstalk", "json", "wiring"], value_parser = sketch_folder())]
    sketch: Option<PathBuf>,
    /// Print the sensors of the gripper as a gripper file, to begin one's own with, then exit. With a port, one sensor for each
    /// column of its board, raw where the column is not known.
    #[arg(long, conflicts_with_all = ["crosstalk", "json", "wiring", "sketch"])]
    gripper_file: bool,
    /// Print the channels of the gripper for the Arduino sketch, then exit: gripper_channels.h, beside due_gripper.ino.
    #[arg(long, conflicts_with_all = ["crosstalk", "json", "wiring", "sketch", "gripper_file"])]
    firmware_header: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Parser of the name of a folder that is named like the sketch, as Arduino wants it.
fn sketch_folder() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        let is_named = std::path::absolute(&path).is_ok_and(|whole| whole.ends_with(SKETCH));
        if is_named { Ok(path) } else { Err(format!("Arduino wants the sketch in a folder named {SKETCH}")) }
    })
}

/// Output of `--json`.
#[derive(Serialize)]
struct DoctorReport<'a> {
    port: Option<&'a std::path::Path>,
    listened_s: f64,
    /// No check failed.
    sound: bool,
    /// Names of the checks that did not see what they need.
    not_checked: Vec<&'static str>,
    findings: Vec<CheckFinding>,
    /// Port and readings, in words.
    #[serde(skip)]
    heard: Option<String>,
}

pub(super) fn run(arguments: &DoctorArguments, sensors: SensorList) -> Result<ExitCode, Failure> {
    if arguments.gripper_file && arguments.port.is_none() {
        say(sensors.to_toml().trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.firmware_header {
        say(firmware_header(sensors)?.trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.wiring {
        say(WIRING_PAGE.trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(folder) = &arguments.sketch {
        write_sketch(folder)?.iter().try_for_each(|path| say(path.display().to_string()))?;
        return Ok(ExitCode::SUCCESS);
    }
    // Captured bytes need no real time.
    let replay_speed = f64::INFINITY;
    let path = arguments.port.clone();
    let options = LinkOptions { path, baud: arguments.baud, replay_speed, sensors, ..LinkOptions::default() };
    let stop = stop_flag()?;
    if arguments.crosstalk {
        return crosstalk(&options, &stop, arguments.json);
    }
    let bar = Progress::new("listening {bar:40} bend each finger, press each pad");
    let seen = examine(&options, Duration::from_secs_f64(arguments.seconds), &mut |listened_s| {
        bar.share(listened_s / arguments.seconds);
        !stop.load(Ordering::Relaxed)
    });
    drop(bar);
    if let Some(link) = seen.link.as_ref().filter(|link| arguments.gripper_file && link.cadence.samples > 0) {
        say(sensors.of_columns(&link.board.channels)?.to_toml().trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let found = findings(&seen);
    let (sound, link) = (is_sound(&found), seen.link.as_ref());
    let report = DoctorReport {
        port: link.map(|link| link.port.path.as_path()).or(arguments.port.as_deref()),
        listened_s: seen.listened_s,
        sound,
        not_checked: not_checked(&found),
        findings: found,
        heard: link.map(|link| {
            let (path, title, samples) = (link.port.path.display(), &link.port.title, link.cadence.samples);
            format!("{path} ({title}): {samples} readings over {:.1} s\n", seen.traces.seconds())
        }),
    };
    report.print(arguments.json)?;
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

impl Report for DoctorReport<'_> {
    fn text(&self, page: &mut Page) {
        self.heard.iter().for_each(|heard| page.line(heard));
        for finding in &self.findings {
            page.line(format!("{:<11} {:<14} {}", finding.verdict.name(), finding.check, finding.seen));
            for (word, text) in [("why:", &finding.cause), ("do:", &finding.fix), ("copy:", &finding.command)] {
                text.iter().for_each(|text| page.line(format!("{word:>26} {text}")));
            }
        }
        page.line(format!("\n{}", summary(&self.findings)));
    }
}

/// Output of `--crosstalk --json`.
#[derive(Serialize)]
struct CrosstalkReport {
    sound: bool,
    found: Vec<Bleed>,
    result: Vec<String>,
}

impl Report for CrosstalkReport {
    fn text(&self, page: &mut Page) {
        let row = |bleed: &Bleed| {
            let (share, counts) = (format!("{:.1}", 100.0 * bleed.share), format!("{:+.0}", bleed.counts));
            let verdict = if bleed.bleeds { CheckStatus::Failed } else { CheckStatus::Passed };
            [bleed.from.label(), bleed.into.label(), share, counts, verdict.name().into()]
        };
        page.table(&["moved", "watched", "crosstalk [%]", "counts", ""], self.found.iter().map(row));
        self.result.iter().for_each(|sentence| page.line(sentence));
    }
}

/// Runs the crosstalk test: the user moves one sensor after the other.
fn crosstalk(options: &LinkOptions, stop: &AtomicBool, json: bool) -> Result<ExitCode, Failure> {
    let mut board = Listener::open(options, stop)?;
    let (mut test, mut shown, keys) = (CrosstalkTest::default(), String::new(), typed_lines()?);
    while !stop.load(Ordering::Relaxed) && !test.is_over() {
        let Some(readings) = board.next()? else { break };
        let known = board.board();
        for reading in readings {
            test.feed(&reading, &known)?;
            let [step, of] = test.step();
            let step_text = test.instruction().map(|instruction| format!("{step} of {of}: {instruction}"));
            if let Some(text) = step_text.filter(|text| *text != shown) {
                note(&text);
                shown = text;
            }
        }
        if keys.try_recv().is_ok() {
            test.skip();
        }
    }
    if !test.is_begun() {
        return Err(format!("no readings from the board. {}", board.sentence()).into());
    }
    let sound = test.is_sound();
    CrosstalkReport { sound, found: test.found().to_vec(), result: test.summary() }.print(json)?;
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
