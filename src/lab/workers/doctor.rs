//! The doctor in the background: an examination of the gripper's port.

use super::job::{Job, Newer};
use super::messages::Wake;
use palpate_device::doctor::{CheckFinding, Observations, examine, findings};
use palpate_device::serial::LinkOptions;
use palpate_tactile::board::SensorList;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Examination to run.
#[derive(Clone, Debug, PartialEq)]
pub struct ExamineRequest {
    /// The port, or a file of captured bytes; the only likely port where nothing is named.
    pub port: Option<PathBuf>,
    /// How long to listen (s).
    pub seconds: f64,
    /// Sensors of the gripper.
    pub sensors: SensorList,
}

/// Function that examines a port: [`examine_port`], or one that uses an open link. It calls the given function repeatedly
/// with the time so far (s), and ends early when that returns false.
pub type Examine = Arc<dyn Fn(&ExamineRequest, &mut dyn FnMut(f64) -> bool) -> Observations + Send + Sync>;

/// Examines a port by opening it.
pub fn examine_port(request: &ExamineRequest, goes_on: &mut dyn FnMut(f64) -> bool) -> Observations {
    let options = LinkOptions { path: request.port.clone(), sensors: request.sensors, ..LinkOptions::default() };
    let seconds = request.seconds.clamp(0.0, 600.0);
    examine(&options, Duration::from_secs_f64(seconds), goes_on)
}

/// Result of an examination.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnosticsReport {
    /// The port and its board; none where none could be opened.
    pub port: Option<String>,
    /// Time over which it was listened to (s).
    pub listened_s: f64,
    /// It was stopped before its time.
    pub cut_short: bool,
    /// Findings of all checks.
    pub findings: Vec<CheckFinding>,
}

/// The job; once stopped, it reports what it has seen so far.
pub fn doctor_job(examine: Examine, wake: Wake) -> Job<ExamineRequest, DiagnosticsReport> {
    Job::new("examine", Newer::Replaces, wake, move |request: &ExamineRequest, run| {
        let mut proceed = |listened_s: f64| {
            let of = request.seconds;
            run.progress(listened_s / of.max(1e-9), format!("listening, {listened_s:.0} of {of:.0} s"));
            !run.stopped()
        };
        proceed(0.0);
        let seen = examine(request, &mut proceed);
        let port = seen.link.as_ref().map(|link| format!("{} ({})", link.port.path.display(), link.port.title));
        let (listened_s, cut_short) = (seen.listened_s, run.stopped());
        Ok(Some(DiagnosticsReport { port, listened_s, cut_short, findings: findings(&seen) }))
    })
}

#[cfg(test)]
mod tests {
    use super::super::job::watch::{settled, until, waker};
    use super::*;
    use palpate_device::doctor::{CheckStatus, is_sound};
    use palpate_tactile::capture::{CAPTURE_MAGIC, Captured};

    fn request(port: PathBuf, seconds: f64) -> ExamineRequest {
        ExamineRequest { port: Some(port), seconds, sensors: SensorList::default() }
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
        let doctor = doctor_job(Arc::new(examine_port), wake);
        doctor.start(request(bytes, 5.0));
        let examined = settled(&doctor, &woken).ok_or("it has looked")?.map_err(|cause| cause.to_string())?;
        assert!(examined.port.as_ref().is_some_and(|port| port.contains("board.bytes")), "{examined:?}");
        let verdict = |check: &str| examined.findings.iter().find(|f| f.check == check).map(|f| f.verdict);
        assert_eq!((verdict("lines"), verdict("firmware")), (Some(CheckStatus::Passed), Some(CheckStatus::Note)));
        assert!(!examined.cut_short && examined.listened_s < 5.0, "a file ends when it ends");
        doctor.start(request(folder.path().join("gone"), 5.0));
        let examined = settled(&doctor, &woken).ok_or("it has looked")?.map_err(|cause| cause.to_string())?;
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
        let doctor = doctor_job(look, wake);
        doctor.start(request(PathBuf::new(), 8.0));
        until(&woken, || doctor.running().filter(|running| running.progress.share > 0.02));
        doctor.stop();
        let examined = settled(&doctor, &woken).ok_or("it has looked")?.map_err(|cause| cause.to_string())?;
        assert!(examined.cut_short && examined.listened_s > 0.1, "{examined:?}");
        Ok(())
    }
}
