//! Choices by their names.

/// A word that names no choice.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown {what} \"{text}\"; choose {choices}")]
pub struct UnknownWord {
    /// The word.
    pub text: String,
    /// What it should name.
    pub what: &'static str,
    /// Choices, separated by commas.
    pub choices: String,
}

impl UnknownWord {
    /// The choice of a name.
    pub(crate) fn choose<T, const N: usize>(
        text: &str,
        what: &'static str,
        choices: [(&str, T); N],
    ) -> Result<T, Self> {
        let names = choices.each_ref().map(|(name, _)| *name).join(", ");
        let found = choices.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(text.trim()));
        found.map(|(_, choice)| choice).ok_or(Self { text: text.to_owned(), what, choices: names })
    }
}
