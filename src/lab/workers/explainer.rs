//! Explanation in the background: a thread "why" that explains a grasp's answer and finds the stored trials nearest to it.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use crate::datasets::SensorView;
use crate::grasping::RecognisedGrasp;
use crate::why::{Attribution, NearestQuery, NearestReport, TrialIndex, WhyError, explain};
use palpate_store::{Store, StoreError};
use palpate_tactile::trial::TrialId;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Nearest trials that are looked for.
const NEAREST: usize = 8;
/// Trials between two reports of progress.
const REPORT_EVERY: usize = 50;

/// Grasp to be explained.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplainRequest {
    /// The grasp.
    pub grasp: Arc<RecognisedGrasp>,
    /// Its trial in the store, where known: it is not among its own nearest.
    pub trial: Option<TrialId>,
}

/// Search for the nearest trials.
#[derive(Clone, Debug)]
pub enum NearestState {
    /// Trials compared, of all.
    Comparing(usize, usize),
    /// The nearest.
    Ready(Arc<NearestReport>),
    /// The store cannot be read.
    Failed(Arc<StoreError>),
}

/// State of the thread.
#[derive(Clone, Debug)]
pub struct ExplainedGrasp {
    /// What was asked.
    pub request: ExplainRequest,
    /// Why the model gave its answer.
    pub why: Result<Arc<Attribution>, WhyError>,
    /// The nearest trials.
    pub nearest: NearestState,
}

/// Handle of the thread.
pub type Explainer = BackgroundJob<ExplainRequest, ExplainedGrasp>;

impl Explainer {
    /// Starts the thread; trials come from the store at `store`.
    pub fn start(store: PathBuf, wake: Wake) -> std::io::Result<Self> {
        let mut service = ExplainService { store, index: TrialIndex::default() };
        Self::spawn("why", wake, move |request, stop, outlet| service.handle(&request, stop, outlet))
    }
}

/// State owned by the thread.
struct ExplainService {
    store: PathBuf,
    index: TrialIndex,
}

impl ExplainService {
    fn handle(&mut self, request: &ExplainRequest, stop: &AtomicBool, outlet: &Outlet<ExplainedGrasp>) {
        let why = explain(&request.grasp, stop).map(Arc::new);
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let show = |nearest| {
            outlet.publish(ExplainedGrasp { request: request.clone(), why: why.clone(), nearest });
        };
        show(NearestState::Comparing(0, 0));
        let Some(signatures) = request.grasp.model.signatures.clone() else { return };
        let query = NearestQuery {
            signatures,
            view: SensorView::of_model(&request.grasp.model.card),
            except: request.trial,
            count: NEAREST,
        };
        let progress = |done: usize, of: usize| {
            if done > 0 && done.is_multiple_of(REPORT_EVERY) {
                show(NearestState::Comparing(done, of));
            }
        };
        let found = Store::open(&self.store)
            .and_then(|store| self.index.nearest(&store, &request.grasp.grasp, &query, stop, &progress));
        match found {
            Ok(Some(report)) => show(NearestState::Ready(Arc::new(report))),
            Ok(None) => {}
            Err(cause) => show(NearestState::Failed(Arc::new(cause))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use crate::why::fixtures::{grasp, linear};

    #[test]
    fn a_grasp_is_explained_and_compared_with_the_store() {
        let folder = tempfile::tempdir().unwrap();
        let (wake, woken) = waker();
        let mut explainer = Explainer::start(folder.path().join("s.sqlite"), wake).unwrap();
        let (model, _) = linear([1.0, 0.0, 0.0]);
        let asked = Arc::new(RecognisedGrasp::alone(model, grasp([3.0, 0.0, 0.0]), None));
        explainer.ask(ExplainRequest { grasp: Arc::clone(&asked), trial: None });
        let view = until(&explainer, &woken, |view| matches!(view.nearest, NearestState::Ready(_)));
        assert!(Arc::ptr_eq(&view.request.grasp, &asked));
        assert!(view.why.as_ref().is_ok_and(|why| why.by_channel[0].points > 1.0));
        assert!(matches!(&view.nearest, NearestState::Ready(report) if report.trials.is_empty()));
        // Given up before it begins: nothing new is shown.
        let other = Arc::new(RecognisedGrasp { hold_s: Some(1.0), ..RecognisedGrasp::clone(&asked) });
        explainer.ask(ExplainRequest { grasp: other, trial: None });
        explainer.give_up();
        while !explainer.is_settled() {
            woken.recv_timeout(std::time::Duration::from_secs(600)).expect("the thread is alive");
        }
        let shown = explainer.view().unwrap();
        assert!(Arc::ptr_eq(&shown.request.grasp, &asked) || shown.request.grasp.hold_s == Some(1.0));
    }
}
