//! Replies of the board: lines that begin with `#`, as `assets/firmware/due_gripper/gripper_logic.h` prints them.
//!
//! ```text
//! # ok p=0.55                                  pressure that is on (bar)
//! # refused reason=above-maximum max=1.00      a command that was not carried out
//! # vent reason=watchdog                       the board vented on its own
//! ```

use super::handshake::GREETING;
use std::fmt;

/// Reply or remark of the board, without its `#`.
#[derive(Clone, Debug, PartialEq)]
pub enum BoardReply {
    /// The command was carried out.
    Acknowledged {
        /// Line pressure that is on (bar).
        line_bar: f64,
    },
    /// The command was not carried out.
    Refused {
        /// Why, in the board's words: `above-maximum max=1.00`.
        reason: String,
    },
    /// The board vented on its own.
    Vented {
        /// Why, in the board's words: `watchdog`.
        cause: String,
    },
    /// Any other remark, the handshake included.
    Other(String),
}

impl BoardReply {
    /// True for the handshake, which a board sends when it starts, and when it is asked.
    pub fn is_handshake(&self) -> bool {
        matches!(self, Self::Other(text) if text.split_whitespace().next() == Some(GREETING))
    }

    /// Parses a remark.
    pub(super) fn parse(remark: &str) -> Self {
        let text = remark.strip_prefix('#').unwrap_or(remark).trim();
        let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
        let reason = || rest.strip_prefix("reason=").unwrap_or(rest).to_owned();
        let line_bar = rest.strip_prefix("p=").and_then(|bar| bar.parse().ok()).filter(|bar: &f64| bar.is_finite());
        match (word, line_bar) {
            ("ok", Some(line_bar)) => Self::Acknowledged { line_bar },
            ("refused", _) => Self::Refused { reason: reason() },
            ("vent", _) => Self::Vented { cause: reason() },
            _ => Self::Other(text.to_owned()),
        }
    }
}

impl fmt::Display for BoardReply {
    /// The remark as the board wrote it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Acknowledged { line_bar } => write!(f, "ok p={line_bar:.2}"),
            Self::Refused { reason } => write!(f, "refused reason={reason}"),
            Self::Vented { cause } => write!(f, "vent reason={cause}"),
            Self::Other(text) => f.write_str(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The firmware that is shipped.
    const FIRMWARE: &str = include_str!("../../../assets/firmware/due_gripper/gripper_logic.h");

    #[test]
    fn every_reply_of_the_firmware_is_recognised_and_printed_back() {
        let printed: Vec<&str> = FIRMWARE.split('"').skip(1).step_by(2).filter(|text| text.starts_with("# ")).collect();
        assert!(printed.len() >= 7, "{printed:?}");
        for text in printed {
            // The numbers follow in the code.
            let line = if text.ends_with('=') { format!("{text}0.55") } else { text.to_owned() };
            let reply = BoardReply::parse(&line);
            assert_eq!(format!("# {reply}"), line);
            let handshake = line.starts_with("# tactile-gripper");
            assert_eq!(reply.is_handshake(), handshake, "{line}");
            assert_eq!(matches!(reply, BoardReply::Other(_)), handshake, "{line}");
        }
    }

    #[test]
    fn a_reply_is_recognised_by_its_whole_first_word() {
        assert_eq!(BoardReply::parse("# ok p=0.55"), BoardReply::Acknowledged { line_bar: 0.55 });
        assert_eq!(
            BoardReply::parse("# refused reason=above-maximum max=1.00"),
            BoardReply::Refused { reason: "above-maximum max=1.00".to_owned() }
        );
        assert_eq!(BoardReply::parse("#vent reason=watchdog"), BoardReply::Vented { cause: "watchdog".to_owned() });
        for other in ["ventilation on", "refusedly", "ok", "ok p=nan", "ok then", ""] {
            assert_eq!(BoardReply::parse(other), BoardReply::Other(other.to_owned()));
        }
    }
}
