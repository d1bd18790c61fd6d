//! Names of classes, which are the labels in files, tables and on the axes of a confusion matrix.

use palpate_sim::objects::titled;

/// Most characters of a name.
pub const LONGEST_NAME: usize = 80;

/// A text that cannot be a label.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClassNameError {
    /// Blanks only.
    #[error("a label cannot be empty; write a name, or \"empty\" for the empty hand")]
    Empty,
    /// Too long.
    #[error("the label \"{beginning}...\" has {length} characters; {LONGEST_NAME} are allowed")]
    TooLong {
        /// Its beginning.
        beginning: String,
        /// Its length (characters).
        length: usize,
    },
    /// A control character, such as a tab or a line break.
    #[error("the label {name:?} holds a control character; write it on one line without tabs")]
    Control {
        /// Beginning of the name.
        name: String,
    },
}

/// Checks a label and trims the blanks around it.
pub fn class_name(text: &str) -> Result<String, ClassNameError> {
    let name = text.trim();
    let length = name.chars().count();
    if name.is_empty() {
        Err(ClassNameError::Empty)
    } else if name.contains(char::is_control) {
        Err(ClassNameError::Control { name: name.chars().take(LONGEST_NAME).collect() })
    } else if length > LONGEST_NAME {
        Err(ClassNameError::TooLong { beginning: name.chars().take(20).collect(), length })
    } else {
        Ok(name.to_owned())
    }
}

/// Name of a trial's object for display: unlabelled trials have an empty name in the store.
pub fn shown_name(object: &str) -> &str {
    if object.is_empty() { "unlabelled" } else { object }
}

/// Title of a trial's object for display, with the name of its class where it differs; `unlabelled` without one.
pub fn shown_title(object: &str) -> String {
    if object.is_empty() { "unlabelled".to_owned() } else { titled(object) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_trimmed_and_nonsense_is_refused() {
        assert_eq!(class_name("  big ball\n"), Ok("big ball".to_owned()));
        assert_eq!(class_name(&"é".repeat(80)), Ok("é".repeat(80)));
        assert_eq!(class_name(" \t "), Err(ClassNameError::Empty));
        assert!(matches!(class_name(&"x".repeat(81)), Err(ClassNameError::TooLong { length: 81, .. })));
        assert!(matches!(class_name("a\tb"), Err(ClassNameError::Control { .. })));
        assert_eq!((shown_name(""), shown_name("lemon")), ("unlabelled", "lemon"));
        assert_eq!(
            (shown_title(""), shown_title("bigball")),
            ("unlabelled".to_owned(), "Tennis ball (bigball)".to_owned())
        );
    }
}
