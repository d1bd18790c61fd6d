//! Sensor layouts (Fig. 5a): which are enough.

use super::prelude::*;
use palpate_sim::gripper::GripperModel;
use palpate_tactile::{CATALOGUE, SensorLayout, SignalDefinition};

pub(super) struct Layouts;

/// The paper's network and that of Zuo et al., to which the paper compares it, both as published; and a method that is
/// trained in seconds.
const MODELS: [&str; 3] = ["paper-macro-layer", "zuo", "extra-trees"];
/// The simplest layout, which the paper chooses.
const SIMPLEST: &str = "C1";
/// Gain below which two layouts are as good as each other.
const MINIMAL: f64 = 0.02;

/// Signals of a layout: its name, and what they are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Signals {
    layout: String,
    definition: SignalDefinition,
}

impl Signals {
    fn of(layout: impl Into<String>, definition: SignalDefinition) -> Self {
        Self { layout: layout.into(), definition }
    }

    /// All layouts as real sensors measure them; all with the contact pressure that only a simulation knows, without and with
    /// force; and C1 with pressure over the hull of the contacts, as in the paper.
    fn all() -> Vec<Self> {
        let of = |definition, force: &'static str| {
            CATALOGUE.iter().map(move |layout| Self::of(format!("{}{force}", layout.name), definition))
        };
        of(SignalDefinition::Parts, "")
            .chain(of(SignalDefinition::Contact, ""))
            .chain(of(SignalDefinition::Contact, "+F"))
            .chain([Self::of(SIMPLEST, SignalDefinition::Hull)])
            .collect()
    }

    /// True for what can be built.
    fn are_of_parts(&self) -> bool {
        self.definition == SignalDefinition::Parts
    }

    fn name(&self) -> String {
        if self.are_of_parts() { self.layout.clone() } else { format!("{} {}", self.layout, self.definition.name()) }
    }

    /// Number of channels on both fingers.
    fn channels(&self) -> Option<usize> {
        let layout = SensorLayout::named(&self.layout).ok()?;
        Some(layout.channels(&GripperModel::default(), self.definition).ok()?.len())
    }
}

impl Factor for Signals {
    fn named(&self, sensors: &str, method: &str) -> String {
        format!("{sensors}, {}, {method}", self.name())
    }
}

impl Study for Layouts {
    type Cell = Fit<Signals>;
    type Found = TestAnswers;

    const CARD: StudyCard = StudyCard {
        key: "layouts",
        title: "Sensor layouts",
        about: "layouts C1 to C8 of real parts and of contact pressure, with and without force, and the layout with the fewest channels that is as good as the best",
        paper: "Fig. 5a",
        budget: "about 40 CPU minutes",
    };

    fn grid(plan: &StudyPlan) -> Vec<Self::Cell> {
        crossed(plan, &Signals::all(), &MODELS, |Kind { sensors, method, factor }| {
            let (of_parts, simple) = (factor.are_of_parts(), [SIMPLEST, "C1+F"].contains(&factor.layout.as_str()));
            let is_wanted = if method.recipe.is_none() {
                of_parts || *sensors != SensorModel::PhysicalLike
            } else {
                // A network takes minutes to train: perfect sensors only, and of the simulation's own signals only C1.
                let in_full = of_parts || (simple && method.key == MODELS[0]);
                let wanted = if plan.size == StudySize::Full { in_full } else { of_parts && simple };
                wanted && *sensors == SensorModel::Virtual
            };
            if is_wanted { plan.pick(if method.recipe.is_some() { 1 } else { PARTS }, 1, 1) } else { 0 }
        })
    }

    fn measure(Fit { kind, part }: &Self::Cell, bench: &StudyData<'_>) -> Result<TestAnswers, StudyError> {
        let mut wanted = usual_grasps(bench.plan(), kind.sensors);
        (wanted.view.layout, wanted.view.signals) = (kind.factor.layout.clone(), kind.factor.definition);
        let sets = bench.split(wanted, kind.method, TestPart::usual(bench.plan(), *part))?;
        if sets[0].about.object == "recorded" {
            let what = "simulated trials: the channels of recorded and imported trials are fixed";
            return Err(StudyError::Missing(what.to_owned()));
        }
        bench.judge(kind.method, &sets)
    }

    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, TestAnswers)>) -> StudyReport {
        let mut rows = pooled(found.into_iter().map(|(fit, judged)| (fit.kind, judged)));
        compare(&mut rows, |kind| Some(kind.with(Signals::of(SIMPLEST, SignalDefinition::Parts))));
        let title = format!("Sensor layouts, {}; differences to {SIMPLEST}", plan.described());
        let chosen = recommended(&rows);
        let tables = vec![
            Row::table("layouts", title, &rows).columns(&[
                Row::SENSORS,
                Row::MODEL,
                Column("layout", "", &|row| row.kind.factor.name().into()),
                Column("channels", "", &|row| row.kind.factor.channels().into()),
                Row::F1,
                Row::ACCURACY,
                Row::gain("F1 against C1"),
                Row::HOLM,
                Row::TESTED,
            ]),
            recommended_table(&chosen),
        ];
        StudyReport::new(described(&rows), tables, vec![simplest_is_enough(&rows), better_than_zuo(&rows)])
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let along = Along::Rows(&|line| line.text("layout").to_owned());
        vec![Facets { along, shift: [0.2, -0.2], ..Facets::USUAL }.figure(report, "layouts")]
    }
}

/// The best layout of parts, and the one with the fewest channels whose F1 lies inside the interval of the best.
type Recommended<'a> = [&'a Row<Signals>; 2];

fn f1(row: &Row<Signals>) -> f64 {
    row.f1.map_or(f64::NEG_INFINITY, |f1| f1.estimate)
}

fn recommended(rows: &[Row<Signals>]) -> Vec<Recommended<'_>> {
    let channels = |row: &Row<Signals>| row.kind.factor.channels().unwrap_or(usize::MAX);
    let of_model = by_model(rows).into_iter().filter_map(|own| {
        let own = own.into_iter().filter(|row| row.kind.factor.are_of_parts());
        let best = own.clone().max_by(|a, b| f1(a).total_cmp(&f1(b)))?;
        let low = best.f1?.low;
        let inside = own.filter(|row| f1(row) >= low);
        let fewest = inside.min_by(|a, b| channels(a).cmp(&channels(b)).then(f1(b).total_cmp(&f1(a))))?;
        Some([best, fewest])
    });
    of_model.collect()
}

fn recommended_table(all: &[Recommended<'_>]) -> StudyTable {
    let title = "Fewest channels whose F1 is inside the best layout's 95 % interval";
    TableRows::new("layouts-recommended", title, all).columns(&[
        Column("sensors", "", &|[best, _]| best.kind.sensors.name().into()),
        Column("model", "", &|[best, _]| best.kind.method.key.into()),
        Column("best", "", &|[best, _]| best.kind.factor.name().into()),
        Column("F1 of the best", PERCENT, &|[best, _]| best.f1.into()),
        Column("recommended", "", &|[_, fewest]| fewest.kind.factor.name().into()),
        Column("channels", "", &|[_, fewest]| fewest.kind.factor.channels().into()),
        Column("F1", PERCENT, &|[_, fewest]| fewest.f1.into()),
    ])
}

fn simplest_is_enough(rows: &[Row<Signals>]) -> Finding {
    let most = by_model(rows).into_iter().filter_map(|own| {
        let gains = own.into_iter().filter(|row| row.kind.factor.are_of_parts());
        let gains = gains.filter_map(|row| Some((row, row.gain?)));
        let (row, gain) = gains.max_by(|a, b| a.1.estimate.total_cmp(&b.1.estimate))?;
        Some((format!("{}: {} over {SIMPLEST}", row.kind.model(), row.kind.factor.name()), gain))
    });
    let claim = Claim(
        "V-B",
        "The simplest layout, C1, is enough: more sensors add little or nothing",
        "Agrees where no layout gains more than 2 points over C1, with its paired 95 % interval; disagrees where one gains more. The \
         paper numbers its layouts without saying which is which, but for C1",
    );
    claim.on_each(POINTS, Rule::AllBelow(MINIMAL), most)
}

fn better_than_zuo(rows: &[Row<Signals>]) -> Finding {
    let gains = gains_over(rows, |kind| {
        let other = method(MODELS[1]).filter(|_| kind.method.key == MODELS[0]);
        let over = |method| {
            let name = format!("{} over {}", kind.factor.name(), MODELS[1]);
            (kind.sensors.name().to_owned(), name, Kind { method, ..kind.clone() })
        };
        other.map(over).into_iter().collect()
    });
    let claim = "The macro-layer is more accurate than the network of Zuo et al.";
    let rule = "Agrees where the paired 95 % interval is above zero for every layout, disagrees where one is below";
    Claim("V-B", claim, rule).on_gains(Rule::AllAbove(0.0), gains)
}
