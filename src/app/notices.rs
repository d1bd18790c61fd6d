//! Messages to the user, shown as notices over the window and kept for a while.

use egui_notify::{Toast, Toasts};
use std::collections::VecDeque;
use std::time::Duration;

/// Message to the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum UserMessage {
    /// Something was done.
    Info(String),
    /// Something needs a look.
    Warning(String),
    /// Something failed.
    Error(String),
}

/// Letters in a line of a notice.
const LINE_LETTERS: usize = 64;
/// Messages that are kept.
const MOST_MESSAGES: usize = 50;

/// Notices on the screen and the last messages.
pub(super) struct Notices {
    toasts: Toasts,
    messages: VecDeque<String>,
}

impl Default for Notices {
    fn default() -> Self {
        // At the lower left, where they do not cover the recognition.
        let toasts = Toasts::default().with_anchor(egui_notify::Anchor::BottomLeft);
        Self { toasts: toasts.with_margin(egui::vec2(12.0, 56.0)), messages: VecDeque::new() }
    }
}

impl Notices {
    /// Shows a message. Long sentences stay until they can have been read, errors twice as long.
    pub(super) fn tell(&mut self, message: UserMessage) {
        let (text, toast, patience): (String, fn(String) -> Toast, u32) = match message {
            UserMessage::Info(text) => (text, |text| Toast::info(text), 1),
            UserMessage::Warning(text) => (text, |text| Toast::warning(text), 1),
            UserMessage::Error(text) => (text, |text| Toast::error(text), 2),
        };
        let time = patience * Duration::from_secs_f32(2.5 + 0.06 * text.len() as f32);
        self.toasts.add(toast(folded(&text, LINE_LETTERS))).duration(Some(time)).show_progress_bar(false);
        self.messages.push_back(text);
        if self.messages.len() > MOST_MESSAGES {
            self.messages.pop_front();
        }
    }

    pub(super) fn info(&mut self, text: impl Into<String>) {
        self.tell(UserMessage::Info(text.into()));
    }

    pub(super) fn warning(&mut self, text: impl Into<String>) {
        self.tell(UserMessage::Warning(text.into()));
    }

    pub(super) fn error(&mut self, text: impl Into<String>) {
        self.tell(UserMessage::Error(text.into()));
    }

    /// Last messages, oldest first.
    pub(super) fn messages(&self) -> &VecDeque<String> {
        &self.messages
    }

    /// Draws the notices.
    pub(super) fn show(&mut self, ctx: &egui::Context) {
        self.toasts.show(ctx);
    }
}

/// Breaks a text between words into lines of at most `width` letters; notices do not wrap.
fn folded(text: &str, width: usize) -> String {
    let mut folded = String::new();
    let mut column = 0;
    for word in text.split(' ') {
        let letters = word.chars().count();
        if column > 0 && column + 1 + letters > width {
            folded.push('\n');
            column = 0;
        } else if column > 0 {
            folded.push(' ');
            column += 1;
        }
        folded.push_str(word);
        column += letters;
    }
    folded
}
