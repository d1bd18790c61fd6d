//! Workflow of a labelling session: which trial the next key is about, which label is chosen, and what happens when a
//! trial begins, ends, or gets its label. Plain data in, effects out: the owner of gripper and labels carries them out.
//!
//! ```text
//!  record -> trial ends -> question "what was it?" -> label -> next object of the plan
//!     ^         typing ahead answers the question          |
//!     '---- record again: the unlabelled trial is discarded'
//! ```

use super::gripper::GripperView;
use super::labeller::{LabelCommand, LabelOutcome, LabelView};
use crate::recording::TrialRequest;
use palpate_sim::objects::{EMPTY, catalogue, object_title};
use palpate_store::labels::LabelledTrial;
use palpate_tactile::trial::Control;
use palpate_tactile::trial::TrialId;
use std::path::{Path, PathBuf};

/// Objects that have a number key.
pub const NUMBERED_OBJECTS: usize = 9;

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
    /// Record a grasp. A running trial, or one without a label, is discarded first.
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
    /// Export all labelled trials into a new folder beside the store.
    Export,
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
    /// Show a warning.
    Warn(String),
    /// Show an error.
    Fail(String),
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
            Self::Disagreeing => "disagreeing",
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
    /// Chosen place in the list of objects; the first otherwise.
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

    /// Objects that match the search, in the order of their number keys: the trial's label, the next of the plan, the
    /// plan, the empty hand. A name that matches no object exactly is offered as a new one, last of those with a number.
    pub fn objects(&self, view: &LabelView) -> Vec<String> {
        let wanted = self.search.trim().to_lowercase();
        let next = view.next.iter().map(|next| next.object.clone());
        let label = self.trial(view).and_then(|trial| trial.object.clone());
        let planned = view.progress.objects.iter().map(|object| object.name.clone());
        let mut names: Vec<String> = Vec::new();
        for name in label.into_iter().chain(next).chain(planned).chain([EMPTY.to_owned()]) {
            let fits = name.to_lowercase().contains(&wanted) || object_title(&name).to_lowercase().contains(&wanted);
            if fits && !names.contains(&name) {
                names.push(name);
            }
        }
        // An exact match comes first.
        let exact = |name: &str| name.to_lowercase() == wanted || object_title(name).to_lowercase() == wanted;
        names.sort_by_key(|name| wanted.is_empty() || !exact(name));
        if !wanted.is_empty() && !names.first().is_some_and(|name| exact(name)) {
            names.insert(names.len().min(NUMBERED_OBJECTS - 1), self.search.trim().to_owned());
        }
        names
    }

    /// Label that is chosen now.
    pub fn label(&self, view: &LabelView) -> Option<String> {
        let names = self.objects(view);
        names.get(self.chosen.unwrap_or(0)).cloned()
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
        let note = self
            .note
            .as_ref()
            .and_then(|(id, text)| (view.trial(*id)?.note != *text).then(|| LabelCommand::Note(*id, text.clone())));
        let tags = self.tags.as_ref().and_then(|(id, text)| {
            let tags = parse_tags(text);
            (view.trial(*id)?.tags != tags).then_some(LabelCommand::Tags(*id, tags))
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
    store: PathBuf,
    draft: LabelDraft,
    /// A trial was running at the last look.
    recording: bool,
    /// Trial that ended last.
    ended: Option<TrialId>,
    /// Command by which the last trial was requested, by its number.
    requested_by: u64,
    /// Outcomes of label commands up to this number have been shown.
    reported: u64,
}

impl LabellingSession {
    /// A session on the store at `store`.
    pub fn new(store: PathBuf) -> Self {
        Self { store, ..Self::default() }
    }

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
                // Text typed while it was running answers its question.
                self.draft.selected = None;
                effects.push(LabellingEffect::Edit(LabelCommand::Refresh));
            }
            let recording = gripper.trial.is_some();
            if recording && !self.recording {
                // A trial may begin automatically: unsaved text is kept.
                let unsaved = now.labels.map(|labels| self.draft.unsaved(labels)).unwrap_or_default();
                effects.extend(unsaved.into_iter().map(LabellingEffect::Edit));
                self.draft.reset();
            }
            self.recording = recording;
        }
        let before = self.reported;
        for (number, outcome) in now.labels.iter().flat_map(|labels| &labels.outcomes).filter(|(n, _)| *n > before) {
            self.reported = *number;
            effects.push(match outcome {
                LabelOutcome::Done(text) => LabellingEffect::Inform(text.clone()),
                LabelOutcome::Warning(text) => LabellingEffect::Warn(text.clone()),
                LabelOutcome::Failed(cause) => LabellingEffect::Fail(cause.to_string()),
            });
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
                }
            }
            LabellingAction::SearchFocused => self.draft.focus_search = false,
            LabellingAction::Select(id) => {
                self.draft.reset();
                self.draft.selected = id;
            }
            LabellingAction::Step(by) => {
                if let Some(labels) = now.labels {
                    self.draft.step(labels, by);
                }
            }
            LabellingAction::Filter(filter) => self.draft.filter = filter,
            LabellingAction::WriteNote(id, text) => self.draft.note = Some((id, text)),
            LabellingAction::WriteTags(id, text) => self.draft.tags = Some((id, text)),
            LabellingAction::ToggleUnsure => {
                let trial = self.in_question(now);
                effects.extend(trial.map(|trial| LabellingEffect::Edit(LabelCommand::Unsure(trial.id, !trial.unsure))));
            }
            LabellingAction::ToggleBlind => {
                let state = if now.blind { "shown" } else { "hidden until the label is given" };
                effects.push(LabellingEffect::SetBlind(!now.blind));
                effects.push(LabellingEffect::Inform(format!("Model prediction: {state}.")));
            }
            LabellingAction::Export => {
                effects.push(LabellingEffect::Edit(LabelCommand::Export(new_export_folder(&self.store))));
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

    /// True while the plots keep the last trial: it stays in sight until it has a label.
    pub fn keeps_trial_in_sight(&self, now: &SessionContext<'_>) -> bool {
        let running = now.gripper.is_some_and(|gripper| gripper.trial.is_some());
        now.labelling && !running && self.draft.selected.is_none() && self.in_question(now).is_some()
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
        if self.recording || self.awaits_question(now) || !shown {
            return None;
        }
        self.draft.trial(now.labels?)
    }

    /// A trial has been requested and is not running yet.
    fn is_beginning(&self, now: &SessionContext<'_>) -> bool {
        now.gripper.map_or(0, |gripper| gripper.handled) < self.requested_by
    }

    fn has_trial(&self, now: &SessionContext<'_>) -> bool {
        self.is_beginning(now) || now.gripper.is_some_and(|gripper| gripper.trial.is_some())
    }

    /// Records a grasp. A running trial is discarded for it; so is an unlabelled one in a labelling session, because it is
    /// recorded again.
    fn record(&mut self, now: &SessionContext<'_>) -> Vec<LabellingEffect> {
        let again = now.labelling && now.gripper.is_some_and(GripperView::is_connected);
        let mut effects = Vec::new();
        if self.has_trial(now) {
            effects.push(LabellingEffect::DiscardRunning);
        } else if let Some(trial) = self.in_question(now).filter(|trial| again && trial.object.is_none()) {
            effects.push(LabellingEffect::Edit(LabelCommand::Discard(trial.id)));
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
        let Some(id) = self.in_question(now).map(|trial| trial.id) else { return Vec::new() };
        self.draft.reset();
        vec![LabellingEffect::Edit(LabelCommand::Discard(id))]
    }

    fn give_label(&mut self, now: &SessionContext<'_>) -> Vec<LabellingEffect> {
        if !now.settled {
            return vec![LabellingEffect::Inform("One moment: the last change is being saved.".to_owned())];
        }
        let (Some(labels), Some(trial)) = (now.labels, self.in_question(now)) else { return Vec::new() };
        let Some(label) = self.draft.label(labels) else { return Vec::new() };
        let mut effects = vec![LabellingEffect::Edit(LabelCommand::Label(trial.id, label))];
        if labels.disagreements.iter().any(|found| found.id == trial.id) {
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

/// A folder beside the store that does not exist yet: export, export-2, export-3 ..
pub(super) fn new_export_folder(store: &Path) -> PathBuf {
    let beside = store.parent().unwrap_or(Path::new(""));
    let name = |k: u32| if k == 1 { "export".to_owned() } else { format!("export-{k}") };
    let free = (1..=u32::MAX).map(|k| beside.join(name(k))).find(|folder| !folder.exists());
    free.unwrap_or_else(|| beside.join("export"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::GraspStage;
    use crate::labelling::Disagreement;
    use crate::workers::{EndedTrial, LabelError, TrialView};
    use palpate_store::ExportError;
    use palpate_store::labels::LabelPlan;
    use std::sync::Arc;

    fn trial(id: TrialId, object: Option<&str>) -> LabelledTrial {
        LabelledTrial { id, object: object.map(str::to_owned), complete: true, ..LabelledTrial::default() }
    }

    fn view() -> LabelView {
        let trials = vec![trial(4, None), trial(3, Some("ball")), trial(2, None), trial(1, Some("lemon"))];
        let progress = LabelPlan::default().progress(&trials);
        let next = progress.next(Some("ball"));
        LabelView { trials, progress, next, ..LabelView::default() }
    }

    fn request() -> TrialRequest {
        TrialRequest { object: None, length_s: None, control: Control::Driven, adds: false }
    }

    fn running(id: TrialId) -> GripperView {
        let trial = TrialView {
            id: Some(id),
            request: request(),
            stage: GraspStage::Lead,
            left_s: None,
            t_s: 0.0,
            length_s: None,
            samples: 0,
        };
        GripperView { trial: Some(trial), ..GripperView::default() }
    }

    fn ended(id: TrialId) -> GripperView {
        let request = request();
        let ended = EndedTrial { id, request, discarded: false, warnings: Vec::new(), cadence: String::new() };
        GripperView { ended: Some(Arc::new(ended)), ..GripperView::default() }
    }

    fn now<'a>(gripper: &'a GripperView, labels: &'a LabelView) -> SessionContext<'a> {
        SessionContext {
            gripper: Some(gripper),
            labels: Some(labels),
            settled: true,
            labelling: true,
            blind: true,
            control: Control::Driven,
        }
    }

    fn edit(command: LabelCommand) -> LabellingEffect {
        LabellingEffect::Edit(command)
    }

    #[test]
    fn the_plan_is_proposed_and_typing_narrows_it_down() {
        let (view, mut draft) = (view(), LabelDraft::default());
        assert_eq!(draft.trial(&view).map(|trial| trial.id), Some(4));
        assert_eq!(draft.label(&view), view.next.as_ref().map(|next| next.object.clone()));
        draft.search = "BALL".to_owned();
        assert_eq!(draft.objects(&view), ["ball", "bigball"]);
        // By its title, too.
        draft.search = "stop".to_owned();
        assert_eq!(draft.objects(&view), ["button", "stop"]);
        // A new name that is a part of another one, and a number without an object.
        draft.search = "ring".to_owned();
        assert_eq!(draft.objects(&view), ["syringe", "ring"]);
        draft.chosen = Some(1);
        assert_eq!(draft.label(&view).as_deref(), Some("ring"));
        draft.chosen = Some(7);
        assert_eq!(draft.label(&view), None);
        draft.chosen = None;
        draft.search = "ball".to_owned();
        draft.chosen = Some(1);
        assert_eq!(draft.label(&view).as_deref(), Some("bigball"));
        (draft.search, draft.chosen) = (" garlic ".to_owned(), None);
        assert_eq!(draft.label(&view).as_deref(), Some("garlic"));
        draft.note = Some((4, "slipped".to_owned()));
        draft.tags = Some((3, " ,".to_owned()));
        assert_eq!(draft.unsaved(&view), [LabelCommand::Note(4, "slipped".to_owned())]);
        draft.reset();
        assert_eq!(draft, LabelDraft::default());
    }

    #[test]
    fn trials_are_picked_with_the_arrows() {
        let (view, mut draft) = (view(), LabelDraft::default());
        for expected in [3, 2, 1, 1] {
            draft.step(&view, 1);
            assert_eq!(draft.selected, Some(expected));
        }
        // Its present label comes first: keeping it takes one key.
        assert_eq!(draft.label(&view).as_deref(), Some("lemon"));
        draft.filter = TrialFilter::Unlabelled;
        draft.step(&view, -1);
        assert_eq!(draft.selected, Some(4));
    }

    #[test]
    fn a_label_goes_to_the_trial_in_question_and_settles_a_disagreement() {
        let (labels, gripper) = (view(), GripperView::default());
        let mut session = LabellingSession::default();
        let next = labels.next.as_ref().map(|next| next.object.clone()).expect("a plan");
        let given = session.apply(LabellingAction::GiveLabel, &now(&gripper, &labels));
        assert_eq!(given, [edit(LabelCommand::Label(4, next))]);
        // Not while the outcome of the last key is unknown.
        let busy = SessionContext { settled: false, ..now(&gripper, &labels) };
        assert!(matches!(session.apply(LabellingAction::GiveLabel, &busy)[..], [LabellingEffect::Inform(_)]));
        let (label, guess) = ("ball".to_owned(), "cube".to_owned());
        let found = Disagreement { id: 3, label, guess, p: 0.9, label_p: 0.1 };
        let labels = LabelView { disagreements: vec![found], ..labels };
        session.apply(LabellingAction::Select(Some(3)), &now(&gripper, &labels));
        let given = session.apply(LabellingAction::GiveLabel, &now(&gripper, &labels));
        assert_eq!(given, [edit(LabelCommand::Label(3, "ball".to_owned())), edit(LabelCommand::Reviewed(3))]);
    }

    #[test]
    fn recording_again_discards_what_has_no_label() {
        let labels = view();
        let mut session = LabellingSession::default();
        let begin = LabellingEffect::BeginTrial(request());
        // Without a connection nothing is thrown away.
        let gripper = GripperView::default();
        assert_eq!(session.apply(LabellingAction::Record, &now(&gripper, &labels)), std::slice::from_ref(&begin));
        let gripper = running(5);
        assert_eq!(
            session.apply(LabellingAction::Record, &now(&gripper, &labels)),
            [LabellingEffect::DiscardRunning, begin]
        );
        // A trial that is requested counts as running.
        session.trial_requested(7);
        let gripper = GripperView { handled: 6, ..GripperView::default() };
        assert_eq!(session.apply(LabellingAction::Discard, &now(&gripper, &labels)), [LabellingEffect::DiscardRunning]);
        let gripper = GripperView { handled: 7, ..GripperView::default() };
        let discarded = session.apply(LabellingAction::Discard, &now(&gripper, &labels));
        assert_eq!(discarded, [edit(LabelCommand::Discard(4))]);
        // Elsewhere a grasp adds to the ones before.
        let elsewhere = SessionContext { labelling: false, ..now(&gripper, &labels) };
        let begun = session.apply(LabellingAction::Record, &elsewhere);
        assert_eq!(begun, [LabellingEffect::BeginTrial(TrialRequest { adds: true, ..request() })]);
    }

    #[test]
    fn an_answer_typed_ahead_waits_for_its_question() {
        let labels = view();
        let mut session = LabellingSession::default();
        // Nothing to answer: everything has a label.
        let done = LabelView { trials: vec![trial(1, Some("lemon"))], ..LabelView::default() };
        let (idle, during) = (GripperView::default(), running(5));
        session.apply(LabellingAction::FocusSearch("c".to_owned()), &now(&idle, &done));
        assert_eq!(session.draft(), &LabelDraft::default());
        // Unsaved text is kept when a trial begins automatically.
        session.apply(LabellingAction::WriteNote(3, "slipped".to_owned()), &now(&idle, &labels));
        let kept = session.observe(&now(&during, &labels));
        assert_eq!(kept, [edit(LabelCommand::Note(3, "slipped".to_owned()))]);
        session.apply(LabellingAction::FocusSearch("cu".to_owned()), &now(&during, &labels));
        session.apply(LabellingAction::SearchFocused, &now(&during, &labels));
        // It ends; the list does not have it yet, so no key is about an older trial.
        let after = ended(5);
        assert_eq!(session.observe(&now(&after, &labels)), [edit(LabelCommand::Refresh)]);
        assert!(session.apply(LabellingAction::GiveLabel, &now(&after, &labels)).is_empty());
        let mut labels = labels;
        labels.trials.insert(0, trial(5, None));
        session.observe(&now(&after, &labels));
        session.apply(LabellingAction::Search("cube".to_owned()), &now(&after, &labels));
        assert!(session.keeps_trial_in_sight(&now(&after, &labels)));
        let given = session.apply(LabellingAction::GiveLabel, &now(&after, &labels));
        assert_eq!(given, [edit(LabelCommand::Label(5, "cube".to_owned()))]);
    }

    #[test]
    fn a_prediction_is_hidden_until_the_label_is_given() {
        let session = LabellingSession::default();
        let (idle, during) = (GripperView::default(), running(5));
        let labelled = LabelView { trials: vec![trial(1, Some("lemon"))], ..LabelView::default() };
        assert!(session.hides_prediction(&now(&idle, &view())));
        assert!(session.hides_prediction(&now(&during, &labelled)));
        assert!(!session.hides_prediction(&now(&idle, &labelled)));
        assert!(!session.hides_prediction(&SessionContext { blind: false, ..now(&during, &labelled) }));
        assert!(!session.hides_prediction(&SessionContext { labelling: false, ..now(&during, &labelled) }));
    }

    #[test]
    fn outcomes_are_reported_once() {
        let mut session = LabellingSession::default();
        let failure = Arc::new(LabelError::from(ExportError::Nothing));
        let text = |text: &str| text.to_owned();
        let outcomes = vec![
            (1, LabelOutcome::Warning(text("updated"))),
            (2, LabelOutcome::Done(text("done"))),
            (3, LabelOutcome::Failed(Arc::clone(&failure))),
        ];
        let (gripper, labels) = (GripperView::default(), LabelView { outcomes, ..LabelView::default() });
        let effects = session.observe(&now(&gripper, &labels));
        let expected = [
            LabellingEffect::Warn(text("updated")),
            LabellingEffect::Inform(text("done")),
            LabellingEffect::Fail(failure.to_string()),
        ];
        assert_eq!(effects, expected);
        assert!(session.observe(&now(&gripper, &labels)).is_empty());
    }
}
