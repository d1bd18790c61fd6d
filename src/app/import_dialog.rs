//! Import of trials of other programs: which column of a file is which, with the curves that come of it.

use crate::app::plots::static_plot;
use crate::app::theme::{self, colour};
use crate::app::widgets::{capital, failure_ui, remark_ui, text_field, warning_ui, wrapped};
use egui::{Button, ComboBox, Grid, Id, Modal, RichText, ScrollArea, Ui};
use egui_plot::{AxisHints, Line};
use palpate_exchange::{Import, Mapping, PROFILES, SPLIT_GAP_S, columns_of, plain_name, read_trials};
use palpate_geometry::palette::series_colour;
use palpate_lab::workers::{Job, JobError, Newer, Wake};
use palpate_store::Store;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a column is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Channel,
    Time,
    Label,
    Trial,
    LeftOut,
}

impl Role {
    const ALL: [Self; 5] = [Self::Channel, Self::Time, Self::Label, Self::Trial, Self::LeftOut];

    fn name(self) -> &'static str {
        match self {
            Self::Channel => "channel",
            Self::Time => "time",
            Self::Label => "label",
            Self::Trial => "trial",
            Self::LeftOut => "left out",
        }
    }
}

/// A column of the file, and what the user says of it.
#[derive(Clone, Debug, PartialEq)]
struct ColumnChoice {
    name: String,
    role: Role,
    /// Unit that counts instead of the header's.
    unit: String,
}

/// File to read, or to store.
#[derive(Debug)]
struct Request {
    path: PathBuf,
    mapping: Mapping,
    /// Store that takes the trials.
    store: Option<PathBuf>,
}

/// What came of a request.
struct Outcome {
    columns: Vec<String>,
    import: Result<Import, String>,
    /// Said once the trials are stored.
    stored: Option<String>,
}

/// An open dialog.
pub(super) struct ImportDialog {
    path: PathBuf,
    store: PathBuf,
    /// Name of the profile, or its file; empty without one.
    profile: String,
    /// Why a profile cannot be used.
    refused: Option<String>,
    /// What the columns do not say.
    base: Mapping,
    columns: Vec<ColumnChoice>,
    label: String,
    split: bool,
    /// The user has said what the columns are.
    chosen: bool,
    job: Job<Request, Outcome>,
}

/// What a dialog asks for.
pub(super) enum Asked {
    Cancel,
    Imported(String),
    OpenProfile,
    SaveProfile(Box<Mapping>),
}

/// Curves and warnings that are shown at most.
const MOST_CURVES: usize = 8;
const MOST_WARNINGS: usize = 5;

fn read(request: &Request) -> Result<Outcome, JobError> {
    let Request { path, mapping, store } = request;
    let columns = columns_of(path, mapping)?;
    let import = read_trials(path, mapping).map_err(|error| error.to_string());
    let mut stored = None;
    if let (Some(store), Ok(import)) = (store, &import) {
        let collection = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let added = Store::open(store)?.insert_imported(&collection, &import.trials)?;
        let known = import.trials.len() - added as usize;
        let known = if known > 0 { format!("; {known} were there already") } else { String::new() };
        stored = Some(format!("{} imported as collection {collection}{known}.", trials_text(added as usize)));
    }
    Ok(Outcome { columns, import, stored })
}

impl ImportDialog {
    /// A dialog for a file whose trials go into a store.
    pub(super) fn new(path: PathBuf, store: PathBuf, wake: Wake) -> Self {
        let job = Job::new("import", Newer::Replaces, wake, |request: &Request, _run| read(request).map(Some));
        let dialog = Self {
            path,
            store,
            profile: String::new(),
            refused: None,
            base: Mapping::default(),
            columns: Vec::new(),
            label: String::new(),
            split: false,
            chosen: false,
            job,
        };
        dialog.start(None);
        dialog
    }

    /// Reads the file anew, and stores its trials where a store is named.
    fn start(&self, store: Option<PathBuf>) {
        self.job.start(Request { path: self.path.clone(), mapping: self.mapping(), store });
    }

    /// Pause that begins a new trial (s).
    fn gap_s(&self) -> f64 {
        self.base.split_gap_s.unwrap_or(SPLIT_GAP_S)
    }

    /// The roles as they are now.
    fn mapping(&self) -> Mapping {
        let split_gap_s = self.split.then_some(self.gap_s());
        let label = Some(self.label.trim().to_owned()).filter(|label| !label.is_empty());
        let label = label.or_else(|| self.base.label.clone());
        if !self.chosen {
            return Mapping { split_gap_s, label, ..self.base.clone() };
        }
        let named = |column: &ColumnChoice| match column.unit.trim() {
            "" => column.name.clone(),
            unit => format!("{} [{unit}]", plain_name(&column.name)),
        };
        let of = |role: Role| self.columns.iter().find(|column| column.role == role).map(named);
        let channel = |column: &ColumnChoice| match self.base.channel_of(&column.name) {
            Some((Some(own), _)) => format!("{own}={}", named(column)),
            _ => named(column),
        };
        let channels = self.columns.iter().filter(|column| column.role == Role::Channel).map(channel).collect();
        let label = of(Role::Label).or(label);
        Mapping { time: of(Role::Time), trial: of(Role::Trial), label, channels, split_gap_s, ..self.base.clone() }
    }

    /// The roles for other files: a label that is no column is that of this file.
    fn profile_to_save(&self) -> Mapping {
        let mapping = self.mapping();
        let is_column =
            |label: &String| self.columns.iter().any(|column| plain_name(&column.name) == plain_name(label));
        Mapping { label: mapping.label.clone().filter(is_column), ..mapping }
    }

    /// Takes in the columns of the file, and a profile that fits.
    fn take_columns(&mut self, names: &[String]) {
        if self.columns.len() == names.len() {
            return;
        }
        let header: Vec<&str> = names.iter().map(String::as_str).collect();
        if let Some((name, profile)) = Mapping::known_for(&header).filter(|_| self.profile.is_empty()) {
            self.split = profile.split_gap_s.is_some();
            (self.profile, self.base) = (name.to_owned(), profile);
        }
        self.columns = names.iter().map(|name| self.choice_of(name)).collect();
        let is_time = |name: &str| name == "t" || name.to_ascii_lowercase().contains("time");
        if !self.columns.iter().any(|column| column.role == Role::Time)
            && let Some(time) = self.columns.iter_mut().find(|column| is_time(&column.name))
        {
            (time.role, self.chosen) = (Role::Time, true);
        }
        self.start(None);
    }

    /// Role of a column by the mapping, or by its name.
    fn choice_of(&self, name: &str) -> ColumnChoice {
        let plain = |text: &str| plain_name(text).to_ascii_lowercase();
        let is = |wanted: Option<&String>| wanted.is_some_and(|wanted| plain(wanted) == plain(name));
        let base = &self.base;
        let role = if is(base.time.as_ref()) || (base.time.is_none() && plain(name) == "t_s") {
            Role::Time
        } else if is(base.trial.as_ref()) || plain(name) == "trial" {
            Role::Trial
        } else if is(base.label_column.as_ref()) || plain(name) == "label" {
            Role::Label
        } else if base.ignore.iter().any(|ignored| plain(ignored) == plain(name))
            || (base.channel_of(name).is_none() && !base.channels.is_empty())
        {
            Role::LeftOut
        } else {
            Role::Channel
        };
        let mapped = match role {
            Role::Time => base.time.as_deref(),
            Role::Channel => base.channel_of(name).map(|(_, column)| column),
            Role::Label | Role::Trial | Role::LeftOut => None,
        };
        let unit = mapped.and_then(|column| column.split_once('[')).map(|(_, unit)| unit.trim_end_matches(']'));
        ColumnChoice { name: name.to_owned(), role, unit: unit.unwrap_or_default().to_owned() }
    }

    /// Uses a profile by its name, or of a file.
    fn use_profile(&mut self, name: String) {
        match Mapping::profile(&name) {
            _ if name.is_empty() => self.base = Mapping::default(),
            Ok(base) => self.base = base,
            Err(cause) => return self.refused = Some(cause),
        }
        self.split = self.base.split_gap_s.is_some();
        (self.profile, self.refused, self.chosen) = (name, None, false);
        self.columns = self.columns.iter().map(|column| self.choice_of(&column.name)).collect();
    }

    /// Uses the profile of a file, and reads anew.
    pub(super) fn open_profile(&mut self, path: &Path) {
        self.use_profile(path.to_string_lossy().into_owned());
        self.start(None);
    }

    /// Draws the dialog; returns what it asks for.
    pub(super) fn ui(&mut self, ctx: &egui::Context) -> Option<Asked> {
        let (running, last) = self.job.state();
        let outcome = last.map(|ended| ended.outcome);
        if let Some(Ok(outcome)) = &outcome {
            if let Some(said) = &outcome.stored {
                return Some(Asked::Imported(said.clone()));
            }
            self.take_columns(&outcome.columns);
        }
        let mut asked = None;
        let before = self.mapping();
        let modal = Modal::new(Id::unique("import dialog")).show(ctx, |ui| {
            let room = ui.ctx().content_rect().size();
            ui.set_width((room.x - 60.0).min(720.0));
            let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            ui.heading(format!("Import {name}"));
            // Of one height, so that buttons stay where they are.
            let height = (room.y - 150.0).clamp(120.0, 560.0);
            ScrollArea::vertical().max_height(height).auto_shrink(false).show(ui, |ui| {
                self.choices_ui(ui, &mut asked);
                if let Some(cause) = &self.refused {
                    failure_ui(ui, cause);
                }
                match &outcome {
                    None => remark_ui(ui, "Reading the file …"),
                    Some(Err(cause)) => failure_ui(ui, cause),
                    Some(Ok(outcome)) => match &outcome.import {
                        Ok(import) => import_ui(ui, import),
                        Err(cause) => failure_ui(ui, cause),
                    },
                }
            });
            ui.add_space(4.0);
            ui.horizontal(|ui| {
                let trials = match &outcome {
                    Some(Ok(outcome)) => outcome.import.as_ref().map_or(0, |import| import.trials.len()),
                    _ => 0,
                };
                let is_ready = trials > 0 && running.is_none();
                if ui.add_enabled(is_ready, Button::new(format!("Import {}", trials_text(trials)))).clicked() {
                    self.start(Some(self.store.clone()));
                }
                if ui.button("Cancel").clicked() {
                    asked = Some(Asked::Cancel);
                }
                if running.is_some() {
                    ui.spinner();
                }
            });
        });
        if self.mapping() != before {
            self.start(None);
        }
        if modal.should_close() { Some(asked.unwrap_or(Asked::Cancel)) } else { asked }
    }

    fn choices_ui(&mut self, ui: &mut Ui, asked: &mut Option<Asked>) {
        ui.horizontal_wrapped(|ui| {
            let title = |name: &str| match PROFILES.iter().find(|(own, _)| *own == name) {
                Some(_) => Mapping::profile(name).unwrap_or_default().title,
                None if name.is_empty() => "its own names".to_owned(),
                None => Path::new(name).file_name().unwrap_or_default().to_string_lossy().into_owned(),
            };
            ui.label("Columns as in");
            let mut profile = self.profile.clone();
            ComboBox::from_id_salt("import profile").selected_text(title(&profile)).show_ui(ui, |ui| {
                for name in std::iter::once("").chain(PROFILES.iter().map(|(name, _)| *name)) {
                    ui.selectable_value(&mut profile, name.to_owned(), title(name));
                }
                if ui.selectable_label(false, "a profile of yours …").clicked() {
                    *asked = Some(Asked::OpenProfile);
                }
            });
            if self.profile != profile {
                self.use_profile(profile);
            }
            if ui
                .button("Save profile …")
                .on_hover_text("Keep these roles for other files of this kind, as TOML")
                .clicked()
            {
                *asked = Some(Asked::SaveProfile(Box::new(self.profile_to_save())));
            }
            let pause = format!("New trial after a pause of {} s", self.gap_s());
            ui.checkbox(&mut self.split, pause);
            let about = "Less each channel's mean over the first 0.15 s of its trial, as a live gripper's readings are";
            ui.checkbox(&mut self.base.rezero, "Subtract the rest").on_hover_text(about);
        });
        ui.horizontal(|ui| {
            ui.label("Label");
            let hint = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            ui.add(
                text_field(&mut self.label, Id::unique("label of an import")).hint_text(format!("{hint}, or a column")),
            );
        });
        if self.columns.is_empty() {
            return;
        }
        ui.add_space(4.0);
        ScrollArea::vertical().id_salt("import columns").max_height(170.0).show(ui, |ui| {
            Grid::new("import columns").num_columns(3).striped(true).show(ui, |ui| {
                for (number, column) in self.columns.iter_mut().enumerate() {
                    let before = column.clone();
                    ui.label(&column.name);
                    let combo = ComboBox::from_id_salt(("import role", number)).width(96.0);
                    let combo = combo.selected_text(column.role.name()).show_ui(ui, |ui| {
                        Role::ALL.iter().for_each(|role| {
                            ui.selectable_value(&mut column.role, *role, role.name());
                        });
                    });
                    let name = format!("Role of {}", column.name);
                    combo.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, &name));
                    let field = text_field(&mut column.unit, Id::unique(("import unit", number)));
                    let name = format!("Unit of {}", column.name);
                    let field = ui.add(field.desired_width(70.0).hint_text("unit"));
                    field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, &name));
                    ui.end_row();
                    self.chosen |= *column != before;
                }
            });
        });
    }
}

fn trials_text(trials: usize) -> String {
    if trials == 1 { "1 trial".to_owned() } else { format!("{trials} trials") }
}

/// What is going to be imported: counts, curves of the first trial, warnings.
fn import_ui(ui: &mut Ui, import: &Import) {
    let mut labels: BTreeMap<&str, usize> = BTreeMap::new();
    import.trials.iter().for_each(|trial| *labels.entry(&trial.label).or_default() += 1);
    let labels: Vec<String> = labels.iter().take(12).map(|(label, count)| format!("{label} {count}")).collect();
    ui.add_space(6.0);
    wrapped(ui, RichText::new(format!("{}: {}", trials_text(import.trials.len()), labels.join(", "))).strong());
    import.warnings.iter().take(MOST_WARNINGS).for_each(|warning| warning_ui(ui, capital(warning)));
    if import.warnings.len() > MOST_WARNINGS {
        remark_ui(ui, format!("and {} more", import.warnings.len() - MOST_WARNINGS));
    }
    if let Some(trial) = import.trials.first() {
        remark_ui(
            ui,
            format!("The first, \"{}\"; each channel is drawn from its least to its largest value.", trial.label),
        );
        let theme = theme::of(ui);
        ui.horizontal_wrapped(|ui| {
            for (channel, name) in trial.signals.channels.iter().enumerate().take(MOST_CURVES) {
                ui.label(RichText::new(name).small().color(colour(series_colour(channel, theme))));
            }
        });
        let seconds = AxisHints::new_x()
            .formatter(|mark: egui_plot::GridMark, _| format!("{}\u{a0}s", (mark.value * 1e9).round() / 1e9));
        let plot = static_plot(theme, "import preview", 130.0, "", seconds, 0.0);
        plot.show_axes([true, false]).show(ui, |plot| {
            let signals = &trial.signals;
            let width = signals.channels.len();
            for (channel, name) in signals.channels.iter().enumerate().take(MOST_CURVES) {
                let values = || signals.values.iter().skip(channel).step_by(width).map(|value| f64::from(*value));
                let known = || values().filter(|value| value.is_finite());
                let (least, most) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
                let points: Vec<[f64; 2]> = signals
                    .t_s
                    .iter()
                    .zip(values())
                    .map(|(t, value)| [*t, (value - least) / (most - least).max(1e-12)])
                    .collect();
                // Gaps stay gaps.
                for part in points.split(|point| point[1].is_nan()).filter(|part| !part.is_empty()) {
                    plot.line(
                        Line::new(name.clone(), part.to_vec()).color(colour(series_colour(channel, theme))).width(1.4),
                    );
                }
            }
        });
    }
}
