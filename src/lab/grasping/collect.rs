//! Collecting a data set: many objects, many random poses each, in parallel, into a store.
//!
//! What is collected depends on the plan alone: not on the number of threads, not on how the work is split into shards,
//! not on how often it was interrupted. Every task has a seed of its own, derived from the plan's seed, the object's name
//! and the task's number, and trials are stored in the order of the plan.

use super::run::grasp;
use palpate_sim::frame::Frame;
use palpate_sim::objects::{EMPTY, ObjectError, ObjectModel, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Between, Scene};
use palpate_store::{Store, StoreError};
use palpate_tactile::trial::SimulatedTrial;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// What to collect.
#[derive(Clone, Debug, PartialEq)]
pub struct CollectionPlan {
    /// Everything but the object: poses, gripper, accuracy.
    pub scene: Scene,
    /// Built-in names or files.
    pub objects: Vec<String>,
    /// Trials of each object.
    pub trials: u32,
    /// Other seeds give other poses.
    pub seed: u64,
    /// Which part of the work is done here.
    pub shard: Shard,
}

/// One of several equal parts of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    of: u32,
}

impl Shard {
    /// All of the work.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Part `number`, from 1, of `of` parts; `None` where there is no such part.
    pub fn new(number: u32, of: u32) -> Option<Self> {
        (1..=of).contains(&number).then_some(Self { number, of })
    }
}

/// What a collection came to.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CollectionReport {
    /// Its name in the store.
    pub collection: String,
    /// Trials stored now.
    pub stored: u32,
    /// Trials of this part that were in the store already.
    pub known: u32,
    /// Poses drawn again because the open fingers would have stood inside the object.
    pub redrawn: u32,
    /// Trials that did not stay finite or did not converge; they are stored and marked, and no data set takes them.
    pub unsound: u32,
}

/// How far a collection has come.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CollectionProgress {
    /// Trials of this part that are in the store.
    pub done: u32,
    /// Trials of this part.
    pub of: u32,
    /// The object of the newest one.
    pub object: String,
}

/// Why a collection cannot go on. What has been stored stays, and is not made again.
#[derive(Debug, thiserror::Error)]
pub enum CollectionError {
    /// An object that cannot be loaded.
    #[error("{0}")]
    Object(String),
    /// A store that cannot be written.
    #[error("{0}")]
    Store(StoreError),
}

/// One trial to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Task {
    object: usize,
    /// Which of the object's trials, from 0.
    number: u64,
    seed: u64,
}

/// Where objects stay as they were released, so many grasps follow each other before the object is put down anew.
const SUCCESSION: u64 = 5;

/// The sixteen and the empty hand.
pub fn all_objects() -> Vec<String> {
    catalogue().iter().map(|b| b.name.clone()).chain([EMPTY.to_owned()]).collect()
}

impl CollectionPlan {
    /// Names what is collected: plans that differ in scene or seed have different names, parts of one plan the same.
    pub fn name(&self) -> String {
        let mut scene = self.scene.clone();
        scene.object.source.clear();
        format!("{:016x}", mixed(hash(&scene.to_toml()) ^ mixed(self.seed)))
    }

    fn tasks(&self) -> Vec<Task> {
        let all = self.objects.iter().enumerate().flat_map(|(object, name)| {
            (0..u64::from(self.trials)).map(move |number| Task { object, number, seed: self.seed_of(name, number) })
        });
        let ours = |(k, _): &(usize, Task)| k % self.shard.of as usize + 1 == self.shard.number as usize;
        all.enumerate().filter(ours).map(|(_, task)| task).collect()
    }

    /// Seeds are positive and fit SQLite's integers; zero stands for the scene's own pose.
    fn seed_of(&self, object: &str, number: u64) -> u64 {
        (mixed(mixed(mixed(self.seed) ^ hash(object)) ^ number) >> 1).max(1)
    }
}

/// FNV-1a.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// The finaliser of splitmix64: neighbouring numbers become unrelated ones.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Makes and stores what of the plan is not in the store yet, on `threads` threads. `tell` hears of every step.
pub fn collect(
    plan: &CollectionPlan,
    store: &mut Store,
    threads: usize,
    tell: &mut dyn FnMut(CollectionProgress),
) -> Result<CollectionReport, CollectionError> {
    let collection = plan.name();
    let known = store.collected(&collection).map_err(CollectionError::Store)?;
    let all = plan.tasks();
    let bench = Bench::new(plan, &collection);
    let is_new = |task: &Task| !known.contains(&(bench.stored_name(task.object), task.seed));
    let tasks: Vec<Task> = all.iter().copied().filter(is_new).collect();
    let mut report = CollectionReport { collection: collection.clone(), ..CollectionReport::default() };
    report.known = (all.len() - tasks.len()) as u32;
    let line =
        Line { tasks: &tasks, taken: AtomicUsize::new(0), stored: AtomicUsize::new(0), stop: AtomicBool::new(false) };
    std::thread::scope(|scope| {
        let (sender, made) = sync_channel(2 * threads.max(1));
        for _ in 0..threads.max(1) {
            let (line, bench, sender) = (&line, &bench, sender.clone());
            scope.spawn(move || line.work(bench, &sender));
        }
        drop(sender);
        let outcome = store_in_order(&line, &made, store, &mut report, &mut |done, object| {
            tell(CollectionProgress { done, of: all.len() as u32, object });
        });
        // Whoever still waits for room in the channel finds it closed.
        line.stop.store(true, Ordering::Relaxed);
        drop(made);
        outcome
    })?;
    Ok(report)
}

/// A trial that has been made, and how often its pose was drawn again; or why its object cannot be loaded.
type Made = Result<(SimulatedTrial, u32), String>;

/// The tasks in order, shared by all threads.
struct Line<'a> {
    tasks: &'a [Task],
    taken: AtomicUsize,
    stored: AtomicUsize,
    stop: AtomicBool,
}

/// How far threads may run ahead of the slowest one: finished trials wait in memory, a quarter of a megabyte each.
const MOST_AHEAD: usize = 256;

impl Line<'_> {
    fn work(&self, bench: &Bench<'_>, made: &SyncSender<(usize, Made)>) {
        loop {
            let k = self.taken.fetch_add(1, Ordering::Relaxed);
            let Some(task) = self.tasks.get(k) else { return };
            while k > self.stored.load(Ordering::Relaxed) + MOST_AHEAD && !self.stop.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(1));
            }
            if self.stop.load(Ordering::Relaxed) {
                return;
            }
            // Others would wait for this task for ever if a fault ended the thread.
            let make = std::panic::AssertUnwindSafe(|| bench.make(*task));
            let outcome = std::panic::catch_unwind(make)
                .unwrap_or_else(|_| Err(format!("grasping with seed {} met a fault of the program", task.seed)));
            if made.send((k, outcome)).is_err() {
                return;
            }
        }
    }
}

/// Stores trials as they become due, several at a time where they are ready.
fn store_in_order(
    line: &Line<'_>,
    made: &Receiver<(usize, Made)>,
    store: &mut Store,
    report: &mut CollectionReport,
    tell: &mut dyn FnMut(u32, String),
) -> Result<(), CollectionError> {
    let mut waiting: BTreeMap<usize, Made> = BTreeMap::new();
    let mut due = 0;
    for (k, outcome) in made {
        waiting.insert(k, outcome);
        let mut ready = Vec::new();
        // A failure has its turn too: what comes before it in the plan is stored first.
        let mut failure = None;
        while let Some(next) = waiting.remove(&due).filter(|_| failure.is_none()) {
            match next {
                Ok(next) => ready.push(next),
                Err(cause) => failure = Some(CollectionError::Object(cause)),
            }
            due += 1;
        }
        let Some((newest, _)) = ready.last() else {
            match failure {
                Some(failure) => return Err(failure),
                None => continue,
            }
        };
        let object = newest.header.object.clone();
        report.stored +=
            store.insert_collected(ready.iter().map(|(trial, _)| trial)).map_err(CollectionError::Store)?;
        report.redrawn += ready.iter().map(|(_, redrawn)| redrawn).sum::<u32>();
        let unsound = |(trial, _): &&(SimulatedTrial, u32)| !trial.data.quality.is_sound();
        report.unsound += ready.iter().filter(unsound).count() as u32;
        line.stored.store(due, Ordering::Relaxed);
        tell(report.known + due as u32, object);
        if let Some(failure) = failure {
            return Err(failure);
        }
    }
    Ok(())
}

/// An object on the bench: loaded when its first trial is due.
struct OnBench {
    model: Option<ObjectModel>,
    sampler: PoseSampler,
}

struct Bench<'a> {
    plan: &'a CollectionPlan,
    collection: &'a str,
    objects: Vec<OnceLock<Result<OnBench, String>>>,
}

impl<'a> Bench<'a> {
    fn new(plan: &'a CollectionPlan, collection: &'a str) -> Self {
        Self { plan, collection, objects: plan.objects.iter().map(|_| OnceLock::new()).collect() }
    }

    /// The name under which trials of an object are stored: files go by their name without folder and extension.
    fn stored_name(&self, object: usize) -> String {
        let source = std::path::Path::new(&self.plan.objects[object]);
        source.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
    }

    fn load(&self, object: usize) -> Result<OnBench, ObjectError> {
        let mut scene = self.plan.scene.clone();
        scene.object.source = palpate_sim::objects::anchored(&self.plan.objects[object]);
        let model = scene.load_object()?;
        let sampler = PoseSampler::new(&scene, model.as_ref());
        Ok(OnBench { model, sampler })
    }

    fn make(&self, task: Task) -> Made {
        let slot = &self.objects[task.object];
        let loaded = slot.get_or_init(|| self.load(task.object).map_err(|error| error.to_string()));
        let on_bench = loaded.as_ref().map_err(Clone::clone)?;
        let model = on_bench.model.as_ref();
        // What a trial finds depends on those before it in its succession. They are grasped again rather than looked
        // up, so that every trial can be made by itself, in any order.
        let first = match self.plan.scene.pose.between {
            Between::Reposed => task.number,
            Between::AsReleased => task.number - task.number % SUCCESSION,
        };
        let mut released: Option<Frame> = None;
        for number in first..task.number {
            let seed = self.plan.seed_of(&self.plan.objects[task.object], number);
            let (scene, _) = on_bench.sampler.draw_after(model, seed, released.as_ref());
            released = grasp(&scene, model, seed).data.frames.pop();
        }
        let (scene, redrawn) = on_bench.sampler.draw_after(model, task.seed, released.as_ref());
        let mut trial = grasp(&scene, model, task.seed);
        trial.header.collection = Some(self.collection.to_owned());
        Ok((trial, redrawn))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_store::encode_frames;

    fn plan() -> CollectionPlan {
        let mut scene = Scene::default();
        scene.timing.duration_s = 0.4;
        let objects = ["ball", "smallcube", EMPTY].map(str::to_owned).to_vec();
        CollectionPlan { scene, objects, trials: 5, seed: 1, shard: Shard::WHOLE }
    }

    fn store(folder: &tempfile::TempDir, name: &str) -> Store {
        Store::open(&folder.path().join(name)).expect("opens")
    }

    /// Everything of a store but dates and identities.
    fn contents(store: &Store) -> Vec<(String, u64, Vec<u8>, String)> {
        let rows = store.list(true).expect("lists");
        let of = |row: &palpate_store::TrialRow| {
            let trial = store.load(row.id).expect("whole");
            (row.object.clone(), row.seed, encode_frames(trial.frames()), trial.header.scene.to_toml())
        };
        rows.iter().map(of).collect()
    }

    #[test]
    fn data_do_not_depend_on_threads_shards_or_interruptions() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = |name: &str, plan: &CollectionPlan, threads: usize| {
            let mut store = store(&folder, name);
            let report = collect(plan, &mut store, threads, &mut |_| ()).expect("collects");
            (store, report)
        };
        let (one, report) = run("one", &plan(), 1);
        assert_eq!((report.stored, report.known, report.unsound), (15, 0, 0));
        let whole = contents(&one);
        assert!(contents(&run("two", &plan(), 2).0) == whole, "two threads");

        // In three parts, merged.
        let mut merged = store(&folder, "merged");
        for number in 1..=3 {
            let shard = Shard::new(number, 3).expect("one of three");
            let name = format!("part{number}");
            assert_eq!(run(&name, &CollectionPlan { shard, ..plan() }, 2).1.stored, 5);
            merged.merge_from(&folder.path().join(name)).expect("merges");
        }
        let mut sorted = whole.clone();
        sorted.sort();
        let mut parts = contents(&merged);
        parts.sort();
        assert!(parts == sorted, "three parts");

        // Begun with fewer trials, taken up again with more: those that are there are not made again.
        let (_, first) = run("resumed", &CollectionPlan { trials: 2, ..plan() }, 2);
        let (resumed, second) = run("resumed", &plan(), 2);
        assert_eq!((first.stored, second.stored, second.known), (6, 9, 6));
        let mut all = contents(&resumed);
        all.sort();
        assert!(all == sorted, "resumed");
    }

    #[test]
    fn successions_of_released_objects_do_not_depend_on_threads_either() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut plan = CollectionPlan { trials: 7, objects: vec!["smallcube".to_owned()], ..plan() };
        plan.scene.timing.duration_s = 4.0;
        plan.scene.pose.between = Between::AsReleased;
        let run = |name: &str, trials: u32, threads: usize| {
            let mut store = store(&folder, name);
            collect(&CollectionPlan { trials, ..plan.clone() }, &mut store, threads, &mut |_| ()).expect("collects");
            store
        };
        let whole = contents(&run("one", 7, 1));
        assert!(contents(&run("two", 7, 2)) == whole);
        run("resumed", 3, 2);
        assert!(contents(&run("resumed", 7, 2)) == whole);
        let shift = |k: usize| Scene::from_toml(&whole[k].3).expect("a scene").object.shift;
        assert_eq!((shift(0), shift(5)), ([0.0; 2], [0.0; 2]), "put down anew after five");
        assert!((1..5).any(|k| shift(k) != [0.0; 2]), "left where the fingers pushed it");
    }

    #[test]
    fn plans_and_seeds_are_told_apart() {
        let other_seed = CollectionPlan { seed: 2, ..plan() };
        let mut other_scene = plan();
        other_scene.scene.object.fixed = true;
        let names = [plan().name(), other_seed.name(), other_scene.name()];
        assert!(names[0] != names[1] && names[0] != names[2] && names[1] != names[2]);
        assert_eq!(CollectionPlan { trials: 50, objects: all_objects(), ..plan() }.name(), names[0]);
        let mut seeds: Vec<u64> =
            CollectionPlan { trials: 1000, objects: all_objects(), ..plan() }.tasks().iter().map(|t| t.seed).collect();
        let count = seeds.len();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!((seeds.len(), count), (17_000, 17_000));
        assert!(seeds[0] > 0 && i64::try_from(seeds[16_999]).is_ok());
        assert!(Shard::new(0, 3).is_none() && Shard::new(4, 3).is_none());
    }

    #[test]
    fn an_object_that_cannot_be_loaded_stops_the_work_and_keeps_what_is_done() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut store = store(&folder, "store");
        let objects = ["ball", "/nowhere/at/all.urdf"].map(str::to_owned).to_vec();
        let outcome = collect(&CollectionPlan { objects, ..plan() }, &mut store, 2, &mut |_| ());
        assert!(
            matches!(&outcome, Err(CollectionError::Object(text)) if text.contains("/nowhere/at/all.urdf")),
            "{outcome:?}"
        );
        assert_eq!(store.list(false).expect("lists").len(), 5);
    }
}
