//! Labelling sessions, step by step.

use super::*;
use crate::grasping::GraspStage;
use crate::labelling::Disagreement;
use crate::workers::{EndedTrial, TrialView};
use palpate_store::labels::{FlagRemark, GuessTop, LabelPlan};
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
        automatic: false,
        adapting: false,
        emulated: false,
    };
    GripperView { trial: Some(trial), ..GripperView::default() }
}

fn ended(id: TrialId) -> GripperView {
    let request = request();
    let (warnings, cadence) = (Vec::new(), String::new());
    let ended = EndedTrial { id, request, discarded: false, complete: true, flags: Vec::new(), warnings, cadence };
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
    assert_eq!(draft.unsaved(&view), [LabelCommand::Edit(4, TrialEdit::Note("slipped".to_owned()))]);
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
fn the_plan_is_no_answer_for_a_trial_that_others_have_followed() {
    let view = view();
    let mut late = LabelDraft { selected: Some(2), ..LabelDraft::default() };
    assert_eq!((late.place(&view), late.label(&view)), (None, None));
    late.search = "lemon".to_owned();
    assert_eq!(late.label(&view).as_deref(), Some("lemon"));
    assert!(LabelDraft::default().label(&view).is_some(), "the newest");
}

#[test]
fn what_the_readings_say_is_offered_after_the_label() {
    let mut view = view();
    let guessed =
        |class: &str| Some(GuessTop { model: "trees".to_owned(), class: class.to_owned(), p: 0.9, label_p: Some(0.1) });
    view.trials[0] = LabelledTrial { guess: guessed("cube"), ..trial(4, Some("lemon")) };
    let draft = LabelDraft { selected: Some(4), ..LabelDraft::default() };
    assert_eq!((draft.label(&view).as_deref(), draft.predicted(&view)), (Some("lemon"), Some("cube")));
    // The number keys are those of the plan, whatever the trial.
    assert_eq!(draft.objects(&view), LabelDraft::default().objects(&view));
    // "Other" is no object, and what touched nothing held none.
    let untouched = FlagRemark { flag: Flag::NoContact, remark: String::new() };
    view.trials[0] = LabelledTrial { flags: vec![untouched], guess: guessed(OTHER), ..trial(4, None) };
    assert_eq!((draft.label(&view).as_deref(), draft.predicted(&view)), (Some(EMPTY), None));
    assert!(!draft.objects(&view).iter().any(|name| name == OTHER));
}

#[test]
fn a_label_goes_to_the_trial_in_question_and_settles_a_disagreement() {
    let (labels, gripper) = (view(), GripperView::default());
    let mut session = LabellingSession::default();
    let next = labels.next.as_ref().map(|next| next.object.clone()).expect("a plan");
    let given = session.apply(LabellingAction::GiveLabel, &now(&gripper, &labels));
    assert_eq!(given, [edit(LabelCommand::Edit(4, TrialEdit::Label(next)))]);
    // Not while the outcome of the last key is unknown.
    let busy = SessionContext { settled: false, ..now(&gripper, &labels) };
    assert!(matches!(session.apply(LabellingAction::GiveLabel, &busy)[..], [LabellingEffect::Inform(_)]));
    let (label, guess) = ("ball".to_owned(), "cube".to_owned());
    let found = Disagreement { id: 3, label, guess, p: 0.9, label_p: 0.1 };
    let labels = LabelView { disagreements: vec![found], ..labels };
    session.apply(LabellingAction::Select(Some(3)), &now(&gripper, &labels));
    let given = session.apply(LabellingAction::GiveLabel, &now(&gripper, &labels));
    assert_eq!(
        given,
        [edit(LabelCommand::Edit(3, TrialEdit::Label("ball".to_owned()))), edit(LabelCommand::Reviewed(3))]
    );
}

#[test]
fn recording_keeps_what_has_no_label() {
    let labels = view();
    let mut session = LabellingSession::default();
    let begin = LabellingEffect::BeginTrial(request());
    // The stored trial in question, and what was written about it, stay in the store.
    let gripper = GripperView::default();
    session.apply(LabellingAction::WriteNote(4, "slipped".to_owned()), &now(&gripper, &labels));
    let note = edit(LabelCommand::Edit(4, TrialEdit::Note("slipped".to_owned())));
    let kept = LabellingEffect::Inform("Trial 4 is kept without a label.".to_owned());
    assert_eq!(session.apply(LabellingAction::Record, &now(&gripper, &labels)), [note, kept, begin.clone()]);
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
    assert_eq!(discarded, [edit(LabelCommand::Edit(4, TrialEdit::Discard))]);
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
    assert_eq!(kept, [edit(LabelCommand::Edit(3, TrialEdit::Note("slipped".to_owned())))]);
    session.apply(LabellingAction::FocusSearch("cu".to_owned()), &now(&during, &labels));
    session.apply(LabellingAction::SearchFocused, &now(&during, &labels));
    // It ends; the list does not have it yet, so no key is about an older trial.
    let after = ended(5);
    assert_eq!(session.observe(&now(&after, &labels)), [edit(LabelCommand::Refresh)]);
    let given = session.apply(LabellingAction::GiveLabel, &now(&after, &labels));
    assert!(matches!(&given[..], [LabellingEffect::Inform(text)] if text.contains("being stored")), "{given:?}");
    let mut labels = labels;
    labels.trials.insert(0, trial(5, None));
    session.observe(&now(&after, &labels));
    session.apply(LabellingAction::Search("cube".to_owned()), &now(&after, &labels));
    assert_eq!(session.in_sight(&now(&after, &labels)), TrialInSight::Last);
    let given = session.apply(LabellingAction::GiveLabel, &now(&after, &labels));
    assert_eq!(given, [edit(LabelCommand::Edit(5, TrialEdit::Label("cube".to_owned())))]);
}

#[test]
fn plots_show_the_trial_that_the_card_asks_about() {
    let (mut labels, during, after) = (view(), running(5), ended(5));
    let mut session = LabellingSession::default();
    assert_eq!(session.in_sight(&now(&GripperView::default(), &labels)), TrialInSight::Stored(4));
    session.observe(&now(&during, &labels));
    assert_eq!(session.in_sight(&now(&during, &labels)), TrialInSight::Live);
    labels.trials.insert(0, trial(5, None));
    session.observe(&now(&after, &labels));
    assert_eq!(session.in_sight(&now(&after, &labels)), TrialInSight::Last);
    // Once it has its label, the card asks about an older one.
    session.apply(LabellingAction::GiveLabel, &now(&after, &labels));
    labels.trials[0].object = Some("lemon".to_owned());
    assert_eq!(session.in_sight(&now(&after, &labels)), TrialInSight::Stored(4));
    session.apply(LabellingAction::Select(Some(3)), &now(&after, &labels));
    assert_eq!(session.in_sight(&now(&after, &labels)), TrialInSight::Stored(3));
    // Chosen in the list, the last one is a stored one like the others.
    session.apply(LabellingAction::Select(Some(5)), &now(&after, &labels));
    assert_eq!(session.in_sight(&now(&after, &labels)), TrialInSight::Stored(5));
    let elsewhere = SessionContext { labelling: false, ..now(&after, &labels) };
    assert_eq!(session.in_sight(&elsewhere), TrialInSight::Live);
}

#[test]
fn a_card_stays_while_further_trials_are_detected() {
    let mut labels = view();
    let mut session = LabellingSession::default();
    let mut detected = running(5);
    detected.trial.as_mut().expect("runs").automatic = true;
    session.apply(LabellingAction::Search("lem".to_owned()), &now(&detected, &labels));
    session.observe(&now(&detected, &labels));
    assert_eq!((session.draft().selected, session.draft().search.as_str()), (Some(4), "lem"));
    assert_eq!(session.in_sight(&now(&detected, &labels)), TrialInSight::Stored(4));
    // Also after the detected one has ended.
    labels.trials.insert(0, trial(5, None));
    let after = ended(5);
    session.observe(&now(&after, &labels));
    assert_eq!(session.draft().selected, Some(4));
    let given = session.apply(LabellingAction::GiveLabel, &now(&after, &labels));
    assert_eq!(given, [edit(LabelCommand::Edit(4, TrialEdit::Label("lemon".to_owned())))]);
    labels.trials.iter_mut().filter(|trial| trial.id == 4).for_each(|trial| trial.object = Some("lemon".to_owned()));
    assert_eq!(session.draft().trial(&labels).map(|trial| trial.id), Some(5));
}

#[test]
fn keys_without_effect_say_why() {
    let (gripper, during, labelled) = (GripperView::default(), running(5), LabelView::default());
    let mut session = LabellingSession::default();
    let mut told = |action: LabellingAction, gripper: &GripperView| {
        let effects = session.apply(action, &now(gripper, &labelled));
        assert!(matches!(&effects[..], [LabellingEffect::Inform(_)]), "{effects:?}");
    };
    for action in [
        LabellingAction::GiveLabel,
        LabellingAction::Discard,
        LabellingAction::ToggleUnsure,
        LabellingAction::Step(1),
        LabellingAction::FocusSearch(String::new()),
    ] {
        told(action, &gripper);
    }
    told(LabellingAction::GiveLabel, &during);
    // A text that may mean two objects labels neither.
    let labels = view();
    session.apply(LabellingAction::Search("ball".to_owned()), &now(&gripper, &labels));
    let given = session.apply(LabellingAction::GiveLabel, &now(&gripper, &labels));
    assert!(matches!(&given[..], [LabellingEffect::Inform(text)] if text.contains("2 objects")), "{given:?}");
    session.apply(LabellingAction::ChooseObject(1), &now(&gripper, &labels));
    let given = session.apply(LabellingAction::GiveLabel, &now(&gripper, &labels));
    assert_eq!(given, [edit(LabelCommand::Edit(4, TrialEdit::Label("bigball".to_owned())))]);
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
