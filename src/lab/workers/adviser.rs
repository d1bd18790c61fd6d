//! Advice in the background: a thread "advise" that finds how a person should move the object before the next grasp.

use super::background_job::BackgroundJob;
use super::messages::Wake;
use crate::grasping::{Advisor, ObjectMove, RecognisedGrasp};
use std::sync::Arc;

/// Advice after a grasp.
#[derive(Clone, Debug)]
pub struct Advice {
    /// The grasp.
    pub grasp: Arc<RecognisedGrasp>,
    /// What to do before the next one; none where nothing is known about objects in such channels.
    pub next: Option<ObjectMove>,
}

/// Handle of the thread: finished grasps in, advice out.
pub type Adviser = BackgroundJob<Arc<RecognisedGrasp>, Advice>;

impl Adviser {
    /// Starts the thread.
    pub fn start(wake: Wake) -> std::io::Result<Self> {
        let mut advisor = Advisor::default();
        Self::spawn("advise", wake, move |grasp: Arc<RecognisedGrasp>, _stop, outlet| {
            let next = advisor.advice(&grasp).map(|by| by.of_object());
            outlet.publish(Advice { grasp, next });
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use palpate_learn::{Sequence, Shipped};

    #[test]
    fn each_grasp_gets_its_advice() {
        let model = Arc::new(Shipped::AnyGripper.model().expect("valid"));
        let t_s: Vec<f32> = (0..300).map(|k| k as f32 / 75.0).collect();
        let (wake, woken) = waker();
        let adviser = Adviser::start(wake).expect("starts");
        for curvature in [0.0, 8.0] {
            let values = t_s.iter().flat_map(|_| [curvature, curvature, 3e3, 3e3]).collect();
            let felt = Sequence { t_s: t_s.clone(), values };
            let grasp = Arc::new(RecognisedGrasp::alone(Arc::clone(&model), felt, None));
            adviser.ask(Arc::clone(&grasp));
            let view = until(&adviser, &woken, |view| Arc::ptr_eq(&view.grasp, &grasp));
            assert!(view.next.is_some_and(|next| !next.to_string().is_empty()), "{view:?}");
        }
    }
}
