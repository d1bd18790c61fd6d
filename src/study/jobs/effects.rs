//! Cost and influence of the effects, measured beside the window. Results are kept in case the scene returns.

use crate::{Explanation, Measuring, StudyProgress, explain_effects};
use palpate_lab::workers::{Job, Newer, Wake, spare_threads};
use palpate_sim::objects::ObjectError;
use palpate_sim::scene::Scene;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time without a change before a scene is measured: a moving slider passes many scenes.
const SETTLE: Duration = Duration::from_millis(300);
/// Time between two looks at whether it has changed.
const LOOK: Duration = Duration::from_millis(10);
/// Number of scenes whose results are kept.
const KEPT: usize = 32;

/// Function that measures a scene: its explanation, `None` when cancelled.
pub type Explain = Arc<dyn Fn(&Scene, &Measuring<'_>) -> Result<Option<Explanation>, ObjectError> + Send + Sync>;

/// Loads a scene's object and explains the scene.
pub fn explain_scene(scene: &Scene, how: &Measuring<'_>) -> Result<Option<Explanation>, ObjectError> {
    let object = scene.load_object()?;
    Ok(explain_effects(scene, object.as_ref(), how))
}

/// The job.
pub fn effects_job(explain: Explain, wake: Wake) -> Job<Scene, Explanation> {
    let mut kept: VecDeque<(Scene, Explanation)> = VecDeque::new();
    Job::new("effects", Newer::Replaces, wake, move |scene: &Scene, run| {
        if let Some((_, known)) = kept.iter().find(|(known, _)| known == scene) {
            return Ok(Some(known.clone()));
        }
        let asked = Instant::now();
        while asked.elapsed() < SETTLE {
            if run.stopped() {
                return Ok(None);
            }
            std::thread::sleep(LOOK);
        }
        let progress =
            |StudyProgress { done, of, .. }: StudyProgress| run.count(done, of, format!("measuring … {done} of {of}"));
        let how = Measuring { threads: spare_threads(), cancelled: run.stop(), progress: &progress };
        let Some(explanation) = explain(scene, &how)? else { return Ok(None) };
        kept.push_back((scene.clone(), explanation.clone()));
        if kept.len() > KEPT {
            kept.pop_front();
        }
        Ok(Some(explanation))
    })
}

#[cfg(test)]
mod tests {
    use super::super::watch::{settled, until, waker};
    use super::*;
    use palpate_sim::objects::EMPTY;
    use palpate_sim::scene::Accuracy;
    use std::sync::mpsc::Receiver;

    fn empty_hand(peak_bar: f64) -> Scene {
        let mut scene = Scene::default();
        EMPTY.clone_into(&mut scene.object.source);
        scene.solver.accuracy = Accuracy::Draft;
        scene.programme.peak_bar = peak_bar;
        scene
    }

    fn job() -> (Job<Scene, Explanation>, Receiver<()>) {
        let (wake, woken) = waker();
        (effects_job(Arc::new(explain_scene), wake), woken)
    }

    #[test]
    fn the_newest_request_is_answered_and_results_are_kept() {
        let (job, woken) = job();
        let [given_up, wanted] = [0.9, 1.0].map(empty_hand);
        job.start(given_up);
        job.start(wanted.clone());
        let first = settled(&job, &woken).expect("ended").expect("measured");
        assert_eq!(job.last().map(|last| Scene::clone(&last.command)), Some(wanted.clone()));
        assert!(first.effects.iter().any(|effect| effect.planned.on && effect.change.norms.curvature_per_m > 0.0));
        job.start(empty_hand(0.5));
        job.start(wanted);
        let again = settled(&job, &woken).expect("ended").expect("known");
        assert_eq!(first.cpu_ms, again.cpu_ms, "measured twice");
    }

    #[test]
    fn a_scene_that_cannot_be_loaded_is_explained() {
        let (job, woken) = job();
        let mut scene = Scene::default();
        "/nowhere/at/all.obj".clone_into(&mut scene.object.source);
        job.start(scene);
        let cause = settled(&job, &woken).expect("ended").expect_err("no such file");
        assert!(cause.to_string().contains("/nowhere/at/all.obj"), "{cause}");
    }

    #[test]
    fn dropping_it_does_not_wait_for_the_measurement() {
        let (job, woken) = job();
        let mut scene = empty_hand(1.0);
        scene.timing.duration_s = 3600.0;
        job.start(scene);
        until(&woken, || job.running().filter(|running| !running.progress.words.is_empty()));
        drop(job);
    }
}
