//! The manual: one chapter per topic of `palpate help`.
//!
//! Each text exists once, as a Markdown file in `assets/help`: `palpate help TOPIC` prints it, and it is the
//! documentation of a module below. Its first line is the summary.

/// A topic of `palpate help`.
#[derive(Clone, Copy, Debug)]
pub struct Topic {
    /// Name of the topic and of its file.
    pub name: &'static str,
    /// Markdown text, summary first.
    pub text: &'static str,
}

impl Topic {
    /// The first line.
    pub fn summary(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default()
    }
}

/// Declares the topics, in the order of the list: a module with the text as its documentation, and a row of [`TOPICS`].
macro_rules! topics {
    ($($name:ident)*) => {
        $(#[doc = include_str!(concat!("../assets/help/", stringify!($name), ".md"))]
        pub mod $name {})*

        /// All topics.
        pub const TOPICS: &[Topic] = &[
            $(Topic {
                name: stringify!($name),
                text: include_str!(concat!("../assets/help/", stringify!($name), ".md")),
            },)*
        ];
    };
}

topics! {
    start
    scenes
    effects
    accuracy
    stability
    promises
    engines
    datasets
    recordings
    recognition
    paper
    studies
    sensors
    gripper
    control
    labelling
    objects
    inspect
    testing
    store
    formats
    keys
    contributing
}
