//! The desk: takes the requests of all clients to the gripper, and what the gripper says to the clients.

use crate::clients::{ClientId, Clients, Heard};
use crate::emulated::EmulatedHand;
use crate::messages::{
    Advice, Answer, Event, Fault, FlagMessage, Message, Outgoing, Request, Subscription, TrialState, VerdictMessage,
};
use crate::outbox::Outbox;
use palpate_lab::grasping::{IdentificationView, ObjectMove, RecognisedGrasp};
use palpate_lab::recording::TrialRequest;
use palpate_lab::workers::{
    EndedJob, EndedTrial, GripperCommand, GripperView, Job, Newer, Notice, Said, Tap, TraceRow, Wake, advice_job,
};
use palpate_sim::objects::class_of;
use palpate_store::Store;
use palpate_store::labels::{Flag, FlagRemark, TrialEdit, class_name};
use palpate_tactile::trial::{Control, TrialId};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

/// Longest wait between two looks at the gripper.
const PATIENCE: Duration = Duration::from_millis(20);

/// What a desk is set up with.
pub struct DeskSetup {
    /// Trials and labels.
    pub store: PathBuf,
    /// Needed by requests that move air.
    pub token: String,
    /// Where people find the token, for the message to those who send none: `in "token.txt"`.
    pub token_place: String,
    /// The emulated gripper, where there is no real one.
    pub emulated: Option<EmulatedHand>,
}

/// A connected client.
struct Client {
    outbox: Arc<Outbox>,
    topics: BTreeSet<Subscription>,
}

/// A request that the gripper works on.
struct Pending {
    client: ClientId,
    outbox: Arc<Outbox>,
    id: Value,
    /// Number of its command.
    sent: u64,
    goal: Goal,
    /// What the gripper said meanwhile; true for what is wrong.
    notes: Vec<(bool, String)>,
}

/// When a request is done.
enum Goal {
    /// Once the pressure is kept.
    Pressed,
    /// Once the sensors were tared, which is confirmed.
    Tared,
    /// Once the fingers were told to vent, whatever is said about it.
    Vented,
    /// Once a trial has begun and has a number; of a driven one, once it has ended.
    Begun {
        driven: bool,
        /// The trial that had ended last.
        before: Option<TrialId>,
        /// It was seen to run.
        seen: bool,
    },
    /// Once this trial has ended.
    Ended(TrialId),
    /// Once the label with this number is stored.
    Labelled(u64, TrialId),
    /// Once the advice is computed.
    Advised,
}

/// A label to be stored.
struct NewLabel {
    trial: TrialId,
    object: String,
    unsure: bool,
}

/// Serves the clients.
pub struct Desk {
    setup: DeskSetup,
    tap: Tap<GripperCommand, GripperView>,
    clients: BTreeMap<ClientId, Client>,
    from: Clients,
    pending: Vec<Pending>,
    /// Who moved air last, and who began the running trial.
    air: Option<ClientId>,
    trial: Option<ClientId>,
    /// The newest view, and the trial that ran in it.
    view: Arc<GripperView>,
    running: Option<TrialId>,
    advice: Job<Arc<RecognisedGrasp>, ObjectMove>,
    labels: Job<NewLabel, ()>,
    labelled: Vec<EndedJob<NewLabel, ()>>,
}

impl Desk {
    /// A desk for these clients. `tap` makes a listener of the gripper's thread, which wakes the desk.
    pub fn new(setup: DeskSetup, from: Clients, tap: impl FnOnce(Wake) -> Tap<GripperCommand, GripperView>) -> Self {
        let sender = from.sender.clone();
        let wake: Wake = Arc::new(move || {
            // Where requests wait already, the desk is awake.
            let _heard = sender.try_send(Heard::Woken);
        });
        Self {
            labels: label_job(setup.store.clone(), Arc::clone(&wake)),
            setup,
            tap: tap(Arc::clone(&wake)),
            clients: BTreeMap::new(),
            from,
            pending: Vec::new(),
            air: None,
            trial: None,
            view: Arc::default(),
            running: None,
            advice: advice_job(wake),
            labelled: Vec::new(),
        }
    }

    /// Serves until `go_on` says no, which is asked some fifty times a second; then the fingers vent if a client had moved air.
    /// True where they do.
    pub fn serve(mut self, mut go_on: impl FnMut() -> bool) -> bool {
        while go_on() {
            match self.from.heard.recv_timeout(PATIENCE) {
                Ok(Heard::Came(id, outbox)) => {
                    self.clients.insert(id, Client { outbox, topics: BTreeSet::new() });
                }
                Ok(Heard::Said(id, message)) => self.take(id, message),
                Ok(Heard::Left(id)) => {
                    self.leave(id);
                    if self.from.only.is_some() && self.clients.is_empty() {
                        break;
                    }
                }
                Ok(Heard::Woken) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.look();
        }
        let (writer, vents) = (self.from.only.take(), self.air.is_some());
        drop(self);
        // A panic in the thread has printed itself.
        let _written = writer.map(std::thread::JoinHandle::join);
        vents
    }

    /// A lost connection vents, and ends the trial that it began.
    fn leave(&mut self, id: ClientId) {
        let Some(client) = self.clients.remove(&id) else { return };
        client.outbox.close();
        self.pending.retain(|pending| pending.client != id);
        let [moved_air, records] =
            [&mut self.air, &mut self.trial].map(|owner| owner.take_if(|own| *own == id).is_some());
        if moved_air {
            self.tap.send(GripperCommand::Vent);
        } else if records {
            self.tap.send(GripperCommand::End);
        }
    }

    // Requests.

    fn take(&mut self, client: ClientId, message: Message) {
        let Some(outbox) = self.clients.get(&client).map(|client| Arc::clone(&client.outbox)) else { return };
        let id = message.id.clone();
        match self.ask(client, message) {
            Ok(Asked::Now(answer)) => outbox.answer(&Outgoing::to(id, Ok(*answer))),
            Ok(Asked::Later(sent, goal)) => {
                self.pending.push(Pending { client, outbox, id, sent, goal, notes: Vec::new() });
            }
            Err(fault) => outbox.answer(&Outgoing::to(id, Err(fault))),
        }
    }

    fn ask(&mut self, client: ClientId, message: Message) -> Result<Asked, Fault> {
        let token = message.token.as_deref();
        match message.request {
            Request::Grasp { object, again } => {
                self.authorise(token)?;
                let object = class_of_field(object)?;
                self.begin(client, TrialRequest { object, control: Control::Driven, length_s: None, adds: again })
            }
            Request::Close { bar } => self.press(client, token, bar),
            Request::Pressure { bar } => self.press(client, token, Some(bar)),
            Request::Vent {} => {
                self.air = None;
                Ok(Asked::Later(self.tap.send(GripperCommand::Vent), Goal::Vented))
            }
            Request::Tare {} => Ok(Asked::Later(self.tap.send(GripperCommand::Tare), Goal::Tared)),
            Request::Record { end: true, .. } => {
                let trial = self.view.trial.as_ref().and_then(|trial| trial.id);
                let trial = trial.ok_or_else(|| Fault::of("end", "no trial is running"))?;
                Ok(Asked::Later(self.tap.send(GripperCommand::End), Goal::Ended(trial)))
            }
            Request::Record { object, seconds, end: false } => {
                let object = class_of_field(object)?;
                self.begin(client, TrialRequest { object, control: Control::Free, length_s: seconds, adds: false })
            }
            Request::Label { trial, object, unsure } => self.label(trial, object, unsure),
            Request::Recognise {} => Ok(Asked::now(Answer { verdict: self.verdict(), ..Answer::default() })),
            // The guide would take its readings for those of a touch.
            Request::Advise {} if self.touched_nothing() => {
                let text = "the last grasp touched nothing, so that no move is known to help: put the object between the fingers";
                Ok(Asked::now(Answer { notes: vec![text.to_owned()], ..Answer::default() }))
            }
            Request::Advise {} => match self.last_grasp() {
                Some(_) => Ok(Asked::Later(0, Goal::Advised)),
                None => Err(Fault::from("there is no grasp to learn from yet".to_owned())),
            },
            Request::Place { object, by } => match &mut self.setup.emulated {
                Some(hand) => {
                    hand.place(object.as_deref(), by.as_ref())?;
                    Ok(Asked::now(Answer::default()))
                }
                None => {
                    Err(Fault::of("request", "only the emulated hand takes objects from a program: move the real one"))
                }
            },
            Request::Subscribe { to } => {
                self.clients.entry(client).and_modify(|client| _ = client.topics.insert(to));
                Ok(Asked::now(Answer::default()))
            }
        }
    }

    fn authorise(&self, token: Option<&str>) -> Result<(), Fault> {
        match token {
            Some(token) if is_same(token, &self.setup.token) => Ok(()),
            Some(_) => Err(Fault::of("token", "this is not the token of the running server")),
            None => Err(Fault::of("token", format!("what moves air needs the token {}", self.setup.token_place))),
        }
    }

    fn press(&mut self, client: ClientId, token: Option<&str>, bar: Option<f64>) -> Result<Asked, Fault> {
        self.authorise(token)?;
        let driven = self.view.trial.as_ref().is_some_and(|trial| trial.request.control == Control::Driven);
        if driven || self.begins() {
            return Err(Fault::from("a grasp is running: wait for its end, or vent".to_owned()));
        }
        self.air = Some(client);
        Ok(Asked::Later(self.tap.send(GripperCommand::Press(bar)), Goal::Pressed))
    }

    /// A trial was asked for and is not seen yet.
    fn begins(&self) -> bool {
        self.pending.iter().any(|pending| matches!(pending.goal, Goal::Begun { .. }))
    }

    fn begin(&mut self, client: ClientId, request: TrialRequest) -> Result<Asked, Fault> {
        if self.begins() || self.view.trial.is_some() {
            return Err(Fault::from("a trial is running: wait for its end, or vent".to_owned()));
        }
        self.trial = Some(client);
        let driven = request.control == Control::Driven;
        if driven {
            self.air = Some(client);
        }
        let goal = Goal::Begun { driven, before: self.view.ended.as_ref().map(|ended| ended.id), seen: false };
        Ok(Asked::Later(self.tap.send(GripperCommand::Begin(request)), goal))
    }

    fn label(&mut self, trial: Option<TrialId>, object: String, unsure: bool) -> Result<Asked, Fault> {
        let object = class_of_field(Some(object))?.unwrap_or_default();
        let last = self.view.ended.as_ref().map(|ended| ended.id);
        let trial = trial.or(last).ok_or_else(|| Fault::of("trial", "no trial was recorded yet: name one"))?;
        let number = self.labels.start(NewLabel { trial, object, unsure });
        Ok(Asked::Later(0, Goal::Labelled(number, trial)))
    }

    // What the gripper says.

    fn look(&mut self) {
        // The view first: what was said before it has come by now.
        let view = self.tap.view().unwrap_or_default();
        let said: Vec<Said> = self.tap.said().collect();
        for said in said {
            match said {
                Said::Row(row) => self.tell_row(&view, &row),
                Said::Notice(notice) => {
                    let note = match notice {
                        Notice::Info(text) => (false, text),
                        Notice::Warning(text) | Notice::Failed(text) => (true, text),
                        Notice::SceneRefused(_) | Notice::Stored(_) | Notice::Logged(..) => continue,
                    };
                    self.pending.iter_mut().for_each(|pending| pending.notes.push(note.clone()));
                }
            }
        }
        let before = std::mem::replace(&mut self.view, view);
        if before.revision != self.view.revision {
            self.compare(&before);
        }
        self.settle();
    }

    /// Tells what is new in the view.
    fn compare(&mut self, before: &GripperView) {
        let (now, old) = (self.view.identification.as_ref(), before.identification.as_ref());
        if now.map(Arc::as_ptr) != old.map(Arc::as_ptr) {
            let verdict = now.and_then(|view| VerdictMessage::of(view));
            if let Some(verdict) =
                verdict.filter(|verdict| old.and_then(|old| VerdictMessage::of(old)).as_ref() != Some(verdict))
            {
                let line: Arc<str> = Outgoing::Event(Event::Verdict(verdict)).line().into();
                self.listeners(Subscription::Verdict).for_each(|outbox| outbox.sample(&line));
            }
            let last = |view: Option<&Arc<IdentificationView>>| view.and_then(|view| view.last.clone());
            if let Some(grasp) = last(now).filter(|grasp| !last(old).is_some_and(|old| Arc::ptr_eq(grasp, &old))) {
                // Computed at once, so that it is there when it is asked for.
                self.advice.start(grasp);
            }
        }
        let trial = self.view.trial.clone();
        if let Some((id, trial)) = trial.and_then(|trial| Some((trial.id?, trial)))
            && self.running.replace(id) != Some(id)
        {
            self.tell_trial(id, TrialState::Begun, trial.request.object, &[]);
        }
        let ended = self.view.ended.clone();
        if let Some(ended) = ended.filter(|ended| before.ended.as_ref().is_none_or(|old| old.id != ended.id)) {
            let state = if ended.complete { TrialState::Ended } else { TrialState::CutShort };
            self.tell_trial(ended.id, state, ended.request.object.clone(), &ended.flags);
            self.trial.take_if(|_| self.view.trial.is_none());
        }
        if self.view.kept_bar.is_none() && self.view.trial.is_none() && self.pending.is_empty() {
            self.air = None;
        }
    }

    fn tell_trial(&self, trial: TrialId, state: TrialState, object: Option<String>, flags: &[FlagRemark]) {
        let flags = flags.iter().map(FlagMessage::from).collect();
        let event = Outgoing::Event(Event::Trial { trial, state, object, flags });
        self.listeners(Subscription::Trial).for_each(|outbox| outbox.answer(&event));
    }

    fn tell_row(&self, view: &GripperView, row: &TraceRow) {
        if self.listeners(Subscription::Rows).next().is_none() {
            return;
        }
        let columns = view.link.iter().flat_map(|link| link.board.channels.iter().cloned());
        let names = view.channels.iter().map(|channel| channel.name()).chain(columns);
        let value = |value: &f32| Some(*value).filter(|value| value.is_finite());
        let event = Event::Rows {
            stretch: row.grasp,
            t_s: row.sample.t_s,
            line_bar: Some(row.sample.line_bar).filter(|bar| bar.is_finite()),
            values: names.zip(row.sample.values.iter().map(value)).collect(),
        };
        let line: Arc<str> = Outgoing::Event(event).line().into();
        self.listeners(Subscription::Rows).for_each(|outbox| outbox.sample(&line));
    }

    fn listeners(&self, topic: Subscription) -> impl Iterator<Item = &Outbox> {
        self.clients.values().filter(move |client| client.topics.contains(&topic)).map(|client| client.outbox.as_ref())
    }

    /// Answers the requests that are done.
    fn settle(&mut self) {
        self.labelled.extend(self.labels.take());
        let pending = std::mem::take(&mut self.pending);
        for mut pending in pending {
            match self.outcome(&mut pending) {
                Some(outcome) => {
                    let id = std::mem::take(&mut pending.id);
                    pending.outbox.answer(&Outgoing::to(id, outcome));
                }
                None => self.pending.push(pending),
            }
        }
    }

    fn outcome(&mut self, pending: &mut Pending) -> Option<Result<Answer, Fault>> {
        if self.view.handled < pending.sent {
            return None;
        }
        let wrong = || {
            let texts: Vec<&str> =
                pending.notes.iter().filter(|(wrong, _)| *wrong).map(|(_, text)| text.as_str()).collect();
            (!texts.is_empty()).then(|| Fault::from(texts.join(". ")))
        };
        // The trial could not be stored; its end is not reported.
        let stopped = || wrong().filter(|fault| fault.text.contains("recording stopped"));
        let notes = || pending.notes.iter().map(|(_, text)| text.clone()).collect();
        Some(match &mut pending.goal {
            Goal::Pressed => match self.view.kept_bar {
                Some(bar) => Ok(Answer { line_bar: Some(bar), ..Answer::default() }),
                None => Err(wrong().unwrap_or_else(|| Fault::from("the fingers were vented".to_owned()))),
            },
            Goal::Tared if pending.notes.iter().all(|(wrong, _)| *wrong) => {
                Err(wrong().unwrap_or_else(|| Fault::from("the gripper did not confirm it".to_owned())))
            }
            Goal::Tared | Goal::Vented => Ok(Answer { notes: notes(), ..Answer::default() }),
            Goal::Begun { driven, before, seen } => {
                let ended = self.view.ended.as_ref().map(|ended| ended.id).filter(|id| Some(*id) != *before);
                let running = self.view.trial.as_ref();
                let id = running.map_or(ended, |trial| trial.id);
                match id {
                    Some(id) if *driven => {
                        pending.goal = Goal::Ended(id);
                        return self.outcome(pending);
                    }
                    Some(id) => Ok(Answer { trial: Some(id), ..Answer::default() }),
                    None if running.is_some() || (*seen && stopped().is_none()) => {
                        *seen = true;
                        return None;
                    }
                    None => Err(wrong().unwrap_or_else(|| Fault::from("no trial was begun".to_owned()))),
                }
            }
            Goal::Ended(id) => match self.view.ended.as_ref().filter(|ended| ended.id == *id) {
                Some(ended) => {
                    let is_driven = ended.request.control == Control::Driven;
                    let cut_short = (is_driven && !ended.complete).then(wrong).flatten();
                    cut_short.map_or_else(|| Ok(self.ended(ended, notes())), Err)
                }
                None if self.view.trial.is_none() => Err(stopped()?),
                None => return None,
            },
            Goal::Labelled(number, trial) => {
                let at = self.labelled.iter().position(|ended| ended.number == *number)?;
                let stored = self.labelled.swap_remove(at).outcome;
                let answer = Answer { trial: Some(*trial), ..Answer::default() };
                stored.map(|_| answer).map_err(|error| Fault::of("trial", error.to_string()))
            }
            Goal::Advised => {
                let (running, ended) = self.advice.state();
                if running.is_some() {
                    return None;
                }
                let advice = ended
                    .and_then(|ended| ended.outcome.ok())
                    .map(|advised| Advice { text: advised.to_string(), by: advised.of_gripper().into() });
                Ok(Answer { advice, ..Answer::default() })
            }
        })
    }

    /// The answer to a trial that has ended.
    fn ended(&self, ended: &EndedTrial, notes: Vec<String>) -> Answer {
        let verdict = self.verdict().filter(|_| ended.request.control == Control::Driven);
        let notes = ended.warnings.iter().cloned().chain(notes).collect();
        let flags = ended.flags.iter().map(FlagMessage::from).collect();
        Answer { trial: Some(ended.id), verdict, flags, notes, ..Answer::default() }
    }

    /// True where the last trial is a grasp that no pad felt.
    fn touched_nothing(&self) -> bool {
        self.view.ended.as_ref().is_some_and(|ended| {
            let driven = ended.request.control == Control::Driven;
            driven && ended.flags.iter().any(|found| found.flag == Flag::NoContact)
        })
    }

    fn verdict(&self) -> Option<VerdictMessage> {
        self.view.identification.as_ref().and_then(|view| VerdictMessage::of(view))
    }

    fn last_grasp(&self) -> Option<&Arc<RecognisedGrasp>> {
        self.view.identification.as_ref()?.last.as_ref()
    }
}

impl Drop for Desk {
    /// After a panic too: nobody is left who answers for the air.
    fn drop(&mut self) {
        if self.air.is_some() {
            self.tap.send(GripperCommand::Vent);
        }
        self.clients.values().for_each(|client| client.outbox.close());
    }
}

/// Stores labels, in their order; another program may hold the store for seconds.
fn label_job(path: PathBuf, wake: Wake) -> Job<NewLabel, ()> {
    let mut opened = None;
    Job::new("label", Newer::Waits, wake, move |label: &NewLabel, _run| {
        let store = match &mut opened {
            Some(store) => store,
            none => none.insert(Store::open(&path)?),
        };
        store.labels().edit(&[label.trial], &TrialEdit::Label(label.object.clone()))?;
        store.labels().edit(&[label.trial], &TrialEdit::Unsure(label.unsure))?;
        Ok(Some(()))
    })
}

/// How a request goes on.
enum Asked {
    /// It is done.
    Now(Box<Answer>),
    /// The command with this number does it.
    Later(u64, Goal),
}

impl Asked {
    fn now(answer: Answer) -> Self {
        Self::Now(Box::new(answer))
    }
}

/// The class that a field names.
fn class_of_field(object: Option<String>) -> Result<Option<String>, Fault> {
    let class = object.map(|name| class_name(class_of(&name)));
    class.transpose().map_err(|error| Fault::of("object", error.to_string()))
}

/// Compares in a time that does not tell how far two texts are the same.
fn is_same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |different, (a, b)| different | (a ^ b)) == 0
}
