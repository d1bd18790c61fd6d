//! Job: a background task of the window. A command goes in; progress comes out, then an outcome or a failure. The
//! thread runs while there is something to do.

use super::messages::Wake;
use std::collections::VecDeque;
use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Least time between two calls of `wake` for progress.
const BETWEEN: Duration = Duration::from_millis(30);
/// Failure after a panic.
const PANIC: &str = "stopped because of a fault in the program; report what you did";

/// Effect of a command on earlier commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Newer {
    /// The command stops and replaces them. Only the newest outcome is kept.
    Replaces,
    /// The command waits for them. All outcomes are kept until they are taken.
    Waits,
}

/// Error of the work.
pub type JobError = Box<dyn Error + Send + Sync>;
/// Error of the work that can be kept and shown.
pub type JobFailure = Arc<dyn Error + Send + Sync>;

/// Progress of a command.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JobProgress {
    /// Share that is done, from 0 to 1.
    pub share: f64,
    /// State in a few words; empty before the first report.
    pub words: String,
}

/// Command that is being worked on.
#[derive(Debug)]
pub struct RunningJob<C> {
    /// Number of the command, from 1.
    pub number: u64,
    /// The command.
    pub command: Arc<C>,
    /// Its progress.
    pub progress: JobProgress,
    stop: Arc<AtomicBool>,
}

/// Command that has ended with an outcome or a failure.
#[derive(Debug)]
pub struct EndedJob<C, O> {
    /// Number of the command, from 1.
    pub number: u64,
    /// The command.
    pub command: Arc<C>,
    /// Its outcome.
    pub outcome: Result<Arc<O>, JobFailure>,
}

/// Access of the work to its job.
pub struct JobRun<'a> {
    stop: &'a AtomicBool,
    report: &'a (dyn Fn(JobProgress) + Sync),
}

type Work<C, O> = dyn FnMut(&C, &JobRun<'_>) -> Result<Option<O>, JobError> + Send;

/// A background task: commands `C` in, outcomes `O` out. Dropping it stops the work and ends the thread.
pub struct Job<C, O> {
    shared: Arc<Shared<C, O>>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

struct Shared<C, O> {
    name: &'static str,
    newer: Newer,
    wake: Wake,
    work: Mutex<Box<Work<C, O>>>,
    state: Mutex<State<C, O>>,
}

struct State<C, O> {
    started: u64,
    /// The thread works on it.
    running: Option<RunningJob<C>>,
    waiting: VecDeque<RunningJob<C>>,
    /// Not taken yet.
    ended: VecDeque<EndedJob<C, O>>,
    last: Option<EndedJob<C, O>>,
    /// When progress was last shown.
    shown: Option<Instant>,
}

impl<C, O> State<C, O> {
    /// The running command was stopped, and others wait for its end.
    fn is_stopping(&self) -> bool {
        self.running.as_ref().is_some_and(RunningJob::is_stopped) && !self.waiting.is_empty()
    }
}

impl<C> RunningJob<C> {
    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl<C: Send + Sync + 'static, O: Send + Sync + 'static> Job<C, O> {
    /// A job whose thread has this name. `work` looks at [`JobRun::stopped`] as often as it can; once stopped it returns
    /// `None`, or the outcome so far. A failure after that is not shown.
    pub fn new(
        name: &'static str,
        newer: Newer,
        wake: Wake,
        work: impl FnMut(&C, &JobRun<'_>) -> Result<Option<O>, JobError> + Send + 'static,
    ) -> Self {
        let state = State {
            started: 0,
            running: None,
            waiting: VecDeque::new(),
            ended: VecDeque::new(),
            last: None,
            shown: None,
        };
        let shared = Shared { name, newer, wake, work: Mutex::new(Box::new(work)), state: Mutex::new(state) };
        Self { shared: Arc::new(shared), thread: Mutex::new(None) }
    }

    /// Starts a command; returns its number.
    pub fn start(&self, command: C) -> u64 {
        let mut state = locked(&self.shared.state);
        state.started += 1;
        let (number, command) = (state.started, Arc::new(command));
        let next = RunningJob { number, command, progress: JobProgress::default(), stop: Arc::default() };
        if let Some(running) = &state.running {
            if self.shared.newer == Newer::Replaces {
                running.stop.store(true, Ordering::Relaxed);
                state.waiting.clear();
            }
            state.waiting.push_back(next);
            return number;
        }
        state.running = Some(next.clone());
        drop(state);
        let mut thread = locked(&self.thread);
        if let Some(before) = thread.take() {
            // Without a running command it has nothing left to do.
            let _ended = before.join();
        }
        let shared = Arc::clone(&self.shared);
        match std::thread::Builder::new().name(self.shared.name.to_owned()).spawn(move || shared.work_on(next)) {
            Ok(started) => *thread = Some(started),
            Err(cause) => {
                self.shared.end(Err(cause.into()));
            }
        }
        number
    }
}

impl<C, O> Job<C, O> {
    /// Stops the running command, and forgets those that wait.
    pub fn stop(&self) {
        let mut state = locked(&self.shared.state);
        state.waiting.clear();
        if let Some(running) = &state.running {
            running.stop.store(true, Ordering::Relaxed);
        }
    }

    /// The running command, where it was stopped for another that other one; and the command that ended last with an outcome or a
    /// failure. Both are of one moment: a command that has just ended is not running.
    pub fn state(&self) -> (Option<RunningJob<C>>, Option<EndedJob<C, O>>) {
        let state = locked(&self.shared.state);
        let next = if state.is_stopping() { state.waiting.front() } else { None };
        (next.or(state.running.as_ref()).cloned(), state.last.clone())
    }

    /// The running command of [`Self::state`].
    pub fn running(&self) -> Option<RunningJob<C>> {
        self.state().0
    }

    /// Commands that wait for that of [`Self::running`].
    pub fn waiting(&self) -> Vec<Arc<C>> {
        let state = locked(&self.shared.state);
        let next = usize::from(state.is_stopping());
        state.waiting.iter().skip(next).map(|next| Arc::clone(&next.command)).collect()
    }

    /// Takes back those of the commands that wait.
    pub fn withdraw(&self, is_meant: impl Fn(&C) -> bool) {
        locked(&self.shared.state).waiting.retain(|waiting| !is_meant(&waiting.command));
    }

    /// Replaces those of the commands that run and wait for which there is another, each in its place.
    pub fn renew(&self, renewed: impl Fn(&C) -> Option<C>) {
        let mut state = locked(&self.shared.state);
        for waiting in &mut state.waiting {
            renewed(&waiting.command).into_iter().for_each(|command| waiting.command = Arc::new(command));
        }
        let Some(running) = state.running.as_ref().filter(|running| !running.is_stopped()) else { return };
        let Some(command) = renewed(&running.command) else { return };
        running.stop.store(true, Ordering::Relaxed);
        state.started += 1;
        let number = state.started;
        let next =
            RunningJob { number, command: Arc::new(command), progress: JobProgress::default(), stop: Arc::default() };
        state.waiting.push_front(next);
    }

    /// True when no command runs or waits.
    pub fn is_settled(&self) -> bool {
        locked(&self.shared.state).running.is_none()
    }

    /// The ended command of [`Self::state`].
    pub fn last(&self) -> Option<EndedJob<C, O>> {
        self.state().1
    }

    /// The last outcome; none after a failure.
    pub fn outcome(&self) -> Option<Arc<O>> {
        self.last()?.outcome.ok()
    }

    /// Commands that have ended since the last call, in order.
    pub fn take(&self) -> VecDeque<EndedJob<C, O>> {
        std::mem::take(&mut locked(&self.shared.state).ended)
    }
}

impl<C: Send + Sync, O: Send + Sync> Shared<C, O> {
    /// Works on a command, then on those that wait.
    fn work_on(&self, mut now: RunningJob<C>) {
        let mut work = locked(&self.work);
        loop {
            let report = |progress| self.report(progress);
            let run = JobRun { stop: &now.stop, report: &report };
            let outcome = catch_unwind(AssertUnwindSafe(|| work(&now.command, &run)));
            match self.end(outcome.unwrap_or_else(|_panic| Err(PANIC.into()))) {
                Some(next) => now = next,
                None => return,
            }
        }
    }

    fn report(&self, progress: JobProgress) {
        let mut state = locked(&self.state);
        let Some(running) = &mut state.running else { return };
        running.progress = progress;
        if state.shown.is_none_or(|shown| shown.elapsed() >= BETWEEN) {
            state.shown = Some(Instant::now());
            drop(state);
            (self.wake)();
        }
    }

    /// Takes in the outcome of the running command; returns the next one.
    fn end(&self, outcome: Result<Option<O>, JobError>) -> Option<RunningJob<C>> {
        let mut state = locked(&self.state);
        let RunningJob { number, command, stop, .. } = state.running.take()?;
        let stopped = stop.load(Ordering::Relaxed);
        if let Some(outcome) = outcome.transpose().filter(|outcome| outcome.is_ok() || !stopped) {
            let ended = EndedJob { number, command, outcome: outcome.map(Arc::new).map_err(JobFailure::from) };
            if self.newer == Newer::Replaces {
                state.ended.clear();
            }
            state.ended.push_back(ended.clone());
            state.last = Some(ended);
        }
        state.shown = None;
        let next = state.waiting.pop_front();
        state.running.clone_from(&next);
        drop(state);
        (self.wake)();
        next
    }
}

impl<C, O> Drop for Job<C, O> {
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = locked(&self.thread).take() {
            let _ended = thread.join();
        }
    }
}

/// Values under these locks are only replaced as a whole, so they are valid even after a panic of the work.
fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl JobRun<'_> {
    /// Flag that stops the command.
    pub fn stop(&self) -> &AtomicBool {
        self.stop
    }

    /// True once the command is stopped.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The outcome, or `None` if the command was stopped.
    pub fn unless_stopped<O>(&self, outcome: O) -> Option<O> {
        (!self.stopped()).then_some(outcome)
    }

    /// Reports progress: the share that is done, and the state in a few words.
    pub fn progress(&self, share: f64, words: impl Into<String>) {
        (self.report)(JobProgress { share, words: words.into() });
    }

    /// Reports progress by number: so many of so many.
    pub fn count(&self, done: usize, of: usize, words: impl Into<String>) {
        self.progress(done as f64 / of.max(1) as f64, words);
    }
}

/// Number of threads for background tasks, beside the window and a simulation.
pub fn spare_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1))
}

impl<C> Clone for RunningJob<C> {
    fn clone(&self) -> Self {
        let Self { number, command, progress, stop } = self;
        Self { number: *number, command: Arc::clone(command), progress: progress.clone(), stop: Arc::clone(stop) }
    }
}

impl<C, O> Clone for EndedJob<C, O> {
    fn clone(&self) -> Self {
        Self { number: self.number, command: Arc::clone(&self.command), outcome: self.outcome.clone() }
    }
}

/// Waiting for a thread in tests.
#[cfg(test)]
pub(super) mod watch {
    use super::*;
    use std::sync::mpsc::{Receiver, channel};

    /// A `wake` and the receiver of its calls.
    pub(crate) fn waker() -> (Wake, Receiver<()>) {
        let (calls, woken) = channel();
        let wake: Wake = Arc::new(move || {
            // The test may have stopped listening.
            let _sent = calls.send(());
        });
        (wake, woken)
    }

    /// Waits for something.
    pub(crate) fn until<T>(woken: &Receiver<()>, mut wanted: impl FnMut() -> Option<T>) -> T {
        loop {
            if let Some(found) = wanted() {
                return found;
            }
            woken.recv_timeout(Duration::from_secs(600)).expect("the thread is alive");
        }
    }

    /// Waits for the end of all commands, and returns the outcome of the last.
    pub(crate) fn settled<C, O>(job: &Job<C, O>, woken: &Receiver<()>) -> Option<Result<Arc<O>, JobFailure>> {
        until(woken, || job.is_settled().then_some(()));
        job.last().map(|ended| ended.outcome)
    }
}

#[cfg(test)]
mod tests {
    use super::watch::{settled, until, waker};
    use super::*;
    use std::sync::mpsc::Receiver;

    /// Counts up to a number, or until it is stopped.
    fn counter(newer: Newer) -> (Job<u64, u64>, Receiver<()>) {
        let (wake, woken) = waker();
        let job = Job::new("count", newer, wake, |most: &u64, run| {
            assert_ne!(*most, 13, "a fault in the program");
            run.progress(0.0, format!("counting to {most}"));
            let reached = (0..*most).take_while(|_| !run.stopped()).count() as u64;
            if *most == 7 { Err(std::fmt::Error.into()) } else { Ok(run.unless_stopped(reached)) }
        });
        (job, woken)
    }

    #[test]
    fn commands_wait_for_each_other_and_are_stopped_together() {
        let (job, woken) = counter(Newer::Waits);
        assert!(job.is_settled() && job.last().is_none());
        assert_eq!([job.start(5), job.start(u64::MAX), job.start(6)], [1, 2, 3]);
        let first = until(&woken, || job.take().pop_front());
        assert_eq!((first.number, *first.command, *first.outcome.expect("counts")), (1, 5, 5));
        let running = until(&woken, || job.running().filter(|running| !running.progress.words.is_empty()));
        assert_eq!((running.number, running.progress.words), (2, format!("counting to {}", u64::MAX)));
        assert_eq!(job.waiting(), [Arc::new(6)]);
        job.stop();
        assert_eq!(settled(&job, &woken).expect("of the first").ok(), Some(Arc::new(5)));
        job.start(8);
        job.start(9);
        settled(&job, &woken);
        assert_eq!(job.take().iter().map(|ended| ended.number).collect::<Vec<_>>(), [4, 5]);
    }

    #[test]
    fn commands_are_renewed_in_their_places() {
        let (job, woken) = counter(Newer::Waits);
        for most in [u64::MAX, 5, u64::MAX - 1] {
            job.start(most);
        }
        job.renew(|most| (*most > 100).then(|| 100 - (u64::MAX - most)));
        // The one that runs is stopped: its successor stands for it.
        let running = job.running().map(|running| *running.command);
        assert!(running.is_none_or(|running| running <= 100), "{running:?}");
        settled(&job, &woken);
        assert_eq!(job.take().iter().map(|ended| *ended.command).collect::<Vec<_>>(), [100, 5, 99]);
        job.renew(|_| Some(1));
        assert!(job.is_settled());
    }

    #[test]
    fn a_newer_command_replaces_older_ones() {
        let (job, woken) = counter(Newer::Replaces);
        job.start(u64::MAX);
        job.start(u64::MAX);
        job.start(4);
        assert_eq!(job.running().map(|running| running.number), Some(3));
        assert_eq!(settled(&job, &woken).expect("an outcome").ok(), Some(Arc::new(4)));
        job.start(5);
        settled(&job, &woken);
        assert_eq!(job.take().iter().map(|ended| *ended.command).collect::<Vec<_>>(), [5], "the newest alone");
    }

    #[test]
    fn errors_and_panics_are_failures() {
        let (job, woken) = counter(Newer::Replaces);
        job.start(7);
        let failure = settled(&job, &woken).expect("ended").expect_err("seven fails");
        assert!(failure.downcast_ref::<std::fmt::Error>().is_some());
        job.start(13);
        let failure = settled(&job, &woken).expect("ended").expect_err("thirteen panics");
        assert!(failure.to_string().contains("a fault in the program") && job.outcome().is_none());
        job.start(3);
        assert_eq!(settled(&job, &woken).expect("ended").ok(), Some(Arc::new(3)), "it goes on");
    }

    #[test]
    fn dropping_a_job_stops_its_work() {
        let (job, _woken) = counter(Newer::Waits);
        job.start(u64::MAX);
        job.start(u64::MAX);
        drop(job);
    }
}
