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
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for line in aligned(header, rows) {
        writeln!(out, "{line}")?;
    }
    Ok(out.flush()?)
}

/// Lines of a table. Each column is looked at once, so that the time grows with the number of cells.
fn aligned<'a, C: AsRef<str>>(header: &'a [&str], rows: &'a [Vec<C>]) -> impl Iterator<Item = String> + 'a {
    let column = |column: usize| {
        let mut width = header[column].chars().count();
        let mut numeric = !rows.is_empty();
        for cell in rows.iter().map(|row| row[column].as_ref()) {
            width = width.max(cell.chars().count());
            numeric = numeric && cell.parse::<f64>().is_ok();
        }
        (width, numeric)
    };
    let columns: Vec<(usize, bool)> = (0..header.len()).map(column).collect();
    let line = move |cells: &mut dyn Iterator<Item = &str>| {
        let padded: Vec<String> = cells
            .zip(&columns)
            .map(
                |(cell, (width, numeric))| if *numeric { format!("{cell:>width$}") } else { format!("{cell:<width$}") },
            )
            .collect();
        padded.join("  ").trim_end().to_owned()
    };
    std::iter::once(line(&mut header.iter().copied()))
        .chain(rows.iter().map(move |row| line(&mut row.iter().map(C::as_ref))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::process::Command;

    /// A cell that counts how often it is looked at.
    struct Counted<'a>(&'a str, &'a Cell<usize>);

    impl AsRef<str> for Counted<'_> {
        fn as_ref(&self) -> &str {
            self.1.set(self.1.get() + 1);
            self.0
        }
    }

    #[test]
    fn a_table_is_aligned_with_two_looks_at_each_cell() {
        let looks = Cell::new(0);
        let rows: Vec<Vec<Counted<'_>>> = [["7", "Lemon"], ["1234", "Tomato"], ["9", "-"]]
            .iter()
            .cycle()
            .take(3000)
            .map(|row| row.iter().map(|text| Counted(text, &looks)).collect())
            .collect();
        let lines: Vec<String> = aligned(&["id", "object"], &rows).collect();
        assert_eq!(lines[..4], ["  id  object", "   7  Lemon", "1234  Tomato", "   9  -"]);
        assert_eq!((lines.len(), looks.get()), (3001, 2 * 2 * 3000));
    }

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
