//! A hand that shakes what it holds (section VII, future work): what inertia adds to the recognition of the objects, and
//! whether it tells apart objects that differ in nothing but their mass.

use super::prelude::*;
use palpate_sim::objects::catalogue;
use palpate_sim::scene::{Auto, Scene};

pub(super) struct Shaken;

/// A hand's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
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

/// A kind of grasps and a method: the set of classes and the motion.
pub(super) struct Case(Kind<(&'static str, Motion)>);

impl StudyCell for Case {
    fn name(&self) -> String {
        let (set, motion) = self.0.factor;
        format!("{set}, {}, {}", motion.name, self.0.model())
    }

    fn method(&self) -> Option<&'static Method> {
        Some(self.0.method)
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
fn grasps(bench: &StudyData<'_>, Case(kind): &Case) -> Result<Dataset, StudyError> {
    let (plan, (set, motion)) = (bench.plan(), kind.factor);
    let usual = plan.wanted(plan.grasps(GRASPS, QUICK), kind.sensors);
    if set == OBJECTS {
        return Ok(bench.data(&DataWanted { scene: scene(motion), ..usual })?.as_ref().clone());
    }
    let mut merged: Option<Dataset> = None;
    for name in VARIED.iter().take(plan.pick(VARIED.len(), VARIED.len(), 1)) {
        let Some(known) = catalogue().iter().find(|known| known.name == *name) else { continue };
        let mut scene = scene(motion);
        scene.object.source.clone_from(&known.name);
        let Ok(Some(object)) = scene.load_object() else { continue };
        for factor in FACTORS {
            let mass = factor * object.mass.mass;
            scene.object.mass = Auto::Value(mass);
            let objects = vec![known.name.clone()];
            let data = bench.data(&DataWanted { scene: scene.clone(), objects, ..usual.clone() })?;
            let class = Class { name: format!("{name} {:.0} g", 1e3 * mass), size: None, shape: None };
            let into = merged.get_or_insert_with(|| Dataset { labels: Labels::default(), ..data.part(&[]) });
            let number = into.labels.classes.len();
            into.labels.classes.push(class);
            into.examples.extend(data.examples.iter().map(|own| Example { class: number, ..own.clone() }));
            into.about.grasps = into.examples.len();
        }
    }
    merged.ok_or_else(|| StudyError::missing("built-in objects"))
}

impl Study for Shaken {
    type Cell = Case;
    type Found = Vec<TestAnswers>;

    const CARD: StudyCard = StudyCard {
        key: "shaking",
        title: "Shaking",
        about: "what inertia adds to recognition: held still, lifted, shaken; the objects, and objects that differ in mass alone",
        paper: "section VII, future work",
    };

    fn grid(plan: &StudyPlan) -> Vec<Case> {
        // What a motion adds needs grasps with that motion.
        if plan.query.is_some() {
            return Vec::new();
        }
        let short = [MOTIONS[0], MOTIONS[2]];
        let motions = plan.pick(&MOTIONS[..], &short, &short);
        let mut cases = Vec::new();
        for factor in [MASSES, OBJECTS].into_iter().flat_map(|set| motions.iter().map(move |motion| (set, *motion))) {
            for &sensors in &plan.sensors {
                let methods = METHODS.into_iter().take(plan.pick(2, 1, 1)).filter_map(method);
                cases.extend(methods.map(|method| Case(Kind { sensors, method, factor })));
            }
        }
        cases
    }

    fn measure(case: &Case, bench: &StudyData<'_>) -> Result<Vec<TestAnswers>, StudyError> {
        let (plan, data) = (bench.plan(), grasps(bench, case)?);
        let of_part = |part| {
            let all = TestPart { train: usize::MAX, ..TestPart::usual(plan, part) };
            bench.judge(case.0.method, &all.split(&data, plan.seed)?)
        };
        (0..TestPart::usual(plan, 0).of).map(of_part).collect()
    }

    fn report(plan: &StudyPlan, found: Vec<(Case, Vec<TestAnswers>)>) -> StudyReport {
        let data = unique(found.iter().filter_map(|(Case(kind), parts)| {
            let (set, motion) = kind.factor;
            Some(format!("{set}, {}: {}", motion.name, parts.iter().find_map(TestAnswers::answers)?.data))
        }));
        let answers = found.into_iter().flat_map(|(Case(kind), parts)| parts.into_iter().map(move |own| (kind, own)));
        let mut rows = pooled(answers);
        let gain = |row: &Row<(&'static str, Motion)>| {
            let still = row.kind.with((row.kind.factor.0, MOTIONS[0]));
            independent(row.f1?, find(&rows, &still).filter(|still| still.kind != row.kind)?.f1?)
        };
        let gains: Vec<Option<Interval>> = rows.iter().map(gain).collect();
        rows.iter_mut().zip(gains).for_each(|(row, gain)| row.gain = gain);
        let title = format!("Motions of the hand, preset {}; differences to still", plan.preset);
        let findings = vec![
            finding("Shaking adds to the recognition of the objects", OBJECTS, &rows),
            finding("Shaking tells apart objects that differ in mass alone", MASSES, &rows),
        ];
        StudyReport::new(
            data,
            vec![Row::table("shaking", title, &rows).columns(&[
                Column("classes", "", &|row: &Row<(&'static str, Motion)>| row.kind.factor.0.into()),
                Row::SENSORS,
                Row::MODEL,
                Column("motion", "", &|row| row.kind.factor.1.name.into()),
                Row::F1,
                Row::ACCURACY,
                Row::gain("F1 against still"),
                Row::TESTED,
            ])],
            findings,
        )
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let note =
            format!("{:.0} mm at {FREQUENCY} Hz after a lift; 95 % intervals by bootstrap over test grasps.", 4.0);
        let facets = Facets {
            plot: &|line| format!("{}, {}", line.text("classes"), line.text("sensors")),
            along: Along::Rows(&|line| line.text("motion").to_owned()),
            shift: -0.12,
            named_once: true,
            size: [1000, 620],
            note: &note,
            ..Facets::USUAL
        };
        let mut figure = facets.figure(report, "shaking");
        let plots = figure.iter_mut().flat_map(|linked| &mut linked.figure.plots);
        plots.for_each(|plot| plot.x.range = Some([0.0, 100.0]));
        vec![figure]
    }
}

/// Difference of two scores on different grasps: deviations add in squares (MOVER; Zou and Donner 2008).
fn independent(own: Interval, other: Interval) -> Option<Interval> {
    let estimate = own.estimate - other.estimate;
    let below = (own.estimate - own.low).hypot(other.high - other.estimate);
    let above = (own.high - own.estimate).hypot(other.estimate - other.low);
    let interval = Interval { estimate, low: estimate - below, high: estimate + above };
    interval.estimate.is_finite().then_some(interval)
}

fn finding(claim: &str, set: &str, rows: &[Row<(&'static str, Motion)>]) -> Finding {
    let shaken = rows.iter().filter(|row| row.kind.factor.0 == set && row.kind.factor.1.name.contains("shaken"));
    let found = shaken.filter_map(|row| Some((format!("{}, {}", row.kind.model(), row.kind.factor.1.name), row.gain?)));
    let rule = "Agrees where the 95 % interval of the gain over a hand that holds still for as long is above zero in each case, disagrees \
                where it is below";
    let mut finding = Claim("VII", claim, rule).on_each(POINTS, Rule::AllAbove(0.0), found);
    if finding.verdict == Agreement::NotMeasured {
        finding.found =
            "Shaken grasps are missing: they are simulated only without options that choose stored trials.".to_owned();
    }
    finding
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
