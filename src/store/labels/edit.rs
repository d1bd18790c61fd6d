//! Changes of trials that a person makes, one or many at once.

use palpate_tactile::trial::CorrectedPhases;

/// A change of trials.
#[derive(Clone, Debug, PartialEq)]
pub enum TrialEdit {
    /// Label trials of the real gripper with their object.
    Label(String),
    /// Set the note; an empty text removes it.
    Note(String),
    /// Replace all tags.
    Tags(Vec<String>),
    /// Add tags.
    Tag(Vec<String>),
    /// Remove tags.
    Untag(Vec<String>),
    /// Mark the label as unsure, or remove the mark.
    Unsure(bool),
    /// Correct the phases of the grasp; none takes them as measured.
    Phases(Option<CorrectedPhases>),
    /// Mark as deleted; can be restored.
    Discard,
    /// Restore deleted trials.
    Restore,
    /// Move trials from the demo log to the store.
    Keep,
}

/// Result of an edit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edited {
    /// Trials that it changed.
    pub changed: usize,
    /// Trials that a label left out, as their object is known.
    pub known: usize,
}

impl Edited {
    /// What was done, in a sentence.
    pub fn sentence(&self, edit: &TrialEdit) -> String {
        let Self { changed, known } = *self;
        let done = match edit {
            TrialEdit::Label(object) => format!("labelled {}", object.trim()),
            TrialEdit::Note(note) if note.trim().is_empty() => "without note now".to_owned(),
            TrialEdit::Note(_) if changed == 1 && known == 0 => return "Note saved".to_owned(),
            TrialEdit::Note(_) => "with the note now".to_owned(),
            TrialEdit::Tags(tags) => format!("tagged [{}]", tags.join(", ")),
            TrialEdit::Tag(tags) => format!("tagged {}", tags.join(", ")),
            TrialEdit::Untag(tags) => format!("no longer tagged {}", tags.join(", ")),
            TrialEdit::Unsure(true) => "marked as unsure".to_owned(),
            TrialEdit::Unsure(false) => "no longer unsure".to_owned(),
            TrialEdit::Phases(Some(_)) => "with corrected phases now".to_owned(),
            TrialEdit::Phases(None) => "with phases as measured now".to_owned(),
            TrialEdit::Discard => "discarded".to_owned(),
            TrialEdit::Restore => "restored".to_owned(),
            TrialEdit::Keep if changed == 0 => return "In the store already".to_owned(),
            TrialEdit::Keep => "kept in the store".to_owned(),
        };
        let keep = match known {
            0 => String::new(),
            1 => "; 1 is simulated or imported and keeps its object".to_owned(),
            _ => format!("; {known} are simulated or imported and keep their object"),
        };
        format!("{changed} {} {done}{keep}", if changed == 1 { "trial" } else { "trials" })
    }
}
