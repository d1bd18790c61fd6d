//! Tactile signatures (Fig. 4a): what bending and pressure do before and after contact, whether each sentence of section
//! V-A holds, and for which finger it would.

mod bodies;
mod course;
mod figures;
mod findings;

use super::prelude::*;
use bodies::{FLAT, ROUND, STATISTICS, Statistic, Summary, VARIED, Varied, WIDTHS, papers_scene, papers_view};
use course::{GraspCurves, Grasped, Signature, median};
use findings::{Measured, findings, sentences};
use palpate_lab::datasets::{NOT_SOUND, SensorView, sequence_of};
use palpate_lab::grasping::grasp;
use palpate_learn::metrics::Bootstrap;
use palpate_sim::objects::{ObjectModel, catalogue};
use palpate_sim::scene::Scene;
use palpate_tactile::SignalDefinition;
use palpate_tactile::trial::SimulatedTrial;
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct TactileSignatures;

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

/// Name of centred bodies in tables.
const BODIES: &str = "bodies, centred";

/// A unit of work: a gripper and grasps by it.
pub(super) struct Unit {
    gripper: &'static str,
    /// Name of the grasps in tables.
    kind: String,
    grasps: Grasps,
}

/// Grasps of a unit.
enum Grasps {
    /// Bodies of known width, centred.
    Bodies,
    /// The built-in objects, centred and as placed.
    Objects,
    /// Objects in random poses.
    Posed(SensorView),
    /// Trials of the plan's query.
    Stored(SensorView),
    /// Bodies, with a setting varied about the paper's scene.
    Varied(&'static Varied),
}

impl StudyCell for Unit {
    fn name(&self) -> String {
        format!("{}: {}", self.gripper, self.kind)
    }
}

fn view_of(sensors: SensorModel) -> SensorView {
    SensorView { sensors, ..SensorView::default() }
}

/// Result of a unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Found {
    /// Description of the data.
    data: String,
    signatures: Vec<Signature>,
    /// Grasps without contact, or in which nothing was held to the end.
    lost: usize,
    /// Grasps left out as unsound.
    unsound: usize,
    curves: Vec<Curve>,
    /// Sentences at each value of a setting.
    varied: Vec<(f64, Summary)>,
}

/// Curves of one grasp, thinned.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Curve {
    object: String,
    size: String,
    shape: String,
    /// Time (s), bending (1/m), pressure (kPa).
    points: Vec<[f64; 3]>,
}

/// Samples of a curve.
const POINTS: usize = 46;

impl Curve {
    fn of(object: &ObjectModel, course: &GraspCurves) -> Option<Self> {
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

/// Bodies, centred.
fn bodies_found(plan: &StudyPlan, scene: &Scene) -> Found {
    let widths = plan.pick(WIDTHS.as_slice(), &WIDTHS, &WIDTHS[..2]);
    let signatures = bodies::signatures(scene, widths);
    Found { lost: bodies::bodies(widths).len() - signatures.len(), signatures, ..Found::default() }
}

/// Built-in objects, centred and as placed.
fn objects_found(plan: &StudyPlan, scene: &Scene) -> Found {
    let mut found = Found::default();
    for name in plan.objects() {
        let mut scene = scene.clone();
        scene.object.source.clone_from(&name);
        let Ok(Some(object)) = scene.load_object() else { continue };
        let trial = grasp(&scene, Some(&object), 0);
        let course = papers_view().signals(&trial).ok().map(|own| GraspCurves::of(&own.channels, &sequence_of(&own)));
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
fn of_data(bench: &StudyData<'_>, wanted: &DataWanted) -> Result<Found, StudyError> {
    let data = bench.data(wanted)?;
    let models: BTreeMap<&str, ObjectModel> = catalogue()
        .iter()
        .filter_map(|known| {
            let mut scene = Scene::default();
            scene.object.source.clone_from(&known.name);
            Some((known.name.as_str(), scene.load_object().ok()??))
        })
        .collect();
    let unsound = data.about.left_out_for.get(NOT_SOUND).copied().unwrap_or(0);
    let mut found = Found { data: data.about.described(), unsound, ..Found::default() };
    for example in &data.examples {
        bench.check_stop()?;
        let class = &data.labels.classes[example.class];
        let course = GraspCurves::of(&data.channels, &example.grasp);
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
    Ok(found)
}

impl Study for TactileSignatures {
    type Cell = Unit;
    type Found = Found;

    const CARD: StudyCard = StudyCard {
        key: "signatures",
        title: "Tactile signatures",
        about: "bending and pressure before and after contact; which of the paper's sentences hold, and for what finger",
        paper: "Fig. 4a",
    };

    fn grid(plan: &StudyPlan) -> Vec<Unit> {
        let read = |view: &SensorView| {
            let pressure = match view.signals {
                SignalDefinition::Contact => "contact pressure",
                SignalDefinition::Parts => "pad pressure",
                SignalDefinition::Hull => "hull pressure",
            };
            format!("{}, {pressure}", view.sensors.name())
        };
        if plan.query.is_some() {
            let stored = plan.sensors.iter().map(|&sensors| view_of(sensors));
            return stored
                .map(|view| Unit { gripper: "stored", kind: read(&view), grasps: Grasps::Stored(view) })
                .collect();
        }
        let mut units = Vec::new();
        for gripper in [DEFAULT, DEFAULT_FIXED, PAPER] {
            units.push(Unit { gripper, kind: BODIES.to_owned(), grasps: Grasps::Bodies });
            units.push(Unit { gripper, kind: "objects, centred".to_owned(), grasps: Grasps::Objects });
        }
        for gripper in [DEFAULT, PAPER] {
            for &sensors in &plan.sensors {
                let papers = (sensors == SensorModel::Virtual).then(papers_view);
                units.extend(papers.into_iter().chain([view_of(sensors)]).map(|view| {
                    let kind = format!("preset {}, {}", plan.preset, read(&view));
                    Unit { gripper, kind, grasps: Grasps::Posed(view) }
                }));
            }
        }
        let varied =
            |own: &'static Varied| Unit { gripper: PAPER, kind: own.name.to_owned(), grasps: Grasps::Varied(own) };
        units.extend(VARIED.iter().map(varied));
        units
    }

    fn measure(unit: &Unit, bench: &StudyData<'_>) -> Result<Found, StudyError> {
        let (plan, scene) = (bench.plan(), scene_of(unit.gripper));
        let found = match &unit.grasps {
            Grasps::Bodies => bodies_found(plan, &scene),
            Grasps::Objects => objects_found(plan, &scene),
            Grasps::Posed(view) => {
                let usual = plan.wanted(plan.grasps(GRASPS, QUICK), view.sensors);
                of_data(bench, &DataWanted { fixed: scene.holds_object(), scene, view: view.clone(), ..usual })?
            }
            Grasps::Stored(view) => {
                of_data(bench, &DataWanted { view: view.clone(), ..plan.wanted(usize::MAX, view.sensors) })?
            }
            Grasps::Varied(own) => {
                let widths = plan.pick(WIDTHS.as_slice(), &WIDTHS[..4], &WIDTHS[..1]);
                let is_wanted = |value: &&f64| plan.pick(true, true, own.known().contains(value));
                let varied = own
                    .values
                    .iter()
                    .filter(is_wanted)
                    .map(|&value| (value, Summary::of(&bodies::signatures(&own.scene(value), widths))));
                Found { varied: varied.take_while(|_| !bench.is_cancelled()).collect(), ..Found::default() }
            }
        };
        bench.check_stop()?;
        Ok(found)
    }

    fn report(plan: &StudyPlan, found: Vec<(Unit, Found)>) -> StudyReport {
        let (mut measured, mut settings) = (Vec::new(), Vec::new());
        for (Unit { gripper, kind, grasps }, found) in found {
            if let Grasps::Varied(varied) = grasps {
                settings.extend(found.varied.into_iter().map(|(value, summary)| (varied, value, summary)));
            } else {
                let view = match grasps {
                    Grasps::Posed(view) | Grasps::Stored(view) => Some(view),
                    Grasps::Bodies | Grasps::Objects | Grasps::Varied(_) => None,
                };
                measured.push(Measured { gripper, kind, summary: Summary::of(&found.signatures), found, view });
            }
        }
        let described = measured.iter().filter(|own| !own.found.data.is_empty());
        let data = described.map(|own| format!("{}: {}", own.gripper, own.found.data)).collect();
        let tables = [
            sentence_table(plan, &measured),
            object_table(&measured),
            setting_table(&settings),
            curve_table(&measured),
        ];
        let tables = tables.into_iter().filter(|table| !table.rows.is_empty());
        StudyReport::new(data, tables.collect(), findings(&measured))
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        figures::all(report)
    }
}

/// Resamples of an interval.
const BOOTSTRAP: Bootstrap = Bootstrap { resamples: 500, seed: 0 };

/// A statistic of signatures, with its interval where there are several grasps of an object.
fn interval(all: &[&Signature], statistic: Statistic) -> Cell {
    if all.iter().all(|own| own.of.trial.is_none()) {
        return Cell::from(statistic(all));
    }
    let names: BTreeSet<&str> = all.iter().map(|own| own.of.object.as_str()).collect();
    let names: Vec<&str> = names.into_iter().collect();
    let objects: Vec<usize> =
        all.iter().map(|own| names.iter().position(|name| *name == own.of.object).unwrap_or_default()).collect();
    Cell::from(BOOTSTRAP.interval(&objects, |kept| statistic(&kept.iter().map(|k| all[*k]).collect::<Vec<_>>())))
}

fn sentence_table(plan: &StudyPlan, all: &[Measured]) -> StudyTable {
    let statistics = STATISTICS.map(|(name, unit, statistic)| {
        let cell = move |own: &Measured| interval(&own.found.signatures.iter().collect::<Vec<_>>(), statistic);
        (name, unit, cell)
    });
    let own: [Column<'_, Measured>; 5] = [
        Column("gripper", "", &|own| own.gripper.into()),
        Column("grasps", "", &|own| own.kind.as_str().into()),
        Column("held", "grasps", &|own| own.summary.grasps.into()),
        Column("lost", "grasps", &|own| own.found.lost.into()),
        Column("unsound", "grasps", &|own| own.found.unsound.into()),
    ];
    let statistics = statistics.iter().map(|(name, unit, cell)| Column(name, unit, cell));
    let columns: Vec<Column<'_, Measured>> = own.into_iter().chain(statistics).collect();
    let title = format!(
        "Sentences of section V-A in numbers, preset {} and centred; rates as shares of that before contact",
        plan.preset
    );
    let shown = |own: &Measured| {
        let trials = own.found.signatures.iter().filter_map(|own| own.of.trial);
        let every = 1 + trials.clone().count() / SHOWN;
        trials.step_by(every).collect()
    };
    TableRows::new("signatures", title, all).with_trials(&shown).read_through(&|own| own.view.clone()).columns(&columns)
}

/// Grasps of one object.
struct ObjectGrasps<'a> {
    of: &'a Measured,
    object: &'a str,
    own: Vec<&'a Signature>,
}

/// Median over the grasps, with its interval.
fn over_grasps(row: &ObjectGrasps<'_>, value: impl Fn(&Signature) -> Option<f64>) -> Cell {
    let values: Vec<f64> = row.own.iter().filter_map(|signature| value(signature)).collect();
    if values.len() < 3 {
        return Cell::from(median(values));
    }
    let at = vec![0; values.len()];
    Cell::from(BOOTSTRAP.interval(&at, |kept| median(kept.iter().map(|k| values[*k]))))
}

fn object_table(all: &[Measured]) -> StudyTable {
    let rows = all.iter().flat_map(|of| {
        let mut by_object: BTreeMap<&str, Vec<&Signature>> = BTreeMap::new();
        for signature in &of.found.signatures {
            by_object.entry(&signature.of.object).or_default().push(signature);
        }
        by_object.into_iter().map(move |(object, own)| ObjectGrasps { of, object, own })
    });
    let rows: Vec<ObjectGrasps<'_>> = rows.collect();
    let shown =
        |row: &ObjectGrasps<'_>| row.own.iter().filter_map(|signature| signature.of.trial).take(SHOWN).collect();
    let table = TableRows::new("objects", "Each object; medians over its grasps", &rows).with_trials(&shown);
    table.read_through(&|row| row.of.view.clone()).columns(&[
        Column("gripper", "", &|row| row.of.gripper.into()),
        Column("grasps", "", &|row| row.of.kind.as_str().into()),
        Column("object", "", &|row| row.object.into()),
        Column("shape", "", &|row| row.own[0].of.shape.as_str().into()),
        Column("width", "mm", &|row| median(row.own.iter().filter_map(|own| own.of.width_mm)).into()),
        Column("held", "grasps", &|row| row.own.len().into()),
        Column("onset", "s", &|row| over_grasps(row, |own| Some(own.onset_s))),
        Column("bending after contact", PERCENT, &|row| over_grasps(row, |own| Some(own.share))),
        Column("rate after contact", PERCENT, &|row| over_grasps(row, |own| own.rate)),
        Column("line after contact (R²)", "", &|row| over_grasps(row, |own| own.line)),
        Column("time to 90 % of pressure", "s", &|row| over_grasps(row, |own| Some(own.rise_s))),
        Column("bending in the hold", "1/m", &|row| over_grasps(row, |own| Some(own.bend))),
        Column("pressure in the hold", "kPa", &|row| over_grasps(row, |own| Some(own.pressure_kpa))),
    ])
}

/// Objects whose curves are shown: a tiny and a large one of each of the paper's shapes, of clear form.
const SHOWN_CURVES: [&str; 6] = ["smallcube", "cube", "labello", "cylinder", "ball", "bigball"];

fn curve_table(all: &[Measured]) -> StudyTable {
    let rows = all.iter().flat_map(|own| {
        let shown = own.found.curves.iter().filter(|curve| SHOWN_CURVES.contains(&curve.object.as_str()));
        shown.flat_map(move |curve| curve.points.iter().map(move |point| (own.gripper, curve, *point)))
    });
    let rows: Vec<(&str, &Curve, [f64; 3])> = rows.collect();
    let title = "A tiny and a large object of each shape over time, centred, as in Fig. 4a";
    TableRows::new("curves", title, &rows).columns(&[
        Column("gripper", "", &|(gripper, ..)| (*gripper).into()),
        Column("object", "", &|(_, curve, _)| curve.object.as_str().into()),
        Column("class", "", &|(_, curve, _)| format!("{} {}", curve.size, curve.shape).into()),
        Column("time", "s", &|(.., point)| Cell::Number(point[0])),
        Column("bending", "1/m", &|(.., point)| Cell::Number(point[1])),
        Column("pressure", "kPa", &|(.., point)| Cell::Number(point[2])),
    ])
}

/// A setting, its value, and what follows.
type Setting = (&'static Varied, f64, Summary);

/// Named scene that has a value of a setting.
fn scene_with(varied: &Varied, value: f64) -> &'static str {
    match varied.known().map(|known| (known - value).abs() < 1e-9 * value.abs()) {
        [true, true] => "default and paper",
        [true, false] => DEFAULT,
        [false, true] => PAPER,
        [false, false] => "",
    }
}

fn setting_table(all: &[Setting]) -> StudyTable {
    let title = "Scene paper with one setting changed, bodies centred";
    TableRows::new("settings", title, all).columns(&[
        Column("setting", "", &|(varied, ..)| varied.name.into()),
        Column("value", "", &|(_, value, _)| Cell::Number(*value)),
        Column("unit", "", &|(varied, ..)| varied.unit.into()),
        Column("scene with this value", "", &|(varied, value, _)| scene_with(varied, *value).into()),
        Column("held", "grasps", &|(.., own)| own.grasps.into()),
        Column("rate after contact, round", PERCENT, &|(.., own)| own.round_rate.into()),
        Column("rate after contact, flat", PERCENT, &|(.., own)| own.flat_rate.into()),
        Column("line after contact, flat (R²)", "", &|(.., own)| own.flat_line.into()),
        Column("time to 90 % of pressure", "s", &|(.., own)| own.rise_s.into()),
        Column("onset with width, rank correlation", "", &|(.., own)| own.size.into()),
        Column("sentences that hold", "", &|(.., own)| {
            sentences(own).iter().filter(|own| own.verdict() == Agreement::Agrees).count().into()
        }),
    ])
}
