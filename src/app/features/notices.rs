//! Messages to the user: a line below the time bar, which covers nothing, with a button where something can be done; and the
//! last messages, in a menu.

use super::App;
use crate::app::theme::colour;
use egui::{Frame, Label, Margin, Panel, RichText, Ui};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::units::{capital, message};
use palpate_lab::workers::{LabelCommand, Notice};
use palpate_store::Stored;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// What can be done about a message: a phrase of the messages that it helps with, its button, and what that does.
struct Remedy(&'static str, &'static str, fn(&mut App));

const REMEDIES: [Remedy; 9] = [
    Remedy(ITS_HULL, "Use its hull", App::use_hull),
    Remedy(ITS_UNIT, "Treat as mm", |app| app.set_object_scale(1e-3)),
    Remedy(ITS_UNIT, "Treat as cm", |app| app.set_object_scale(1e-2)),
    Remedy(ITS_UNIT, "Treat as m", |app| app.set_object_scale(1.0)),
    Remedy("cannot read \"", "Choose a file …", App::ask_for_object),
    Remedy("cannot read the mesh", "Choose a file …", App::ask_for_object),
    Remedy("not calibrated", "Calibrate …", |app| app.show_panel("calibration")),
    Remedy("no calibration", "Calibrate …", |app| app.show_panel("calibration")),
    Remedy(UNDONE_BY_KEY, "Undo", |app| app.edit_labels(LabelCommand::Undo)),
];

/// In messages about the object of the scene, until another one is asked for.
const ITS_HULL: &str = "object.collision = \"hull\"";
const ITS_UNIT: &str = "set object.scale to decide";
/// In messages of what Ctrl+Z takes back, until something else is changed.
const UNDONE_BY_KEY: &str = "Ctrl+Z brings it back";

/// Messages that are kept.
const MOST_MESSAGES: usize = 50;
/// Least height of the line (points).
const LINE: f32 = 18.0;
/// Time that a message with a button stays.
const WITH_BUTTON: Duration = Duration::from_secs(30);

/// Time for which the last message can still be read after it, in quiet letters.
const QUIET: Duration = Duration::from_secs(10);

/// In messages of a store that is lost, which stay until they are dismissed: whatever is recorded goes nowhere.
const STORE_LOST: &str = "while it was open";
/// Time that they stay: a day's work.
const LASTING: Duration = Duration::from_secs(86_400);

/// Level of a message, least urgent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Info,
    Warning,
    Error,
}

/// Message in the line.
struct Shown {
    level: Level,
    /// Action that has failed or was stopped: when it succeeds or begins again, the message is no longer true.
    failed: Option<&'static str>,
    text: String,
    /// It can have been read once.
    read: Instant,
    until: Instant,
}

/// Messages of the window.
#[derive(Default)]
pub(in crate::app) struct Notices {
    shown: Vec<Shown>,
    messages: VecDeque<String>,
    /// When the last message came.
    told: Option<Instant>,
    /// What was said of the object: once, until another one is asked for.
    of_object: Vec<String>,
}

/// True for what is said of an object when it is loaded.
fn is_of_object(text: &str) -> bool {
    [ITS_HULL, ITS_UNIT, "gives no usable mass"].iter().any(|phrase| text.contains(phrase))
}

/// Remedies for a message.
fn remedies(text: &str) -> impl Iterator<Item = &'static Remedy> + '_ {
    REMEDIES.iter().filter(|Remedy(phrase, ..)| text.contains(phrase) || text.starts_with(&capital(phrase)))
}

impl Notices {
    /// Shows a message. Long sentences stay until they can have been read, errors twice as long.
    fn tell(&mut self, level: Level, text: &str) {
        let text = message(text);
        if is_of_object(&text) {
            if self.of_object.contains(&text) {
                return;
            }
            self.of_object.push(text.clone());
        }
        let reading = Duration::from_secs_f32(2.5 + 0.06 * text.len() as f32);
        let time = if level == Level::Error { 2 * reading } else { reading };
        let [reading, time] = if text.contains(STORE_LOST) { [LASTING; 2] } else { [reading, time] };
        let time = if remedies(&text).next().is_some() { time.max(WITH_BUTTON) } else { time };
        self.shown.retain(|shown| shown.text != text);
        let now = Instant::now();
        self.shown.push(Shown { level, failed: None, text: text.clone(), read: now + reading, until: now + time });
        self.messages.push_back(text);
        self.told = Some(now);
        if self.messages.len() > MOST_MESSAGES {
            self.messages.pop_front();
        }
    }

    /// Shows a notice of a thread.
    pub(in crate::app) fn show(&mut self, notice: Notice) {
        match notice {
            Notice::Info(text) => self.info(text),
            Notice::Warning(text) => self.warning(text),
            Notice::Failed(text) => self.error(text),
            Notice::SceneRefused(refusal) => self.error(refusal.cause),
            Notice::Stored(Stored::New(id)) => self.info(format!("Trial {id} stored.")),
            Notice::Stored(Stored::Known(id)) => {
                self.info(format!("Not stored again: trial {id} is the same grasp (Inspect, Ctrl+2)."));
            }
            Notice::Stored(Stored::Kept(id)) => {
                self.info(format!("Trial {id} of the demo log is the same grasp: kept in the store."));
            }
            Notice::Logged(..) => {}
        }
    }

    pub(in crate::app) fn info(&mut self, text: impl Into<String>) {
        self.tell(Level::Info, &text.into());
    }

    pub(in crate::app) fn warning(&mut self, text: impl Into<String>) {
        self.tell(Level::Warning, &text.into());
    }

    pub(in crate::app) fn error(&mut self, text: impl Into<String>) {
        self.tell(Level::Error, &text.into());
    }

    /// Shows why an action has failed, until it succeeds.
    pub(in crate::app) fn failed(&mut self, attempt: &'static str, text: impl Into<String>) {
        self.error(text);
        self.until(attempt);
    }

    /// The last message is true until this action succeeds or begins again.
    pub(in crate::app) fn until(&mut self, attempt: &'static str) {
        if let Some(shown) = self.shown.last_mut() {
            shown.failed = Some(attempt);
        }
    }

    /// Takes errors of an action away: it has succeeded. The list of messages keeps them.
    pub(in crate::app) fn done(&mut self, attempt: &'static str) {
        if self.shown.extract_if(.., |shown| shown.failed == Some(attempt)).count() > 0 {
            // The last message is no longer so.
            self.told = None;
        }
    }

    /// Takes away what Ctrl+Z no longer does: something else is changed now.
    pub(in crate::app) fn changed(&mut self) {
        self.shown.retain(|shown| !shown.text.contains(UNDONE_BY_KEY));
    }

    /// Takes away what was said of an object: another one is asked for.
    pub(in crate::app) fn object_changed(&mut self) {
        self.of_object.clear();
        self.shown.retain(|shown| !is_of_object(&shown.text));
    }

    /// Last messages, oldest first.
    pub(in crate::app) fn messages(&self) -> &VecDeque<String> {
        &self.messages
    }

    /// The message to show now: the newest error that is still to be read, else the newest that can be decided, else the newest
    /// warning, else the newest. What can have been read makes room for the answer to a later action.
    fn first(&mut self, ctx: &egui::Context) -> Option<usize> {
        let now = Instant::now();
        self.shown.retain(|shown| shown.until > now);
        if let Some(next) = self.shown.iter().map(|shown| shown.until).min() {
            ctx.request_repaint_after(next - now);
        }
        let level = |shown: &Shown| if now < shown.read { shown.level } else { Level::Info };
        let urgency = |shown: &Shown| (level(shown), remedies(&shown.text).next().is_some());
        (0..self.shown.len()).max_by_key(|k| (urgency(&self.shown[*k]), *k))
    }

    /// The message to show now to an audience: what has failed.
    pub(in crate::app) fn current(&mut self, ctx: &egui::Context) -> Option<&str> {
        self.first(ctx)?;
        self.shown.iter().rfind(|shown| shown.level == Level::Error).map(|shown| shown.text.as_str())
    }

    /// Draws the line; returns what the remedy that was chosen does.
    pub(in crate::app) fn line(&mut self, ui: &mut Ui, theme: Theme) -> Option<fn(&mut App)> {
        let first = self.first(ui.ctx());
        let colours = theme.colours();
        let bar = Frame::new().fill(colour(colours.raised)).inner_margin(Margin::symmetric(12, 2));
        let mut chosen = None;
        Panel::bottom("messages").frame(bar).show_separator_line(false).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.set_min_height(LINE);
                let Some(first) = first else {
                    let late = self.told.is_none_or(|told| told.elapsed() > QUIET);
                    return quiet_line(ui, colours.quiet_text, self.messages.back().filter(|_| !late));
                };
                let Shown { level, text, .. } = &self.shown[first];
                let ink = match level {
                    Level::Info => colours.text,
                    Level::Warning => colours.warning,
                    Level::Error => colours.error,
                };
                let others = self.shown.len() - 1;
                let mut closed = false;
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    closed = ui.small_button("×").on_hover_text("Dismiss").clicked();
                    // The number of others comes and goes; what is clicked stays where it is.
                    for Remedy(_, button, does) in remedies(text) {
                        if ui.button(RichText::new(*button).small()).clicked() {
                            chosen = Some(*does);
                        }
                    }
                    if others > 0 {
                        ui.menu_button(RichText::new(format!("{others} more")).small(), |ui| {
                            for shown in self.shown.iter().rev() {
                                ui.label(&shown.text);
                            }
                        });
                    }
                    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                        // The buttons beside it decide.
                        let said = text.replace(&format!("; {ITS_UNIT}"), "");
                        ui.add(Label::new(RichText::new(said).small().color(colour(ink))).wrap());
                    });
                });
                if closed || chosen.is_some() {
                    self.shown.remove(first);
                }
            });
        });
        chosen
    }
}

/// Line without news: the last message, or the two keys that lead on.
fn quiet_line(ui: &mut Ui, ink: Rgb, last: Option<&String>) {
    let text = last.map_or("Ctrl+K finds any action, F1 shows all keys", String::as_str);
    ui.add(Label::new(RichText::new(text).small().color(colour(ink))).truncate());
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::MeshError;
    use palpate_sim::scene::Scene;

    #[test]
    fn the_loss_of_the_store_is_shown_until_it_is_dismissed() {
        let mut notices = Notices::default();
        let path = std::path::PathBuf::from("trials.sqlite");
        let lost = palpate_store::StoreError::FileLost { path, event: "cut short" }.to_string();
        notices.error(lost.clone());
        notices.error("Another failure");
        let ctx = egui::Context::default();
        let hour = Instant::now() + Duration::from_secs(3600);
        notices.shown.retain(|shown| shown.until > hour);
        assert_eq!(notices.current(&ctx), Some(message(&lost).as_str()));
    }

    #[test]
    fn an_error_disappears_when_its_action_succeeds() {
        let mut notices = Notices::default();
        notices.failed("scene", "cannot read the mesh");
        notices.failed("study", "the study failed");
        notices.done("scene");
        let ctx = egui::Context::default();
        assert_eq!(notices.current(&ctx), Some("The study failed"));
        notices.done("study");
        assert!(notices.current(&ctx).is_none() && notices.told.is_none());
        assert_eq!(notices.messages().len(), 2, "what was said can be looked up");
    }

    #[test]
    fn a_button_stays_where_it_is_while_other_messages_come_and_go() {
        use egui_kittest::kittest::Queryable as _;
        let (mut notices, undo) = (Notices::default(), "Trial 7 discarded; Ctrl+Z brings it back");
        notices.info("Trial 6 stored.");
        notices.warning(undo);
        let draw = |ui: &mut Ui, notices: &mut Notices| assert!(notices.line(ui, Theme::Dark).is_none());
        let mut harness = egui_kittest::Harness::new_ui_state(draw, notices);
        let place = |harness: &egui_kittest::Harness<'_, Notices>| harness.get_by_label("Undo").rect();
        let before = place(&harness);
        assert!(harness.query_by_label("1 more").is_some());
        harness.state_mut().shown.retain(|shown| shown.text == undo);
        harness.step();
        assert!(harness.query_by_label("1 more").is_none());
        assert_eq!(place(&harness), before);
    }

    #[test]
    fn warnings_carry_the_buttons_that_help() {
        let of = |text: &str| remedies(text).map(|Remedy(_, button, _)| *button).collect::<Vec<_>>();
        let open = MeshError::Open { holes: 1, widest_mm: 20.0 };
        assert_eq!(of(&open.to_string()), ["Use its hull"]);
        assert_eq!(of(&MeshError::NotOrientable.to_string()), ["Use its hull"]);
        assert!(of("Trial 3 stored.").is_empty());
        // The messages are those of the loader, so that a change of its words is noticed here.
        let folder = tempfile::tempdir().expect("a folder");
        let load = |name: &str| {
            let mut scene = Scene::default();
            scene.object.source = folder.path().join(name).to_string_lossy().into_owned();
            scene.load_object()
        };
        assert_eq!(of(&load("gone.obj").expect_err("no file").to_string()), ["Choose a file …"]);
        let corners = "v 0 0 0\nv 40 0 0\nv 0 40 0\nv 0 0 40\n";
        let cube = format!("{corners}f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
        std::fs::write(folder.path().join("large.obj"), cube).expect("writes");
        let large = load("large.obj").expect("loads").expect("an object");
        let scale = large.warnings.iter().find(|warning| warning.contains("scale")).expect("a warning of its size");
        assert_eq!(of(scale), ["Treat as mm", "Treat as cm", "Treat as m"]);
        // It comes before later warnings, and goes with its object.
        let mut notices = Notices::default();
        notices.warning(scale);
        notices.warning("no finger touched the object");
        let ctx = egui::Context::default();
        assert_eq!(notices.first(&ctx), Some(0));
        notices.object_changed();
        assert_eq!(
            notices.shown.iter().map(|shown| shown.text.as_str()).collect::<Vec<_>>(),
            ["No finger touched the object"]
        );
        assert_eq!(of("Trial 7 discarded; Ctrl+Z brings it back"), ["Undo"]);
    }
}
