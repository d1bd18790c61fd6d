//! Successive grasps of one object (Fig. 8): put down anew between them, or left as the fingers released it.
//!
//! Grasps are combined in two ways: the iterated network is fed with the probabilities of those before, and the product of
//! experts multiplies the probabilities of each grasp alone.

use super::answers::{PARTS, Pool, SHOWN, TestPart, usual_grasps};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, percent_point};
use super::plan::{DataWanted, StudyPlan};
use super::pools::{Gains, add_new, better_than_each, finding, finding_on_gains, points};
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use crate::grasping::SUCCESSION;
use palpate_geometry::drawing::{DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis};
use palpate_learn::metrics::Interval;
use palpate_learn::{Belief, Dataset, Method, Model, Pmf, StopReason, StopRule, method};
use palpate_sim::scene::Between;
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::TrialId;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Grasps;

const CARD: StudyCard = StudyCard {
    key: "grasps",
    title: "Successive grasps",
    about: "accuracy and F1 after one to eight grasps, put down anew or left as released, by feedback and by product of \
            experts, and confident stops that are wrong",
    paper: "Fig. 8",
    budget: "about 30 CPU minutes",
};

/// The paper's iterated network, strict and tuned, one of a single grasp, and a method of seconds.
const MODELS: [&str; 4] = ["paper-ids-lstm", "ids-lstm", "macro-layer", "extra-trees"];
/// Grasps in a row.
const MOST: usize = SUCCESSION as usize;
/// Grasps of each object that were left as released.
const RELEASED: usize = 10 * MOST;
/// Grasps after which the paper sees no change, and the largest change that is none.
const STEADY: usize = 4;
const NO_CHANGE: f64 = 0.01;

/// Names of the ways to place the object, and to combine grasps.
pub(super) const ANEW: &str = "put down anew";
const LEFT: &str = "left as released";
const FEEDBACK: &str = "feedback";
pub(super) const PRODUCT: &str = "product of experts";

pub(super) struct Case {
    sensors: SensorModel,
    method: &'static Method,
    part: usize,
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for (number, &sensors) in plan.sensors.iter().enumerate() {
            for method in MODELS.into_iter().filter_map(method) {
                let parts = plan.pick(if number > 0 && method.recipe.is_some() { 1 } else { PARTS }, 1, 1);
                cases.extend((0..parts).map(|part| Self { sensors, method, part }));
            }
        }
        cases
    }

    fn name(&self) -> String {
        format!("{}, {}, part {}", self.sensors.name(), self.method.key, self.part + 1)
    }

    fn method(&self) -> &'static Method {
        self.method
    }
}

/// Result of a unit.
#[derive(Serialize, Deserialize)]
struct GraspsResult {
    data: Vec<String>,
    classes: Vec<String>,
    courses: Vec<Course>,
}

/// Rounds of successive grasps, combined in one way.
#[derive(Serialize, Deserialize)]
struct Course {
    placed: String,
    combined: String,
    rounds: Vec<CourseRound>,
}

/// A round: grasps in a row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct CourseRound {
    /// The first of its trials.
    first: TrialId,
    truth: usize,
    /// Decision after each grasp.
    decided: Vec<usize>,
    /// Grasps until the usual stop rule ends the round.
    stopped: usize,
    /// True where that is because it was certain.
    sure: bool,
}

impl CourseRound {
    /// True where the decision at the stop is right.
    fn is_right(&self) -> bool {
        self.decided.get(self.stopped - 1) == Some(&self.truth)
    }
}

/// Grasps in a row as indices: each test grasp with others of its object after it. Grasps of objects that stayed as released
/// follow each other in their own order, and are left out.
fn placed_anew(data: &Dataset) -> Vec<Vec<usize>> {
    let left: BTreeSet<TrialId> = data.examples.iter().filter_map(|example| example.after).collect();
    let is_anew = |k: &usize| data.examples[*k].after.is_none() && !left.contains(&data.examples[*k].id);
    let rounds = data.by_class().into_iter().flat_map(|members| {
        let members: Vec<usize> = members.into_iter().filter(is_anew).collect();
        let count = members.len();
        let round = |first: usize| (0..MOST.min(count)).map(|k| members[(first + k) % count]).collect();
        (0..count).map(round).collect::<Vec<Vec<usize>>>()
    });
    rounds.collect()
}

/// Grasps in a row as indices, in the order in which they were made.
fn left_as_released(data: &Dataset) -> Vec<Vec<usize>> {
    let at: BTreeMap<TrialId, usize> = data.examples.iter().enumerate().map(|(k, example)| (example.id, k)).collect();
    let next: BTreeMap<usize, usize> =
        data.examples.iter().enumerate().filter_map(|(k, example)| Some((*at.get(&example.after?)?, k))).collect();
    let firsts = (0..data.examples.len()).filter(|k| data.examples[*k].after.is_none());
    let rounds = firsts.map(|first| std::iter::successors(Some(first), |k| next.get(k).copied()).take(MOST).collect());
    rounds.filter(|round: &Vec<usize>| round.len() > 1).collect()
}

/// Runs rounds of a model on a data set, combined in one way.
fn course(model: &Model, data: &Dataset, alone: &[Pmf], rounds: &[Vec<usize>], feedback: bool) -> Vec<CourseRound> {
    let (recogniser, rule) = (model.recogniser.as_ref(), StopRule { most_grasps: MOST, ..model.card.stop });
    let run = |grasps: &Vec<usize>| {
        let (mut belief, mut decided, mut stop) = (Belief::default(), Vec::new(), None);
        for &k in grasps {
            let with = match belief.now() {
                None => alone[k].clone(),
                Some(before) if feedback => recogniser.recognise(&data.examples[k].grasp, Some(before)).pmf,
                Some(before) => before.times(&alone[k]),
            };
            decided.push(with.top().0);
            belief.add(with, alone[k].clone());
            if stop.is_none() {
                stop = rule
                    .judge(&belief, recogniser.rejection())
                    .map(|reason| (decided.len(), reason == StopReason::Sure));
            }
        }
        let (stopped, sure) = stop.unwrap_or((decided.len(), false));
        let first = &data.examples[grasps[0]];
        CourseRound { first: first.id, truth: first.class, decided, stopped, sure }
    };
    rounds.iter().filter(|grasps| !grasps.is_empty()).map(run).collect()
}

impl CaseStudy for Grasps {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let wanted = usual_grasps(plan, case.sensors).read_by(case.method);
        let Some(data) = bench.data(&wanted)? else { return Ok(None) };
        let (train, test) = TestPart::usual(plan, case.part).split(&data, plan.seed)?;
        // Stored trials hold both, told apart by the trial before them.
        let released = DataWanted { between: Between::AsReleased, grasps: plan.grasps(RELEASED, 2 * MOST), ..wanted };
        let released = if plan.query.is_some() { Some(data.clone()) } else { bench.data(&released)? };
        let Some(released) = released else { return Ok(None) };
        let Some(model) = bench.fit(case.method, &train)? else { return Ok(None) };
        // Grasps that the model has learned from belong to no round.
        let learned: Vec<u64> = train.examples.iter().map(|example| example.content).collect();
        let mut released_rounds = left_as_released(&released);
        released_rounds.retain(|round| round.iter().all(|k| !learned.contains(&released.examples[*k].content)));
        let anew_rounds = placed_anew(&test);
        let Some(in_order) = released.relabelled(&test.labels) else {
            return Err(StudyError::Missing("the same objects in both ways to place them".to_owned()));
        };
        let mut courses = Vec::new();
        for (placed, data, rounds) in [(ANEW, &test, &anew_rounds), (LEFT, &in_order, &released_rounds)] {
            let alone: Vec<Pmf> =
                data.examples.iter().map(|example| model.recogniser.recognise(&example.grasp, None).pmf).collect();
            let is_iterated = case.method.recipe.is_some_and(|recipe| recipe().iterated);
            for (combined, feedback) in [(PRODUCT, false), (FEEDBACK, true)] {
                if !feedback || is_iterated {
                    let rounds = course(&model, data, &alone, rounds, feedback);
                    courses.push(Course { placed: placed.to_owned(), combined: combined.to_owned(), rounds });
                }
            }
        }
        let described = |data: &Dataset, placed: &str| format!("{}, {placed}", data.about.described());
        let result = GraspsResult {
            data: vec![described(&test, ANEW), described(&in_order, LEFT)],
            classes: test.labels.classes.iter().map(|class| class.name.clone()).collect(),
            courses,
        };
        UnitResult::new(&result).map(Some)
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let (mut data, mut classes, mut courses): (Vec<String>, Vec<String>, Vec<Merged>) = Default::default();
        for case in Case::all(plan) {
            let Some(unit) = units.get(&case.name()) else { continue };
            let result: GraspsResult = unit.read()?;
            result.data.iter().for_each(|line| add_new(&mut data, line));
            classes = result.classes;
            for course in result.courses {
                let kind = [case.sensors.name().to_owned(), case.method.key.to_owned(), course.placed, course.combined];
                match courses.iter_mut().find(|merged| merged.kind == kind) {
                    Some(merged) => merged.rounds.extend(course.rounds),
                    None => courses.push(Merged { kind, rounds: course.rounds }),
                }
            }
        }
        courses.retain(|merged| !merged.rounds.is_empty());
        let mut table = StudyTable::new(
            CARD.key,
            format!("Successive grasps, {}", plan.described()),
            &[
                ("sensors", ""),
                ("model", ""),
                ("object", ""),
                ("combined by", ""),
                ("grasps", ""),
                ("F1", PERCENT),
                ("accuracy", PERCENT),
                ("rounds", ""),
            ],
        );
        let mut stops = StudyTable::new(
            "grasps-stops",
            format!(
                "Grasping until one object has a probability of {:.0} %, at most {MOST} times",
                100.0 * StopRule::default().threshold
            ),
            &[
                ("sensors", ""),
                ("model", ""),
                ("object", ""),
                ("combined by", ""),
                ("mean grasps", ""),
                ("stopped when sure", PERCENT),
                ("wrong of these", PERCENT),
                ("right in all", PERCENT),
                ("rounds", ""),
            ],
        );
        for merged in &courses {
            let named: Vec<Cell> = merged.kind.iter().map(Cell::text).collect();
            for grasps in 1..=merged.most() {
                let pool = merged.after(&classes, grasps);
                let numbers = vec![
                    Cell::Number(grasps as f64),
                    Cell::interval(pool.f1()),
                    Cell::interval(pool.accuracy()),
                    Cell::Number(pool.len() as f64),
                ];
                table.push([named.clone(), numbers].concat(), pool.misjudged());
            }
            let (cells, wrong) = merged.stops();
            stops.push([named, cells].concat(), wrong);
        }
        let findings = findings(&classes, &courses);
        Ok(StudyReport::new(data, vec![table, stops], findings))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table)).into_iter().collect()
    }
}

/// Rounds of one kind over all parts: sensors, model, way to place the object, way to combine grasps.
struct Merged {
    kind: [String; 4],
    rounds: Vec<CourseRound>,
}

impl Merged {
    /// Grasps that every round has, at most; rounds that an unsound grasp cut short end earlier.
    fn most(&self) -> usize {
        let mut lengths: Vec<usize> = self.rounds.iter().map(|round| round.decided.len()).collect();
        lengths.sort_unstable();
        lengths.get(lengths.len() / 10).copied().unwrap_or(0)
    }

    /// Decisions after some grasps, of the rounds that have as many as all kinds of tables need.
    fn after(&self, classes: &[String], grasps: usize) -> Pool {
        let most = self.most();
        let whole = self.rounds.iter().filter(|round| round.decided.len() >= most);
        Pool::of_decisions(classes, whole.map(|round| (round.first, round.truth, round.decided[grasps - 1])))
    }

    /// Cells of the table of stops, and some rounds that stopped wrongly.
    fn stops(&self) -> (Vec<Cell>, Vec<TrialId>) {
        let sure: Vec<&CourseRound> = self.rounds.iter().filter(|round| round.sure).collect();
        let wrong: Vec<TrialId> = sure.iter().filter(|round| !round.is_right()).map(|round| round.first).collect();
        let right = self.rounds.iter().filter(|round| round.is_right()).count();
        let grasps: usize = self.rounds.iter().map(|round| round.stopped).sum();
        let cells = vec![
            Cell::Number(grasps as f64 / self.rounds.len() as f64),
            Cell::Interval(Interval::of_share(sure.len(), self.rounds.len())),
            Cell::interval((!sure.is_empty()).then(|| Interval::of_share(wrong.len(), sure.len()))),
            Cell::Interval(Interval::of_share(right, self.rounds.len())),
            Cell::Number(self.rounds.len() as f64),
        ];
        (cells, wrong.into_iter().take(SHOWN).collect())
    }
}

fn findings(classes: &[String], courses: &[Merged]) -> Vec<Finding> {
    let rule = "Agrees where every paired 95 % interval is above zero, disagrees where one is below";
    // The paper's figure: the iterated network with feedback; the object is put down anew.
    let papers: Vec<&Merged> = courses.iter().filter(|merged| merged.kind[3] == FEEDBACK).collect();
    let named = |merged: &Merged| merged.kind[..3].join(", ");
    let gain = |merged: &Merged, from: usize, to: usize| -> Option<Interval> {
        let to = to.min(merged.most());
        (from < to).then(|| merged.after(classes, to).against(&merged.after(classes, from)))?.map(|gain| gain.f1)
    };
    let rising: Vec<(String, Gains)> = papers
        .iter()
        .map(|merged| {
            let gains =
                gain(merged, 1, STEADY).map(|gain| (format!("from one to {} grasps", STEADY.min(merged.most())), gain));
            (named(merged), gains.into_iter().collect())
        })
        .collect();
    let (mut found, mut verdicts) = (Vec::new(), Vec::new());
    for merged in &papers {
        let Some(late) = gain(merged, STEADY, MOST) else { continue };
        found.push(format!(
            "{}: {} points of macro F1 from {STEADY} to {} grasps",
            named(merged),
            points(late),
            merged.most()
        ));
        verdicts.push(if late.high < NO_CHANGE {
            Agreement::Agrees
        } else if late.low > NO_CHANGE {
            Agreement::Disagrees
        } else {
            Agreement::Partly
        });
    }
    let against_product: Vec<(String, Gains)> = papers
        .iter()
        .map(|merged| {
            let twin = |other: &&Merged| other.kind[..3] == merged.kind[..3] && other.kind[3] == PRODUCT;
            let most = STEADY.min(merged.most());
            let gain = courses
                .iter()
                .find(twin)
                .and_then(|other| merged.after(classes, most).against(&other.after(classes, most)));
            (
                named(merged),
                gain.map(|gain| (format!("over the {PRODUCT} after {most}"), gain.f1)).into_iter().collect(),
            )
        })
        .collect();
    let wrong = papers.iter().filter(|merged| merged.kind[2] == ANEW).map(|merged| {
        let sure = merged.rounds.iter().filter(|round| round.sure);
        let (count, wrong) = sure.fold((0, 0), |(n, wrong), round| (n + 1, wrong + usize::from(!round.is_right())));
        (merged.kind[..2].join(", "), count, Interval::of_share(wrong, count))
    });
    let wrong: Vec<(String, usize, Interval)> = wrong.filter(|(_, count, _)| *count > 0).collect();
    let promised = 1.0 - StopRule::default().threshold;
    let verdict = |share: &Interval| match (share.high < promised, share.low > promised) {
        (true, _) => Agreement::Agrees,
        (_, true) => Agreement::Disagrees,
        (false, false) => Agreement::Partly,
    };
    let listed = wrong.iter().map(|(kind, count, share)| {
        let [estimate, low, high] = [share.estimate, share.low, share.high].map(|x| 100.0 * x);
        format!("{kind}: {estimate:.1} % ({low:.1} to {high:.1}) of {count} confident stops are wrong")
    });
    vec![
        finding_on_gains(("V-E", "Accuracy and F1 rise over successive grasps", rule), &rising, better_than_each),
        finding(
            (
                "V-E",
                "Performance is steady after three or four grasps; further grasps add nothing",
                "Agrees where the paired 95 % interval of the gain from four to eight grasps stays below one point, disagrees where it is \
                 above",
            ),
            found.join("; "),
            Agreement::of_all(verdicts),
        ),
        finding_on_gains(
            (
                "V-E",
                "Feeding back the probabilities of earlier grasps uses them better than treating grasps as independent",
                rule,
            ),
            &against_product,
            better_than_each,
        ),
        finding(
            (
                "VI",
                "A threshold on the probability makes the decision confident",
                "Agrees where the 95 % interval of wrong decisions among confident ones stays below one minus the threshold",
            ),
            listed.collect::<Vec<_>>().join("; "),
            Agreement::of_all(wrong.iter().map(|(_, _, share)| verdict(share))),
        ),
    ]
}

/// A plot for each sensor model and way to place the object, one line per model and way to combine.
fn figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    let mut names: Vec<String> = Vec::new();
    let named = |row: usize| format!("{}, {}", table.text(row, "model"), table.text(row, "combined by"));
    (0..table.rows.len()).for_each(|row| add_new(&mut names, &named(row)));
    for sensors in table.texts("sensors") {
        for placed in table.texts("object") {
            let rows = table.rows_with(&[("sensors", sensors), ("object", placed)]);
            let mut series = Vec::new();
            for (colour, name) in names.iter().enumerate() {
                let own: Vec<usize> = rows.iter().copied().filter(|row| named(*row) == *name).collect();
                if own.is_empty() {
                    continue;
                }
                for (point, row) in own.iter().enumerate() {
                    let mark = FigureMark::Point(series.len(), point);
                    links.push(FigureLink { plot: plots.len(), mark, table: at, row: *row });
                }
                let shift = 0.06 * (colour as f64 - 0.5 * (names.len() - 1) as f64);
                let points = own.iter().map(|row| {
                    let grasps = table.cell(*row, "grasps").value().unwrap_or(f64::NAN);
                    percent_point(table, *row, "F1", grasps + shift)
                });
                let line = if name.ends_with(FEEDBACK) { LineStyle::Bold } else { LineStyle::Thin };
                series.push(DataSeries {
                    name: name.clone(),
                    colour,
                    line,
                    marker: Marker::of_series(colour),
                    points: points.collect(),
                });
            }
            if !series.is_empty() {
                let most = rows.iter().filter_map(|row| table.cell(*row, "grasps").value()).fold(0.0, f64::max);
                let x = PlotAxis::count("grasps of the object", most as usize);
                let y = PlotAxis::linear(F1_PERCENT);
                plots.push(Plot { title: format!("{sensors} sensors, {placed}"), x, y, series, ..Plot::default() });
            }
        }
    }
    let note = "Macro F1 with 95 % intervals, by bootstrap over rounds.".to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1080, 860], links }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_learn::{Class, Example, Labels};

    #[test]
    fn rounds_follow_the_order_of_grasps() {
        let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
        let example =
            |(id, class, after): (i64, usize, Option<i64>)| Example { id, class, after, ..Example::default() };
        // A chain of three, one of two in another order, and a grasp whose predecessor is left out.
        let made = [
            (1, 0, None),
            (2, 0, Some(1)),
            (5, 1, Some(4)),
            (3, 0, Some(2)),
            (4, 1, None),
            (9, 1, Some(8)),
            (7, 0, None),
        ];
        let labels = Labels { classes: vec![class("ball"), class("cube")], ..Labels::default() };
        let data = Dataset { labels, examples: made.into_iter().map(example).collect(), ..Dataset::default() };
        let ids = |rounds: Vec<Vec<usize>>| -> Vec<Vec<i64>> {
            rounds.iter().map(|round| round.iter().map(|k| data.examples[*k].id).collect()).collect()
        };
        assert_eq!(ids(left_as_released(&data)), [vec![1, 2, 3], vec![4, 5]]);
        // Only the last of the first class was put down anew, and nothing followed it.
        assert_eq!(ids(placed_anew(&data)), [vec![7]]);
        let example = |id: i64| example((id, 0, None));
        let anew = Dataset { examples: (0..3).map(example).collect(), ..data.clone() };
        assert_eq!(placed_anew(&anew), [vec![0, 1, 2], vec![1, 2, 0], vec![2, 0, 1]]);
    }

    #[test]
    fn stops_are_counted_where_they_happen() {
        let round = |decided: &[usize], stopped: usize, sure: bool| CourseRound {
            first: 1,
            truth: 0,
            decided: decided.to_vec(),
            stopped,
            sure,
        };
        let rounds = vec![round(&[1, 0], 2, true), round(&[1, 0], 1, true), round(&[1, 1], 2, false)];
        let merged = Merged { kind: Default::default(), rounds };
        let (cells, wrong) = merged.stops();
        assert_eq!(wrong, [1]);
        assert_eq!(cells[0].value().map(|mean| (mean * 3.0).round()), Some(5.0));
        assert_eq!(cells[2].value(), Some(0.5));
        assert_eq!(merged.most(), 2);
    }
}
