//! Outcome of a check, and the evidence that checks need.

use super::{CheckStatus, Observations};
use crate::serial::LinkStatus;
use palpate_geometry::units::three_digits;

/// A finding without its name.
pub(super) struct Outcome {
    pub(super) verdict: CheckStatus,
    pub(super) seen: String,
    pub(super) cause: Option<String>,
    pub(super) fix: Option<String>,
    pub(super) command: Option<String>,
}

impl Outcome {
    fn new(verdict: CheckStatus, seen: impl Into<String>) -> Self {
        Self { verdict, seen: seen.into(), cause: None, fix: None, command: None }
    }

    pub(super) fn passed(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Passed, seen)
    }

    pub(super) fn skipped(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Skipped, seen)
    }

    pub(super) fn not_checked(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::NotChecked, seen)
    }

    pub(super) fn note(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Note, seen)
    }

    pub(super) fn failed(seen: impl Into<String>) -> Self {
        Self::new(CheckStatus::Failed, seen)
    }

    pub(super) fn because(self, cause: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { cause: Some(cause.into()), fix: Some(fix.into()), ..self }
    }

    pub(super) fn with(self, command: impl Into<String>) -> Self {
        Self { command: Some(command.into()), ..self }
    }
}

/// Status of the link, if it was opened.
pub(super) fn link(seen: &Observations) -> Result<&LinkStatus, Outcome> {
    seen.link.as_ref().ok_or_else(|| Outcome::not_checked("the port did not open"))
}

/// Status of the link, if readings came for so long (s).
pub(super) fn readings(seen: &Observations, seconds: f64) -> Result<&LinkStatus, Outcome> {
    let link = link(seen)?;
    match (link.cadence.samples, seen.traces.seconds()) {
        (0, _) => Err(Outcome::not_checked("no readings")),
        (_, came) if came < seconds => {
            Err(Outcome::not_checked(format!("readings came for {} s; {seconds} s are needed", three_digits(came))))
        }
        _ => Ok(link),
    }
}

/// Either outcome.
pub(super) fn either(outcome: Result<Outcome, Outcome>) -> Outcome {
    outcome.unwrap_or_else(|unseen| unseen)
}
