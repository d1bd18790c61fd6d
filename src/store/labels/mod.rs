//! Labels: class names, edits, predictions, flags and the plan of a labelling session.

mod class_name;
mod edit;
mod flag;
mod labelled_trial;
mod plan;
mod sparkline;
mod unknown_word;

pub use class_name::{ClassClash, Classes, LONGEST_NAME, LabelError, class_name, compared, shown_name, shown_title};
pub use edit::{Edited, TrialEdit};
pub use flag::{Flag, FlagRemark, cadence_line, flaws};
pub use labelled_trial::{ADAPTING, Guess, GuessTop, LabelledTrial};
pub use plan::{LabelPlan, MOST_WANTED, NextTrial, ObjectProgress, PlannedObject, PoseCue, Progress};
pub use sparkline::{SPARKLINE_BINS, Sparkline};
pub use unknown_word::UnknownWord;
