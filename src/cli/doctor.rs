//! `palpate doctor`: what is wrong between the gripper's board and this computer.

use super::Failure;
use super::terminal::{say, say_json};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_core::doctor::{Finding, Observations, USUAL_LISTEN_S, examine, findings, is_sound, summary};
use palpate_core::rig::serial::{Baud, LinkOptions};
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Arguments of `palpate doctor`.
#[derive(Debug, clap::Args)]
pub(super) struct DoctorArguments {
    /// The port, a link to one, or a file of captured bytes; the only likely port where it is left out.
    port: Option<PathBuf>,
    /// How long to listen (s). Bend a finger and press each pad meanwhile: more can be seen then.
    #[arg(long, value_name = "S", default_value_t = USUAL_LISTEN_S, value_parser = seconds)]
    seconds: f64,
    /// Rate of the board's serial line (bit/s); without it the usual ones are tried.
    #[arg(long, value_name = "BAUD", value_parser = parse_baud)]
    baud: Option<Baud>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|s| (1.0..=600.0).contains(s));
    number.ok_or_else(|| "write a number of seconds from 1 to 600".to_owned())
}

fn parse_baud(text: &str) -> Result<Baud, String> {
    let rates: Vec<String> = Baud::SCANNED.iter().map(|baud| baud.rate().to_string()).collect();
    let found = Baud::SCANNED.into_iter().find(|baud| baud.rate().to_string() == text);
    found.ok_or_else(|| format!("choose one of {}", rates.join(", ")))
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
    let options = LinkOptions { path: arguments.port.clone(), baud: arguments.baud, ..LinkOptions::default() };
    let stop = super::interrupt::stop_flag()?;
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
