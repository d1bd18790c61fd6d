//! All methods side by side (Fig. 7): scores, paired differences, and what a model costs.

use super::prelude::*;
use palpate_learn::comparison::in_table_order;

pub(super) struct Models;

/// The paper's model, strict and tuned.
const PAPERS_MODEL: &str = "paper-ds-lstm";
const TUNED: &str = "ds-lstm";

/// Numbers of training grasps of the objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Balance {
    Balanced,
    /// 40 to 55 of each object, as in the paper, or the same share of fewer.
    Imbalanced,
}

impl Factor for Balance {
    fn name(&self) -> String {
        if *self == Self::Balanced { "balanced" } else { "imbalanced" }.to_owned()
    }
}

/// True for networks that are trained many times.
fn is_costly(method: &Method) -> bool {
    method.recipe.is_some_and(|recipe| recipe().cross_fitted)
}

/// True for the paper's model and what it is compared with.
fn is_of_papers_table(method: &Method) -> bool {
    matches!(method.kind, MethodKind::Single | MethodKind::Ensemble) || [PAPERS_MODEL, TUNED].contains(&method.key)
}

/// Name of a kind of data in tables.
fn grasps(kind: &Kind<Balance>) -> String {
    format!("{}, {}", kind.sensors.name(), kind.factor.name())
}

impl Crossing for Models {
    type Factor = Balance;

    const CARD: StudyCard = StudyCard {
        key: "models",
        title: "Comparison of methods",
        about: "all methods on the same grasps: macro F1 and accuracy, paired differences, cost of training and answers",
        paper: "Fig. 7",
    };

    fn grid(plan: &StudyPlan) -> Vec<Fit<Balance>> {
        let methods: Vec<&str> = in_table_order().into_iter().map(|method| method.key).collect();
        crossed(plan, &[Balance::Balanced, Balance::Imbalanced], &methods, |kind| match kind.factor {
            Balance::Balanced if is_costly(kind.method) => 1,
            Balance::Balanced => kind.usual_parts(plan),
            // Imbalance is measured only for the paper's comparison.
            Balance::Imbalanced => {
                usize::from(plan.sensors.first() == Some(&kind.sensors) && is_of_papers_table(kind.method))
            }
        })
    }

    fn sets(Fit { kind, part }: &Fit<Balance>, bench: &StudyData<'_>) -> Result<[Dataset; 2], StudyError> {
        let (plan, is_imbalanced) = (bench.plan(), kind.factor == Balance::Imbalanced);
        let train = if is_imbalanced { TRAIN * 55 / 50 } else { TRAIN };
        let part = TestPart { train, ..TestPart::usual(plan, *part) };
        let [mut train, test] = bench.split(usual_grasps(plan, kind.sensors), kind.method, part)?;
        if is_imbalanced {
            let most = train.by_class().iter().map(Vec::len).max().unwrap_or(0);
            train = train.imbalanced((40 * most).div_ceil(55)..=most, plan.seed);
        }
        Ok([train, test])
    }

    fn compared(rows: &mut [Row<Balance>]) {
        for rows in rows.chunk_by_mut(|a, b| grasps(&a.kind) == grasps(&b.kind)) {
            compare(rows, |kind| Some(Kind { method: method(PAPERS_MODEL)?, ..*kind }));
        }
    }

    fn report(plan: &StudyPlan, rows: &[Row<Balance>]) -> (Vec<StudyTable>, Vec<Finding>) {
        let title = format!(
            "Methods on grasps that none has seen, {}; differences to {PAPERS_MODEL} {SHARED}",
            plan.described()
        );
        let table = Row::table("models", title, rows).columns(&[
            Column("grasps", "", &|row: &Row<Balance>| grasps(&row.kind).into()),
            Row::MODEL,
            Column("kind", "", &|row| row.kind.method.kind.name().into()),
            Row::F1,
            Row::ACCURACY,
            Row::gain("F1 against the paper's model"),
            Row::HOLM,
            Column("ECE", "", &|row| row.mean(|answers| Some(answers.ece)).into()),
            Column("training", "CPU s", &|row| row.mean(|answers| Some(answers.cost.train_cpu_s)).into()),
            Column("live step", "µs", &|row| row.mean(|answers| answers.cost.step_us).into()),
            Column("whole grasp", "ms", &|row| row.mean(|answers| Some(answers.cost.answer_ms)).into()),
            Column("model file", "kB", &|row| row.cost().map(|cost| cost.bytes as f64 / 1e3).into()),
            Column("parameters", "", &|row| row.cost().map(|cost| cost.parameters as f64).into()),
            Row::TESTED,
            Column("remark", "", &|row| row.remark().into()),
        ]);
        (vec![table], findings(rows))
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let plot = |line: TableLine<'_>| line.text("grasps").to_owned();
        let series = |line: TableLine<'_>| line.text("kind").to_owned();
        let facets = Facets { plot: &plot, series: &series, size: [1080, 900], ..Facets::USUAL };
        let Some(mut figure) = facets.plots(report, "models") else { return Vec::new() };
        figure.plots.push(Plot {
            title: "Cost".to_owned(),
            x: PlotAxis::logarithmic("CPU time of training (s)"),
            y: PlotAxis::linear(F1_PERCENT),
            ..Plot::default()
        });
        let first = figure.lines().next().map_or("", |line| line.text("grasps"));
        for (colour, group) in unique(figure.lines().map(|line| line.text("kind"))).into_iter().enumerate() {
            let points = figure.lines_with(&[("grasps", first), ("kind", group)]).into_iter().map(|line| {
                let label = line.text("model").to_owned();
                (line, DataPoint { label, ..line.percent("F1", line.value("training")) })
            });
            figure.series(DataSeries { name: group.to_owned(), ..dots(colour) }, points);
        }
        vec![Some(figure.figure("models", facets.columns, facets.size, facets.note))]
    }
}

/// Networks are tested on fewer grasps than the others.
const SHARED: &str = "on the grasps that both were tested on";

fn findings(rows: &[Row<Balance>]) -> Vec<Finding> {
    // Gains of the paper's model over others of each kind of data, worst first.
    let gains = |claim: &str, why: &str, factor: Balance, group: MethodKind, rule: Rule| {
        let own = rows.iter().filter(|row| row.kind.factor == factor && row.kind.method.kind == group);
        let named = |row: &Row<Balance>| {
            Some((grasps(&row.kind), (format!("{PAPERS_MODEL} over {}", row.kind.method.key), negated(row.gain?))))
        };
        let mut gains = grouped(own.filter_map(named));
        gains.iter_mut().for_each(|(_, gains)| gains.sort_by(|a, b| a.1.estimate.total_cmp(&b.1.estimate)));
        Claim("V-D", claim, &format!("{why}. Differences {SHARED}")).on_gains(rule, gains)
    };
    let (balanced, above) = (Balance::Balanced, Rule::AllAbove(0.0));
    vec![
        gains("The dual-stage LSTM is better than every single model", ALL_GAIN, balanced, MethodKind::Single, above),
        gains(
            "The dual-stage LSTM is at least as good as every ensemble, and comparable to RUSBoost",
            "Disagrees where the paired 95 % interval of an ensemble excludes zero in its favour",
            balanced,
            MethodKind::Ensemble,
            Rule::NoneBelow(0.0),
        ),
        gains(
            "The dual-stage LSTM is particularly effective on imbalanced data",
            ALL_GAIN,
            Balance::Imbalanced,
            MethodKind::Single,
            above,
        ),
        costs(rows),
    ]
}

fn costs(rows: &[Row<Balance>]) -> Finding {
    let claim = Claim(
        "VI",
        "The dual-stage LSTM is as precise as ensembles and costs less",
        "Agrees where both its training and its answer to a grasp take less CPU time than those of every ensemble, disagrees where \
         both take more. The lines are the times of the dual-stage LSTM",
    );
    let cost = |row: &Row<Balance>| -> Option<[f64; 2]> {
        let answer_ms = row.mean(|answers| Some(answers.cost.answer_ms))?;
        Some([row.mean(|answers| Some(answers.cost.train_cpu_s))?, answer_ms])
    };
    let costs = |is_wanted: &dyn Fn(&Method) -> bool| -> Vec<(&str, [f64; 2])> {
        let own = rows.iter().filter(|row| grasps(&row.kind) == grasps(&rows[0].kind) && is_wanted(row.kind.method));
        own.filter_map(|row| Some((row.kind.method.key, cost(row)?))).collect()
    };
    let papers = costs(&|method| method.key == PAPERS_MODEL);
    let (mut measured, mut verdicts) = (Vec::new(), Vec::new());
    for (at, what, unit) in [(0, "training", "CPU s"), (1, "answer to a grasp", "ms")] {
        for (key, cost) in costs(&|method| method.kind == MethodKind::Ensemble) {
            let Some((_, papers)) = papers.first() else { continue };
            measured.push(ClaimNumber::new(format!("{key}: {what}"), Some(cost[at]), unit, papers[at]));
            verdicts.push(if papers[at] < cost[at] { Agreement::Agrees } else { Agreement::Disagrees });
        }
    }
    let sentences = [
        "Every ensemble takes more CPU time than the paper's model, for both.",
        "Some ensembles take more CPU time than the paper's model, others less.",
        "Every ensemble takes less CPU time than the paper's model, for both.",
    ];
    claim.finding(measured, Agreement::of_all(verdicts), sentences)
}
