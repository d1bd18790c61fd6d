//! Advice in the background: how a person should move the object before the next grasp.

use super::job::{Job, Newer};
use super::messages::Wake;
use crate::grasping::{Advisor, ObjectMove, RecognisedGrasp};
use std::sync::Arc;

/// The job: a finished grasp in, the move before the next grasp out; none if no known grasps have the model's channels.
pub fn advice_job(wake: Wake) -> Job<Arc<RecognisedGrasp>, ObjectMove> {
    let mut advisor = Advisor::default();
    Job::new("advise", Newer::Replaces, wake, move |grasp: &Arc<RecognisedGrasp>, _run| {
        Ok(advisor.advice(grasp).map(|by| by.of_object()))
    })
}

#[cfg(test)]
mod tests {
    use super::super::job::watch::{settled, waker};
    use super::*;
    use palpate_learn::{Sequence, Shipped};

    #[test]
    fn each_grasp_gets_its_advice() {
        let model = Arc::new(Shipped::AnyGripper.model().expect("valid"));
        let t_s: Vec<f32> = (0..300).map(|k| k as f32 / 75.0).collect();
        let (wake, woken) = waker();
        let advice = advice_job(wake);
        for (k, curvature) in [0.0, 8.0].into_iter().enumerate() {
            let values = t_s.iter().flat_map(|_| [curvature, curvature, 3e3, 3e3]).collect();
            let felt = Sequence { t_s: t_s.clone(), values };
            advice.start(Arc::new(RecognisedGrasp::alone(Arc::clone(&model), felt, None)));
            let next = settled(&advice, &woken).expect("advised").expect("no failure");
            assert!(!next.to_string().is_empty() && advice.last().is_some_and(|last| last.number == k as u64 + 1));
        }
    }
}
