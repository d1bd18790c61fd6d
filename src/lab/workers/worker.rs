//! Worker: a thread that owns a gripper or a store. Commands go in; the newest view, trace rows and notices come out.

use super::latest::Latest;
use super::messages::{Notice, TraceRow, Wake};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Maximum number of queued trace rows: two minutes at 75 Hz. A slower reader finds a gap.
const MOST_ROWS: usize = 9000;

/// Handle of the thread. Dropping it ends the thread after all commands, and waits for that.
pub struct Worker<C, V> {
    mail: Sender<Mail<C>>,
    /// Number of commands sent, locked while one is sent.
    sent: Arc<Mutex<u64>>,
    view: Arc<Latest<V>>,
    rows: Receiver<TraceRow>,
    notices: Receiver<Notice>,
    shared: Arc<Shared>,
    taps: Arc<Taps>,
    thread: Option<JoinHandle<()>>,
}

/// A second listener of a worker, beside the holder of its handle, and a second sender of commands.
pub struct Tap<C, V> {
    mail: Sender<Mail<C>>,
    sent: Arc<Mutex<u64>>,
    view: Arc<Latest<V>>,
    said: Receiver<Said>,
}

/// What a worker says besides its views.
#[derive(Clone, Debug)]
pub enum Said {
    /// A sample.
    Row(TraceRow),
    /// A notice.
    Notice(Notice),
}

/// The second listeners, and what wakes them.
#[derive(Default)]
struct Taps(Mutex<Vec<(SyncSender<Said>, Wake)>>);

impl Taps {
    /// Tells all. A listener whose queue is full misses it; one that has gone is forgotten.
    fn tell(&self, said: &dyn Fn() -> Said) {
        locked(&self.0).retain(|(tap, _)| !matches!(tap.try_send(said()), Err(TrySendError::Disconnected(_))));
    }

    fn wake(&self) {
        locked(&self.0).iter().for_each(|(_, wake)| wake());
    }
}

/// The values are valid after a panic too: they are changed by single calls.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Sends a command; returns the number of commands so far.
fn send_counted<C>(mail: &Sender<Mail<C>>, sent: &Mutex<u64>, command: C) -> u64 {
    let mut sent = locked(sent);
    // A thread that has failed has sent a notice; the rest of the window works.
    let _sent = mail.send(Mail::Command(command));
    *sent += 1;
    *sent
}

impl<C, V> Tap<C, V> {
    /// [`Worker::send`].
    pub fn send(&self, command: C) -> u64 {
        send_counted(&self.mail, &self.sent, command)
    }

    /// [`Worker::view`].
    pub fn view(&self) -> Option<Arc<V>> {
        self.view.get()
    }

    /// Rows and notices since the last call, in order.
    pub fn said(&self) -> impl Iterator<Item = Said> + '_ {
        self.said.try_iter()
    }
}

/// State that the handle and its thread share.
#[derive(Debug, Default)]
struct Shared {
    /// Number of commands that the thread has taken, and of those whose results are shown.
    taken: AtomicU64,
    handled: AtomicU64,
    rows_lost: AtomicBool,
    /// The thread cannot be interrupted, so that a window that closes does not wait for it.
    detached: AtomicBool,
    ending: AtomicBool,
}

/// What is sent to the thread.
enum Mail<C> {
    Command(C),
    /// Look for results of jobs.
    Look,
    End,
}

/// The thread ends, or has ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorkerEnds;

/// Commands of the thread.
pub(super) struct Inbox<C> {
    mail: Receiver<Mail<C>>,
    sender: Sender<Mail<C>>,
    shared: Arc<Shared>,
}

impl<C: Send + 'static> Inbox<C> {
    /// The next command; none if there is a result to look for, or after this time.
    pub(super) fn next(&self, patience: Option<Duration>) -> Result<Option<C>, WorkerEnds> {
        match self.mail.recv_timeout(patience.unwrap_or(Duration::MAX)) {
            Ok(Mail::Command(command)) => {
                self.shared.taken.fetch_add(1, Ordering::Relaxed);
                Ok(Some(command))
            }
            Ok(Mail::Look) | Err(RecvTimeoutError::Timeout) => Ok(None),
            Ok(Mail::End) | Err(RecvTimeoutError::Disconnected) => Err(WorkerEnds),
        }
    }

    /// Asks the thread to look for the result of a job.
    pub(super) fn waker(&self) -> Wake {
        let sender = self.sender.clone();
        Arc::new(move || {
            // The thread may have ended.
            let _sent = sender.send(Mail::Look);
        })
    }
}

/// Sends notices to the window.
#[derive(Clone)]
pub(super) struct Notifier {
    notices: Sender<Notice>,
    wake: Wake,
    taps: Arc<Taps>,
}

impl Notifier {
    pub(super) fn notify(&self, notice: Notice) {
        self.send(notice);
        self.wake();
    }

    fn send(&self, notice: Notice) {
        self.taps.tell(&|| Said::Notice(notice.clone()));
        // The window may be closed.
        let _sent = self.notices.send(notice);
    }

    fn wake(&self) {
        (self.wake)();
        self.taps.wake();
    }
}

/// Output of the thread to the window.
pub(super) struct Publisher<V> {
    view: Arc<Latest<V>>,
    rows: SyncSender<TraceRow>,
    shared: Arc<Shared>,
    pub(super) notifier: Notifier,
}

impl<V> Publisher<V> {
    /// Replaces the view, which shows the results of all commands taken so far.
    pub(super) fn publish(&self, view: V) {
        self.publish_with(view, []);
    }

    /// Replaces the view, with notices about these results.
    pub(super) fn publish_with(&self, view: V, notices: impl IntoIterator<Item = Notice>) {
        self.view.publish(Arc::new(view));
        notices.into_iter().for_each(|notice| self.notifier.send(notice));
        self.shared.handled.store(self.shared.taken.load(Ordering::Relaxed), Ordering::Release);
        self.wake();
    }

    /// Sends a row; if the queue is full, records that a row was lost.
    pub(super) fn row(&self, row: TraceRow) {
        self.notifier.taps.tell(&|| Said::Row(row.clone()));
        if let Err(TrySendError::Full(_)) = self.rows.try_send(row) {
            self.shared.rows_lost.store(true, Ordering::Relaxed);
        }
    }

    pub(super) fn notify(&self, notice: Notice) {
        self.notifier.notify(notice);
    }

    pub(super) fn wake(&self) {
        self.notifier.wake();
    }

    /// Returns what could be started; otherwise a notice says what is missing.
    pub(super) fn or_notice<T>(&self, missing: &str, started: std::io::Result<T>) -> Option<T> {
        started.map_err(|cause| self.notify(Notice::Failed(format!("{missing}: {cause}")))).ok()
    }

    /// While set, a window that closes does not wait for the thread.
    pub(super) fn set_detached(&self, detached: bool) {
        self.shared.detached.store(detached, Ordering::Relaxed);
    }
}

impl<C: Send + 'static, V: Send + Sync + 'static> Worker<C, V> {
    /// Starts the thread. A panic becomes a notice that calls the thread `title`.
    pub(super) fn spawn(
        name: &str,
        title: &'static str,
        wake: Wake,
        run: impl FnOnce(&Inbox<C>, Publisher<V>) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (sender, mail) = channel();
        let (row_sender, rows) = sync_channel(MOST_ROWS);
        let (notice_sender, notices) = channel();
        let (view, shared) = (Arc::<Latest<V>>::default(), Arc::<Shared>::default());
        let taps = Arc::<Taps>::default();
        let notifier = Notifier { notices: notice_sender, wake, taps: Arc::clone(&taps) };
        let last_words = notifier.clone();
        let inbox = Inbox { mail, sender: sender.clone(), shared: Arc::clone(&shared) };
        let (shown, state) = (Arc::clone(&view), Arc::clone(&shared));
        let publisher = Publisher { view: shown, rows: row_sender, shared: state, notifier };
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            if catch_unwind(AssertUnwindSafe(|| run(&inbox, publisher))).is_err() {
                let text = format!(
                    "{title} stopped because of a fault in the program; restart Palpate and report what you did"
                );
                last_words.notify(Notice::Failed(text));
            }
        })?;
        let sent = Arc::default();
        Ok(Self { mail: sender, sent, view, rows, notices, shared, taps, thread: Some(thread) })
    }
}

impl<C, V> Worker<C, V> {
    /// Sends a command; returns the number of commands so far. Commands are handled in order.
    pub fn send(&self, command: C) -> u64 {
        send_counted(&self.mail, &self.sent, command)
    }

    /// A second listener, which `wake` is called for like the first.
    pub fn tap(&self, wake: Wake) -> Tap<C, V> {
        let (sender, said) = sync_channel(MOST_ROWS);
        locked(&self.taps.0).push((sender, wake));
        Tap { mail: self.mail.clone(), sent: Arc::clone(&self.sent), view: Arc::clone(&self.view), said }
    }

    /// True when all commands are handled and the view shows their results.
    pub fn is_settled(&self) -> bool {
        self.shared.handled.load(Ordering::Acquire) == *locked(&self.sent)
    }

    /// True once the thread has failed.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// The newest view; none before the first one.
    pub fn view(&self) -> Option<Arc<V>> {
        self.view.get()
    }

    /// Trace rows since the last call, in order.
    pub fn rows(&self) -> impl Iterator<Item = TraceRow> + '_ {
        self.rows.try_iter()
    }

    /// True once after rows had to be dropped because the queue was full.
    pub fn take_rows_lost(&self) -> bool {
        self.shared.rows_lost.swap(false, Ordering::Relaxed)
    }

    /// Notices since the last call, in order.
    pub fn notices(&self) -> impl Iterator<Item = Notice> + '_ {
        self.notices.try_iter()
    }

    /// Sends commands of others than the window; an error if the thread has ended.
    pub(super) fn sender(&self) -> impl Fn(C) -> Result<(), WorkerEnds> + Send + Sync + use<C, V>
    where
        C: Send,
    {
        let mail = self.mail.clone();
        move |command| mail.send(Mail::Command(command)).map_err(|_gone| WorkerEnds)
    }

    /// The slot of the newest view.
    pub(super) fn views(&self) -> Arc<Latest<V>> {
        Arc::clone(&self.view)
    }
}

impl<C, V> Drop for Worker<C, V> {
    fn drop(&mut self) {
        self.shared.ending.store(true, Ordering::Relaxed);
        // The thread may have failed.
        let _sent = self.mail.send(Mail::End);
        let detached = || self.shared.detached.load(Ordering::Relaxed);
        let Some(thread) = self.thread.take() else { return };
        while !thread.is_finished() && !detached() {
            std::thread::sleep(Duration::from_millis(1));
        }
        if thread.is_finished() {
            let _ended = thread.join();
        }
    }
}

/// Waiting for a worker in tests.
#[cfg(test)]
pub(super) mod watch {
    use super::*;
    use crate::workers::job::watch::until;

    /// Waits for a view that meets a condition.
    pub(crate) fn shown<C, V>(worker: &Worker<C, V>, woken: &Receiver<()>, wanted: impl Fn(&V) -> bool) -> Arc<V> {
        until(woken, || worker.view().filter(|view| wanted(view)))
    }

    /// Waits for the next notice.
    pub(crate) fn told<C, V>(worker: &Worker<C, V>, woken: &Receiver<()>) -> Notice {
        until(woken, || worker.notices().next())
    }
}

#[cfg(test)]
mod tests {
    use super::super::job::watch::{until, waker};
    use super::watch::{shown, told};
    use super::*;

    fn adder() -> (Worker<u32, u32>, Receiver<()>) {
        let (wake, woken) = waker();
        let worker = Worker::spawn("add", "the adder", wake, |inbox, publisher| {
            let mut sum = 0;
            while let Ok(command) = inbox.next(None) {
                assert_ne!(command, Some(13), "a fault in the program");
                sum += command.unwrap_or(100);
                publisher.publish(sum);
                publisher.notify(Notice::Info(sum.to_string()));
                if sum == 6 {
                    (inbox.waker())();
                }
            }
        });
        (worker.expect("starts"), woken)
    }

    #[test]
    fn commands_are_handled_in_order_and_counted() {
        let (worker, woken) = adder();
        assert!(worker.is_settled() && worker.view().is_none());
        assert_eq!([1, 2, 3].map(|number| worker.send(number)), [1, 2, 3]);
        for sum in [1, 3, 6, 106] {
            assert_eq!(told(&worker, &woken), Notice::Info(sum.to_string()));
        }
        shown(&worker, &woken, |sum| *sum == 106);
        until(&woken, || worker.is_settled().then_some(()));
    }

    #[test]
    fn a_panic_becomes_a_notice() {
        let (worker, woken) = adder();
        worker.send(13);
        let Notice::Failed(text) = told(&worker, &woken) else { panic!("a failure") };
        assert!(text.starts_with("the adder stopped because of a fault in the program"), "{text}");
        while !worker.has_ended() {
            std::thread::yield_now();
        }
        worker.send(1);
    }
}
