//! Talking on the terminal: results to standard output, everything else to standard error.

use super::Failure;
use std::error::Error;
use std::io::{BufRead as _, ErrorKind, IsTerminal as _, Write};
use std::sync::mpsc::{Receiver, channel};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::{Layer as _, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;

/// Prints a line of results.
pub(super) fn say(line: impl std::fmt::Display) -> Result<(), Failure> {
    writeln!(std::io::stdout(), "{line}")?;
    Ok(())
}

/// Prints a value as JSON.
pub(super) fn say_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    say(serde_json::to_string_pretty(value)?)
}

/// Prints a warning beside the results.
pub(super) fn warn(line: &str) {
    // When standard error is closed there is nobody to tell.
    let _unheard = writeln!(std::io::stderr(), "warning: {line}");
}

/// Prints what is going on, or what to do next, beside the results.
pub(super) fn note(line: &str) {
    let _unheard = writeln!(std::io::stderr(), "{line}");
}

/// The lines that are typed, as they come; none any more once nobody is there to type.
pub(super) fn typed_lines() -> Result<Receiver<String>, Failure> {
    let (told, lines) = channel();
    // Ends with the program: a read of the keyboard cannot be interrupted.
    std::thread::Builder::new().name("keys".to_owned()).spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if told.send(line).is_err() {
                return;
            }
        }
    })?;
    Ok(lines)
}

/// Shows what the program itself logs as a warning or worse on standard error; libraries keep their thoughts to
/// themselves.
pub(super) fn show_log() {
    let ours = ["palpate", "palpate_core", "palpate_render"].map(|name| (name, LevelFilter::WARN));
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).without_time().with_target(false);
    let lines = lines.with_ansi(std::io::stderr().is_terminal());
    tracing_subscriber::registry().with(lines.with_filter(Targets::new().with_targets(ours))).init();
}

/// From now on a panic, ours or a library's, is told as one sentence instead of a trace.
pub(super) fn put_faults_into_words() {
    std::panic::set_hook(Box::new(|fault| {
        let place = fault.location().map_or_else(|| "an unknown place".to_owned(), ToString::to_string);
        let what = fault.payload_as_str().unwrap_or("no words");
        let text = format!("Palpate met a fault of its own: {what} ({place}). Trials in the store are safe");
        complain(&format!("{text}; please report this with what you did"));
    }));
}

/// Prints why a command failed.
pub(super) fn complain(line: &str) {
    let _unheard = writeln!(std::io::stderr(), "error: {line}");
}

/// True when output failed because its reader has gone.
pub(super) fn is_closed_pipe(failure: &(dyn Error + 'static)) -> bool {
    failure.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == ErrorKind::BrokenPipe)
}

/// Rows of text in columns: the first left-aligned, numbers right-aligned.
pub(super) fn table(header: &[&str], rows: &[Vec<String>]) -> Result<(), Failure> {
    let width = |column: usize| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells.chain([header[column].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let numeric = |column: usize| !rows.is_empty() && rows.iter().all(|row| row[column].parse::<f64>().is_ok());
    let line = |cells: &[&str]| {
        let padded: Vec<String> = cells
            .iter()
            .enumerate()
            .map(|(i, cell)| {
                let width = widths[i];
                if numeric(i) { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
            })
            .collect();
        padded.join("  ").trim_end().to_owned()
    };
    say(line(header))?;
    for row in rows {
        say(line(&row.iter().map(String::as_str).collect::<Vec<_>>()))?;
    }
    Ok(())
}
