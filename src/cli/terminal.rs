//! Output to the terminal: results to standard output, everything else to standard error. One report has two forms, JSON and
//! text.

use super::Failure;
use indicatif::{ProgressBar, ProgressStyle};
use palpate_geometry::{one_line, printable_lines};
use serde::Serialize;
use std::backtrace::{Backtrace, BacktraceStatus};
use std::error::Error;
use std::io::{BufRead as _, BufWriter, ErrorKind, IsTerminal as _, Write};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::{Layer as _, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;

/// True where terminals understand escape sequences; those of Windows do once a program switches that on.
pub(super) const ESCAPES: bool = !cfg!(windows);
/// Clears the line of a terminal.
pub(super) const CLEAR_LINE: &str = if ESCAPES {
    "\r\x1b[K"
} else {
    "\r                                                                               \r"
};

/// Prints a line of results. Control characters that a text of others brings are written out, here and below.
pub(super) fn say(line: impl std::fmt::Display) -> Result<(), Failure> {
    say_as_is(printable_lines(&line.to_string()))
}

/// Prints a text of this program, which may set bold type.
pub(super) fn say_as_is(text: impl std::fmt::Display) -> Result<(), Failure> {
    writeln!(std::io::stdout(), "{text}")?;
    Ok(())
}

/// Prints a value as JSON.
pub(super) fn say_json(value: &impl Serialize) -> Result<(), Failure> {
    say_as_is(serde_json::to_string_pretty(value)?)
}

/// Result of a command.
pub(super) trait Report: Serialize + Sized {
    /// Writes the text.
    fn text(&self, page: &mut Page);

    /// Prints the report.
    fn print(&self, json: bool) -> Result<(), Failure> {
        if json {
            return say_json(self);
        }
        let mut page = Page::default();
        self.text(&mut page);
        page.print()
    }
}

/// Text of a report. Facts are aligned with each other; warnings go to standard error.
#[derive(Default)]
pub(super) struct Page(Vec<Part>);

/// Heading of a column and its cell in a row.
pub(super) type Column<R> = (&'static str, fn(&R) -> String);

enum Part {
    Line(String),
    Fact(String, String),
    Warning(String),
}

impl Page {
    /// Adds a line.
    pub(super) fn line(&mut self, line: impl std::fmt::Display) {
        self.0.push(Part::Line(printable_lines(&line.to_string())));
    }

    /// Adds a name and what is to be said of it; nothing where that is absent.
    pub(super) fn fact(&mut self, name: impl Into<String>, text: impl Into<Option<String>>) {
        self.0.extend(text.into().map(|text| Part::Fact(name.into(), text)));
    }

    /// Adds a warning.
    pub(super) fn warn(&mut self, text: impl Into<String>) {
        self.0.push(Part::Warning(text.into()));
    }

    /// Adds a table: columns of text left-aligned, of numbers right-aligned.
    pub(super) fn table<R: AsRef<[String]>>(&mut self, header: &[&str], rows: impl IntoIterator<Item = R>) {
        let rows = rows.into_iter().map(|row| row.as_ref().iter().map(|cell| one_line(cell)).collect::<Vec<_>>());
        let rows: Vec<Vec<String>> = rows.collect();
        let rows: Vec<&[String]> = rows.iter().map(Vec::as_slice).collect();
        self.0.extend(aligned(header, &rows).map(Part::Line));
    }

    /// Adds a table of which each column says its heading and its cell in a row.
    pub(super) fn columns<R>(&mut self, columns: &[Column<R>], rows: &[R]) {
        let header: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
        let cells = |row: &R| columns.iter().map(|(_, cell)| cell(row)).collect::<Vec<_>>();
        self.table(&header, rows.iter().map(cells));
    }

    /// Prints the text.
    pub(super) fn print(&self) -> Result<(), Failure> {
        let width = |part: &Part| if let Part::Fact(name, _) = part { name.chars().count() + 2 } else { 0 };
        let width = self.0.iter().map(width).max().unwrap_or(0);
        let mut out = BufWriter::new(std::io::stdout().lock());
        for part in &self.0 {
            match part {
                Part::Line(line) => writeln!(out, "{line}")?,
                Part::Fact(name, text) => writeln!(out, "{name:<width$}{}", printable_lines(text))?,
                Part::Warning(text) => {
                    out.flush()?;
                    warn(text);
                }
            }
        }
        Ok(out.flush()?)
    }
}

/// Prints a warning to standard error.
pub(super) fn warn(line: &str) {
    // Nothing can be reported where standard error is closed.
    let _closed = writeln!(std::io::stderr(), "warning: {}", printable_lines(line));
}

/// Prints progress or an instruction to standard error.
pub(super) fn note(line: &str) {
    let _closed = writeln!(std::io::stderr(), "{}", printable_lines(line));
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

/// Progress on standard error, visible only on a terminal; removed when dropped.
pub(super) struct Progress(pub(super) ProgressBar);

impl Progress {
    /// Progress in the form of a template of `indicatif`.
    pub(super) fn new(template: &str) -> Self {
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        // A bar of length 0 would be full.
        Self(ProgressBar::no_length().with_style(style))
    }

    /// Work whose share cannot be told: what it is, and how long it has taken.
    pub(super) fn waiting(what: &str) -> Self {
        let progress = Self::new("{msg} … {elapsed}");
        progress.0.set_message(what.to_owned());
        progress.0.enable_steady_tick(Duration::from_millis(200));
        progress
    }

    /// Work that is named, with the time left.
    pub(super) fn of(what: &str) -> Self {
        let progress = Self::new("{msg} {bar:40} {pos}/{len} {eta} left");
        progress.0.set_message(what.to_owned());
        progress
    }

    /// The same in percent.
    pub(super) fn of_share(what: &str) -> Self {
        let progress = Self::new("{msg} {bar:40} {percent} % {eta} left");
        progress.0.set_message(what.to_owned());
        progress
    }

    /// Shows how much is done.
    pub(super) fn show(&self, done: usize, of: usize) {
        if of > 0 {
            self.0.set_length(of as u64);
            self.0.set_position(done as u64);
        }
    }

    /// Shows which share is done.
    pub(super) fn share(&self, share: f64) {
        self.show((share * 1000.0) as usize, 1000);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Day and time of a time stamp, without its fraction of a second.
pub(super) fn date(stamp: &str) -> String {
    stamp.chars().take(19).collect::<String>().replace('T', " ")
}

/// Prints log messages of the program itself, warnings or worse, to standard error.
pub(super) fn show_log() {
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).without_time().with_target(false);
    let lines = lines.with_ansi(ESCAPES && std::io::stderr().is_terminal());
    tracing_subscriber::registry()
        .with(lines.with_filter(Targets::new().with_target("palpate", LevelFilter::WARN)))
        .init();
}

/// Reports a panic in one sentence, with a backtrace where `RUST_BACKTRACE` asks for one.
pub(super) fn report_panics() {
    std::panic::set_hook(Box::new(|panic| {
        if palpate_exchange::is_contained() {
            return;
        }
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
    let _closed = writeln!(std::io::stderr(), "error: {}", printable_lines(line));
}

/// True where output failed because its reader has gone.
pub(super) fn is_closed_pipe(failure: &(dyn Error + 'static)) -> bool {
    failure.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == ErrorKind::BrokenPipe)
}

/// Prints rows in columns: text left-aligned, numbers right-aligned.
pub(super) fn table(header: &[&str], rows: &[Vec<String>]) -> Result<(), Failure> {
    let mut page = Page::default();
    page.table(header, rows);
    page.print()
}

/// Lines of a table. Each column is looked at once, so that the time grows with the number of cells.
pub(super) fn aligned<'a, C: AsRef<str>>(header: &'a [&str], rows: &'a [&'a [C]]) -> impl Iterator<Item = String> + 'a {
    let column = |column: usize| {
        let cells = || rows.iter().map(|row| row[column].as_ref());
        let widest = cells().map(|cell| cell.chars().count()).max().unwrap_or(0).max(header[column].chars().count());
        (widest, !rows.is_empty() && cells().all(|cell| cell.parse::<f64>().is_ok()))
    };
    let columns: Vec<(usize, bool)> = (0..header.len()).map(column).collect();
    let pad = |(cell, (width, numeric)): (&str, &(usize, bool))| match numeric {
        true => format!("{cell:>width$}"),
        false => format!("{cell:<width$}"),
    };
    let line = move |cells: Vec<&str>| {
        let padded: Vec<String> = cells.into_iter().zip(&columns).map(pad).collect();
        padded.join("  ").trim_end().to_owned()
    };
    std::iter::once(line(header.to_vec())).chain(rows.iter().map(move |row| line(row.iter().map(C::as_ref).collect())))
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
    fn a_table_is_aligned_with_three_looks_at_each_cell() {
        let looks = Cell::new(0);
        let rows: Vec<Vec<Counted<'_>>> = [["7", "Lemon"], ["1234", "Tomato"], ["9", "-"]]
            .iter()
            .cycle()
            .take(3000)
            .map(|row| row.iter().map(|text| Counted(text, &looks)).collect())
            .collect();
        let rows: Vec<&[Counted<'_>]> = rows.iter().map(Vec::as_slice).collect();
        let lines: Vec<String> = aligned(&["id", "object"], &rows).collect();
        assert_eq!(lines[..4], ["  id  object", "   7  Lemon", "1234  Tomato", "   9  -"]);
        assert!(lines.len() == 3001 && looks.get() <= 3 * 2 * 3000, "{} looks", looks.get());
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
