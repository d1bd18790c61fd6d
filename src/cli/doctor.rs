//! `palpate doctor`: what is wrong between the gripper's board and this computer.

use super::Failure;
use super::link;
use super::terminal::{note, say, say_json, table, typed_lines};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_tactile::board::KNOWN_AFTER;
use palpate_device::doctor::{Bleed, CrosstalkTest, Finding, Observations, USUAL_LISTEN_S, Verdict, WIRING_PAGE, examine, findings, is_sound, summary, write_sketch};
use palpate_device::serial::{Baud, LinkEvent, LinkOptions};
use palpate_device::wire::Heard;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Arguments of `palpate doctor`.
#[derive(Debug, clap::Args)]
pub(super) struct DoctorArguments {
    /// The port, a link to one, or a file of captured bytes; the only likely port where it is left out.
    port: Option<PathBuf>,
    /// How long to listen (s). Bend a finger and press each pad meanwhile: more can be seen then.
    #[arg(long, value_name = "S", default_value_t = USUAL_LISTEN_S, value_parser = seconds)]
    seconds: f64,
    /// Rate of the board's serial line (bit/s); without it the usual ones are tried.
    #[arg(long, value_name = "BAUD", value_parser = super::record::parse_baud)]
    baud: Option<Baud>,
    /// Test for crosstalk instead, step by step: each sensor in turn is moved by hand, alone, while those of the other finger
    /// are watched. Enter leaves one out; Ctrl+C ends it and says what was seen.
    #[arg(long, conflicts_with = "seconds")]
    crosstalk: bool,
    /// Print how the board is wired, which port is which, and what its lines are; and look at nothing.
    #[arg(long, conflicts_with_all = ["crosstalk", "json"])]
    wiring: bool,
    /// Write the sketch for the Due into a folder, which Arduino wants to be called due_gripper; and look at nothing.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["crosstalk", "json", "wiring"])]
    sketch: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|s| (1.0..=600.0).contains(s));
    number.ok_or_else(|| "write a number of seconds from 1 to 600".to_owned())
}

/// What `--json` prints.
#[derive(Serialize)]
struct Told<'a> {
    port: Option<&'a std::path::Path>,
    listened_s: f64,
    sound: bool,
    findings: Vec<Finding>,
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
    let options = LinkOptions { path: arguments.port.clone(), baud: arguments.baud, ..LinkOptions::default() };
    let stop = super::interrupt::stop_flag()?;
    if arguments.crosstalk {
        return crosstalk(&options, &stop, arguments.json);
    }
    // It draws on standard error, and only on a terminal.
    let bar = ProgressBar::new((arguments.seconds * 10.0) as u64);
    bar.set_style(ProgressStyle::with_template("listening {bar:40} bend a finger and press each pad meanwhile")?);
    let seen = examine(&options, Duration::from_secs_f64(arguments.seconds), &mut |listened_s| {
        bar.set_position((listened_s * 10.0) as u64);
        !stop.load(Ordering::Relaxed)
    });
    bar.finish_and_clear();
    let found = findings(&seen);
    let sound = is_sound(&found);
    if arguments.json {
        let port = seen.link.as_ref().map(|link| link.port.path.as_path()).or(arguments.port.as_deref());
        say_json(&Told { port, listened_s: seen.listened_s, sound, findings: found })?;
    } else {
        tell(&seen, &found)?;
    }
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// What `--crosstalk --json` prints.
#[derive(Serialize)]
struct Crosstalk<'a> {
    sound: bool,
    found: &'a [Bleed],
    told: Vec<String>,
}

/// How long the board may be silent before the test is given up.
const SILENCE: Duration = Duration::from_secs(10);

/// Moves one sensor after the other, by the user's hands.
fn crosstalk(options: &LinkOptions, stop: &AtomicBool, json: bool) -> Result<ExitCode, Failure> {
    // Nobody moves what was captured long ago.
    let replay_speed = if options.path.as_ref().is_some_and(|path| path.is_file()) { f64::INFINITY } else { 1.0 };
    let options = LinkOptions { replay_speed, ..options.clone() };
    let link = link::open(&options, link::USUAL_WAIT_S, || stop.load(Ordering::Relaxed))?;
    let (mut test, mut told) = (None, String::new());
    let (mut heard, mut newest) = (0, Instant::now());
    let keys = typed_lines()?;
    while !stop.load(Ordering::Relaxed) && !link.is_over() {
        let events = link.take(Duration::from_millis(50));
        let board = link.status().board;
        for event in events {
            let LinkEvent::Heard(Heard::Reading(reading)) = event else { continue };
            newest = Instant::now();
            heard += 1;
            if heard < KNOWN_AFTER {
                continue;
            }
            let test = match &mut test {
                Some(test) => test,
                empty @ None => empty.insert(CrosstalkTest::new(&board)?),
            };
            test.see(&board);
            test.feed(&reading);
            let instruction = test.instruction();
            if test.source().is_some() && told != instruction {
                let [step, of] = test.step();
                note(&format!("{step} of {of}: {instruction}"));
                told = instruction;
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
        return Err(format!("nothing was heard of the board. {}", link.status().state.sentence()).into());
    };
    let sound = test.is_sound();
    if json {
        say_json(&Crosstalk { sound, found: test.found(), told: test.summary() })?;
    } else {
        let row = |bleed: &Bleed| {
            let (share, counts) = (format!("{:.1}", 100.0 * bleed.share), format!("{:+.0}", bleed.counts));
            let verdict = if bleed.bleeds { Verdict::Wrong } else { Verdict::Good };
            vec![bleed.from.label().into(), bleed.into.label().into(), share, counts, verdict.name().into()]
        };
        table(&["moved", "watched", "shows [%]", "counts", ""], &test.found().iter().map(row).collect::<Vec<_>>())?;
        test.summary().iter().try_for_each(say)?;
    }
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn tell(seen: &Observations, found: &[Finding]) -> Result<(), Failure> {
    if let Some(link) = &seen.link {
        say(format!("{} ({}), listened to for {:.0} s\n", link.port.path.display(), link.port.title, seen.listened_s))?;
    }
    for finding in found {
        say(format!("{:<9} {:<14} {}", finding.verdict.name(), finding.check, finding.seen))?;
        for (word, text) in [("why", &finding.cause), ("do", &finding.fix), ("copy", &finding.command)] {
            if let Some(text) = text {
                say(format!("{:>24} {text}", format!("{word}:")))?;
            }
        }
    }
    say(format!("\n{}", summary(found)))
}
