//! Output to the terminal: results to standard output, everything else to standard error.

use super::Failure;
use std::backtrace::{Backtrace, BacktraceStatus};
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

/// Prints a warning to standard error.
pub(super) fn warn(line: &str) {
    // Nothing can be reported where standard error is closed.
    let _closed = writeln!(std::io::stderr(), "warning: {line}");
}

/// Prints progress or an instruction to standard error.
pub(super) fn note(line: &str) {
    let _closed = writeln!(std::io::stderr(), "{line}");
}

/// Lines of standard input as they are typed, until it ends.
pub(super) fn typed_lines() -> Result<Receiver<String>, Failure> {
    let (sender, lines) = channel();
    // Ends with the program: a read of the keyboard cannot be interrupted.
    std::thread::Builder::new().name("keys".to_owned()).spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    })?;
    Ok(lines)
}

/// Prints log messages of the program itself, warnings or worse, to standard error.
pub(super) fn show_log() {
    let ours = ["palpate", "palpate_core", "palpate_render"].map(|name| (name, LevelFilter::WARN));
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).without_time().with_target(false);
    let lines = lines.with_ansi(std::io::stderr().is_terminal());
    tracing_subscriber::registry().with(lines.with_filter(Targets::new().with_targets(ours))).init();
}

/// Reports a panic in one sentence, with a backtrace where `RUST_BACKTRACE` asks for one.
pub(super) fn report_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map_or_else(|| "unknown place".to_owned(), ToString::to_string);
        let message = panic.payload_as_str().unwrap_or("no message");
        let text = format!("internal error: {message} ({place}). Stored trials are safe");
        error(&format!("{text}. Please report this with what you did"));
        let backtrace = Backtrace::capture();
        match backtrace.status() {
            BacktraceStatus::Captured => note(&backtrace.to_string()),
            _ => note("RUST_BACKTRACE=1 adds a backtrace"),
        }
    }));
}

/// Prints why a command failed.
pub(super) fn error(line: &str) {
    let _closed = writeln!(std::io::stderr(), "error: {line}");
}

/// True where output failed because its reader has gone.
pub(super) fn is_closed_pipe(failure: &(dyn Error + 'static)) -> bool {
    failure.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == ErrorKind::BrokenPipe)
}

/// Prints rows in columns: text left-aligned, numbers right-aligned.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// Set where this test runs itself to panic.
    const PANICS: &str = "PALPATE_TEST_PANICS";

    #[test]
    fn a_panic_is_one_sentence_and_a_backtrace_where_asked_for() {
        if std::env::var_os(PANICS).is_some() {
            report_panics();
            panic!("on purpose");
        }
        let name = "cli::terminal::tests::a_panic_is_one_sentence_and_a_backtrace_where_asked_for";
        let run = |backtrace: &str| {
            let mut command = Command::new(std::env::current_exe().expect("this test"));
            command.args(["--exact", name, "--nocapture"]).env(PANICS, "1").env("RUST_BACKTRACE", backtrace);
            let output = command.env_remove("RUST_LIB_BACKTRACE").output().expect("runs");
            assert!(!output.status.success());
            String::from_utf8_lossy(&output.stderr).into_owned()
        };
        let (plain, traced) = (run("0"), run("1"));
        assert!(plain.contains("error: internal error: on purpose ("), "{plain}");
        assert!(plain.contains("RUST_BACKTRACE=1") && !plain.contains("a_panic_is_one_sentence"), "{plain}");
        assert!(traced.contains("on purpose") && traced.contains("a_panic_is_one_sentence"), "{traced}");
    }
}
