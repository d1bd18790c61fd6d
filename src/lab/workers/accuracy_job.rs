//! Accuracy job: a thread that measures cost and error of a scene's accuracy. It runs whole grasps of its own, so that the
//! numbers stand there long before the watched grasp is over; another scene makes it start over.

use super::latest::Latest;
use super::messages::{MeasuredAccuracy, Wake};
use crate::study::accuracy_cost;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

struct Job {
    number: u64,
    scene: Scene,
    object: Option<Arc<ObjectModel>>,
}

/// Handle of the thread. Dropping it cancels the measurement and ends the thread.
#[derive(Debug)]
pub(super) struct AccuracyJob {
    jobs: Option<Sender<Job>>,
    /// Number of the newest job; an older one gives up.
    newest: Arc<AtomicU64>,
    measured: Option<Scene>,
    thread: Option<JoinHandle<()>>,
}

impl AccuracyJob {
    /// Starts the thread; results go to the slot.
    pub(super) fn start(results: Arc<Latest<MeasuredAccuracy>>, wake: Wake) -> std::io::Result<Self> {
        let (jobs, inbox) = channel();
        let newest = Arc::new(AtomicU64::new(0));
        let watch = Arc::clone(&newest);
        let work = move || measure_all(&inbox, &watch, &results, &wake);
        let thread = std::thread::Builder::new().name("accuracy".to_owned()).spawn(work)?;
        Ok(Self { jobs: Some(jobs), newest, measured: None, thread: Some(thread) })
    }

    /// Measures a scene, unless it is the one measured last.
    pub(super) fn measure(&mut self, scene: &Scene, object: Option<Arc<ObjectModel>>) {
        if self.measured.as_ref() == Some(scene) {
            return;
        }
        self.measured = Some(scene.clone());
        let number = self.newest.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(jobs) = &self.jobs {
            // Without its thread nothing is measured, which shows.
            let _gone = jobs.send(Job { number, scene: scene.clone(), object });
        }
    }
}

impl Drop for AccuracyJob {
    fn drop(&mut self) {
        self.newest.fetch_add(1, Ordering::Relaxed);
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // A panic there loses only the measurement.
            let _ended = thread.join();
        }
    }
}

fn measure_all(inbox: &Receiver<Job>, newest: &AtomicU64, results: &Latest<MeasuredAccuracy>, wake: &Wake) {
    while let Ok(job) = inbox.recv() {
        let outdated = || newest.load(Ordering::Relaxed) != job.number;
        if let Some(cost) = accuracy_cost(&job.scene, job.object.as_deref(), &outdated).filter(|_| !outdated()) {
            results.publish(Arc::new(MeasuredAccuracy { scene: job.scene, cost }));
            wake();
        }
    }
}
