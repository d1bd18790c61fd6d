//! Tactile signatures (Fig. 4a): what bending and pressure do before and after contact, whether each sentence of section
//! V-A holds, and for which finger it would.

mod bodies;
mod course;
mod figures;
mod findings;

use super::bench::{StudyBench, StudyError};
use super::plan::{DataWanted, StudyPlan};
use super::report::{Cell, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{PaperStudy, StudyCard, StudyUnit, UnitResult};
use crate::datasets::{SensorView, sequence_of};
use crate::grasping::grasp;
use bodies::{FLAT, ROUND, STATISTICS, Statistic, Summary, VARIED, WIDTHS, papers_scene, papers_view};
use course::{Course, Grasped, Signature, median};
use findings::{Measured, findings};
use palpate_learn::metrics::Bootstrap;
use palpate_sim::objects::{ObjectModel, catalogue};
use palpate_sim::scene::Scene;
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::{SimulatedTrial, TrialId};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct TactileSignatures;

const CARD: StudyCard = StudyCard {
    key: "signatures",
    title: "Tactile signatures",
    about: "bending and pressure before and after contact; which of the paper's sentences hold, and for what finger",
    paper: "Fig. 4a",
    budget: "about 1 CPU minute",
};

/// Grasps of each object in random poses.
const GRASPS: usize = 40;
const QUICK: usize = 5;

/// Names of grippers in tables.
const DEFAULT: &str = "default";
const DEFAULT_FIXED: &str = "default, fixed";
const PAPER: &str = "paper";

fn scene_of(gripper: &str) -> Scene {
    let mut scene = if gripper == PAPER { papers_scene() } else { Scene::default() };
    if gripper == DEFAULT_FIXED {
        scene.set_object_fixed(true);
    }
    scene
}

/// Kinds of grasps, by their names in tables.
const BODIES: &str = "bodies, centred";
const OBJECTS: &str = "objects, centred";

/// A unit of work.
enum Unit {
    /// Bodies of known width, or the built-in objects, centred and as placed.
    Centred { gripper: &'static str, kind: &'static str },
    /// Objects in random poses.
    Posed { gripper: &'static str, view: SensorView },
    /// Trials of the plan's query.
    Stored(SensorView),
    /// A setting about the paper's scene.
    Varied(usize),
}

impl Unit {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        if plan.query.is_some() {
            return plan.sensors.iter().map(|&sensors| Self::Stored(view_of(sensors))).collect();
        }
        let mut units = Vec::new();
        for gripper in [DEFAULT, DEFAULT_FIXED, PAPER] {
            units.extend([BODIES, OBJECTS].map(|kind| Self::Centred { gripper, kind }));
        }
        for gripper in [DEFAULT, PAPER] {
            for &sensors in &plan.sensors {
                let papers = (sensors == SensorModel::Virtual).then(papers_view);
                let views = papers.into_iter().chain([view_of(sensors)]);
                units.extend(views.map(|view| Self::Posed { gripper, view }));
            }
        }
        units.extend((0..VARIED.len()).map(Self::Varied));
        units
    }

    /// Its gripper and kind of grasps.
    fn kind(&self, plan: &StudyPlan) -> (&'static str, String) {
        let read = |view: &SensorView| format!("{}, {}", view.sensors.name(), view.signals.name());
        match self {
            Self::Centred { gripper, kind } => (gripper, (*kind).to_owned()),
            Self::Posed { gripper, view } => (gripper, format!("preset {}, {}", plan.preset, read(view))),
            Self::Stored(view) => ("stored", read(view)),
            Self::Varied(at) => (PAPER, VARIED[*at].name.to_owned()),
        }
    }

    fn name(&self, plan: &StudyPlan) -> String {
        let (gripper, kind) = self.kind(plan);
        format!("{gripper}: {kind}")
    }
}

fn view_of(sensors: SensorModel) -> SensorView {
    SensorView { sensors, ..SensorView::default() }
}

/// Result of a unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Found {
    /// Description of the data.
    data: String,
    signatures: Vec<Signature>,
    /// Grasps without contact, or in which nothing was held to the end.
    lost: usize,
    curves: Vec<Curve>,
    /// Sentences at each value of a setting.
    varied: Vec<(f64, Summary)>,
}

/// Course of one grasp, thinned.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Curve {
    object: String,
    size: String,
    shape: String,
    /// Time (s), bending (1/m), pressure (kPa).
    points: Vec<[f64; 3]>,
}

/// Samples of a curve.
const POINTS: usize = 46;

impl Curve {
    fn of(object: &ObjectModel, course: &Course) -> Option<Self> {
        let class = object.class?;
        let step = (course.t_s.len() - 1) as f64 / (POINTS - 1) as f64;
        let at = |k: usize| (step * k as f64).round() as usize;
        let rounded = |value: f64| (1e4 * value).round() / 1e4;
        let point = |k: usize| [course.t_s[at(k)], course.bend[at(k)], 1e-3 * course.pressure[at(k)]].map(rounded);
        Some(Self {
            object: object.name.clone(),
            size: class.size.name().to_owned(),
            shape: class.shape.name().to_owned(),
            points: (0..POINTS).map(point).collect(),
        })
    }
}

/// `round` for the paper's cylindrical and spherical objects, `flat` for cubic ones.
fn shape_of(class: &str) -> &'static str {
    match class {
        "cylindrical" | "spherical" => ROUND,
        "cubic" => FLAT,
        _ => "unknown",
    }
}

/// Width of an object across the open fingers, as it lies before the grasp (mm).
fn width_mm(trial: &SimulatedTrial, object: &ObjectModel) -> Option<f64> {
    let lies = trial.frames().first()?.world_from_object?;
    let across = lies.rotation.inverse() * (trial.data.world_from_gripper.rotation * glam::DVec3::X);
    Some(1e3 * (object.resting.reach(across) + object.resting.reach(-across)))
}

fn centred(plan: &StudyPlan, gripper: &str, kind: &str) -> Found {
    let scene = scene_of(gripper);
    let mut found = Found::default();
    if kind == BODIES {
        let widths = plan.pick(WIDTHS.as_slice(), &WIDTHS, &WIDTHS[..2]);
        found.signatures = bodies::signatures(&scene, widths);
        found.lost = bodies::bodies(widths).len() - found.signatures.len();
        return found;
    }
    for name in plan.objects() {
        let mut scene = scene.clone();
        scene.object.source.clone_from(&name);
        let Ok(Some(object)) = scene.load_object() else { continue };
        let trial = grasp(&scene, Some(&object), 0);
        let course = papers_view().signals(&trial).ok().map(|own| Course::of(&own.channels, &sequence_of(&own)));
        let Some(course) = course.flatten() else { continue };
        found.curves.extend(Curve::of(&object, &course));
        let shape = object.class.map_or("unknown", |class| shape_of(class.shape.name())).to_owned();
        let of = Grasped { object: name, shape, width_mm: width_mm(&trial, &object), trial: None };
        match course.signature(of) {
            Some(signature) => found.signatures.push(signature),
            None => found.lost += 1,
        }
    }
    found
}

/// Signatures of the grasps of a data set.
fn of_data(bench: &StudyBench<'_>, wanted: &DataWanted) -> Result<Option<Found>, StudyError> {
    let Some(data) = bench.data(wanted)? else { return Ok(None) };
    let models: BTreeMap<&str, ObjectModel> = catalogue()
        .iter()
        .filter_map(|known| {
            let mut scene = Scene::default();
            scene.object.source.clone_from(&known.name);
            Some((known.name.as_str(), scene.load_object().ok()??))
        })
        .collect();
    let mut found = Found { data: data.about.described(), ..Found::default() };
    for example in &data.examples {
        if bench.is_cancelled() {
            return Ok(None);
        }
        let class = &data.labels.classes[example.class];
        let course = Course::of(&data.channels, &example.grasp);
        let course = course.ok_or_else(|| {
            StudyError::Missing(format!("curvature and pressure; the trials have {}", data.channels.join(", ")))
        })?;
        let shape = class.shape.map_or("unknown", |shape| shape_of(&data.labels.shapes[shape])).to_owned();
        let of = Grasped { object: class.name.clone(), shape, width_mm: None, trial: Some(example.id) };
        let Some(mut signature) = course.signature(of) else {
            found.lost += 1;
            continue;
        };
        if let Some(object) = models.get(class.name.as_str()) {
            let trial = bench.simulated(example.id)?;
            signature.of.width_mm = trial.and_then(|trial| width_mm(&trial, object));
        }
        found.signatures.push(signature);
    }
    Ok(Some(found))
}

impl PaperStudy for TactileSignatures {
    fn card(&self) -> StudyCard {
        CARD
    }

    fn units(&self, plan: &StudyPlan) -> Vec<StudyUnit> {
        Unit::all(plan).iter().map(|unit| StudyUnit { name: unit.name(plan), method: None }).collect()
    }

    fn measure(&self, unit: &str, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let own = Unit::all(plan).into_iter().find(|own| own.name(plan) == unit);
        let found = match own.ok_or_else(|| StudyError::Unknown(format!("unit {unit}")))? {
            Unit::Centred { gripper, kind } => Some(centred(plan, gripper, kind)),
            Unit::Posed { gripper, view } => {
                let (scene, usual) = (scene_of(gripper), plan.wanted(plan.grasps(GRASPS, QUICK), view.sensors));
                of_data(bench, &DataWanted { fixed: scene.holds_object(), scene, view, ..usual })?
            }
            Unit::Stored(view) => {
                let usual = plan.wanted(usize::MAX, view.sensors);
                of_data(bench, &DataWanted { view, ..usual })?
            }
            Unit::Varied(at) => {
                let widths = plan.pick(WIDTHS.as_slice(), &WIDTHS[..4], &WIDTHS[..1]);
                let values = VARIED[at]
                    .values
                    .iter()
                    .filter(|value| plan.pick(true, true, VARIED[at].known().iter().any(|known| known == *value)));
                let varied =
                    values.map(|&value| (value, Summary::of(&bodies::signatures(&VARIED[at].scene(value), widths))));
                Some(Found { varied: varied.take_while(|_| !bench.is_cancelled()).collect(), ..Found::default() })
            }
        };
        found.filter(|_| !bench.is_cancelled()).map(|found| UnitResult::new(&found)).transpose()
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut report = StudyReport::default();
        let (mut sentences, mut each) = (sentence_table(plan), object_table());
        let (mut curves, mut settings) = (curve_table(), setting_table());
        let mut measured = Vec::new();
        for unit in Unit::all(plan) {
            let Some(result) = units.get(&unit.name(plan)) else { continue };
            let found: Found = result.read()?;
            let (gripper, kind) = unit.kind(plan);
            if let Unit::Varied(at) = unit {
                for (value, summary) in &found.varied {
                    add_setting(&mut settings, at, *value, summary);
                }
                continue;
            }
            if !found.data.is_empty() {
                report.data.push(format!("{gripper}: {}", found.data));
            }
            let summary = Summary::of(&found.signatures);
            add_sentences(&mut sentences, gripper, &kind, &found, &summary);
            add_objects(&mut each, gripper, &kind, &found.signatures);
            for curve in &found.curves {
                add_curve(&mut curves, gripper, curve);
            }
            measured.push(Measured { gripper, kind, summary });
        }
        report.tables = [sentences, each, settings, curves].into_iter().filter(|t| !t.rows.is_empty()).collect();
        report.findings = findings(&measured);
        Ok(report)
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        figures::all(report)
    }
}

/// Resamples of an interval.
const BOOTSTRAP: Bootstrap = Bootstrap { resamples: 500, seed: 0 };

/// A statistic of signatures, with its interval where there are several grasps of an object.
fn interval(all: &[&Signature], statistic: Statistic) -> Cell {
    if all.iter().all(|own| own.of.trial.is_none()) {
        return Cell::number(statistic(all));
    }
    let names: BTreeSet<&str> = all.iter().map(|own| own.of.object.as_str()).collect();
    let names: Vec<&str> = names.into_iter().collect();
    let objects: Vec<usize> =
        all.iter().map(|own| names.iter().position(|name| *name == own.of.object).unwrap_or_default()).collect();
    Cell::interval(BOOTSTRAP.interval(&objects, |kept| statistic(&kept.iter().map(|k| all[*k]).collect::<Vec<_>>())))
}

fn sentence_table(plan: &StudyPlan) -> StudyTable {
    StudyTable::new(
        "signatures",
        format!("Sentences of section V-A in numbers, preset {}; rates as shares of that before contact", plan.preset),
        &[
            ("gripper", ""),
            ("grasps", ""),
            ("held", "grasps"),
            ("lost", "grasps"),
            ("bending with time before contact, rank correlation", ""),
            ("pressure before contact", PERCENT),
            ("rate after contact, round", PERCENT),
            ("rate after contact, flat", PERCENT),
            ("line after contact, flat (R²)", ""),
            ("bending after contact, round", PERCENT),
            ("bending after contact, flat", PERCENT),
            ("bending with curvature of round objects, rank correlation", ""),
            ("time to 90 % of pressure", "s"),
            ("onset with width, rank correlation", ""),
        ],
    )
}

fn add_sentences(table: &mut StudyTable, gripper: &str, kind: &str, found: &Found, summary: &Summary) {
    let all: Vec<&Signature> = found.signatures.iter().collect();
    let trials: Vec<TrialId> = all.iter().filter_map(|own| own.of.trial).collect();
    let shown = trials.iter().step_by(1 + trials.len() / super::answers::SHOWN).copied().collect();
    let counts = [summary.grasps, found.lost].map(|count| Cell::Number(count as f64));
    let numbers = STATISTICS.map(|statistic| interval(&all, statistic));
    table.push([Cell::text(gripper), Cell::text(kind)].into_iter().chain(counts).chain(numbers).collect(), shown);
}

fn object_table() -> StudyTable {
    StudyTable::new(
        "objects",
        "Each object; medians over its grasps",
        &[
            ("gripper", ""),
            ("grasps", ""),
            ("object", ""),
            ("shape", ""),
            ("width", "mm"),
            ("held", "grasps"),
            ("onset", "s"),
            ("bending after contact", PERCENT),
            ("rate after contact", PERCENT),
            ("line after contact (R²)", ""),
            ("time to 90 % of pressure", "s"),
            ("bending in the hold", "1/m"),
            ("pressure in the hold", "kPa"),
        ],
    )
}

fn add_objects(table: &mut StudyTable, gripper: &str, kind: &str, signatures: &[Signature]) {
    let mut by_object: BTreeMap<&str, Vec<&Signature>> = BTreeMap::new();
    for signature in signatures {
        by_object.entry(&signature.of.object).or_default().push(signature);
    }
    for (object, own) in by_object {
        let of = |value: &dyn Fn(&Signature) -> Option<f64>| -> Cell {
            let values: Vec<f64> = own.iter().filter_map(|signature| value(signature)).collect();
            if values.len() < 3 {
                return Cell::number(median(values));
            }
            let at = vec![0; values.len()];
            Cell::interval(BOOTSTRAP.interval(&at, |kept| median(kept.iter().map(|k| values[*k]))))
        };
        table.push(
            vec![
                Cell::text(gripper),
                Cell::text(kind),
                Cell::text(object),
                Cell::text(&own[0].of.shape),
                Cell::number(median(own.iter().filter_map(|signature| signature.of.width_mm))),
                Cell::Number(own.len() as f64),
                of(&|own| Some(own.onset_s)),
                of(&|own| Some(own.share)),
                of(&|own| own.rate),
                of(&|own| own.line),
                of(&|own| Some(own.rise_s)),
                of(&|own| Some(own.bend)),
                of(&|own| Some(own.pressure_kpa)),
            ],
            own.iter().filter_map(|signature| signature.of.trial).take(super::answers::SHOWN).collect(),
        );
    }
}

fn curve_table() -> StudyTable {
    StudyTable::new(
        "curves",
        "A tiny and a large object of each shape over time, centred, as in Fig. 4a",
        &[("gripper", ""), ("object", ""), ("class", ""), ("time", "s"), ("bending", "1/m"), ("pressure", "kPa")],
    )
}

/// Objects whose curves are shown: a tiny and a large one of each of the paper's shapes, of clear form.
const SHOWN_CURVES: [&str; 6] = ["smallcube", "cube", "labello", "cylinder", "ball", "bigball"];

fn add_curve(table: &mut StudyTable, gripper: &str, curve: &Curve) {
    if !SHOWN_CURVES.contains(&curve.object.as_str()) {
        return;
    }
    for [t, bend, pressure] in &curve.points {
        let class = format!("{} {}", curve.size, curve.shape);
        let numbers = [*t, *bend, *pressure].map(Cell::Number);
        let texts = [Cell::text(gripper), Cell::text(&curve.object), Cell::text(class)];
        table.push(texts.into_iter().chain(numbers).collect(), Vec::new());
    }
}

fn setting_table() -> StudyTable {
    StudyTable::new(
        "settings",
        "Scene paper with one setting changed, bodies centred",
        &[
            ("setting", ""),
            ("value", ""),
            ("unit", ""),
            ("scene with this value", ""),
            ("held", "grasps"),
            ("rate after contact, round", PERCENT),
            ("rate after contact, flat", PERCENT),
            ("line after contact, flat (R²)", ""),
            ("time to 90 % of pressure", "s"),
            ("onset with width, rank correlation", ""),
            ("sentences that hold", ""),
        ],
    )
}

fn add_setting(table: &mut StudyTable, at: usize, value: f64, summary: &Summary) {
    let varied = &VARIED[at];
    let [usual, papers] = varied.known().map(|known| (known - value).abs() < 1e-9 * value.abs());
    let scene = match (usual, papers) {
        (true, true) => "default and paper",
        (true, false) => DEFAULT,
        (false, true) => PAPER,
        (false, false) => "",
    };
    let held = findings::sentences(summary).iter().filter(|own| own.verdict == super::Agreement::Agrees).count();
    table.push(
        vec![
            Cell::text(varied.name),
            Cell::Number(value),
            Cell::text(varied.unit),
            Cell::text(scene),
            Cell::Number(summary.grasps as f64),
            Cell::number(summary.round_rate),
            Cell::number(summary.flat_rate),
            Cell::number(summary.flat_line),
            Cell::number(summary.rise_s),
            Cell::number(summary.size),
            Cell::Number(held as f64),
        ],
        Vec::new(),
    );
}
