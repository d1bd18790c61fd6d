//! The newest lines as they came, for whoever wants to see them.

use std::collections::VecDeque;

/// Lines that are remembered.
const LINES: usize = 200;
/// Bytes of a line that are remembered: a line of the firmware has about a hundred.
const SHOWN: usize = 240;

/// What was made of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineKind {
    /// Numbers.
    Values,
    /// A remark, or names of columns.
    Remark,
    /// Nothing; why.
    Bad(&'static str),
}

/// A line as it came.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ConsoleLine {
    /// When it arrived, in milliseconds since the stream began.
    pub arrived_ms: u64,
    /// Its text; what is none is escaped.
    pub text: String,
    /// What was made of it.
    pub kind: LineKind,
}

/// The newest lines.
#[derive(Clone, Debug, Default)]
pub(super) struct LineLog {
    lines: VecDeque<ConsoleLine>,
}

impl LineLog {
    pub(super) fn add(&mut self, line: &[u8], arrived_s: f64, kind: LineKind) {
        if self.lines.len() == LINES {
            self.lines.pop_front();
        }
        let shown = &line[..line.len().min(SHOWN)];
        let text = match std::str::from_utf8(shown) {
            Ok(text) if !text.chars().any(char::is_control) => text.to_owned(),
            _ => shown.escape_ascii().to_string(),
        };
        self.lines.push_back(ConsoleLine { arrived_ms: (arrived_s.max(0.0) * 1e3) as u64, text, kind });
    }

    pub(super) fn lines(&self) -> impl Iterator<Item = &ConsoleLine> {
        self.lines.iter()
    }
}
