//! What the workbench does for the real gripper: it takes in what was felt, lets the simulated fingers close with the real
//! ones, and grants what is asked for at the desk where trials are recorded and labelled.

use super::{Shown, Workbench};
use crate::app::actions::{DeskAction, Message};
use crate::app::modes::Mode;
use crate::app::panels::{Source, USUAL_METHOD, control_title};
use palpate_lab::workers::{Command, GripperWish, LabelWish, TrainRequest, TrialPart, TrialRequest};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::catalogue;
use palpate_store::labels::LabelledTrial;
use palpate_tactile::trial::Control;
use std::path::{Path, PathBuf};

impl Workbench {
    /// Grants what is asked for at the desk.
    pub(super) fn at_desk(&mut self, action: DeskAction) {
        let draft = &mut self.view.draft;
        match action {
            DeskAction::Record => self.begin_trial(),
            DeskAction::Discard => self.discard_trial(),
            DeskAction::Give => self.give_label(),
            DeskAction::Choose(place) => {
                let objects = self.labeller.view().map(|labels| draft.objects(&labels).len());
                draft.chosen =
                    Some(place).filter(|place| objects.is_some_and(|objects| *place < objects)).or(draft.chosen);
            }
            DeskAction::Search(search) => (draft.search, draft.chosen) = (search, None),
            // A question that is about to be asked is answered there, too.
            DeskAction::FocusSearch(typed) => {
                if self.trial_part.is_some() || self.asked_about().is_some() || self.awaits_question() {
                    self.view.draft.type_ahead(&typed);
                }
            }
            DeskAction::SearchFocused => draft.focus_search = false,
            DeskAction::Select(id) => {
                draft.done();
                draft.selected = id;
            }
            DeskAction::Step(by) => {
                if let Some(labels) = self.labeller.view() {
                    draft.step(&labels, by);
                }
            }
            DeskAction::Show(shown) => draft.shown = shown,
            DeskAction::WriteNote(id, text) => draft.note = Some((id, text)),
            DeskAction::WriteTags(id, text) => draft.tags = Some((id, text)),
            DeskAction::ToggleUnsure => {
                if let Some(trial) = self.asked_about() {
                    self.labeller.ask(LabelWish::Unsure(trial.id, !trial.unsure));
                }
            }
            DeskAction::NextControl => {
                let controls = [Control::ByHand, Control::Driven, Control::Free];
                let now = controls.iter().position(|control| *control == self.view.control).unwrap_or(0);
                self.view.control = controls[(now + 1) % controls.len()];
                self.tell(Message::Info(format!("the fingers are moved {}", control_title(self.view.control))));
            }
            DeskAction::ToggleWatch => {
                let watching = self.gripper.view().is_some_and(|gripper| gripper.watching.is_some());
                let request = TrialRequest { object: None, control: Control::Free, adds: false };
                self.gripper.wish(GripperWish::Watch((!watching).then_some(request)));
                let state = if watching { "when R is pressed" } else { "by themselves, when the fingers move" };
                self.tell(Message::Info(format!("trials begin {state}")));
            }
            DeskAction::Export => self.labeller.ask(LabelWish::Export(self.new_export())),
            DeskAction::Train => {
                let request = TrainRequest { method: USUAL_METHOD.to_owned(), seed: 1, quick: false };
                self.tools.train_and_tell(request);
                self.tell(Message::Info(
                    "training on the labelled trials: the panel Training shows how far it is".to_owned(),
                ));
            }
            DeskAction::ToggleBlind => {
                self.view.blind = !self.view.blind;
                let state = if self.view.blind { "hidden until the label is given" } else { "shown" };
                self.tell(Message::Info(format!("what the model says is {state}")));
            }
        }
    }

    /// What the model says is hidden while a trial goes on, and until it has a label.
    pub(super) fn is_blind(&self, shown: &Shown) -> bool {
        let going_on = shown.gripper.as_ref().is_some_and(|gripper| gripper.trial.is_some());
        let open = shown.labels.as_ref().is_some_and(|labels| labels.unlabelled().is_some());
        self.view.mode == Mode::Label && self.view.blind && (going_on || open)
    }

    /// Takes in what the real gripper has felt, and lets the simulated one close its fingers with it.
    pub(super) fn gather_gripper(&mut self) {
        if self.gripper.take_rows_lost() {
            self.felt.clear();
        }
        for row in self.gripper.rows() {
            self.felt.push(&row);
        }
        let Some(gripper) = self.gripper.view() else { return };
        if self.connected != gripper.is_connected() {
            self.connected = gripper.is_connected();
            self.view.source = if self.connected { Source::Gripper } else { Source::Simulation };
            self.hand_over();
        }
        self.show_next_object();
        // What is to be labelled stays in sight until it is.
        let asked = self.view.draft.selected.is_none() && self.asked_about().is_some();
        self.felt.hold_grasp(self.view.mode == Mode::Label && gripper.trial.is_none() && asked);
        let ended = gripper.ended.as_ref().map(|ended| ended.id);
        if self.trial_ended != ended {
            self.trial_ended = ended;
            // What was typed while it went on is the answer to its question.
            self.view.draft.selected = None;
            self.labeller.ask(LabelWish::Refresh);
        }
        let part = gripper.trial.as_ref().map(|trial| trial.part);
        if self.trial_part != part {
            if self.trial_part.is_none() {
                // One that begins by itself asks nobody whether they are done with writing.
                let labels = self.labeller.view();
                let unsaved = labels.map(|labels| self.view.draft.unsaved(&labels)).unwrap_or_default();
                unsaved.into_iter().for_each(|wish| self.labeller.ask(wish));
                self.view.draft.done();
            }
            self.trial_part = part;
            if part == Some(TrialPart::Phase(Phase::Close)) {
                self.close_twin();
            }
        }
    }

    /// A model that was trained by key listens to the gripper at once.
    pub(super) fn gather_training(&mut self) {
        match self.tools.trained() {
            Some(Ok(finished)) => {
                let f1 = finished.judged.evaluation.f1_macro;
                self.tell(Message::Info(format!("trained: macro F1 {f1:.2} on the trials held back")));
                self.use_model(&finished.trained);
            }
            Some(Err(cause)) => self.tell(Message::Error(format!("nothing was trained: {cause}"))),
            None => {}
        }
    }

    /// Tells what came of wishes about labels.
    pub(super) fn gather_labels(&mut self) {
        let Some(labels) = self.labeller.view() else { return };
        let before = self.labels_told;
        for (number, told) in labels.told.iter().filter(|(number, _)| *number > before) {
            self.labels_told = *number;
            self.tell(match told {
                Ok(text) => Message::Info(text.clone()),
                Err(cause) => Message::Error(cause.clone()),
            });
        }
    }

    /// While a gripper is connected the simulation is its twin: it waits, closes with it, and stores nothing.
    fn hand_over(&mut self) {
        if self.connected {
            let status = self.worker.snapshot().map(|snapshot| snapshot.status.clone()).unwrap_or_default();
            self.before_twin = Some((status.recording, status.grasps));
            self.tell_simulation([Command::SetRecording(false), Command::SetGrasps(1), Command::Reset, Command::Pause]);
        } else if let Some((recording, grasps)) = self.before_twin.take() {
            self.tell_simulation([Command::SetRecording(recording), Command::SetGrasps(grasps.max(1))]);
        }
    }

    /// The simulated fingers do what the real ones do, so that one lies over the other.
    fn close_twin(&mut self) {
        self.tell_simulation([Command::SetSpeed(1.0), Command::Reset, Command::Play]);
    }

    /// At the desk the twin grasps what the plan has next, where it knows that object.
    fn show_next_object(&mut self) {
        if self.view.mode != Mode::Label || !self.connected || self.trial_part.is_some() {
            return;
        }
        let next = self.labeller.view().and_then(|labels| labels.next.as_ref().map(|next| next.object.clone()));
        let known = next.filter(|name| catalogue().iter().any(|built_in| built_in.name == *name));
        if let Some(name) = known.filter(|name| *name != self.scene.object.source) {
            self.open(&name);
            self.tell_simulation([Command::Pause]);
        }
    }

    fn tell_simulation<const N: usize>(&mut self, commands: [Command; N]) {
        for command in commands {
            if let Err(cause) = self.worker.send(command) {
                self.tell(Message::Warning(cause.to_string()));
            }
        }
    }

    /// A folder beside the store that does not exist yet: export, export-2, export-3 ..
    fn new_export(&self) -> PathBuf {
        let beside = self.store.parent().unwrap_or(Path::new(""));
        let name = |k: u32| if k == 1 { "export".to_owned() } else { format!("export-{k}") };
        let free = (1..=u32::MAX).map(|k| beside.join(name(k))).find(|folder| !folder.exists());
        free.unwrap_or_else(|| beside.join("export"))
    }

    /// A trial has ended, and the list of labels has not told of it yet.
    fn awaits_question(&self) -> bool {
        let Some(ended) = self.trial_ended else { return false };
        self.labeller.view().is_none_or(|labels| labels.trial(ended).is_none_or(|trial| !trial.complete))
    }

    /// The trial that the card asks about: none while one goes on, or has ended and is not in the list yet, and none while
    /// the card does not show what came of the last keys: nobody means what they cannot see.
    fn asked_about(&self) -> Option<LabelledTrial> {
        let shown = self.labeller.is_settled() && !self.is_beginning();
        if self.trial_part.is_some() || self.awaits_question() || !shown {
            return None;
        }
        self.view.draft.trial(self.labeller.view()?.as_ref()).cloned()
    }

    /// A trial has been asked for and is not seen yet.
    fn is_beginning(&self) -> bool {
        self.gripper.view().map_or(0, |gripper| gripper.granted) < self.begun_by
    }

    /// Whether a trial goes on, or is about to.
    fn has_trial(&self) -> bool {
        self.is_beginning() || self.gripper.view().is_some_and(|gripper| gripper.trial.is_some())
    }

    /// Records a grasp. One that goes on is given up for it; at the labelling desk so is one that has no label yet: it is
    /// recorded again.
    fn begin_trial(&mut self) {
        let again = self.view.mode == Mode::Label && self.connected;
        if self.has_trial() {
            self.gripper.wish(GripperWish::Discard);
        } else if let Some(trial) = self.asked_about().filter(|trial| again && trial.object.is_none()) {
            self.labeller.ask(LabelWish::Discard(trial.id));
        }
        self.view.draft.done();
        let request = TrialRequest { object: None, control: self.view.control, adds: self.view.mode == Mode::Demo };
        self.begun_by = self.gripper.wish(GripperWish::Begin(request));
    }

    /// Gives up the trial that goes on, or throws away the one that the card asks about.
    fn discard_trial(&mut self) {
        if self.has_trial() {
            self.gripper.wish(GripperWish::Discard);
        } else if let Some(trial) = self.asked_about() {
            self.labeller.ask(LabelWish::Discard(trial.id));
            self.view.draft.done();
        }
    }

    /// The trial that the card asks about is of the object that is chosen.
    fn give_label(&mut self) {
        if !self.labeller.is_settled() {
            return self.tell(Message::Info("one moment: what was asked for before is not done yet".to_owned()));
        }
        let (Some(labels), Some(trial)) = (self.labeller.view(), self.asked_about()) else { return };
        if let Some(label) = self.view.draft.label(&labels) {
            self.labeller.ask(LabelWish::Label(trial.id, label));
            // Somebody has looked at it again.
            if labels.disagreements.iter().any(|found| found.id == trial.id) {
                self.labeller.ask(LabelWish::Reviewed(trial.id));
            }
            self.view.draft.done();
        }
    }
}
