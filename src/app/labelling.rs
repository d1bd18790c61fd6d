//! Labelling without the mouse: which trial the keys are about, which label is chosen, and what a key comes to. Nothing is
//! drawn here.

use super::panels::title_of;
use palpate_store::labels::LabelledTrial;
use palpate_tactile::trial::TrialId;
use palpate_lab::workers::{LabelView, LabelWish};

/// What the user is about to say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LabelDraft {
    /// A trial that was picked out of the list; else the newest one without a label.
    pub selected: Option<TrialId>,
    /// What was typed to find an object.
    pub search: String,
    /// The place in the list of objects that was chosen; else the first.
    pub chosen: Option<usize>,
    /// The cursor goes into the search field.
    pub focus_search: bool,
    /// What the user is writing of the trial.
    pub note: Option<(TrialId, String)>,
    /// The tags that the user is writing, with commas.
    pub tags: Option<(TrialId, String)>,
    /// Which trials the list shows.
    pub shown: ShownTrials,
}

/// Objects that can be chosen by a number.
pub(super) const LISTED: usize = 9;

/// Which trials the list shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShownTrials {
    /// All that are not discarded.
    #[default]
    Kept,
    /// Those without a label.
    Unlabelled,
    /// Those with a flag.
    Flagged,
    /// Those whose label is not what the model saw.
    Disagreeing,
    /// Those that were thrown away.
    Discarded,
}

impl ShownTrials {
    pub(super) const ALL: [Self; 5] = [Self::Kept, Self::Unlabelled, Self::Flagged, Self::Disagreeing, Self::Discarded];

    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Kept => "all",
            Self::Unlabelled => "unlabelled",
            Self::Flagged => "flagged",
            Self::Disagreeing => "disagreeing",
            Self::Discarded => "discarded",
        }
    }

    /// The trials, as the list has them.
    pub(super) fn of(self, view: &LabelView) -> Vec<&LabelledTrial> {
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

impl LabelDraft {
    /// The trial that a label would be of.
    pub(super) fn trial<'a>(&self, view: &'a LabelView) -> Option<&'a LabelledTrial> {
        match self.selected {
            Some(id) => view.trial(id),
            None => view.unlabelled(),
        }
    }

    /// Names of objects that fit what was typed, in the order of their keys: of the plan, what comes next first. What is
    /// none of their names may be that of a new object, which comes last of those with a
    /// number.
    pub(super) fn objects(&self, view: &LabelView) -> Vec<String> {
        let wanted = self.search.trim().to_lowercase();
        let next = view.next.iter().map(|next| next.object.clone());
        let label = self.trial(view).and_then(|trial| trial.object.clone());
        let planned = view.progress.objects.iter().map(|object| object.name.clone());
        let mut names: Vec<String> = Vec::new();
        for name in label.into_iter().chain(next).chain(planned).chain(["empty".to_owned()]) {
            let fits = name.to_lowercase().contains(&wanted) || title_of(&name).to_lowercase().contains(&wanted);
            if fits && !names.contains(&name) {
                names.push(name);
            }
        }
        // A name that was typed whole comes first.
        let whole = |name: &str| name.to_lowercase() == wanted || title_of(name).to_lowercase() == wanted;
        names.sort_by_key(|name| wanted.is_empty() || !whole(name));
        if !wanted.is_empty() && !names.first().is_some_and(|name| whole(name)) {
            names.insert(names.len().min(LISTED - 1), self.search.trim().to_owned());
        }
        names
    }

    /// The label that would be given now.
    pub(super) fn label(&self, view: &LabelView) -> Option<String> {
        let names = self.objects(view);
        names.get(self.chosen.unwrap_or(0)).cloned()
    }

    /// Moves to the trial so many places further in the list.
    pub(super) fn step(&mut self, view: &LabelView, by: isize) {
        let listed: Vec<TrialId> = self.shown.of(view).iter().map(|trial| trial.id).collect();
        let now = self.trial(view).and_then(|trial| listed.iter().position(|id| *id == trial.id));
        let place = match now {
            Some(place) => place.saturating_add_signed(by).min(listed.len().saturating_sub(1)),
            None => 0,
        };
        self.selected = listed.get(place).copied();
        (self.search, self.chosen) = (String::new(), None);
    }

    /// The cursor goes into the search field; what was typed on its way there stands in it already.
    pub(super) fn type_ahead(&mut self, typed: &str) {
        self.focus_search = true;
        self.search.push_str(typed);
        self.chosen = None;
    }

    /// What was written of a trial and is not in the store: its note, its tags.
    pub(super) fn unsaved(&self, view: &LabelView) -> Vec<LabelWish> {
        let note = self
            .note
            .as_ref()
            .and_then(|(id, text)| (view.trial(*id)?.note != *text).then(|| LabelWish::Note(*id, text.clone())));
        let tags = self.tags.as_ref().and_then(|(id, text)| {
            let tags = tags_of(text);
            (view.trial(*id)?.tags != tags).then_some(LabelWish::Tags(*id, tags))
        });
        note.into_iter().chain(tags).collect()
    }

    /// A label has been given: back to the newest trial without one.
    pub(super) fn done(&mut self) {
        *self = Self { shown: self.shown, focus_search: self.focus_search, ..Self::default() };
    }
}

/// Tags, as they are written with commas.
pub(super) fn tags_of(text: &str) -> Vec<String> {
    text.split(',').map(|tag| tag.trim().to_owned()).filter(|tag| !tag.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_store::labels::LabelPlan;

    fn trial(id: TrialId, object: Option<&str>) -> LabelledTrial {
        LabelledTrial { id, object: object.map(str::to_owned), complete: true, ..LabelledTrial::default() }
    }

    fn view() -> LabelView {
        let trials = vec![trial(4, None), trial(3, Some("ball")), trial(2, None), trial(1, Some("lemon"))];
        let progress = LabelPlan::default().progress(&trials);
        let next = progress.next(Some("ball"));
        LabelView { trials, progress, next, ..LabelView::default() }
    }

    #[test]
    fn the_plan_is_proposed_and_typing_narrows_it_down() {
        let (view, mut draft) = (view(), LabelDraft::default());
        assert_eq!(draft.trial(&view).map(|trial| trial.id), Some(4));
        assert_eq!(draft.label(&view), view.next.as_ref().map(|next| next.object.clone()));
        draft.search = "BALL".to_owned();
        assert_eq!(draft.objects(&view), ["ball", "bigball"]);
        // By what people call it, too.
        draft.search = "stop".to_owned();
        assert_eq!(draft.objects(&view), ["button", "stop"]);
        // A new one whose name is a part of another's, and a number that nothing stands behind.
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
        assert_eq!(draft.unsaved(&view), [LabelWish::Note(4, "slipped".to_owned())]);
        draft.done();
        assert_eq!(draft, LabelDraft::default());
    }

    #[test]
    fn trials_are_picked_with_the_arrows() {
        let (view, mut draft) = (view(), LabelDraft::default());
        for expected in [3, 2, 1, 1] {
            draft.step(&view, 1);
            assert_eq!(draft.selected, Some(expected));
        }
        // What it is called now comes first: to leave it as it is takes one key.
        assert_eq!(draft.label(&view).as_deref(), Some("lemon"));
        draft.shown = ShownTrials::Unlabelled;
        draft.step(&view, -1);
        assert_eq!(draft.selected, Some(4));
    }
}
