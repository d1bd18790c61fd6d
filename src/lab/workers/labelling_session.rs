//! Workflow of a labelling session: which trial the next key is about, which label is chosen, and what happens when a
//! trial begins, ends, or gets its label. Plain data in, effects out: the owner of gripper and labels carries them out.
//!
//! ```text
//!  record -> trial ends -> question "what was it?" -> label -> next object of the plan
//!     ^         typing ahead answers the question          |
//!     '---- record: the unlabelled trial waits -------------'
//! ```

use super::gripper::GripperView;
use super::label_worker::{LabelCommand, LabelView};
use super::object_search::{ObjectSearch, search_objects};
use crate::recording::TrialRequest;
use palpate_learn::OTHER;
use palpate_sim::objects::{EMPTY, catalogue, object_title};
use palpate_store::labels::{Flag, LabelledTrial, TrialEdit};
use palpate_tactile::trial::Control;
use palpate_tactile::trial::TrialId;

/// State that a session decides by.
#[derive(Clone, Copy)]
pub struct SessionContext<'a> {
    /// Newest state of the real gripper.
    pub gripper: Option<&'a GripperView>,
    /// Newest state of labels and plan.
    pub labels: Option<&'a LabelView>,
    /// `labels` shows the outcome of every command sent.
    pub settled: bool,
    /// Trials are recorded to be labelled.
    pub labelling: bool,
    /// The model's prediction stays hidden until the label is given.
    pub blind: bool,
    /// Actuation of the next trial.
    pub control: Control,
}

/// User action in a labelling session.
#[derive(Clone, Debug, PartialEq)]
pub enum LabellingAction {
    /// Record a grasp. A running trial is discarded first; a stored one without a label is kept.
    Record,
    /// Discard the running trial, or the one in question.
    Discard,
    /// Give the chosen label to the trial in question.
    GiveLabel,
    /// Choose the object at this place of the list.
    ChooseObject(usize),
    /// Filter objects by a part of their names.
    Search(String),
    /// Move the cursor into the search field, after text typed meanwhile.
    FocusSearch(String),
    /// The search field has the cursor.
    SearchFocused,
    /// Select this trial; without one, the newest unlabelled.
    Select(Option<TrialId>),
    /// Select the trial this many places further in the list.
    Step(isize),
    /// Filter the list of trials.
    Filter(TrialFilter),
    /// Note of a trial while it is being written.
    WriteNote(TrialId, String),
    /// Tags of a trial while they are being written.
    WriteTags(TrialId, String),
    /// Mark the label of the trial in question as unsure, or as sure.
    ToggleUnsure,
    /// Hide or show the model's prediction until the label is given.
    ToggleBlind,
    /// Change labels or plan.
    Edit(LabelCommand),
}

/// Consequence of a session's step, for the owner of gripper and labels to carry out.
#[derive(Clone, Debug, PartialEq)]
pub enum LabellingEffect {
    /// Change labels or plan.
    Edit(LabelCommand),
    /// Begin a trial, then report its number with [`LabellingSession::trial_requested`].
    BeginTrial(TrialRequest),
    /// Discard the running trial.
    DiscardRunning,
    /// Hide the model's prediction until the label is given, or show it.
    SetBlind(bool),
    /// Show a message.
    Inform(String),
}

/// Trial that the plots show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrialInSight {
    /// The running trial, or the live stream.
    Live,
    /// The trial that ended last.
    Last,
    /// A trial in the store.
    Stored(TrialId),
}

/// Filter of the list of trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrialFilter {
    /// All but discarded ones.
    #[default]
    Kept,
    /// Without a label.
    Unlabelled,
    /// With a flag.
    Flagged,
    /// Label and model disagree.
    Disagreeing,
    /// Discarded.
    Discarded,
}

impl TrialFilter {
    /// All filters, in the order of their buttons.
    pub const ALL: [Self; 5] = [Self::Kept, Self::Unlabelled, Self::Flagged, Self::Disagreeing, Self::Discarded];

    /// Name on its button.
    pub fn title(self) -> &'static str {
        match self {
            Self::Kept => "all",
            Self::Unlabelled => "unlabelled",
            Self::Flagged => "flagged",
            Self::Disagreeing => "to review",
            Self::Discarded => "discarded",
        }
    }

    /// Trials that pass, in the order of the list.
    pub fn of(self, view: &LabelView) -> Vec<&LabelledTrial> {
        let listed =
            |wanted: &dyn Fn(&LabelledTrial) -> bool| view.trials.iter().filter(|trial| wanted(trial)).collect();
        match self {
            Self::Kept => listed(&|trial| !trial.discarded),
            Self::Unlabelled => listed(&|trial| !trial.discarded && trial.object.is_none()),
            Self::Flagged => listed(&|trial| !trial.discarded && !trial.flags.is_empty()),
            Self::Disagreeing => view.disagreements.iter().filter_map(|found| view.trial(found.id)).collect(),
            Self::Discarded => listed(&|trial| trial.discarded),
        }
    }
}

/// Label that is being chosen, with text that is not stored yet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LabelDraft {
    /// Trial selected in the list; the newest unlabelled one otherwise.
    pub selected: Option<TrialId>,
    /// Text in the search field.
    pub search: String,
    /// Place chosen in the list of objects; otherwise the one that the search means.
    pub chosen: Option<usize>,
    /// The search field should get the cursor.
    pub focus_search: bool,
    /// Note being written.
    pub note: Option<(TrialId, String)>,
    /// Tags being written, separated by commas.
    pub tags: Option<(TrialId, String)>,
    /// Filter of the list of trials.
    pub filter: TrialFilter,
}

impl LabelDraft {
    /// Trial that the label is for.
    pub fn trial<'a>(&self, view: &'a LabelView) -> Option<&'a LabelledTrial> {
        match self.selected {
            Some(id) => view.trial(id),
            None => view.unlabelled(),
        }
    }

    /// Objects that match the search, best matches first, among equals in the order of the plan: their number keys stay theirs
    /// from trial to trial. After the plan come the empty hand and what else the trial may be of. A name that matches no object
    /// exactly is offered as a new one, last of those with a number.
    pub fn objects(&self, view: &LabelView) -> Vec<String> {
        self.found(view).names
    }

    fn found(&self, view: &LabelView) -> ObjectSearch {
        let trial = self.trial(view);
        let label = trial.and_then(|trial| trial.object.as_deref());
        // A trial that was cut may have ended before the touch.
        let has = |flag: Flag| trial.is_some_and(|trial| trial.flags.iter().any(|found| found.flag == flag));
        let untouched = (has(Flag::NoContact) && !has(Flag::Interrupted)).then_some(EMPTY);
        let next = view.next.as_ref().map(|next| next.object.as_str());
        let planned = view.progress.objects.iter().map(|object| object.name.as_str());
        let mut names: Vec<String> = Vec::new();
        for name in planned.chain([EMPTY]).chain(label).chain(self.predicted(view)) {
            if !names.iter().any(|own| own == name) {
                names.push(name.to_owned());
            }
        }
        search_objects(names, &self.search, label.or(untouched).or(next))
    }

    /// What the model took a labelled trial for; none of one that is still to be labelled.
    pub fn predicted<'a>(&self, view: &'a LabelView) -> Option<&'a str> {
        let trial = self.trial(view).filter(|trial| trial.object.is_some())?;
        trial.guess.as_ref().map(|guess| guess.class.as_str()).filter(|class| *class != OTHER)
    }

    /// Place in the list of objects that a label is given from; none while the search may mean several.
    pub fn place(&self, view: &LabelView) -> Option<usize> {
        // What comes next in the plan is no answer for a trial that others have followed.
        let trial = self.trial(view).filter(|trial| trial.object.is_none() && self.search.is_empty());
        let is_late =
            trial.is_some_and(|trial| view.trials.iter().any(|own| own.id > trial.id && own.object.is_some()));
        self.chosen.or_else(|| self.found(view).sure.filter(|_| !is_late))
    }

    /// Label that is chosen now.
    pub fn label(&self, view: &LabelView) -> Option<String> {
        self.objects(view).get(self.place(view)?).cloned()
    }

    /// Selects the trial this many places further in the list.
    fn step(&mut self, view: &LabelView, by: isize) {
        let listed: Vec<TrialId> = self.filter.of(view).iter().map(|trial| trial.id).collect();
        let now = self.trial(view).and_then(|trial| listed.iter().position(|id| *id == trial.id));
        let place = match now {
            Some(place) => place.saturating_add_signed(by).min(listed.len().saturating_sub(1)),
            None => 0,
        };
        self.selected = listed.get(place).copied();
        (self.search, self.chosen) = (String::new(), None);
    }

    /// Text that is not stored yet: note and tags.
    fn unsaved(&self, view: &LabelView) -> Vec<LabelCommand> {
        let note = self.note.as_ref().and_then(|(id, text)| {
            (view.trial(*id)?.note != *text).then(|| LabelCommand::Edit(*id, TrialEdit::Note(text.clone())))
        });
        let tags = self.tags.as_ref().and_then(|(id, text)| {
            let tags = parse_tags(text);
            (view.trial(*id)?.tags != tags).then_some(LabelCommand::Edit(*id, TrialEdit::Tags(tags)))
        });
        note.into_iter().chain(tags).collect()
    }

    /// Back to the newest unlabelled trial.
    fn reset(&mut self) {
        *self = Self { filter: self.filter, focus_search: self.focus_search, ..Self::default() };
    }
}

/// A labelling session.
#[derive(Clone, Debug, Default)]
pub struct LabellingSession {
    draft: LabelDraft,
    /// A trial was running at the last look.
    recording: bool,
    /// That trial, or the last one, was detected automatically.
    automatic: bool,
    /// Trial that ended last.
    ended: Option<TrialId>,
    /// Command by which the last trial was requested, by its number.
    requested_by: u64,
}

impl LabellingSession {
    /// Label that is being chosen.
    pub fn draft(&self) -> &LabelDraft {
        &self.draft
    }

    /// Takes note of the number of the command that requested a trial.
    pub fn trial_requested(&mut self, number: u64) {
        self.requested_by = number;
    }

    /// Updates the session with gripper and labels.
    pub fn observe(&mut self, now: &SessionContext<'_>) -> Vec<LabellingEffect> {
        let mut effects = Vec::new();
        if let Some(gripper) = now.gripper {
            let ended = gripper.ended.as_ref().map(|ended| ended.id);
            if self.ended != ended {
                self.ended = ended;
                // Text typed while it was running answers its question, unless an older one is still open.
                if self.open_question(now).is_none() {
                    self.draft.selected = None;
                }
                effects.push(LabellingEffect::Edit(LabelCommand::Refresh));
            }
            let recording = gripper.trial.is_some();
            if recording && !self.recording {
                // A trial may begin automatically: its predecessor's question stays open, or unsaved text is kept.
                self.automatic = gripper.trial.as_ref().is_some_and(|trial| trial.automatic);
                let asked = now.labels.and_then(|labels| self.draft.trial(labels));
                match asked.filter(|trial| self.automatic && now.labelling && trial.object.is_none()) {
                    Some(asked) => self.draft.selected = Some(asked.id),
                    None => {
                        let unsaved = now.labels.map(|labels| self.draft.unsaved(labels)).unwrap_or_default();
                        effects.extend(unsaved.into_iter().map(LabellingEffect::Edit));
                        self.draft.reset();
                    }
                }
            }
            self.recording = recording;
        }
        effects
    }

    /// Applies a user's action.
    pub fn apply(&mut self, action: LabellingAction, now: &SessionContext<'_>) -> Vec<LabellingEffect> {
        let mut effects = Vec::new();
        match action {
            LabellingAction::Record => return self.record(now),
            LabellingAction::Discard => return self.discard(now),
            LabellingAction::GiveLabel => return self.give_label(now),
            LabellingAction::ChooseObject(place) => {
                let objects = now.labels.map(|labels| self.draft.objects(labels).len());
                let exists = objects.is_some_and(|objects| place < objects);
                self.draft.chosen = Some(place).filter(|_| exists).or(self.draft.chosen);
            }
            LabellingAction::Search(search) => (self.draft.search, self.draft.chosen) = (search, None),
            LabellingAction::FocusSearch(typed) => {
                // Typing ahead: a question that is about to be asked can be answered already.
                if self.recording || self.in_question(now).is_some() || self.awaits_question(now) {
                    self.draft.focus_search = true;
                    self.draft.search.push_str(&typed);
                    self.draft.chosen = None;
                } else {
                    effects.push(self.no_question(now));
                }
            }
            LabellingAction::SearchFocused => self.draft.focus_search = false,
            LabellingAction::Select(id) => {
                self.draft.reset();
                self.draft.selected = id;
            }
            LabellingAction::Step(by) => match now.labels {
                Some(labels) if !self.draft.filter.of(labels).is_empty() => self.draft.step(labels, by),
                _ => effects.push(LabellingEffect::Inform("No trials in the list.".to_owned())),
            },
            LabellingAction::Filter(filter) => self.draft.filter = filter,
            LabellingAction::WriteNote(id, text) => self.draft.note = Some((id, text)),
            LabellingAction::WriteTags(id, text) => self.draft.tags = Some((id, text)),
            LabellingAction::ToggleUnsure => {
                effects.push(match self.in_question(now) {
                    Some(trial) => {
                        LabellingEffect::Edit(LabelCommand::Edit(trial.id, TrialEdit::Unsure(!trial.unsure)))
                    }
                    None => self.no_question(now),
                });
            }
            LabellingAction::ToggleBlind => {
                let state = if now.blind { "shown" } else { "hidden until the label is given" };
                effects.push(LabellingEffect::SetBlind(!now.blind));
                effects.push(LabellingEffect::Inform(format!("Model prediction: {state}.")));
            }
            LabellingAction::Edit(command) => effects.push(LabellingEffect::Edit(command)),
        }
        effects
    }

    /// True while the model's prediction is hidden: during a trial, and until it has a label.
    pub fn hides_prediction(&self, now: &SessionContext<'_>) -> bool {
        let running = now.gripper.is_some_and(|gripper| gripper.trial.is_some());
        let open = now.labels.is_some_and(|labels| labels.unlabelled().is_some());
        now.labelling && now.blind && (running || open)
    }

    /// Trial that the plots show: the one that the card asks about, or the live stream.
    pub fn in_sight(&self, now: &SessionContext<'_>) -> TrialInSight {
        let open = self.open_question(now);
        let blocked = self.recording || self.awaits_question(now);
        let asked = if blocked { open } else { now.labels.and_then(|labels| self.draft.trial(labels)) };
        match asked.filter(|_| now.labelling).map(|trial| trial.id) {
            None => TrialInSight::Live,
            Some(id) if Some(id) == self.ended && self.draft.selected != self.ended && !self.recording => {
                TrialInSight::Last
            }
            Some(id) => TrialInSight::Stored(id),
        }
    }

    /// Next object of the plan, where it is a built-in one that a simulation can grasp meanwhile.
    pub fn next_known_object(&self, now: &SessionContext<'_>) -> Option<String> {
        let connected = now.gripper.is_some_and(|gripper| gripper.is_connected() && gripper.trial.is_none());
        let next = now.labels.filter(|_| now.labelling && connected)?.next.as_ref()?;
        let known = catalogue().iter().any(|built_in| built_in.name == next.object);
        known.then(|| next.object.clone())
    }

    /// A trial has ended, and the labels do not list it yet.
    fn awaits_question(&self, now: &SessionContext<'_>) -> bool {
        let Some(ended) = self.ended else { return false };
        now.labels.is_none_or(|labels| labels.trial(ended).is_none_or(|trial| !trial.complete))
    }

    /// Trial that a key is about. None during a trial and until it is listed, and none while the outcome of the last key
    /// is not shown.
    fn in_question<'a>(&self, now: &SessionContext<'a>) -> Option<&'a LabelledTrial> {
        let shown = now.settled && !self.is_beginning(now);
        if !shown {
            return None;
        }
        if self.recording || self.awaits_question(now) {
            return self.open_question(now);
        }
        self.draft.trial(now.labels?)
    }

    /// Trial whose question stays open while further ones are detected.
    fn open_question<'a>(&self, now: &SessionContext<'a>) -> Option<&'a LabelledTrial> {
        let selected = self.draft.selected.filter(|_| self.automatic)?;
        now.labels?.trial(selected).filter(|trial| trial.object.is_none() && !trial.discarded)
    }

    /// Why no key is about a trial.
    fn no_question(&self, now: &SessionContext<'_>) -> LabellingEffect {
        let text = if !now.settled {
            "One moment: the last change is being saved."
        } else if self.has_trial(now) {
            "The trial is still running. Q ends it; an object can be typed ahead ( / )."
        } else if self.awaits_question(now) {
            "One moment: the trial is being stored."
        } else {
            "No trial waits for a label. R records one; the arrow keys select one."
        };
        LabellingEffect::Inform(text.to_owned())
    }

    /// A trial has been requested and is not running yet.
    fn is_beginning(&self, now: &SessionContext<'_>) -> bool {
        now.gripper.map_or(0, |gripper| gripper.handled) < self.requested_by
    }

    fn has_trial(&self, now: &SessionContext<'_>) -> bool {
        self.is_beginning(now) || now.gripper.is_some_and(|gripper| gripper.trial.is_some())
    }

    /// Records a grasp. A running trial is discarded for it; a stored one without a label is kept, and asked about later.
    fn record(&mut self, now: &SessionContext<'_>) -> Vec<LabellingEffect> {
        let mut effects = Vec::new();
        if self.has_trial(now) {
            effects.push(LabellingEffect::DiscardRunning);
        } else if let Some(trial) = self.in_question(now).filter(|trial| now.labelling && trial.object.is_none()) {
            let unsaved = now.labels.map(|labels| self.draft.unsaved(labels)).unwrap_or_default();
            effects.extend(unsaved.into_iter().map(LabellingEffect::Edit));
            effects.push(LabellingEffect::Inform(format!("Trial {} is kept without a label.", trial.id)));
        }
        self.draft.reset();
        let request = TrialRequest { object: None, length_s: None, control: now.control, adds: !now.labelling };
        effects.push(LabellingEffect::BeginTrial(request));
        effects
    }

    fn discard(&mut self, now: &SessionContext<'_>) -> Vec<LabellingEffect> {
        if self.has_trial(now) {
            return vec![LabellingEffect::DiscardRunning];
        }
        let Some(id) = self.in_question(now).map(|trial| trial.id).filter(|_| now.labelling) else {
            let stored =
                if now.labelling { "or selected" } else { "; stored ones are discarded in Label mode (Ctrl+3)" };
            return vec![LabellingEffect::Inform(format!("No trial to discard: none is running {stored}."))];
        };
        self.draft.reset();
        vec![LabellingEffect::Edit(LabelCommand::Edit(id, TrialEdit::Discard))]
    }

    fn give_label(&mut self, now: &SessionContext<'_>) -> Vec<LabellingEffect> {
        let (Some(labels), Some(trial)) = (now.labels, self.in_question(now)) else {
            return vec![self.no_question(now)];
        };
        let Some(label) = self.draft.label(labels) else {
            let (text, many) = (self.draft.search.trim(), self.draft.objects(labels).len());
            if text.is_empty() {
                let text = "No object is chosen: use its number, the arrow keys or the mouse, or type its name (/).";
                return vec![LabellingEffect::Inform(text.to_owned())];
            }
            // The text in the field stays, to be completed or chosen from.
            let text = format!("\"{text}\" may be {many} objects: choose one with the arrow keys or the mouse.");
            self.draft.focus_search = true;
            return vec![LabellingEffect::Inform(text)];
        };
        let corrected = trial.object.as_ref().filter(|old| **old != label).map(|old| {
            let [new, old] = [&label, old].map(|name| object_title(name));
            LabellingEffect::Inform(format!("Trial {}: {new}, no longer {old}; Ctrl+Z brings it back", trial.id))
        });
        let disagrees = labels.disagreements.iter().any(|found| found.id == trial.id && found.guess != label);
        let mut effects = vec![LabellingEffect::Edit(LabelCommand::Edit(trial.id, TrialEdit::Label(label)))];
        effects.extend(corrected);
        if disagrees {
            effects.push(LabellingEffect::Edit(LabelCommand::Reviewed(trial.id)));
        }
        self.draft.reset();
        effects
    }
}

/// Splits tags at commas.
pub fn parse_tags(text: &str) -> Vec<String> {
    text.split(',').map(|tag| tag.trim().to_owned()).filter(|tag| !tag.is_empty()).collect()
}

#[cfg(test)]
mod tests;
