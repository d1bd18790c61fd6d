//! Thread behind a panel: handles commands one after the other and publishes its state. Running work can be cancelled.

use super::latest::Latest;
use super::messages::Wake;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Handle of the thread: commands `W` in, the newest view `V` out. Dropping it cancels running work and ends the thread.
#[derive(Debug)]
pub struct BackgroundJob<W, V> {
    /// `None` while the thread is being ended.
    commands: Option<Sender<(W, Arc<AtomicBool>)>>,
    /// Set to cancel all commands sent with it.
    stop: Arc<AtomicBool>,
    view: Arc<Latest<V>>,
    /// Number of commands, and of those handled.
    asked: AtomicU64,
    done: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

/// Output of the thread.
pub(super) struct Outlet<V> {
    view: Arc<Latest<V>>,
    wake: Wake,
}

impl<V> Outlet<V> {
    pub(super) fn publish(&self, view: V) {
        self.view.publish(Arc::new(view));
        (self.wake)();
    }
}

impl<W: Send + 'static, V: Send + Sync + 'static> BackgroundJob<W, V> {
    /// Starts the thread. `work` is called for each command, in order; it looks at the flag as often as it can, and ends early
    /// once that is set.
    pub(super) fn spawn(
        name: &str,
        wake: Wake,
        mut work: impl FnMut(W, &AtomicBool, &Outlet<V>) + Send + 'static,
    ) -> std::io::Result<Self> {
        Self::spawn_idling(name, wake, move |command, stop, outlet| {
            command.into_iter().for_each(|command| work(command, stop, outlet));
            None
        })
    }

    /// Starts a thread that also works by itself: `work` returns how long it waits for the next command at most, and is
    /// called without one when that time is over.
    pub(super) fn spawn_idling(
        name: &str,
        wake: Wake,
        mut work: impl FnMut(Option<W>, &AtomicBool, &Outlet<V>) -> Option<Duration> + Send + 'static,
    ) -> std::io::Result<Self> {
        let (commands, inbox) = channel::<(W, Arc<AtomicBool>)>();
        let view = Arc::new(Latest::default());
        let outlet = Outlet { view: Arc::clone(&view), wake };
        let (asked, done) = (AtomicU64::new(0), Arc::new(AtomicU64::new(0)));
        let handled = Arc::clone(&done);
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            let mut patience = None;
            while let Ok(next) = next_command(&inbox, patience) {
                let Some((command, stop)) = next else {
                    patience = work(None, &AtomicBool::new(false), &outlet);
                    continue;
                };
                patience = work(Some(command), &stop, &outlet);
                handled.fetch_add(1, Ordering::Release);
                (outlet.wake)();
            }
        })?;
        Ok(Self { commands: Some(commands), stop: Arc::default(), view, asked, done, thread: Some(thread) })
    }
}

/// The next command, or none after so much time; an error once no more can come.
fn next_command<T>(inbox: &Receiver<T>, patience: Option<Duration>) -> Result<Option<T>, RecvTimeoutError> {
    match patience {
        None => inbox.recv().map(Some).map_err(|_closed| RecvTimeoutError::Disconnected),
        Some(patience) => match inbox.recv_timeout(patience) {
            Err(RecvTimeoutError::Timeout) => Ok(None),
            outcome => outcome.map(Some),
        },
    }
}

impl<W, V> BackgroundJob<W, V> {
    /// Sends a command; commands are handled in order.
    pub fn ask(&self, command: W) {
        self.asked.fetch_add(1, Ordering::Relaxed);
        if let Some(commands) = &self.commands {
            // Fails only after a panic of the thread, which standard error reports; the rest of the window works.
            let _heard = commands.send((command, Arc::clone(&self.stop)));
        }
    }

    /// True when all commands are handled and the view shows their results.
    pub fn is_settled(&self) -> bool {
        self.done.load(Ordering::Acquire) == self.asked.load(Ordering::Relaxed)
    }

    /// Cancels all commands sent so far.
    pub fn give_up(&mut self) {
        std::mem::take(&mut self.stop).store(true, Ordering::Relaxed);
    }

    /// The newest view; none before the first command is handled.
    pub fn view(&self) -> Option<Arc<V>> {
        self.view.get()
    }
}

impl<W, V> Drop for BackgroundJob<W, V> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            let _ended = thread.join();
        }
    }
}

/// Waiting for a job in tests.
#[cfg(test)]
pub(super) mod watch {
    use super::*;
    use std::sync::mpsc::Receiver;
    use std::time::Duration;

    /// A `wake` and the receiver of its calls.
    pub(crate) fn waker() -> (Wake, Receiver<()>) {
        let (calls, woken) = channel();
        let wake: Wake = Arc::new(move || {
            // The test may have stopped listening.
            let _sent = calls.send(());
        });
        (wake, woken)
    }

    /// Waits for a view that meets a condition.
    pub(crate) fn until<W, V>(job: &BackgroundJob<W, V>, woken: &Receiver<()>, wanted: impl Fn(&V) -> bool) -> Arc<V> {
        loop {
            if let Some(view) = job.view().filter(|view| wanted(view)) {
                return view;
            }
            woken.recv_timeout(Duration::from_secs(600)).expect("the thread is alive");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::watch::{until, waker};
    use super::*;

    /// Counts up to a number, or until it is given up; then says how far it came.
    fn counter() -> (BackgroundJob<u64, u64>, std::sync::mpsc::Receiver<()>) {
        let (wake, woken) = waker();
        let job = BackgroundJob::spawn("count", wake, |most: u64, stop, outlet| {
            let reached = (0..most).take_while(|_| !stop.load(Ordering::Relaxed)).count();
            outlet.publish(reached as u64);
        });
        (job.expect("starts"), woken)
    }

    #[test]
    fn commands_run_in_order_and_are_cancelled_together() {
        let (mut job, woken) = counter();
        assert_eq!(job.view(), None);
        assert!(job.is_settled());
        job.ask(u64::MAX);
        assert!(!job.is_settled());
        job.give_up();
        while !job.is_settled() {
            woken.recv_timeout(std::time::Duration::from_secs(600)).expect("the thread is alive");
        }
        job.ask(7);
        until(&job, &woken, |n| *n == 7);
        job.ask(u64::MAX);
        job.ask(u64::MAX);
        job.give_up();
        job.ask(5);
        until(&job, &woken, |n| *n == 5);
    }

    #[test]
    fn dropping_the_handle_cancels_its_work() {
        let (job, _woken) = counter();
        job.ask(u64::MAX);
        drop(job);
    }
}
