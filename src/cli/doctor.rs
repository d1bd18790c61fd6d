//! `palpate doctor`: diagnoses the connection between the gripper's board and this computer.

use super::Failure;
use super::link;
use super::setup::within;
use super::terminal::{note, say, say_json, table, typed_lines};
use clap::builder::{PathBufValueParser, TypedValueParser};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_device::doctor::{
    Bleed, CheckFinding, CheckStatus, CrosstalkTest, Observations, SKETCH, USUAL_LISTEN_S, WIRING_PAGE, examine,
    findings, is_sound, not_checked, summary, write_sketch,
};
use palpate_device::protocol::DecodedEvent;
use palpate_device::serial::{Baud, LinkEvent, LinkOptions};
use palpate_tactile::board::KNOWN_AFTER;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Arguments of `palpate doctor`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate doctor
  palpate doctor /dev/ttyACM0 --seconds 10
  palpate doctor --crosstalk
  palpate doctor --wiring
  palpate doctor --sketch due_gripper

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
struct Report<'a> {
    port: Option<&'a std::path::Path>,
    listened_s: f64,
    /// No check failed.
    sound: bool,
    /// Names of the checks that did not see what they need.
    not_checked: Vec<&'static str>,
    findings: Vec<CheckFinding>,
}

pub(super) fn run(arguments: &DoctorArguments) -> Result<ExitCode, Failure> {
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
    let options = LinkOptions { path, baud: arguments.baud, replay_speed, ..LinkOptions::default() };
    let stop = super::interrupt::stop_flag()?;
    if arguments.crosstalk {
        return crosstalk(&options, &stop, arguments.json);
    }
    let bar = ProgressBar::new((arguments.seconds * 10.0) as u64);
    bar.set_style(ProgressStyle::with_template("listening {bar:40} bend each finger, press each pad")?);
    let seen = examine(&options, Duration::from_secs_f64(arguments.seconds), &mut |listened_s| {
        bar.set_position((listened_s * 10.0) as u64);
        !stop.load(Ordering::Relaxed)
    });
    bar.finish_and_clear();
    let found = findings(&seen);
    let sound = is_sound(&found);
    if arguments.json {
        let port = seen.link.as_ref().map(|link| link.port.path.as_path()).or(arguments.port.as_deref());
        say_json(&Report {
            port,
            listened_s: seen.listened_s,
            sound,
            not_checked: not_checked(&found),
            findings: found,
        })?;
    } else {
        print(&seen, &found)?;
    }
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Output of `--crosstalk --json`.
#[derive(Serialize)]
struct CrosstalkReport<'a> {
    sound: bool,
    found: &'a [Bleed],
    result: Vec<String>,
}

/// Silence of the board that ends the test.
const SILENCE: Duration = Duration::from_secs(10);

/// Runs the crosstalk test: the user moves one sensor after the other.
fn crosstalk(options: &LinkOptions, stop: &AtomicBool, json: bool) -> Result<ExitCode, Failure> {
    let link = link::open(options, link::USUAL_WAIT_S, || stop.load(Ordering::Relaxed))?;
    let (mut test, mut shown) = (None, String::new());
    let (mut readings, mut newest) = (0, Instant::now());
    let keys = typed_lines()?;
    while !stop.load(Ordering::Relaxed) && !link.is_over() {
        let events = link.take(Duration::from_millis(50));
        let board = link.status().board;
        for event in events {
            let LinkEvent::Decoded(DecodedEvent::Reading(reading)) = event else { continue };
            newest = Instant::now();
            readings += 1;
            if readings < KNOWN_AFTER {
                continue;
            }
            let test = match &mut test {
                Some(test) => test,
                empty @ None => empty.insert(CrosstalkTest::new(&board)?),
            };
            test.see(&board);
            test.feed(&reading);
            let instruction = test.instruction();
            if test.source().is_some() && shown != instruction {
                let [step, of] = test.step();
                note(&format!("{step} of {of}: {instruction}"));
                shown = instruction;
            }
        }
        if let (Ok(_enter), Some(test)) = (keys.try_recv(), &mut test) {
            test.skip();
        }
        if test.as_ref().is_some_and(|test: &CrosstalkTest| test.source().is_none()) {
            break;
        }
        if newest.elapsed() > SILENCE {
            return Err(
                format!("no readings for {:.0} s. {}", SILENCE.as_secs_f64(), link.status().state.sentence()).into()
            );
        }
    }
    let Some(test) = test else {
        return Err(format!("no readings from the board. {}", link.status().state.sentence()).into());
    };
    let sound = test.is_sound();
    if json {
        say_json(&CrosstalkReport { sound, found: test.found(), result: test.summary() })?;
    } else {
        let row = |bleed: &Bleed| {
            let (share, counts) = (format!("{:.1}", 100.0 * bleed.share), format!("{:+.0}", bleed.counts));
            let verdict = if bleed.bleeds { CheckStatus::Failed } else { CheckStatus::Passed };
            vec![bleed.from.label().into(), bleed.into.label().into(), share, counts, verdict.name().into()]
        };
        table(&["moved", "watched", "crosstalk [%]", "counts", ""], &test.found().iter().map(row).collect::<Vec<_>>())?;
        test.summary().iter().try_for_each(say)?;
    }
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn print(seen: &Observations, found: &[CheckFinding]) -> Result<(), Failure> {
    if let Some(link) = &seen.link {
        let (path, title) = (link.port.path.display(), &link.port.title);
        let (samples, lasted) = (link.cadence.samples, seen.traces.seconds());
        say(format!("{path} ({title}): {samples} readings over {lasted:.1} s\n"))?;
    }
    for finding in found {
        say(format!("{:<11} {:<14} {}", finding.verdict.name(), finding.check, finding.seen))?;
        for (word, text) in [("why", &finding.cause), ("do", &finding.fix), ("copy", &finding.command)] {
            if let Some(text) = text {
                say(format!("{:>26} {text}", format!("{word}:")))?;
            }
        }
    }
    say(format!("\n{}", summary(found)))
}
