//! Successive grasps of one object (Fig. 8): put down anew between them, or left as the fingers released it.
//!
//! Grasps are combined in two ways: the iterated network is fed with the probabilities of those before, and the product of
//! experts multiplies the probabilities of each grasp alone.

use super::prelude::*;
use palpate_lab::datasets::SensorView;
use palpate_lab::grasping::SUCCESSION;
use palpate_learn::{StopReason, StopRule};
use palpate_sim::scene::Between;
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Grasps;

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

/// Result of a unit.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct GraspsResult {
    data: Vec<String>,
    classes: Vec<String>,
    courses: Vec<ConfidenceByGrasp>,
}

/// Rounds of successive grasps, combined in one way.
#[derive(Clone, Serialize, Deserialize)]
struct ConfidenceByGrasp {
    placed: String,
    combined: String,
    rounds: Vec<CourseRound>,
}

/// A round: grasps in a row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct CourseRound {
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

impl Study for Grasps {
    type Cell = Fit<()>;
    type Found = GraspsResult;

    const CARD: StudyCard = StudyCard {
        key: "grasps",
        title: "Successive grasps",
        about: "accuracy and F1 after one to eight grasps, put down anew or left as released, by feedback and by product of \
                experts, and confident stops that are wrong",
        paper: "Fig. 8",
    };

    fn grid(plan: &StudyPlan) -> Vec<Self::Cell> {
        crossed(plan, &[()], &MODELS, |kind| kind.usual_parts(plan))
    }

    fn measure(Fit { kind, part }: &Self::Cell, bench: &StudyData<'_>) -> Result<GraspsResult, StudyError> {
        let plan = bench.plan();
        let wanted = usual_grasps(plan, kind.sensors).read_by(kind.method);
        let [train, test] = bench.split(wanted.clone(), kind.method, TestPart::usual(plan, *part))?;
        // Stored trials hold both, told apart by the trial before them.
        let released =
            DataWanted { between: Between::AsReleased, grasps: plan.grasps(RELEASED, 2 * MOST), ..wanted.clone() };
        let released = bench.data(if plan.query.is_some() { &wanted } else { &released })?;
        let model = bench.fit(kind.method, &train)?;
        // Grasps that the model has learned from belong to no round.
        let learned: Vec<u64> = train.examples.iter().map(|example| example.content).collect();
        let mut released_rounds = left_as_released(&released);
        released_rounds.retain(|round| round.iter().all(|k| !learned.contains(&released.examples[*k].content)));
        let anew_rounds = placed_anew(&test);
        let Some(in_order) = released.relabelled(&test.labels) else {
            return Err(StudyError::missing("the same objects in both ways to place them"));
        };
        let mut courses = Vec::new();
        for (placed, data, rounds) in [(ANEW, &test, &anew_rounds), (LEFT, &in_order, &released_rounds)] {
            let alone: Vec<Pmf> =
                data.examples.iter().map(|example| model.recogniser.recognise(&example.grasp, None).pmf).collect();
            let is_iterated = kind.method.recipe.is_some_and(|recipe| recipe().iterated);
            for (combined, feedback) in [(PRODUCT, false), (FEEDBACK, true)] {
                if !feedback || is_iterated {
                    let rounds = course(&model, data, &alone, rounds, feedback);
                    courses.push(ConfidenceByGrasp {
                        placed: placed.to_owned(),
                        combined: combined.to_owned(),
                        rounds,
                    });
                }
            }
        }
        let described = |data: &Dataset, placed: &str| format!("{}, {placed}", data.about.described());
        Ok(GraspsResult {
            data: vec![described(&test, ANEW), described(&in_order, LEFT)],
            classes: test.labels.classes.iter().map(|class| class.name.clone()).collect(),
            courses,
        })
    }

    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, GraspsResult)>) -> StudyReport {
        let data = unique(found.iter().flat_map(|(_, result)| result.data.clone()));
        let classes = found.last().map_or_else(Vec::new, |(_, result)| result.classes.clone());
        let courses = found.into_iter().flat_map(|(fit, result)| {
            let kind = move |course: ConfidenceByGrasp| (fit.kind.with(Way::of(&course)), course.rounds);
            result.courses.into_iter().map(kind)
        });
        let merged = grouped(courses).into_iter().map(|(kind, rounds)| Merged { kind, rounds: rounds.concat() });
        let merged: Vec<Merged> = merged.filter(|merged| !merged.rounds.is_empty()).collect();
        let rows: Vec<Row<(Way, usize)>> =
            merged.iter().flat_map(|own| (1..=own.most()).map(|grasps| own.after(&classes, grasps))).collect();
        let table = Row::table("grasps", format!("Successive grasps, {}", plan.described()), &rows).columns(&[
            Row::SENSORS,
            Row::MODEL,
            Column("object", "", &|row| row.kind.factor.0.placed.into()),
            Column("combined by", "", &|row| row.kind.factor.0.combined.into()),
            Column("grasps", "", &|row| row.kind.factor.1.into()),
            Row::F1,
            Row::ACCURACY,
            Column("rounds", "", &|row| row.pool.len().into()),
        ]);
        StudyReport::new(data, vec![table, stops_table(&merged)], findings(&rows, &merged))
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let named = |line: TableLine<'_>| format!("{}, {}", line.text("model"), line.text("combined by"));
        let axis = |lines: &[TableLine<'_>]| {
            let most = lines.iter().map(|line| line.value("grasps")).fold(0.0, f64::max);
            PlotAxis::count("grasps of the object", most as usize)
        };
        let facets = Facets {
            plot: &|line| format!("{} sensors, {}", line.text("sensors"), line.text("object")),
            series: &named,
            along: Along::Axis(&axis, &|line| line.value("grasps")),
            shift: 0.06,
            look: &|name, colour| lines(colour, name.ends_with(FEEDBACK)),
            size: [1080, 860],
            note: "Macro F1 with 95 % intervals, by bootstrap over rounds.",
            ..Facets::USUAL
        };
        vec![facets.figure(report, "grasps")]
    }
}

/// Ways to place the object and to combine grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Way {
    placed: &'static str,
    combined: &'static str,
}

impl Way {
    fn of(course: &ConfidenceByGrasp) -> Self {
        let placed = if course.placed == ANEW { ANEW } else { LEFT };
        Self { placed, combined: if course.combined == FEEDBACK { FEEDBACK } else { PRODUCT } }
    }
}

/// Rounds of one kind over all parts.
struct Merged {
    kind: Kind<Way>,
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
    fn after(&self, classes: &[String], grasps: usize) -> Row<(Way, usize)> {
        let most = self.most();
        let whole = self.rounds.iter().filter(|round| round.decided.len() >= most);
        let decisions = whole.map(|round| (round.first, round.truth, round.decided[grasps - 1]));
        Row::of_pool(self.kind.with((self.kind.factor, grasps)), Pool::of_decisions(classes, decisions))
    }

    fn share(&self, is: impl Fn(&CourseRound) -> bool, of: impl Fn(&CourseRound) -> bool) -> Option<Interval> {
        let all: Vec<&CourseRound> = self.rounds.iter().filter(|round| of(round)).collect();
        let count = all.iter().filter(|round| is(round)).count();
        (!all.is_empty()).then(|| Interval::of_share(count, all.len()))
    }

    /// Share of wrong decisions among confident ones.
    fn wrong(&self) -> Option<Interval> {
        self.share(|round| !round.is_right(), |round| round.sure)
    }

    fn mean_grasps(&self) -> f64 {
        self.rounds.iter().map(|round| round.stopped).sum::<usize>() as f64 / self.rounds.len() as f64
    }

    /// Some rounds that stopped wrongly.
    fn misjudged(&self) -> Vec<TrialId> {
        let wrong = self.rounds.iter().filter(|round| round.sure && !round.is_right());
        wrong.map(|round| round.first).take(SHOWN).collect()
    }
}

fn stops_table(all: &[Merged]) -> StudyTable {
    let sure = 100.0 * StopRule::default().threshold;
    let title = format!("Grasping until one object has a probability of {sure:.0} %, at most {MOST} times");
    let sensors = |own: &Merged| Some(SensorView { sensors: own.kind.sensors, ..SensorView::default() });
    TableRows::new("grasps-stops", title, all).with_trials(&Merged::misjudged).read_through(&sensors).columns(&[
        Column("sensors", "", &|own| own.kind.sensors.name().into()),
        Column("model", "", &|own| own.kind.method.key.into()),
        Column("object", "", &|own| own.kind.factor.placed.into()),
        Column("combined by", "", &|own| own.kind.factor.combined.into()),
        Column("mean grasps", "", &|own| Some(own.mean_grasps()).into()),
        Column("stopped when sure", PERCENT, &|own| own.share(|round| round.sure, |_| true).into()),
        Column("wrong of these", PERCENT, &|own| own.wrong().into()),
        Column("right in all", PERCENT, &|own| own.share(CourseRound::is_right, |_| true).into()),
        Column("rounds", "", &|own| own.rounds.len().into()),
    ])
}

fn findings(rows: &[Row<(Way, usize)>], all: &[Merged]) -> Vec<Finding> {
    // The paper's figure: the iterated network with feedback.
    let most =
        |kind: &Kind<(Way, usize)>| all.iter().find(|own| own.kind == kind.with(kind.factor.0)).map_or(0, Merged::most);
    let named =
        |kind: &Kind<(Way, usize)>| format!("{}, {}, {}", kind.model(), kind.factor.0.combined, kind.factor.0.placed);
    // Gain of grasps after some over fewer, or by feedback over the product.
    let gains = |at: usize, name: &dyn Fn(usize) -> String, other: &dyn Fn(Way) -> (Way, usize)| {
        gains_over(rows, |kind| {
            let (way, grasps) = kind.factor;
            let (is_last, (other, from)) = (grasps == at.min(most(kind)), other(way));
            let is_wanted = is_last && way.combined == FEEDBACK && (other, from) != (way, grasps);
            let found = || (named(kind), name(grasps), kind.with((other, if from == 0 { grasps } else { from })));
            is_wanted.then(found)
        })
    };
    let rising = gains(STEADY, &|to| format!("from one to {to} grasps"), &|way| (way, 1));
    let over_product =
        gains(STEADY, &|to| format!("over the {PRODUCT} after {to}"), &|way| (Way { combined: PRODUCT, ..way }, 0));
    let late = gains(MOST, &|to| format!("from {STEADY} to {to} grasps"), &|way| (way, STEADY));
    let papers = all.iter().filter(|own| own.kind.factor == Way { placed: ANEW, combined: FEEDBACK });
    let wrong = papers.filter_map(|own| {
        let count = own.rounds.iter().filter(|own| own.sure).count();
        let named = format!("{}, {FEEDBACK}, {ANEW}", own.kind.model());
        Some((format!("{named}: wrong of {count} confident stops"), own.wrong()?))
    });
    let above = Rule::AllAbove(0.0);
    vec![
        Claim("V-E", "Accuracy and F1 rise over successive grasps", ALL_GAIN).on_gains(above, rising),
        Claim(
            "V-E",
            "Performance is steady after three or four grasps; further grasps add nothing",
            "Agrees where the paired 95 % interval of the gain from four to eight grasps stays below one point, disagrees where it is \
             above",
        )
        .on_gains(Rule::AllBelow(NO_CHANGE), late),
        Claim(
            "V-E",
            "Feeding back the probabilities of earlier grasps uses them better than treating grasps as independent",
            ALL_GAIN,
        )
        .on_gains(above, over_product),
        Claim(
            "VI",
            "A threshold on the probability makes the decision confident",
            "Agrees where the 95 % interval of wrong decisions among confident ones stays below one minus the threshold",
        )
        .on_each(PERCENT, Rule::AllBelow(1.0 - StopRule::default().threshold), wrong),
    ]
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
        let method = palpate_learn::method("ids-lstm").expect("known");
        let factor = Way { placed: ANEW, combined: FEEDBACK };
        let merged =
            Merged { kind: Kind { sensors: palpate_tactile::model::SensorModel::Virtual, method, factor }, rounds };
        assert_eq!((merged.misjudged(), (merged.mean_grasps() * 3.0).round()), (vec![1], 5.0));
        assert_eq!(merged.wrong().map(|wrong| wrong.estimate), Some(0.5));
        assert_eq!(merged.most(), 2);
    }
}
