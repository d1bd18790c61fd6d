//! Explanation in the background: why the model gave its answer to a grasp, and the stored trials nearest to it.

use super::job::{EndedJob, Job, Newer};
use super::messages::Wake;
use crate::datasets::SensorView;
use crate::grasping::RecognisedGrasp;
use crate::why::{Attribution, NearestQuery, NearestReport, TrialIndex, explain};
use palpate_store::Store;
use palpate_tactile::trial::TrialId;
use std::path::PathBuf;
use std::sync::Arc;

/// Nearest trials that are looked for.
const NEAREST: usize = 8;

/// Grasp to be explained.
#[derive(Clone, Debug)]
pub struct ExplainRequest {
    /// The grasp.
    pub grasp: Arc<RecognisedGrasp>,
    /// Its trial in the store, where known: it is not among its own nearest.
    pub trial: Option<TrialId>,
}

impl ExplainRequest {
    /// True for requests about the same grasp.
    pub fn is_like(&self, other: &Self) -> bool {
        self.trial == other.trial && Arc::ptr_eq(&self.grasp, &other.grasp)
    }
}

/// The two jobs that explain a grasp.
pub struct Explainer {
    /// Why the model gave its answer.
    pub why: Job<ExplainRequest, Attribution>,
    /// The nearest trials.
    pub nearest: Job<ExplainRequest, NearestReport>,
}

impl Explainer {
    /// Trials come from the store at `store`.
    pub fn new(store: PathBuf, wake: &Wake) -> Self {
        let mut index = TrialIndex::default();
        let why = Job::new("why", Newer::Replaces, Arc::clone(wake), |request: &ExplainRequest, run| {
            Ok(run.unless_stopped(explain(&request.grasp, run.stop())?))
        });
        let nearest = Job::new("nearest", Newer::Replaces, Arc::clone(wake), move |request: &ExplainRequest, run| {
            let grasp = &request.grasp;
            let Some(signatures) = grasp.model.signatures.clone() else { return Ok(None) };
            let view = SensorView::of_model(&grasp.model.card);
            let query = NearestQuery { signatures, view, except: request.trial, count: NEAREST };
            let progress = |done: usize, of: usize| run.count(done, of, format!("Comparing … {done} of {of}"));
            Ok(index.nearest(&Store::open(&store)?, &grasp.grasp, &query, run.stop(), &progress)?)
        });
        Self { why, nearest }
    }

    /// Explains a grasp instead of the one before, unless it is the same, without a look into the store: some dozens of
    /// answers of the model, a few milliseconds.
    pub fn weigh(&self, request: &ExplainRequest) {
        start_once(&self.why, request);
    }

    /// The same, with the nearest trials.
    pub fn explain(&self, request: &ExplainRequest) {
        start_once(&self.why, request);
        start_once(&self.nearest, request);
    }

    /// Explanation of a grasp; none before there is one.
    pub fn explained(&self, request: &ExplainRequest) -> Option<EndedJob<ExplainRequest, Attribution>> {
        self.why.last().filter(|ended| ended.command.is_like(request))
    }
}

/// Starts a job on a grasp that is neither running nor the last one.
fn start_once<T: Clone + Send + Sync + 'static>(job: &Job<ExplainRequest, T>, request: &ExplainRequest) {
    let is_running = job.running().is_some_and(|running| running.command.is_like(request));
    if !is_running && !job.last().is_some_and(|ended| ended.command.is_like(request)) {
        job.start(request.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::super::job::watch::{settled, waker};
    use super::*;
    use crate::why::fixtures::{grasp, linear};

    #[test]
    fn a_grasp_is_explained_and_compared_with_the_store() {
        let folder = tempfile::tempdir().unwrap();
        let (wake, woken) = waker();
        let explainer = Explainer::new(folder.path().join("s.sqlite"), &wake);
        let (model, _) = linear([1.0, 0.0, 0.0]);
        let asked = Arc::new(RecognisedGrasp::alone(model, grasp([3.0, 0.0, 0.0]), None));
        let request = ExplainRequest { grasp: Arc::clone(&asked), trial: None };
        explainer.explain(&request);
        explainer.explain(&request);
        assert!(settled(&explainer.why, &woken).unwrap().is_ok_and(|why| why.by_channel[0].points > 1.0));
        assert!(settled(&explainer.nearest, &woken).unwrap().is_ok_and(|report| report.trials.is_empty()));
        assert!(explainer.explained(&request).is_some_and(|explained| explained.number == 1), "asked once");
        // Stopped: nothing new is shown.
        let other = Arc::new(RecognisedGrasp { hold_s: Some(1.0), ..RecognisedGrasp::clone(&asked) });
        let other = ExplainRequest { grasp: other, trial: None };
        explainer.explain(&other);
        explainer.why.stop();
        settled(&explainer.why, &woken);
        assert!(explainer.explained(&other).is_none() || explainer.explained(&request).is_none());
    }
}
