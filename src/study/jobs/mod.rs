//! Background tasks of the window that measure: commands in, progress and an outcome or a failure out.
//!
//! | job | command | outcome | newer |
//! |---|---|---|---|
//! | [`fit_job`] | recorded trials | a fitted finger | replaces |
//! | [`recorded_trials_job`] [`study_files_job`] | | what the store and its folders hold | replaces |
//! | [`effects_job`] | a scene | cost and change of each effect | replaces |
//! | [`study_runner`] | a study | its result | waits |

mod effects;
mod fit;
mod study_runner;

pub use effects::{Explain, effects_job, explain_scene};
pub use fit::{FitTrials, FittedFinger, fit_job, fit_trials, recorded_trials_job};
pub use study_runner::{
    DrawFigure, StudyEnd, StudyFiles, StudyFilesByKey, StudyOrigin, StudyRequest, StudyResult, StudyRunner,
    has_other_units, study_files_job, study_runner,
};

/// Waiting for jobs in tests.
#[cfg(test)]
mod watch {
    use palpate_lab::workers::{Job, JobFailure, Wake};
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, channel};
    use std::time::Duration;

    /// A `wake` and the receiver of its calls.
    pub(super) fn waker() -> (Wake, Receiver<()>) {
        let (calls, woken) = channel();
        let wake: Wake = Arc::new(move || {
            // The test may have stopped listening.
            let _sent = calls.send(());
        });
        (wake, woken)
    }

    /// Waits for something.
    pub(super) fn until<T>(woken: &Receiver<()>, mut wanted: impl FnMut() -> Option<T>) -> T {
        loop {
            if let Some(found) = wanted() {
                return found;
            }
            woken.recv_timeout(Duration::from_secs(600)).expect("the thread is alive");
        }
    }

    /// Waits for the end of all commands, and returns the outcome of the last.
    pub(super) fn settled<C, O>(job: &Job<C, O>, woken: &Receiver<()>) -> Option<Result<Arc<O>, JobFailure>> {
        until(woken, || job.is_settled().then_some(()));
        job.last().map(|ended| ended.outcome)
    }
}
