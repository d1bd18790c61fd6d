//! Background measurement of what accuracy costs in one scene: a thread "accuracy-study" that grasps it at every setting of
//! the quick study.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use crate::study::Measuring;
use crate::study::accuracy::{AccuracyPlan, AccuracyStudy, AccuracyStudyError};
use palpate_sim::scene::Scene;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// State of the measurement.
#[derive(Clone, Debug)]
pub enum SceneAccuracyState {
    /// Number of settings measured, and of all.
    Measuring(usize, usize),
    /// Finished.
    Ready(Arc<AccuracyStudy>),
    /// Stopped by the user.
    Stopped,
    /// Not possible.
    Failed(Arc<AccuracyStudyError>),
}

/// Newest measurement.
#[derive(Clone, Debug)]
pub struct SceneAccuracyView {
    /// Measured scene.
    pub scene: Arc<Scene>,
    /// State of the measurement.
    pub state: SceneAccuracyState,
}

/// Handle of the measuring thread.
pub type SceneAccuracyJob = BackgroundJob<Box<Scene>, SceneAccuracyView>;

impl SceneAccuracyJob {
    /// Starts the thread.
    pub fn start(wake: Wake) -> std::io::Result<Self> {
        Self::spawn("accuracy-study", wake, |scene, stop, outlet| {
            let scene = Arc::new(*scene);
            let publish = |state| outlet.publish(SceneAccuracyView { scene: Arc::clone(&scene), state });
            publish(SceneAccuracyState::Measuring(0, 0));
            let state = match measured(&scene, stop, outlet) {
                Ok(Some(study)) => SceneAccuracyState::Ready(Arc::new(study)),
                Ok(None) => SceneAccuracyState::Stopped,
                Err(cause) => SceneAccuracyState::Failed(Arc::new(cause)),
            };
            publish(state);
        })
    }
}

fn measured(
    scene: &Arc<Scene>,
    stop: &AtomicBool,
    outlet: &Outlet<SceneAccuracyView>,
) -> Result<Option<AccuracyStudy>, AccuracyStudyError> {
    let object = scene.load_object()?;
    let progress = |done: usize, of: usize| {
        let state = SceneAccuracyState::Measuring(done, of);
        outlet.publish(SceneAccuracyView { scene: Arc::clone(scene), state });
    };
    let how = Measuring { threads: 1, cancelled: stop, progress: &progress };
    Ok(AccuracyPlan::of_one_scene().run_scene(scene, object.as_ref(), &how)?)
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use palpate_sim::objects::EMPTY;
    use std::time::Duration;

    fn empty_hand() -> Box<Scene> {
        let mut scene = Scene::default();
        EMPTY.clone_into(&mut scene.object.source);
        scene.timing.duration_s = 1.0;
        Box::new(scene)
    }

    #[test]
    fn a_scene_is_measured_at_every_setting_or_refused() {
        let (wake, woken) = waker();
        let job = SceneAccuracyJob::start(wake).expect("starts");
        job.ask(empty_hand());
        let view = until(&job, &woken, |view| matches!(view.state, SceneAccuracyState::Ready(_)));
        let SceneAccuracyState::Ready(study) = &view.state else { panic!("{view:?}") };
        assert_eq!(study.rows.len(), AccuracyPlan::of_one_scene().settings.len());
        assert!(
            study.rows.iter().all(|row| row.groups.iter().all(|cost| cost.grasps == 1 && cost.cpu_ms.median > 0.0))
        );
        let mut nowhere = empty_hand();
        "/nowhere/at/all.obj".clone_into(&mut nowhere.object.source);
        job.ask(nowhere);
        let view = until(&job, &woken, |view| matches!(view.state, SceneAccuracyState::Failed(_)));
        let SceneAccuracyState::Failed(cause) = &view.state else { panic!("{view:?}") };
        assert!(cause.to_string().contains("/nowhere/at/all.obj"), "{cause}");
    }

    #[test]
    fn a_measurement_can_be_stopped() {
        let (wake, woken) = waker();
        let mut job = SceneAccuracyJob::start(wake).expect("starts");
        let mut long = empty_hand();
        long.timing.duration_s = 3000.0;
        job.ask(long);
        woken.recv_timeout(Duration::from_secs(600)).expect("it has begun");
        job.give_up();
        until(&job, &woken, |view| matches!(view.state, SceneAccuracyState::Stopped));
    }
}
