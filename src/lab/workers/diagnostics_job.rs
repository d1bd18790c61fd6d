//! The doctor beside a window: a thread "examine" that looks at the gripper's port when asked to, says how far it is, and
//! hands over its findings.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use palpate_device::doctor::{CheckFinding, Observations, examine, findings};
use palpate_device::serial::LinkOptions;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Examination to run.
#[derive(Clone, Debug, PartialEq)]
pub struct ExamineRequest {
    /// The port, or a file of captured bytes; the only likely port where nothing is named.
    pub port: Option<PathBuf>,
    /// How long to listen (s).
    pub seconds: f64,
}

/// Function that examines a port: [`examine_port`], or one that uses an open link. It calls the given function repeatedly
/// with the time so far (s), and ends early when that returns false.
pub type Examine = Arc<dyn Fn(&ExamineRequest, &mut dyn FnMut(f64) -> bool) -> Observations + Send + Sync>;

/// Examines a port by opening it.
pub fn examine_port(request: &ExamineRequest, goes_on: &mut dyn FnMut(f64) -> bool) -> Observations {
    let options = LinkOptions { path: request.port.clone(), ..LinkOptions::default() };
    let seconds = request.seconds.clamp(0.0, 600.0);
    examine(&options, Duration::from_secs_f64(seconds), goes_on)
}

/// Where the doctor stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnosticsView {
    /// Running examination and its duration so far (s).
    pub running: Option<(ExamineRequest, f64)>,
    /// What came out of the last examination.
    pub last: Option<Arc<DiagnosticsReport>>,
}

/// What came out of an examination.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnosticsReport {
    /// The port that was listened to, in words; none where none could be opened.
    pub port: Option<String>,
    /// For how long (s).
    pub listened_s: f64,
    /// It was ended before its time.
    pub cut_short: bool,
    /// What was found.
    pub findings: Vec<CheckFinding>,
}

/// A handle on the thread.
pub type DiagnosticsJob = BackgroundJob<ExamineRequest, DiagnosticsView>;

impl DiagnosticsJob {
    /// Starts the thread.
    pub fn start(look: Examine, wake: Wake) -> std::io::Result<Self> {
        let mut last = None;
        Self::spawn("examine", wake, move |request, stop, outlet| {
            let examination = Arc::new(examined(&look, &request, stop, outlet, last.as_ref()));
            last = Some(Arc::clone(&examination));
            outlet.publish(DiagnosticsView { running: None, last: Some(examination) });
        })
    }
}

fn examined(
    look: &Examine,
    request: &ExamineRequest,
    stop: &AtomicBool,
    outlet: &Outlet<DiagnosticsView>,
    last: Option<&Arc<DiagnosticsReport>>,
) -> DiagnosticsReport {
    let report = |listened_s: f64| {
        outlet.publish(DiagnosticsView { running: Some((request.clone(), listened_s)), last: last.cloned() });
    };
    report(0.0);
    let seen = look(request, &mut |listened_s| {
        report(listened_s);
        !stop.load(Ordering::Relaxed)
    });
    let port = seen.link.as_ref().map(|link| format!("{} ({})", link.port.path.display(), link.port.title));
    DiagnosticsReport {
        port,
        listened_s: seen.listened_s,
        cut_short: stop.load(Ordering::Relaxed),
        findings: findings(&seen),
    }
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use palpate_device::doctor::{CheckStatus, is_sound};
    use palpate_tactile::capture::{CAPTURE_MAGIC, Captured};

    fn request(port: PathBuf, seconds: f64) -> ExamineRequest {
        ExamineRequest { port: Some(port), seconds }
    }

    #[test]
    fn a_port_is_looked_at_and_one_that_is_not_there_is_told() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let bytes = folder.path().join("board.bytes");
        let mut file = CAPTURE_MAGIC.to_vec();
        for i in 0..10 {
            let line = format!("t_us:{},seq:{i},flexL:1400,flexR:1500,fsrL:0,fsrR:0\n", 20_000 * i);
            Captured::Bytes { arrived_s: 0.02 * f64::from(i), bytes: line.into_bytes() }.write(&mut file)?;
        }
        std::fs::write(&bytes, file)?;
        let (wake, woken) = waker();
        let doctor = DiagnosticsJob::start(Arc::new(examine_port), wake)?;
        assert!(doctor.view().is_none(), "before a request");
        doctor.ask(request(bytes, 5.0));
        until(&doctor, &woken, |view| view.running.is_some() && view.last.is_none());
        let view = until(&doctor, &woken, |view| view.running.is_none());
        let examined = view.last.as_ref().ok_or("it has looked")?;
        assert!(examined.port.as_ref().is_some_and(|port| port.contains("board.bytes")), "{examined:?}");
        let verdict = |check: &str| examined.findings.iter().find(|f| f.check == check).map(|f| f.verdict);
        assert_eq!((verdict("lines"), verdict("firmware")), (Some(CheckStatus::Passed), Some(CheckStatus::Note)));
        assert!(!examined.cut_short && examined.listened_s < 5.0, "a file ends when it ends");
        doctor.ask(request(folder.path().join("gone"), 5.0));
        let view = until(&doctor, &woken, |view| view.running.is_none() && view.last != Some(Arc::clone(examined)));
        let examined = view.last.as_ref().ok_or("it has looked")?;
        assert!(examined.port.is_none() && !is_sound(&examined.findings));
        Ok(())
    }

    #[test]
    fn a_look_that_is_given_up_ends_with_what_was_seen() -> Result<(), Box<dyn std::error::Error>> {
        let look: Examine = Arc::new(|_, goes_on| {
            let mut listened_s = 0.0;
            while goes_on(listened_s) {
                listened_s += 0.05;
                std::thread::sleep(Duration::from_millis(1));
            }
            let nothing = request(PathBuf::from("/nowhere/at/all"), 0.0);
            Observations { listened_s, ..examine_port(&nothing, &mut |_| true) }
        });
        let (wake, woken) = waker();
        let mut doctor = DiagnosticsJob::start(look, wake)?;
        doctor.ask(request(PathBuf::new(), 8.0));
        until(&doctor, &woken, |view| view.running.as_ref().is_some_and(|(_, listened_s)| *listened_s > 0.1));
        doctor.give_up();
        let view = until(&doctor, &woken, |view| view.running.is_none());
        let examined = view.last.as_ref().ok_or("it has looked")?;
        assert!(examined.cut_short && examined.listened_s > 0.1, "{examined:?}");
        Ok(())
    }
}
