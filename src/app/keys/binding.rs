//! A key and its action, and text typed ahead of its field.

use crate::app::actions::Action;
use crate::app::context::PanelContext;
use crate::app::notices::UserMessage;
use egui::{Key, KeyboardShortcut, Modifiers};

/// Key, its line in the sheet, and its action.
pub(in crate::app) struct Binding {
    pub(in crate::app) shortcut: KeyboardShortcut,
    /// Text in the sheet; empty where another line covers it.
    pub(in crate::app) does: &'static str,
    pub(in crate::app) act: fn(&PanelContext<'_>) -> Option<Action>,
    /// Message where it has no effect.
    pub(in crate::app) otherwise: &'static str,
}

/// A binding.
pub(in crate::app) const fn key(
    modifiers: Modifiers,
    key: Key,
    does: &'static str,
    act: fn(&PanelContext<'_>) -> Option<Action>,
) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(modifiers, key), does, act, otherwise: "Nothing to do here now." }
}

impl Binding {
    /// The binding with a message for when it has no effect.
    pub(in crate::app) const fn otherwise(self, message: &'static str) -> Self {
        Self { otherwise: message, ..self }
    }

    /// Its action, or the message why it has no effect.
    pub(in crate::app) fn action(&self, context: &PanelContext<'_>) -> Action {
        (self.act)(context).unwrap_or_else(|| UserMessage::Info(self.otherwise.to_owned()).into())
    }

    /// True if the key triggers the binding. An additional Shift is ignored: some keyboards need it for the key.
    pub(in crate::app) fn is(&self, key: Key, modifiers: Modifiers) -> bool {
        let KeyboardShortcut { modifiers: wanted, logical_key } = self.shortcut;
        logical_key == key && modifiers.alt == wanted.alt && modifiers.matches_logically(wanted)
    }

    /// Acts repeatedly while held down.
    pub(in crate::app) fn repeats(&self) -> bool {
        matches!(
            self.shortcut.logical_key,
            Key::ArrowUp | Key::ArrowDown | Key::ArrowLeft | Key::ArrowRight | Key::Minus | Key::Equals
        )
    }
}

/// Text typed after the key of a search field, in the same frame or before the field has the keyboard (`waits`). It is for
/// the field and triggers no keys.
pub(in crate::app) fn typed_ahead(ctx: &egui::Context, waits: bool) -> Option<String> {
    ctx.input_mut(|input| {
        let slash = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::Slash, pressed: true, .. });
        let text = |event: &egui::Event| match event {
            egui::Event::Text(text) if text != "/" => Some(text.clone()),
            _ => None,
        };
        let pressed = input.events.iter().position(slash);
        let from = pressed.or_else(|| waits.then_some(0))?;
        let typed: String = input.events[from..].iter().filter_map(text).collect();
        if pressed.is_none() && !input.events.iter().any(|event| matches!(event, egui::Event::Text(_))) {
            return None;
        }
        let is_stop = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::Escape, .. });
        let is_typed = |event: &egui::Event| matches!(event, egui::Event::Key { .. } | egui::Event::Text(_));
        let mut place = 0;
        input.events.retain(|event| {
            place += 1;
            place <= from || !is_typed(event) || is_stop(event)
        });
        Some(typed)
    })
}
