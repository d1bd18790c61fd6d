//! Background measurement of cost and influence of the effects: a new request replaces older ones, and results are kept
//! in case the scene returns.

use super::latest::Latest;
use super::messages::Wake;
use crate::study::{Explanation, Measuring, explain_effects};
use palpate_sim::objects::ObjectError;
use palpate_sim::scene::Scene;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time without a change before a scene is measured: a moving slider passes many scenes.
const SETTLE: Duration = Duration::from_millis(300);
/// Number of scenes whose results are kept.
const KEPT: usize = 32;

/// State of the measurement of a scene.
#[derive(Clone, Debug)]
pub enum EffectsState {
    /// Number of effects measured, and of all.
    Measuring(usize, usize),
    /// Finished.
    Ready(Arc<Explanation>),
    /// The object could not be loaded.
    Failed(Arc<ObjectError>),
}

/// Newest measurement.
#[derive(Clone, Debug)]
pub struct EffectsView {
    /// Measured scene.
    pub scene: Arc<Scene>,
    /// State of the measurement.
    pub state: EffectsState,
    /// Newest finished measurement, of this scene or of one before it.
    pub last: Option<Arc<Explanation>>,
}

/// Function that measures a scene: its explanation, `None` when cancelled.
pub type Explain = Arc<dyn Fn(&Scene, &Measuring<'_>) -> Result<Option<Explanation>, ObjectError> + Send + Sync>;

/// Loads a scene's object and explains the scene.
pub fn explain_scene(scene: &Scene, how: &Measuring<'_>) -> Result<Option<Explanation>, ObjectError> {
    let object = scene.load_object()?;
    Ok(explain_effects(scene, object.as_ref(), how))
}

/// Scene to measure, with a flag that cancels the measurement.
struct MeasureRequest {
    scene: Arc<Scene>,
    cancelled: Arc<AtomicBool>,
}

/// Handle of the measuring thread. Dropping it cancels the measurement and ends the thread.
#[derive(Debug)]
pub struct EffectsWorker {
    /// `None` while the thread is being ended.
    commands: Option<Sender<MeasureRequest>>,
    asked: Option<(Arc<Scene>, Arc<AtomicBool>)>,
    view: Arc<Latest<EffectsView>>,
    thread: Option<JoinHandle<()>>,
}

impl EffectsWorker {
    /// Starts the thread.
    pub fn start(explain: Explain, wake: Wake) -> std::io::Result<Self> {
        let (commands, inbox) = channel();
        let view = Arc::new(Latest::default());
        let job = MeasuringJob { explain, view: Arc::clone(&view), wake, kept: VecDeque::new(), last: None };
        let thread = std::thread::Builder::new().name("effects".to_owned()).spawn(move || job.work(&inbox))?;
        Ok(Self { commands: Some(commands), asked: None, view, thread: Some(thread) })
    }

    /// Requests the measurement of a scene, in place of any earlier request.
    pub fn ask(&mut self, scene: &Scene) {
        if self.asked().is_some_and(|asked| asked == scene) {
            return;
        }
        self.give_up();
        let command = MeasureRequest { scene: Arc::new(scene.clone()), cancelled: Arc::new(AtomicBool::new(false)) };
        self.asked = Some((Arc::clone(&command.scene), Arc::clone(&command.cancelled)));
        if let Some(commands) = &self.commands {
            // Sending fails only if the thread panicked, which standard error reports; the rest of the window works.
            let _heard = commands.send(command);
        }
    }

    /// Cancels the current measurement; a new request may follow.
    pub fn give_up(&mut self) {
        if let Some((_, cancelled)) = self.asked.take() {
            cancelled.store(true, Ordering::Relaxed);
        }
    }

    /// Scene of the last request.
    pub fn asked(&self) -> Option<&Scene> {
        self.asked.as_ref().map(|(scene, _)| scene.as_ref())
    }

    /// Newest measurement.
    pub fn view(&self) -> Option<Arc<EffectsView>> {
        self.view.get()
    }
}

impl Drop for EffectsWorker {
    fn drop(&mut self) {
        self.give_up();
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            let _ended = thread.join();
        }
    }
}

/// State owned by the thread.
struct MeasuringJob {
    explain: Explain,
    view: Arc<Latest<EffectsView>>,
    wake: Wake,
    kept: VecDeque<(Arc<Scene>, Arc<Explanation>)>,
    last: Option<Arc<Explanation>>,
}

impl MeasuringJob {
    fn work(mut self, inbox: &Receiver<MeasureRequest>) {
        let mut next = inbox.recv().ok();
        while let Some(command) = next.take() {
            let known = self.kept.iter().find(|(scene, _)| *scene == command.scene).map(|(_, known)| Arc::clone(known));
            if let Some(known) = known {
                self.last = Some(Arc::clone(&known));
                self.publish(&command.scene, EffectsState::Ready(known));
            } else {
                self.publish(&command.scene, EffectsState::Measuring(0, 0));
                match inbox.recv_timeout(SETTLE) {
                    Ok(newer) => {
                        next = Some(newer);
                        continue;
                    }
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => self.measure(&command),
                }
            }
            next = inbox.recv().ok();
        }
    }

    fn measure(&mut self, command: &MeasureRequest) {
        let progress = |done: usize, of: usize| self.publish(&command.scene, EffectsState::Measuring(done, of));
        // Leaves one core to the simulation on screen.
        let threads = std::thread::available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1));
        let how = Measuring { threads, cancelled: &command.cancelled, progress: &progress };
        let explanation = match (self.explain)(&command.scene, &how) {
            Ok(Some(explanation)) => Arc::new(explanation),
            Ok(None) => return,
            Err(cause) => return self.publish(&command.scene, EffectsState::Failed(Arc::new(cause))),
        };
        self.last = Some(Arc::clone(&explanation));
        self.publish(&command.scene, EffectsState::Ready(Arc::clone(&explanation)));
        self.kept.push_back((Arc::clone(&command.scene), explanation));
        if self.kept.len() > KEPT {
            self.kept.pop_front();
        }
    }

    fn publish(&self, scene: &Arc<Scene>, state: EffectsState) {
        let (scene, last) = (Arc::clone(scene), self.last.clone());
        self.view.publish(Arc::new(EffectsView { scene, state, last }));
        (self.wake)();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::objects::EMPTY;
    use palpate_sim::scene::Accuracy;

    fn empty_hand(peak_bar: f64) -> Scene {
        let mut scene = Scene::default();
        EMPTY.clone_into(&mut scene.object.source);
        scene.solver.accuracy = Accuracy::Draft;
        scene.programme.peak_bar = peak_bar;
        scene
    }

    fn start() -> (EffectsWorker, Receiver<()>) {
        let (wake, woken) = channel();
        let wake: Wake = Arc::new(move || {
            // The test may have dropped its receiver.
            let _heard = wake.send(());
        });
        (EffectsWorker::start(Arc::new(explain_scene), wake).expect("a thread"), woken)
    }

    fn measured(worker: &EffectsWorker, woken: &Receiver<()>, scene: &Scene) -> Arc<Explanation> {
        loop {
            woken.recv_timeout(Duration::from_secs(600)).expect("something happens");
            let view = worker.view().expect("published");
            match &view.state {
                EffectsState::Ready(explanation) if *view.scene == *scene => return Arc::clone(explanation),
                EffectsState::Failed(cause) => panic!("{cause}"),
                _ => {}
            }
        }
    }

    #[test]
    fn the_newest_request_is_answered_and_results_are_kept() {
        let (mut worker, woken) = start();
        let [given_up, wanted] = [0.9, 1.0].map(empty_hand);
        worker.ask(&given_up);
        worker.ask(&wanted);
        let first = measured(&worker, &woken, &wanted);
        assert!(first.effects.iter().any(|effect| effect.planned.on && effect.change.norms.curvature_per_m > 0.0));
        worker.ask(&empty_hand(0.5));
        worker.ask(&wanted);
        assert!(Arc::ptr_eq(&first, &measured(&worker, &woken, &wanted)), "measured twice");
    }

    #[test]
    fn a_scene_that_cannot_be_loaded_is_explained() {
        let (mut worker, woken) = start();
        let mut scene = Scene::default();
        "/nowhere/at/all.obj".clone_into(&mut scene.object.source);
        worker.ask(&scene);
        let cause = loop {
            woken.recv_timeout(Duration::from_secs(600)).expect("something happens");
            if let Some(EffectsState::Failed(cause)) = worker.view().map(|view| view.state.clone()) {
                break cause;
            }
        };
        assert!(cause.to_string().contains("/nowhere/at/all.obj"), "{cause}");
    }

    #[test]
    fn dropping_it_does_not_wait_for_the_measurement() {
        let (mut worker, woken) = start();
        let mut scene = empty_hand(1.0);
        scene.timing.duration_s = 3600.0;
        worker.ask(&scene);
        woken.recv_timeout(Duration::from_secs(600)).expect("it has begun");
        drop(worker);
    }
}
