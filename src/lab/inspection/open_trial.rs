//! A stored trial, opened: everything that plots, pictures and bars show of it, sample by sample.

use super::phases::{PhaseSpan, PhaseTimes, TouchPhase, phases_of_frames, touches_of_frames};
use crate::datasets::{SensorView, knows_fingers, noise_seed};
use crate::grasping::{Identification, IdentificationView, Row};
use crate::labelling::measured_phases;
use crate::picture::Stage;
use crate::recording::OpenTrialError;
use palpate_geometry::Pose;
use palpate_learn::{Model, Models, Shipped, StopRule};
use palpate_sim::frame::{Frame, GraspFailure, Plan, Quality};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::capital_title;
use palpate_store::Store;
use palpate_tactile::board::Board;
use palpate_tactile::trial::{
    BoardCourse, CorrectedPhases, GraspOrigin, SimulatedData, TrialData, TrialHeader, TrialId, TrialSource,
};
use palpate_tactile::{Channel, LayoutError, Sensors, Signals};
use std::sync::Arc;

/// How a trial is opened.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Sensors through which a simulated trial is read.
    pub sensors: SensorView,
    /// Recognisers; where there is none for a trial, its answers are left out.
    pub models: Models,
    /// Most grasps of its stop rule, in place of the model's own.
    pub grasps: Option<u32>,
    /// What is kept besides channels and answers.
    pub keep: Keep,
}

/// What an open trial keeps besides channels and answers; each includes the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Keep {
    /// Nothing.
    #[default]
    Channels,
    /// Fingers and object at each sample.
    Frames,
    /// The meshes of the 3-D view.
    Scenery,
}

/// Facts that only simulated trials have.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedFacts {
    /// Numerical quality.
    pub quality: Quality,
    /// Effects.
    pub plan: Plan,
    /// Pose of the gripper in the world in which the trial began.
    pub world_from_gripper: Pose,
}

/// Values of one channel over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name, as in files: `pressure_left`; the board's own name for its counts.
    pub name: String,
    /// The channel; none for counts of a board and for channels of other programs.
    pub channel: Option<Channel>,
    /// Unit: `1/m`, `Pa`, `N`, `counts`; empty where unknown.
    pub unit: &'static str,
    /// A value per sample; NaN where it is undefined.
    pub values: Vec<f32>,
}

impl Column {
    /// True where it has a value at any sample.
    pub(super) fn is_read(&self) -> bool {
        self.values.iter().any(|value| value.is_finite())
    }
}

/// A stored trial, opened.
#[derive(Clone, Debug)]
pub struct OpenTrial {
    /// Number in its store.
    pub id: TrialId,
    /// Origin.
    pub source: TrialSource,
    /// Time of its beginning, UTC.
    pub created: String,
    /// Facts that trials of all sources have.
    pub header: TrialHeader,
    /// Title of the object: `Lemon`, or `unlabelled`.
    pub title: String,
    /// Sensors through which a simulated trial was read.
    pub sensors: SensorView,
    /// Times of the samples, rising (s); a simulated trial and one of a board count from their beginning.
    pub t_s: Vec<f64>,
    /// Line pressure at each sample (bar); NaN where it is unknown.
    pub line_bar: Vec<f64>,
    /// Channels; for a board, its raw counts follow those derived from them.
    pub columns: Vec<Column>,
    /// Board of a recorded trial.
    pub board: Option<Board>,
    /// Phases of the grasp.
    pub phases: Vec<PhaseSpan>,
    /// First contact of each finger (s), left and right, where its pad shows one.
    pub touched_s: [Option<f64>; 2],
    /// Facts that only simulated trials have.
    pub simulated: Option<SimulatedFacts>,
    /// Meshes of the 3-D view.
    pub stage: Option<Arc<Stage>>,
    /// Fingers and object over time, in their own samples. Those of a board are arcs of the curvature that its strips read.
    pub frames: Vec<Arc<Frame>>,
    /// Answer of the recogniser at each sample; empty without one.
    pub answers: Vec<Arc<IdentificationView>>,
    /// Another model judged the grasps before this one: the answers are to this one alone.
    pub judged_alone: bool,
    /// The model has not learned the fingers of the trial.
    pub other_fingers: bool,
    /// Why nothing was recognised.
    pub recognition_off: Option<String>,
    /// What is missing, in sentences: an object's file that is gone, sensors without calibration.
    pub remarks: Vec<String>,
}

/// State of a trial at a time.
#[derive(Clone, Copy, Debug)]
pub struct Instant<'a> {
    /// The sample at that time, or the last before it.
    pub sample: usize,
    /// Fingers and object then.
    pub frame: Option<&'a Arc<Frame>>,
    /// The recogniser's answer then.
    pub answer: Option<&'a Arc<IdentificationView>>,
}

impl OpenTrial {
    /// The pads of a simulated grasp do not touch the object at the end of its hold.
    pub fn nothing_held(&self) -> bool {
        let end = self.frames.iter().rfind(|frame| frame.phase == Phase::Hold && frame.world_from_object.is_some());
        let failure = self.simulated.as_ref().and_then(|own| own.quality.failure);
        let never_touched = failure == Some(GraspFailure::NeverTouched);
        let lost = |(stage, frame): (&Arc<Stage>, &Arc<Frame>)| stage.force_on_object(frame).is_none();
        never_touched || self.stage.as_ref().zip(end).is_some_and(lost)
    }

    /// Opens a trial of any source. The recogniser answers as it did live, from the samples alone.
    pub fn open(store: &Store, id: TrialId, options: &OpenOptions) -> Result<Self, OpenTrialError> {
        let trial = store.load(id)?;
        let mut open = Self::empty(id, store.created(id)?, trial.source(), trial.header.clone());
        open.sensors = options.sensors.clone();
        let (marks, began_s, gaps) = match &trial.data {
            TrialData::Simulated(_) => Default::default(),
            TrialData::Recorded(log) => {
                let BoardCourse { board, phases, began_s, .. } = &log.course;
                open.board = Some(board.clone());
                let measured = if phases.is_empty() { measured_phases(board, &log.readings) } else { Vec::new() };
                let marks = phases.iter().chain(&measured).map(|mark| (mark.from_s - began_s, mark.phase));
                (PhaseTimes::of_samples(marks), *began_s, log.gaps.clone())
            }
            TrialData::Imported(_) => Default::default(),
        };
        match trial.data {
            TrialData::Simulated(data) => open.read_simulated(data, options)?,
            TrialData::Recorded(_) | TrialData::Imported(_) => {
                open.read_replayed(store, trial, options, began_s, &gaps)?;
                if let Some(signals) = store.readings(id)? {
                    open.break_at_gaps(&signals);
                }
                open.find_phases(marks);
                open.reconstruct(options);
            }
        }
        Ok(open)
    }

    /// A trial without samples.
    pub(super) fn empty(id: TrialId, created: String, source: TrialSource, header: TrialHeader) -> Self {
        Self {
            id,
            source,
            created,
            title: match header.object.as_str() {
                "" => "unlabelled".to_owned(),
                name => capital_title(name),
            },
            header,
            sensors: SensorView::default(),
            t_s: Vec::new(),
            line_bar: Vec::new(),
            columns: Vec::new(),
            board: None,
            phases: Vec::new(),
            touched_s: [None; 2],
            simulated: None,
            stage: None,
            frames: Vec::new(),
            answers: Vec::new(),
            judged_alone: false,
            other_fingers: false,
            recognition_off: None,
            remarks: Vec::new(),
        }
    }

    /// Name of the source, in words.
    pub fn source_title(&self) -> &'static str {
        match self.source {
            TrialSource::Recorded if self.board.as_ref().is_some_and(|board| board.emulated) => "emulated gripper",
            TrialSource::Recorded => "real gripper",
            source => source.title(),
        }
    }

    /// Its first and last time (s); zero without samples.
    pub fn span_s(&self) -> [f64; 2] {
        [self.t_s.first(), self.t_s.last()].map(|t| t.copied().unwrap_or(0.0))
    }

    /// True where a board's sensors were not calibrated, so that there are counts alone.
    pub fn has_counts_alone(&self) -> bool {
        self.source == TrialSource::Recorded
            && !self.columns.iter().any(|column| column.channel.is_some() && column.is_read())
    }

    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Mean of a channel over the hold, in its unit; none without hold or values there.
    pub fn hold_mean(&self, name: &str) -> Option<f64> {
        let span = self.phases.iter().find(|span| span.phase == TouchPhase::Hold)?;
        let held = |(t, value): (&f64, &f32)| {
            ((span.from_s..span.to_s).contains(t) && value.is_finite()).then_some(f64::from(*value))
        };
        let values: Vec<f64> = self.t_s.iter().zip(&self.column(name)?.values).filter_map(held).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// Beginning of a phase (s), where the grasp has it.
    pub fn phase_from(&self, phase: TouchPhase) -> Option<f64> {
        self.phases.iter().find(|span| span.phase == phase).map(|span| span.from_s)
    }

    /// Time of the last sample of a phase (s), where the grasp has it.
    pub fn last_of(&self, phase: TouchPhase) -> Option<f64> {
        let span = self.phases.iter().find(|span| span.phase == phase)?;
        let ends = self.phases.last().is_some_and(|last| last.phase == phase);
        let within = |t: &&f64| **t < span.to_s || ends;
        self.t_s.iter().rev().find(within).copied()
    }

    /// State at a time (s): that of the last sample until then, or of the first one. None without samples.
    pub fn at(&self, t_s: f64) -> Option<Instant<'_>> {
        let sample = last_until(&self.t_s, |t| *t, t_s)?;
        let frame = last_until(&self.frames, |frame| frame.t, t_s).map(|k| &self.frames[k]);
        Some(Instant { sample, frame, answer: self.answers.get(sample) })
    }

    fn read_simulated(&mut self, data: SimulatedData, options: &OpenOptions) -> Result<(), OpenTrialError> {
        let scene = self.header.scene.clone();
        let gripper = &scene.gripper;
        let model = options.models.of(Shipped::simulated(scene.holds_object())).cloned();
        let mut identification = model.map(|model| identification(model, options));
        let more = identification.as_ref().and_then(|own| own.channels_on(gripper).ok()).unwrap_or_default();
        let (layout, signals) = (options.sensors.shown()?, options.sensors.signals);
        let shown = layout.channels(gripper, signals)?.len();
        let mut reader = Sensors::new(&layout, gripper, signals)?;
        reader.add(&more);
        let rows = self.rows_of(&data.frames, &reader, options);
        if let Some(identification) = &mut identification {
            self.other_fingers = !knows_fingers(&identification.model().card, &scene);
            let earlier = self.header.earlier.as_ref();
            self.judged_alone = earlier.is_some_and(|earlier| !identification.resume(earlier));
            let names = reader.channels().iter().map(Channel::name).enumerate();
            let off = identification.begin_grasp(names).err().map(|cause| cause.to_string());
            // Sensors of a real gripper have no part for it.
            let no_part = identification.model().card.only_simulated() && options.sensors.is_physical();
            self.recognition_off = off.or_else(|| no_part.then(|| LayoutError::no_such_part().to_string()));
        }
        let identification = identification.filter(|_| self.recognition_off.is_none());
        self.answers = answers(identification, &rows);
        self.columns = reader.channels()[..shown].iter().map(column_of).collect();
        for row in &rows {
            self.push(row, row.t_s);
        }
        self.phases = phases_of_frames(data.frames.iter(), gripper);
        self.touched_s = touches_of_frames(&data.frames.iter(), gripper);
        let SimulatedData { world_from_gripper, plan, quality, frames } = data;
        self.remarks.extend(self.header.origin.as_ref().and_then(GraspOrigin::other_physics));
        if options.keep >= Keep::Scenery {
            let object = scene.load_object();
            if let Err(cause) = &object {
                self.remarks.push(format!("The object is not drawn: {cause}"));
            }
            let object = object.ok().flatten();
            self.stage = Some(Arc::new(Stage::new(&scene, object.as_ref(), world_from_gripper)));
        }
        if options.keep >= Keep::Frames {
            self.frames = frames.into_iter().map(Arc::new).collect();
        }
        self.simulated = Some(SimulatedFacts { quality, plan, world_from_gripper });
        Ok(())
    }

    /// Rows of frames: through ideal sensors one of each frame, as they were live; or by the sensors' own clock.
    fn rows_of(&self, frames: &[Frame], reader: &Sensors, options: &OpenOptions) -> Vec<Row> {
        if options.sensors.sensors == Default::default() {
            return frames.iter().map(|frame| Row::of_frame(frame, reader)).collect();
        }
        let clean = reader.signals(frames);
        let read: Signals = options.sensors.sensors.apply(&clean, noise_seed(&self.header));
        let row = |(k, t_s): (usize, &f64)| {
            let frame = last_until(frames, |frame| frame.t, *t_s).map(|k| &frames[k]);
            let line_bar = frame.map_or(f64::NAN, |frame| frame.line_bar);
            Row { t_s: *t_s, line_bar, phase: frame.map(|frame| frame.phase), values: read.row(k).into() }
        };
        read.t_s.iter().enumerate().map(row).collect()
    }

    pub(super) fn push(&mut self, row: &Row, t_s: f64) {
        self.t_s.push(t_s);
        self.line_bar.push(row.line_bar);
        for (place, column) in self.columns.iter_mut().enumerate() {
            column.values.push(row.values.get(place).copied().unwrap_or(f32::NAN));
        }
    }

    /// The phases as they are, with the beginning of one moved (s).
    pub fn with_phase_at(&self, phase: TouchPhase, from_s: f64) -> CorrectedPhases {
        let from = |own: TouchPhase| if own == phase { Some(from_s) } else { self.phase_from(own) };
        CorrectedPhases {
            closing: from(TouchPhase::PreShaping).or_else(|| self.phases.first().map(|span| span.from_s)),
            contact: from(TouchPhase::Contact),
            hold: from(TouchPhase::Hold),
            release: from(TouchPhase::Release),
        }
    }
}

fn column_of(channel: &Channel) -> Column {
    let unit = channel.quantity.unit();
    Column { name: channel.name(), unit, values: Vec::new(), channel: Some(channel.clone()) }
}

fn identification(model: Arc<Model>, options: &OpenOptions) -> Identification {
    let own = model.card.stop;
    let rule = StopRule { most_grasps: options.grasps.map_or(own.most_grasps, |grasps| grasps as usize), ..own };
    Identification::new(model, rule)
}

/// Answers after each row; the last one is that after the grasp.
fn answers(identification: Option<Identification>, rows: &[Row]) -> Vec<Arc<IdentificationView>> {
    let Some(mut identification) = identification else { return Vec::new() };
    let mut newest = Arc::new(identification.view());
    let mut answers = Vec::with_capacity(rows.len());
    for row in rows {
        if identification.push(row.t_s, row) {
            newest = Arc::new(identification.view());
        }
        answers.push(Arc::clone(&newest));
    }
    identification.end_grasp();
    if let Some(last) = answers.last_mut() {
        *last = Arc::new(identification.view());
    }
    answers
}

/// Place of the last sample that is not after `t_s`, or of the first; none without any.
fn last_until<T>(samples: &[T], time: impl Fn(&T) -> f64, t_s: f64) -> Option<usize> {
    let after = samples.partition_point(|sample| time(sample) <= t_s + 1e-9);
    (!samples.is_empty()).then(|| after.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::gripper::Phase;
    use palpate_sim::scene::Scene;
    use palpate_store::ImportedTrial;
    use palpate_store::labels::TrialEdit;
    use palpate_tactile::model::SensorModel;
    use palpate_tactile::trial::{EarlierGrasps, SimulatedTrial};

    fn stored(object: &str) -> (tempfile::TempDir, Store, TrialId) {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::open(&folder.path().join("trials.sqlite")).expect("opens");
        let mut scene = Scene::default();
        scene.object.source = object.to_owned();
        let model = scene.load_object().expect("built in");
        let id = store.insert(&grasp(&scene, model.as_ref(), 0)).expect("stored").id();
        (folder, store, id)
    }

    #[test]
    fn a_simulated_trial_opens_as_it_was() -> Result<(), Box<dyn std::error::Error>> {
        let (folder, store, id) = stored("lemon");
        let models = Models::shipped()?;
        let options = OpenOptions { models, keep: Keep::Scenery, ..OpenOptions::default() };
        let open = OpenTrial::open(&store, id, &options)?;
        let trial = store.load(id)?;
        assert_eq!((open.title.as_str(), open.source_title()), ("Lemon", "simulated"));
        assert_eq!(open.t_s.len(), trial.frames().len());
        assert_eq!((open.frames.len(), open.answers.len()), (open.t_s.len(), open.t_s.len()));
        let names: Vec<_> = open.columns.iter().map(|column| (column.name.as_str(), column.unit)).collect();
        assert_eq!(names[0], ("curvature_left", "1/m"));
        assert!(names.contains(&("force_right", "N")) && names.len() == 6, "{names:?}");
        assert!(open.columns.iter().all(|column| column.values.len() == open.t_s.len()));
        // Every phase, in its order, each at the first sample that shows it.
        let phases: Vec<TouchPhase> = open.phases.iter().map(|span| span.phase).collect();
        assert_eq!(phases, TouchPhase::ALL);
        let hold = trial.frames().iter().find(|frame| frame.phase == Phase::Hold).map(|frame| frame.t);
        assert_eq!(open.phase_from(TouchPhase::Hold), hold);
        // The state at a time is that of the last sample until then.
        let now = open.at(1.0).expect("samples");
        assert!(open.t_s[now.sample] <= 1.0 + 1e-9 && open.t_s[now.sample + 1] > 1.0);
        assert_eq!(now.frame.map(|frame| frame.t), Some(open.t_s[now.sample]));
        assert_eq!(open.at(-1.0).map(|now| now.sample), Some(0));
        assert_eq!(open.at(99.0).map(|now| now.sample), Some(open.t_s.len() - 1));
        // Trials of other physics say so, and are otherwise as they were.
        assert_eq!(open.remarks, [""; 0]);
        let TrialData::Simulated(data) = trial.data.clone() else { panic!("simulated") };
        let mut older = SimulatedTrial { header: trial.header.clone(), data };
        older.header.origin.as_mut().expect("simulated").physics = 1;
        older.header.earlier = Some(EarlierGrasps { model: "another".to_owned(), judged: Vec::new() });
        let mut other = Store::open(&folder.path().join("older.sqlite"))?;
        let id = other.insert(&older)?.id();
        let reopened = OpenTrial::open(&other, id, &options)?;
        let said = |remark: &String| remark.starts_with("Simulated with older physics (1, this version has 2):");
        assert!(reopened.remarks.iter().any(said), "{:?}", reopened.remarks);
        assert!(reopened.judged_alone && !open.judged_alone);
        assert_eq!((&reopened.t_s, &reopened.columns), (&open.t_s, &open.columns));
        // The last answer is the one after the grasp.
        assert!(open.answers.last().is_some_and(|answer| answer.beliefs.len() == 1 && !answer.listening));
        Ok(())
    }

    #[test]
    fn corrected_phases_replace_those_measured_until_they_are_taken_back() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
        let t_s: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
        // At rest for a second, then a pressure that rises.
        let values = t_s.iter().map(|t| if *t < 1.0 { 0.0 } else { 10.0 * (t - 1.0) } as f32).collect();
        let signals = Signals { channels: vec!["pressure_left".to_owned()], t_s, values };
        let (name, label) = ("1".to_owned(), "mug".to_owned());
        store.insert_imported(
            "mine",
            &[ImportedTrial { name, label, size: None, shape: None, session: None, signals }],
        )?;
        let open = |store: &Store| OpenTrial::open(store, 1, &OpenOptions::default());
        let measured = open(&store)?;
        let contact = measured.phase_from(TouchPhase::Contact).expect("the pressure rises");
        assert!((1.0..1.2).contains(&contact), "{contact}");
        let corrected = measured.with_phase_at(TouchPhase::Contact, 1.5);
        store.labels().edit(&[1], &TrialEdit::Phases(Some(corrected)))?;
        let moved = open(&store)?;
        assert_eq!(moved.phase_from(TouchPhase::Contact), Some(1.5));
        assert_eq!(moved.phase_from(TouchPhase::PreShaping), measured.phase_from(TouchPhase::PreShaping));
        assert!(store.journal().undo()?.is_some());
        assert_eq!(open(&store)?.phases, measured.phases);
        Ok(())
    }

    #[test]
    fn other_sensors_read_the_same_trial_differently() -> Result<(), Box<dyn std::error::Error>> {
        let (_folder, store, id) = stored("ball");
        let open = |layout: &str, sensors| {
            let sensors = SensorView { layout: layout.to_owned(), sensors, ..SensorView::default() };
            OpenTrial::open(&store, id, &OpenOptions { sensors, ..OpenOptions::default() })
        };
        let halves = open("C6", SensorModel::Virtual)?;
        assert!(halves.column("pressure_left_distal").is_some() && halves.column("force_left_distal").is_some());
        assert!(halves.answers.is_empty() && halves.frames.is_empty() && halves.stage.is_none());
        let real = open("C1", SensorModel::PhysicalLike)?;
        let clean = open("C1", SensorModel::Virtual)?;
        assert_ne!(real.t_s.len(), clean.t_s.len(), "a board has a clock of its own");
        assert_eq!(real.phases, clean.phases, "the phases belong to the grasp, not to its sensors");
        assert!(matches!(open("C99", SensorModel::Virtual), Err(OpenTrialError::Layout(_))));
        assert!(matches!(OpenTrial::open(&store, 99, &OpenOptions::default()), Err(OpenTrialError::Store(_))));
        Ok(())
    }
}
