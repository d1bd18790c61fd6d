//! Log of the newest raw lines.

use std::collections::VecDeque;

/// Lines that are kept.
const LINES: usize = 200;
/// Bytes of a line that are kept: a line of the firmware has about a hundred.
const SHOWN: usize = 240;

/// Kind of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineKind {
    /// Numbers.
    Values,
    /// A remark, or a header.
    Remark,
    /// Unreadable, and why.
    Bad(&'static str),
}

/// Raw line.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ConsoleLine {
    /// Time of arrival (ms since the stream began).
    pub arrived_ms: u64,
    /// Its text; other bytes are escaped.
    pub text: String,
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
