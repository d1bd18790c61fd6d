//! Actions: functions of the [`App`]. Buttons push them; keys, palette, key sheet and manual read one table of [`Act`]s.

use crate::app::features::App;
use egui::{Key, KeyboardShortcut, Modifiers, Response};

/// What a button does with the window.
pub(super) type Action = Box<dyn FnOnce(&mut App)>;

/// Actions pushed in one frame. They run after it, in their order.
#[derive(Default)]
pub struct Actions(Vec<Action>);

impl Actions {
    /// Adds an action.
    pub fn push(&mut self, action: impl FnOnce(&mut App) + 'static) {
        self.0.push(Box::new(action));
    }

    /// Adds the action of a button that was clicked.
    pub(super) fn on(&mut self, button: &Response, action: impl FnOnce(&mut App) + 'static) {
        if button.clicked() {
            self.push(action);
        }
    }
}

impl IntoIterator for Actions {
    type Item = Action;
    type IntoIter = std::vec::IntoIter<Action>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

/// An action with a name: a line of the palette and, with a key, of key sheet and manual.
pub(super) struct Act {
    pub(super) shortcut: Option<KeyboardShortcut>,
    /// What it does; empty where another line covers it.
    pub(super) does: &'static str,
    run: Run,
}

#[derive(Clone, Copy)]
enum Run {
    Always(fn(&mut App)),
    /// Or the reason why it has no effect now.
    Where(fn(&mut App) -> Result<(), &'static str>),
}

/// An action with a key.
pub(super) const fn key(modifiers: Modifiers, key: Key, does: &'static str, run: fn(&mut App)) -> Act {
    Act { shortcut: Some(KeyboardShortcut::new(modifiers, key)), does, run: Run::Always(run) }
}

/// An action with a key that says why it has no effect now.
pub(super) const fn key_where(
    modifiers: Modifiers,
    key: Key,
    does: &'static str,
    run: fn(&mut App) -> Result<(), &'static str>,
) -> Act {
    Act { shortcut: Some(KeyboardShortcut::new(modifiers, key)), does, run: Run::Where(run) }
}

/// An action of the palette alone.
pub(super) const fn command(does: &'static str, run: fn(&mut App)) -> Act {
    Act { shortcut: None, does, run: Run::Always(run) }
}

impl Act {
    /// Does it, or says why not.
    pub(super) fn run(&self, app: &mut App) {
        match self.run {
            Run::Always(run) => run(app),
            Run::Where(run) => {
                if let Err(why) = run(app) {
                    app.notices.info(why);
                }
            }
        }
    }

    /// True if a key triggers it. An additional Shift is ignored: some keyboards need it for the key.
    pub(super) fn is(&self, key: Key, modifiers: Modifiers) -> bool {
        self.shortcut.is_some_and(|KeyboardShortcut { modifiers: wanted, logical_key }| {
            logical_key == key && modifiers.alt == wanted.alt && modifiers.matches_logically(wanted)
        })
    }

    /// Acts repeatedly while its key is held down.
    pub(super) fn repeats(&self) -> bool {
        let key = self.shortcut.map(|shortcut| shortcut.logical_key);
        matches!(key, Some(Key::ArrowUp | Key::ArrowDown | Key::ArrowLeft | Key::ArrowRight | Key::Minus | Key::Equals))
    }

    /// Its key in words; empty without one.
    pub(super) fn key_text(&self, ctx: &egui::Context) -> String {
        self.shortcut.map(|shortcut| ctx.format_shortcut(&shortcut)).unwrap_or_default()
    }
}
