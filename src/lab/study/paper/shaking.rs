//! A hand that shakes what it holds (section VII, future work): what inertia adds to the recognition of the objects, and
//! whether it tells apart objects that differ in nothing but their mass.

use super::answers::{Judged, Pool, TestPart, fit_and_judge};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, named_rows, percent_row};
use super::plan::{DataWanted, StudyPlan};
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use palpate_geometry::drawing::{DataSeries, Figure, Marker, Plot, PlotAxis};
use palpate_learn::metrics::Interval;
use palpate_learn::{Class, Dataset, Example, Labels, Method, method};
use palpate_sim::objects::catalogue;
use palpate_sim::scene::{Auto, Scene};
use palpate_tactile::model::SensorModel;
use std::collections::BTreeMap;

pub(super) struct Shaken;

const CARD: StudyCard = StudyCard {
    key: "shaking",
    title: "Shaking",
    about: "what inertia adds to recognition: held still, lifted, shaken; the objects, and objects that differ in mass alone",
    paper: "section VII, future work",
    budget: "about 50 CPU minutes",
};

/// A hand's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Motion {
    /// Name in tables.
    name: &'static str,
    /// Distance of the turning points from the middle (m); none where the hand lifts nothing.
    amplitude: Option<f64>,
    /// Closing direction, across the fingers, up.
    direction: [f64; 3],
}

/// Motions; the first is the reference. A lift without a swing is one of an amplitude that moves nothing.
const MOTIONS: [Motion; 4] = [
    Motion { name: "still", amplitude: None, direction: [0.0, 0.0, 1.0] },
    Motion { name: "lifted", amplitude: Some(1e-9), direction: [0.0, 0.0, 1.0] },
    Motion { name: "shaken up and down", amplitude: Some(0.004), direction: [0.0, 0.0, 1.0] },
    Motion { name: "shaken sideways", amplitude: Some(0.004), direction: [1.0, 0.0, 0.0] },
];

/// Oscillations per second (Hz): 4 mm at 4 Hz are a quarter of the acceleration of gravity.
const FREQUENCY: f64 = 4.0;
/// Ticks of the hold: room for lift and eight oscillations; the trial's length (s).
const HOLD_TICKS: u32 = 26;
const DURATION_S: f64 = 5.6;

/// Sets of classes.
const OBJECTS: &str = "objects";
const MASSES: &str = "masses";
/// Objects whose mass is varied, and the factors.
const VARIED: [&str; 4] = ["ball", "cube", "cylinder", "parallelepiped"];
const FACTORS: [f64; 2] = [0.5, 1.5];

const METHODS: [&str; 2] = ["extra-trees", "macro-layer"];
/// Grasps of each class.
const GRASPS: usize = 60;
const QUICK: usize = 8;

pub(super) struct Case {
    sensors: SensorModel,
    set: &'static str,
    motion: Motion,
    method: &'static Method,
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        // What a motion adds needs grasps with that motion.
        if plan.query.is_some() {
            return Vec::new();
        }
        let methods = || METHODS.into_iter().take(plan.pick(2, 1, 1)).filter_map(method);
        let motions: Vec<Motion> =
            plan.pick(MOTIONS.to_vec(), vec![MOTIONS[0], MOTIONS[2]], vec![MOTIONS[0], MOTIONS[2]]);
        let mut cases = Vec::new();
        for set in [MASSES, OBJECTS] {
            for &motion in &motions {
                for &sensors in &plan.sensors {
                    cases.extend(methods().map(|method| Self { sensors, set, motion, method }));
                }
            }
        }
        cases
    }

    fn name(&self) -> String {
        format!("{}, {}, {}, {}", self.set, self.motion.name, self.sensors.name(), self.method.key)
    }

    fn method(&self) -> &'static Method {
        self.method
    }
}

fn scene(motion: Motion) -> Scene {
    let mut scene = Scene::default();
    (scene.programme.hold_ticks, scene.timing.duration_s) = (HOLD_TICKS, DURATION_S);
    if let Some(amplitude) = motion.amplitude {
        scene.shaking.amplitude = amplitude;
        (scene.shaking.frequency, scene.shaking.direction) = (FREQUENCY, motion.direction);
    }
    scene
}

/// Grasps of the objects, or of some of them with other masses, each mass a class of its own.
fn grasps(bench: &StudyBench<'_>, case: &Case) -> Result<Option<Dataset>, StudyError> {
    let plan = bench.plan();
    let usual = plan.wanted(plan.grasps(GRASPS, QUICK), case.sensors);
    if case.set == OBJECTS {
        let data = bench.data(&DataWanted { scene: scene(case.motion), ..usual })?;
        return Ok(data.map(|data| data.as_ref().clone()));
    }
    let mut merged: Option<Dataset> = None;
    for name in VARIED.iter().take(plan.pick(VARIED.len(), VARIED.len(), 1)) {
        let Some(known) = catalogue().iter().find(|known| known.name == *name) else { continue };
        let mut scene = scene(case.motion);
        scene.object.source.clone_from(&known.name);
        let Ok(Some(object)) = scene.load_object() else { continue };
        for factor in FACTORS {
            let mass = factor * object.mass.mass;
            scene.object.mass = Auto::Value(mass);
            let objects = vec![known.name.clone()];
            let Some(data) = bench.data(&DataWanted { scene: scene.clone(), objects, ..usual.clone() })? else {
                return Ok(None);
            };
            let class = Class { name: format!("{name} {:.0} g", 1e3 * mass), size: None, shape: None };
            let into = merged.get_or_insert_with(|| Dataset { labels: Labels::default(), ..data.part(&[]) });
            let number = into.labels.classes.len();
            into.labels.classes.push(class);
            into.examples.extend(data.examples.iter().map(|own| Example { class: number, ..own.clone() }));
            into.about.grasps = into.examples.len();
        }
    }
    Ok(merged)
}

impl CaseStudy for Shaken {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let Some(data) = grasps(bench, &case)? else { return Ok(None) };
        let mut parts: Vec<Judged> = Vec::new();
        for part in 0..TestPart::usual(plan, 0).of {
            let all = TestPart { train: usize::MAX, ..TestPart::usual(plan, part) };
            let (train, test) = all.split(&data, plan.seed)?;
            let Some(judged) = fit_and_judge(bench, case.method, &train, &test)? else { return Ok(None) };
            parts.push(judged);
        }
        UnitResult::new(&parts).map(Some)
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut report = StudyReport::default();
        let mut pools: Vec<(Case, Paired)> = Vec::new();
        for case in Case::all(plan) {
            let Some(unit) = units.get(&case.name()) else { continue };
            let parts: Vec<Judged> = unit.read()?;
            if let Some(answers) = parts.iter().find_map(Judged::answers) {
                let line = format!("{}, {}: {}", case.set, case.motion.name, answers.data);
                if !report.data.contains(&line) {
                    report.data.push(line);
                }
            }
            let pool = Pool::of(parts.iter().filter_map(Judged::answers));
            let scores =
                Paired { f1: pool.f1(), accuracy: pool.accuracy(), tested: pool.len(), trials: pool.misjudged() };
            pools.push((case, scores));
        }
        let mut table = StudyTable::new(
            CARD.key,
            format!("Motions of the hand, preset {}; differences to still", plan.preset),
            &[
                ("classes", ""),
                ("sensors", ""),
                ("model", ""),
                ("motion", ""),
                ("F1", PERCENT),
                ("accuracy", PERCENT),
                ("F1 against still", PERCENT),
                ("tested", "grasps"),
            ],
        );
        let mut measured = Vec::new();
        for (case, own) in &pools {
            let still = |other: &&(Case, Paired)| {
                let (other, _) = other;
                other.motion == MOTIONS[0]
                    && (other.set, other.sensors, other.method.key) == (case.set, case.sensors, case.method.key)
            };
            let still = pools.iter().find(still).filter(|_| case.motion != MOTIONS[0]);
            let gain = still.and_then(|(_, still)| independent(own.f1?, still.f1?));
            table.push(
                vec![
                    Cell::text(case.set),
                    Cell::text(case.sensors.name()),
                    Cell::text(case.method.key),
                    Cell::text(case.motion.name),
                    Cell::interval(own.f1),
                    Cell::interval(own.accuracy),
                    Cell::interval(gain),
                    Cell::Number(own.tested as f64),
                ],
                own.trials.clone(),
            );
            measured.extend(gain.map(|gain| {
                (case.set, format!("{}, {}, {}", case.sensors.name(), case.method.key, case.motion.name), gain)
            }));
        }
        report.findings = [finding(OBJECTS, &measured), finding(MASSES, &measured)].into_iter().collect();
        report.tables.push(table);
        Ok(report)
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table)).into_iter().collect()
    }
}

/// Scores of one case.
struct Paired {
    f1: Option<Interval>,
    accuracy: Option<Interval>,
    tested: usize,
    trials: Vec<i64>,
}

/// Difference of two scores on different grasps: deviations add in squares (MOVER; Zou and Donner 2008).
fn independent(own: Interval, other: Interval) -> Option<Interval> {
    let estimate = own.estimate - other.estimate;
    let below = (own.estimate - own.low).hypot(other.high - other.estimate);
    let above = (own.high - own.estimate).hypot(other.estimate - other.low);
    let interval = Interval { estimate, low: estimate - below, high: estimate + above };
    interval.estimate.is_finite().then_some(interval)
}

fn finding(set: &str, measured: &[(&'static str, String, Interval)]) -> Finding {
    let own: Vec<_> = measured.iter().filter(|(of, name, _)| *of == set && name.contains("shaken")).collect();
    let claim = match set {
        MASSES => "Shaking tells apart objects that differ in mass alone",
        _ => "Shaking adds to the recognition of the objects",
    };
    let listed = own.iter().map(|(_, name, gain)| {
        format!("{name}: {:+.1} ({:+.1} to {:+.1})", 100.0 * gain.estimate, 100.0 * gain.low, 100.0 * gain.high)
    });
    Finding {
        section: "VII".to_owned(),
        claim: claim.to_owned(),
        found: match own.is_empty() {
            true => "shaken grasps are missing: they are simulated only without options that choose stored trials".to_owned(),
            false => format!("points of macro F1 over still: {}", listed.collect::<Vec<_>>().join("; ")),
        },
        verdict: Agreement::of_all(own.iter().map(|(_, _, gain)| Agreement::of_gain(Some(*gain)))),
        why: "Agrees where the 95 % interval of the gain over a hand that holds still for as long is above zero in each case, disagrees \
              where it is below"
            .to_owned(),
    }
}

/// A plot for each set of classes and sensors, one row for each motion.
fn figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    let motions = table.texts("motion");
    for set in table.texts("classes") {
        for sensors in table.texts("sensors") {
            let mut series = Vec::new();
            for (colour, model) in table.texts("model").into_iter().enumerate() {
                let mut points = Vec::new();
                for row in table.rows_with(&[("classes", set), ("sensors", sensors), ("model", model)]) {
                    let place = motions.iter().position(|motion| *motion == table.text(row, "motion")).unwrap_or(0);
                    links.push(FigureLink {
                        plot: plots.len(),
                        mark: FigureMark::Point(series.len(), points.len()),
                        table: at,
                        row,
                    });
                    points.push(percent_row(table, row, "F1", -(place as f64) - 0.12 * colour as f64));
                }
                let name = if plots.is_empty() { model.to_owned() } else { String::new() };
                series.push(DataSeries { name, colour, marker: Marker::Dot, points, ..DataSeries::default() });
            }
            let x = PlotAxis { range: Some([0.0, 100.0]), ..PlotAxis::linear(F1_PERCENT) };
            plots.push(Plot {
                title: format!("{set}, {sensors}"),
                x,
                y: named_rows(&motions),
                series,
                sideways: true,
                ..Plot::default()
            });
        }
    }
    let note = format!("{:.0} mm at {FREQUENCY} Hz after a lift; 95 % intervals by bootstrap over test grasps.", 4.0);
    let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1000, 620], links }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_moves_within_the_hold_and_not_where_it_is_still() {
        assert_eq!(scene(MOTIONS[0]).hand_motion(), None);
        for motion in &MOTIONS[1..] {
            let scene = scene(*motion);
            scene.check().expect(motion.name);
            let moves = scene.hand_motion().expect(motion.name);
            assert!((moves.at(2.6).place.z - 0.03).abs() < 0.005, "{}", motion.name);
            let far = (250..460)
                .map(|k| moves.at(0.01 * f64::from(k)))
                .map(|at| (at.place.z - 0.03).abs().max(at.place.x.abs()));
            let most = far.fold(0.0, f64::max);
            assert!((most - motion.amplitude.expect("moves")).abs() < 2e-4, "{}: {most}", motion.name);
        }
    }

    #[test]
    fn independent_differences_are_wider_than_each_of_their_parts() {
        let of = |estimate: f64| Interval { estimate, low: estimate - 0.03, high: estimate + 0.04 };
        let gain = independent(of(0.8), of(0.7)).expect("finite");
        assert!(
            (gain.estimate - 0.1).abs() < 1e-12 && (gain.low - 0.05).abs() < 1e-9 && (gain.high - 0.15).abs() < 1e-9
        );
    }
}
