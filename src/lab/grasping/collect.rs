//! Collecting a data set: many objects, many random poses each, in parallel, into a store.
//!
//! The plan alone determines the data; the number of threads, the split into shards and interruptions do not change
//! them. Every task has its own seed, derived from the plan's seed, the object's name and the task's number, and trials
//! are stored in the order of the plan.

use super::agreement::{Recompute, grasp_soundly};
use palpate_sim::objects::{EMPTY, ObjectError, ObjectModel, RandomShape, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Between, Scene};
use palpate_store::labels::{ClassClash, Classes};
use palpate_store::{Store, StoreError};
use palpate_tactile::trial::SimulatedTrial;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Scene, objects and amount of a collection.
#[derive(Clone, Debug, PartialEq)]
pub struct CollectionPlan {
    /// Scene without the object: poses, gripper, accuracy.
    pub scene: Scene,
    /// Names of built-in objects, or paths of object files.
    pub objects: Vec<String>,
    /// Their classes, in the same order; empty where they have their own names.
    pub classes: Vec<String>,
    /// Trials of each object.
    pub trials: u32,
    /// Seed of the poses.
    pub seed: u64,
    /// Part of the work to do.
    pub shard: Shard,
    /// When a grasp is computed again at a finer accuracy.
    pub recompute: Recompute,
}

/// One of several equal parts of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    of: u32,
}

impl Shard {
    /// The whole work.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Part `number`, from 1, of `of` parts; `None` if there is no such part.
    pub fn new(number: u32, of: u32) -> Option<Self> {
        (1..=of).contains(&number).then_some(Self { number, of })
    }

    /// True for the units of this part, by their place in the whole work.
    pub fn has(self, place: usize) -> bool {
        place % self.of as usize + 1 == self.number as usize
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// A text that names no part.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write K/N with K from 1 to N, as in 3/8")]
pub struct NoShard;

impl std::str::FromStr for Shard {
    type Err = NoShard;

    fn from_str(text: &str) -> Result<Self, NoShard> {
        let parsed = text.split_once('/').and_then(|(number, of)| Self::new(number.parse().ok()?, of.parse().ok()?));
        parsed.ok_or(NoShard)
    }
}

/// Result of a collection.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CollectionReport {
    /// Its name in the store.
    pub collection: String,
    /// Trials stored by this run.
    pub stored: u32,
    /// Trials of this part that the store already held.
    pub known: u32,
    /// Poses redrawn because the open fingers would have intersected the object.
    pub redrawn: u32,
    /// Trials computed again at a finer accuracy than the scene asks for.
    pub recomputed: u32,
    /// Ended before the plan was done; a new run of the same plan resumes.
    pub interrupted: bool,
    /// Trials with non-finite values, without convergence, or that do not come to rest at any accuracy: stored and
    /// marked, but excluded from data sets.
    pub unsound: u32,
}

/// Progress of a collection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CollectionProgress {
    /// Trials of this part in the store so far.
    pub done: u32,
    /// All trials of this part.
    pub of: u32,
    /// Object of the newest trial.
    pub object: String,
}

/// Error that ends a collection. Stored trials stay, and a new run skips them.
#[derive(Debug, thiserror::Error)]
pub enum CollectionError {
    /// An object failed to load.
    #[error(transparent)]
    Object(#[from] Arc<ObjectError>),
    /// Two objects would be one class.
    #[error(transparent)]
    OneClass(#[from] ClassClash),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A grasp panicked; standard error says where.
    #[error("internal error in the grasp with seed {seed}; earlier trials are stored. Please report it")]
    Internal {
        /// Its seed.
        seed: u64,
    },
}

/// Trial to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Task {
    object: usize,
    /// Index among the object's trials, from 0.
    number: u64,
    seed: u64,
}

/// Grasps in a row before the object is placed again, if objects stay as released: as many as the study of successive
/// grasps looks at.
pub const SUCCESSION: u64 = 8;

/// The sixteen and the empty hand.
pub fn all_objects() -> Vec<String> {
    catalogue().iter().map(|b| b.name.clone()).chain([EMPTY.to_owned()]).collect()
}

impl CollectionPlan {
    /// Trials of the sixteen and the empty hand.
    pub fn of_all_objects(scene: Scene, trials: u32, seed: u64) -> Self {
        let (objects, recompute) = (all_objects(), Recompute::default());
        Self { scene, objects, classes: Vec::new(), trials, seed, shard: Shard::WHOLE, recompute }
    }

    /// Loads the files of the plan, and refuses two objects in one class, before anything is stored.
    pub fn ready(&self) -> Result<ReadyCollection<'_>, CollectionError> {
        let mut ready = ReadyCollection::new(self);
        let mut classes = Classes::default();
        for object in 0..self.objects.len() {
            let source = &self.objects[object];
            let content = ready.prepare(object)?;
            let class = ready.names[object].clone();
            classes.take(&class, content, source, "name a class of each with --class")?;
        }
        Ok(ready)
    }

    /// Name of the collection: plans that differ in scene or seed have different names, parts of one plan the same.
    pub fn name(&self) -> String {
        let mut scene = self.scene.clone();
        scene.object.source.clear();
        let agreement = match self.recompute {
            Recompute::Unsettled => 0,
            Recompute::UntilAgreement => mixed(1),
        };
        let succession = match scene.pose.between {
            Between::Reposed => 0,
            Between::AsReleased | Between::Guided => mixed(SUCCESSION),
        };
        format!("{:016x}", mixed(hash(&scene.to_toml()) ^ mixed(self.seed) ^ agreement ^ succession))
    }

    fn tasks(&self) -> Vec<Task> {
        let all = self.objects.iter().enumerate().flat_map(|(object, name)| {
            (0..u64::from(self.trials)).map(move |number| Task { object, number, seed: self.seed_of(name, number) })
        });
        let ours = |(k, _): &(usize, Task)| self.shard.has(*k);
        all.enumerate().filter(ours).map(|(_, task)| task).collect()
    }

    /// Seed of a trial: positive and within SQLite's integers, because zero means the scene's own pose.
    fn seed_of(&self, object: &str, number: u64) -> u64 {
        (mixed(mixed(mixed(self.seed) ^ hash(object)) ^ number) >> 1).max(1)
    }
}

/// FNV-1a hash.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Finaliser of splitmix64: maps neighbouring numbers to unrelated ones.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Collects a plan; see [`ReadyCollection::collect`].
pub fn collect(
    plan: &CollectionPlan,
    store: &mut Store,
    threads: usize,
    progress: &mut dyn FnMut(CollectionProgress) -> ControlFlow<()>,
) -> Result<CollectionReport, CollectionError> {
    plan.ready()?.collect(store, threads, progress)
}

impl ReadyCollection<'_> {
    /// Simulates and stores the trials of the plan that the store lacks, on `threads` threads. `progress` receives
    /// the progress, and ends the collection by [`ControlFlow::Break`].
    pub fn collect(
        &self,
        store: &mut Store,
        threads: usize,
        progress: &mut dyn FnMut(CollectionProgress) -> ControlFlow<()>,
    ) -> Result<CollectionReport, CollectionError> {
        let known = store.collected(&self.collection)?;
        let all = self.plan.tasks();
        let is_new = |task: &Task| !known.contains(&(self.names[task.object].clone(), task.seed));
        let tasks: Vec<Task> = all.iter().copied().filter(is_new).collect();
        let mut report = CollectionReport { collection: self.collection.clone(), ..CollectionReport::default() };
        report.known = (all.len() - tasks.len()) as u32;
        let line = Line {
            tasks: &tasks,
            taken: AtomicUsize::new(0),
            stored: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
        };
        std::thread::scope(|scope| {
            let (sender, made) = sync_channel(2 * threads.max(1));
            for _ in 0..threads.max(1) {
                let (line, sender) = (&line, sender.clone());
                scope.spawn(move || line.work(self, &sender));
            }
            drop(sender);
            let outcome = store_in_order(&line, &made, store, &mut report, &mut |done, object| {
                progress(CollectionProgress { done, of: all.len() as u32, object })
            });
            // Threads that wait for room in the channel find it closed.
            line.stop.store(true, Ordering::Relaxed);
            drop(made);
            outcome
        })?;
        Ok(report)
    }
}

/// A finished trial and how often its pose was redrawn, or the reason for a failure.
type Made = Result<(SimulatedTrial, u32), CollectionError>;

/// Queue of the tasks in order, shared by all threads.
struct Line<'a> {
    tasks: &'a [Task],
    taken: AtomicUsize,
    stored: AtomicUsize,
    stop: AtomicBool,
}

/// Largest lead of a thread over the slowest, in trials: finished trials wait in memory, a quarter of a megabyte each.
const MOST_AHEAD: usize = 256;

impl Line<'_> {
    fn work(&self, ready: &ReadyCollection<'_>, made: &SyncSender<(usize, Made)>) {
        loop {
            let k = self.taken.fetch_add(1, Ordering::Relaxed);
            let Some(task) = self.tasks.get(k) else { return };
            while k > self.stored.load(Ordering::Relaxed) + MOST_AHEAD && !self.stop.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(1));
            }
            if self.stop.load(Ordering::Relaxed) {
                return;
            }
            // If a panic ended the thread, the other threads would wait for this task forever.
            let make = std::panic::AssertUnwindSafe(|| ready.make(*task));
            let outcome = std::panic::catch_unwind(make).unwrap_or(Err(CollectionError::Internal { seed: task.seed }));
            if made.send((k, outcome)).is_err() {
                return;
            }
        }
    }
}

/// Stores trials in the order of the plan, several at a time if they are ready.
fn store_in_order(
    line: &Line<'_>,
    made: &Receiver<(usize, Made)>,
    store: &mut Store,
    report: &mut CollectionReport,
    progress: &mut dyn FnMut(u32, String) -> ControlFlow<()>,
) -> Result<(), CollectionError> {
    let mut waiting: BTreeMap<usize, Made> = BTreeMap::new();
    let (known, mut due) = (report.known, 0);
    for (k, outcome) in made {
        waiting.insert(k, outcome);
        let mut ready = Vec::new();
        // A failure waits its turn too: trials before it in the plan are stored first.
        let mut failure = None;
        while let Some(next) = waiting.remove(&due).filter(|_| failure.is_none()) {
            match next {
                Ok(next) => ready.push(next),
                Err(cause) => failure = Some(cause),
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
        let stored = store.insert_collected(ready.iter().map(|(trial, _)| trial))?;
        report.stored += stored;
        report.known += ready.len() as u32 - stored;
        report.redrawn += ready.iter().map(|(_, redrawn)| redrawn).sum::<u32>();
        let unsound = |(trial, _): &&(SimulatedTrial, u32)| !trial.data.quality.is_sound();
        report.unsound += ready.iter().filter(unsound).count() as u32;
        let recomputed = |(trial, _): &&(SimulatedTrial, u32)| trial.data.quality.recomputed.is_some();
        report.recomputed += ready.iter().filter(recomputed).count() as u32;
        line.stored.store(due, Ordering::Relaxed);
        let go_on = progress(known + due as u32, object);
        if let Some(failure) = failure {
            return Err(failure);
        }
        if go_on.is_break() && due < line.tasks.len() {
            report.interrupted = true;
            return Ok(());
        }
    }
    Ok(())
}

/// Loaded object with its pose sampler; a built-in one is loaded for its first trial.
struct OnBench {
    model: Option<ObjectModel>,
    sampler: PoseSampler,
}

/// A plan whose objects are at hand, each in a class of its own.
pub struct ReadyCollection<'a> {
    plan: &'a CollectionPlan,
    collection: String,
    /// Names of the objects in the store.
    names: Vec<String>,
    objects: Vec<OnceLock<Result<OnBench, Arc<ObjectError>>>>,
}

impl<'a> ReadyCollection<'a> {
    fn new(plan: &'a CollectionPlan) -> Self {
        let objects = plan.objects.iter().map(|_| OnceLock::new()).collect();
        Self { plan, collection: plan.name(), names: plan.objects.clone(), objects }
    }

    /// Loads the object of a file; returns the hash of its content. Those without a file cannot fail.
    fn prepare(&mut self, object: usize) -> Result<u64, CollectionError> {
        let source = &self.plan.objects[object];
        let is_named = source == EMPTY || RandomShape::seed_of(source).is_some();
        let (mut name, mut content) = (source.clone(), 0);
        if !is_named && !catalogue().iter().any(|built_in| built_in.name == *source) {
            let loaded = self.load(object).map_err(Arc::new)?;
            (name, content) = loaded.model.as_ref().map_or((name, 0), |model| (model.name.clone(), model.content));
            self.objects[object] = OnceLock::from(Ok(loaded));
        }
        self.names[object] = self.plan.classes.get(object).filter(|_| source != EMPTY).cloned().unwrap_or(name);
        Ok(content)
    }

    fn load(&self, object: usize) -> Result<OnBench, ObjectError> {
        let mut scene = self.plan.scene.clone();
        let source = palpate_sim::objects::anchored(&self.plan.objects[object]);
        scene.object.name.take_if(|_| scene.object.source != source);
        scene.object.source = source;
        let mut model = scene.load_object()?;
        if let (Some(model), Some(class)) = (&mut model, self.plan.classes.get(object)) {
            model.name.clone_from(class);
        }
        let sampler = PoseSampler::new(&scene, model.as_ref());
        Ok(OnBench { model, sampler })
    }

    fn make(&self, task: Task) -> Made {
        let slot = &self.objects[task.object];
        let loaded = slot.get_or_init(|| self.load(task.object).map_err(Arc::new));
        let on_bench = loaded.as_ref().map_err(Arc::clone)?;
        let model = on_bench.model.as_ref();
        // The object's pose depends on the earlier grasps of the same succession. They are simulated again instead of
        // read from the store, so that trials can be simulated independently and in any order.
        let first = match self.plan.scene.pose.between {
            Between::Reposed => task.number,
            Between::AsReleased | Between::Guided => task.number - task.number % SUCCESSION,
        };
        let mut before: Option<SimulatedTrial> = None;
        for number in first..task.number {
            let seed = self.plan.seed_of(&self.plan.objects[task.object], number);
            let released = before.as_ref().and_then(|trial| trial.frames().last());
            let (scene, _) = on_bench.sampler.draw_after(model, seed, released);
            before = Some(grasp_soundly(&scene, model, seed, self.plan.recompute));
        }
        let released = before.as_ref().and_then(|trial| trial.frames().last());
        let (scene, redrawn) = on_bench.sampler.draw_after(model, task.seed, released);
        let mut trial = grasp_soundly(&scene, model, task.seed, self.plan.recompute);
        trial.header.collection = Some(self.collection.clone());
        if let Some(origin) = trial.header.origin.as_mut().filter(|_| on_bench.sampler.is_left(&scene)) {
            origin.after = before.and_then(|trial| trial.header.identity());
        }
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
        CollectionPlan { objects, ..CollectionPlan::of_all_objects(scene, 5, 1) }
    }

    fn store(folder: &tempfile::TempDir, name: &str) -> Store {
        Store::open(&folder.path().join(name)).expect("opens")
    }

    /// Content of a store without dates and identities.
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
            let report = collect(plan, &mut store, threads, &mut |_| ControlFlow::Continue(())).expect("collects");
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

        // Started with fewer trials, resumed with more: stored trials are skipped.
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
        let mut plan = CollectionPlan { trials: 10, objects: vec!["smallcube".to_owned()], ..plan() };
        plan.scene.timing.duration_s = 4.0;
        plan.scene.pose.between = Between::AsReleased;
        let run =
            |name: &str, trials: u32, threads: usize| {
                let mut store = store(&folder, name);
                collect(&CollectionPlan { trials, ..plan.clone() }, &mut store, threads, &mut |_| {
                    ControlFlow::Continue(())
                })
                .expect("collects");
                store
            };
        let whole = contents(&run("one", 10, 1));
        assert!(contents(&run("two", 10, 2)) == whole);
        run("resumed", 3, 2);
        assert!(contents(&run("resumed", 10, 2)) == whole);
        let shift = |k: usize| Scene::from_toml(&whole[k].3).expect("a scene").object.shift;
        assert_eq!((shift(0), shift(8)), ([0.0; 2], [0.0; 2]), "put down anew after eight");
        assert!((1..8).any(|k| shift(k) != [0.0; 2]), "left where the fingers pushed it");

        let store = store(&folder, "one");
        let trials = store.list(true).expect("lists");
        let headers: Vec<_> = trials.iter().map(|row| store.load(row.id).expect("whole").header).collect();
        for (k, pair) in headers.windows(2).enumerate() {
            let stayed = pair[1].scene.object.shift != [0.0; 2];
            let after = pair[1].origin.as_ref().and_then(|origin| origin.after.clone());
            assert_eq!(after, pair[0].identity().filter(|_| stayed), "trial {}", k + 1);
        }
    }

    #[test]
    fn plans_and_seeds_are_told_apart() {
        let other_seed = CollectionPlan { seed: 2, ..plan() };
        let mut other_scene = plan();
        other_scene.scene.object.fixed = true;
        let agreed = CollectionPlan { recompute: Recompute::UntilAgreement, ..plan() };
        let names = [plan().name(), other_seed.name(), other_scene.name(), agreed.name()];
        let different: std::collections::BTreeSet<&String> = names.iter().collect();
        assert_eq!(different.len(), names.len());
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
    fn a_collection_that_is_stopped_keeps_its_trials_and_resumes() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::open(&folder.path().join("stopped.sqlite")).expect("opens");
        let stopped = collect(&plan(), &mut store, 2, &mut |progress| match progress.done {
            0..3 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        });
        let stopped = stopped.expect("collects");
        let all = plan().tasks().len() as u32;
        assert!(stopped.interrupted && (3..all).contains(&stopped.stored), "{stopped:?} of {all}");
        let rest = collect(&plan(), &mut store, 2, &mut |_| ControlFlow::Continue(())).expect("collects");
        assert_eq!((rest.interrupted, rest.known, rest.stored), (false, stopped.stored, all - stopped.stored));
    }

    #[test]
    fn objects_are_at_hand_and_told_apart_before_anything_is_stored() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let objects = ["ball", "/nowhere/at/all.urdf"].map(str::to_owned).to_vec();
        let outcome = CollectionPlan { objects, ..plan() }.ready().map(drop);
        assert!(
            matches!(&outcome, Err(CollectionError::Object(cause)) if cause.to_string().contains("/nowhere/at/all.urdf")),
            "{outcome:?}"
        );
        let made = |name: &str, side: f64| {
            let path = folder.path().join(name).join("urdf/model.urdf");
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            let shape = format!("<collision><geometry><box size='0.03 0.03 {side}'/></geometry></collision>");
            std::fs::write(&path, format!("<robot name='model'><link name='a'>{shape}</link></robot>"))
                .expect("written");
            path.to_str().expect("a name").to_owned()
        };
        let objects = vec![made("can", 0.03), made("brick", 0.04)];
        let clash = CollectionPlan { objects: objects.clone(), ..plan() }.ready().map(drop).expect_err("one class");
        let text = clash.to_string();
        assert!(objects.iter().all(|path| text.contains(path.as_str())) && text.contains("--class"), "{text}");
        let same = vec![objects[0].clone(), made("again", 0.03)];
        assert!(CollectionPlan { objects: same, ..plan() }.ready().is_ok(), "one content is one class");
        let classes = ["can", "brick"].map(str::to_owned).to_vec();
        let told = CollectionPlan { objects, classes, trials: 1, ..plan() };
        let mut store = store(&folder, "store");
        let collected =
            |store: &mut Store| collect(&told, store, 2, &mut |_| ControlFlow::Continue(())).expect("collects");
        assert_eq!((collected(&mut store).stored, collected(&mut store).known), (2, 2));
        let rows = store.list(false).expect("lists");
        assert_eq!(rows.iter().map(|row| row.object.as_str()).collect::<Vec<_>>(), ["can", "brick"]);
    }
}
