//! How many grasps a model has to learn from (Fig. 6c).

use super::prelude::*;

pub(super) struct TrainingSize;

/// Models of the figure: the paper's and what it is compared with.
const MODELS: [&str; 9] =
    [PAPERS_MODEL, TUNED, "lstm", "decision-tree", "knn", "svm", "random-forest", "rusboost", "extra-trees"];
/// Models that are trained on more grasps than a hand collects in a day.
const BEYOND: [&str; 5] = [PAPERS_MODEL, TUNED, "svm", "random-forest", "extra-trees"];
/// The paper's model, strict and tuned.
const PAPERS_MODEL: &str = "paper-ds-lstm";
const TUNED: &str = "ds-lstm";
/// Training grasps of each object that the paper had.
const USUAL: usize = 50;
/// Grasps of each object to test in each part, and parts.
const TEST: usize = 100;
const PARTS: usize = 3;
/// Most training grasps of each object, and those of methods whose fits take minutes: networks, and support vector machines on
/// noisy readings (16 CPU minutes with 400 grasps of each object, three times that with 800).
const MOST: usize = 800;
const MOST_OF_NOISY_SVM: usize = 400;
const MOST_OF_TUNED: usize = 400;
const MOST_OF_NETWORK: usize = 200;

fn sizes(plan: &StudyPlan) -> &'static [usize] {
    plan.pick(&[5, 10, 20, 50, 100, 200, 400, 800][..], &[5, 10, 20][..], &[2, 4][..])
}

/// Training grasps of each object.
impl Factor for usize {
    fn named(&self, sensors: &str, method: &str) -> String {
        format!("{sensors}, {method} of {self} grasps")
    }
}

/// Most training grasps of each object for a kind of fits; only the first sensors have all.
fn most(kind: &Kind<usize>, is_first: bool) -> usize {
    let most = match (kind.method.recipe.is_some(), is_first) {
        (true, true) if kind.method.key == TUNED => MOST_OF_TUNED,
        (true, true) => MOST_OF_NETWORK,
        (true, false) => USUAL,
        (false, false) if kind.method.key == "svm" => MOST_OF_NOISY_SVM,
        (false, _) => MOST,
    };
    if BEYOND.contains(&kind.method.key) { most } else { most.min(USUAL) }
}

impl Study for TrainingSize {
    type Cell = Fit<usize>;
    type Found = TestAnswers;

    const CARD: StudyCard = StudyCard {
        key: "training-size",
        title: "Size of the training set",
        about: "models over 5 to 800 training grasps of each object (networks and noisy SVMs to fewer), and the fewest that are enough",
        paper: "Fig. 6c",
        budget: "about 140 CPU minutes",
    };

    fn grid(plan: &StudyPlan) -> Vec<Self::Cell> {
        crossed(plan, sizes(plan), &MODELS, |kind| {
            let is_first = plan.sensors.first() == Some(&kind.sensors);
            if kind.factor > most(kind, is_first) {
                return 0;
            }
            let is_costly = kind.method.recipe.is_some() && (!is_first || kind.method.key != PAPERS_MODEL);
            plan.pick(if is_costly || kind.factor > USUAL { 1 } else { PARTS }, 1, 1)
        })
    }

    fn measure(Fit { kind, part }: &Self::Cell, bench: &StudyData<'_>) -> Result<TestAnswers, StudyError> {
        let plan = bench.plan();
        let wanted = plan.wanted(plan.grasps(MOST + TEST, 40), kind.sensors);
        let of = plan.pick((MOST + TEST) / TEST, 2, 3);
        let sets = bench.split(wanted, kind.method, TestPart { of, part: *part, train: kind.factor })?;
        bench.judge(kind.method, &sets)
    }

    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, TestAnswers)>) -> StudyReport {
        let mut rows = pooled(found.into_iter().map(|(fit, judged)| (fit.kind, judged)));
        let kinds: Vec<Kind<usize>> = rows.iter().map(|row| row.kind).collect();
        compare(&mut rows, |kind| {
            let smaller = kinds.iter().filter(|own| **own == Kind { factor: own.factor, ..*kind });
            smaller.filter(|own| own.factor < kind.factor).max_by_key(|own| own.factor).copied()
        });
        let title = format!("Models by the number of training grasps of each object, {}", plan.described());
        let enough = Enough::all(&rows);
        let tables = vec![
            Row::table("training-size", title, &rows).columns(&[
                Row::SENSORS,
                Row::MODEL,
                Column("training grasps", "", &|row| row.kind.factor.into()),
                Row::F1,
                Row::ACCURACY,
                Row::gain("gain of doubling"),
                Row::TESTED,
            ]),
            Enough::table(&enough),
        ];
        StudyReport::new(described(&rows), tables, findings(&rows))
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let axis = |_: &[TableLine<'_>]| PlotAxis::logarithmic("training grasps of each object");
        let figure = Facets {
            along: Along::Axis(&axis, &|line| line.value("training grasps")),
            look: &|model, colour| lines(colour, model == PAPERS_MODEL),
            size: [1080, 520],
            ..Facets::USUAL
        };
        let mut figure = figure.figure(report, "training-size");
        let plots = figure.iter_mut().flat_map(|linked| &mut linked.figure.plots);
        let least = LinkedPlots::of(report, "training-size-least");
        let least = least.map_or_else(Vec::new, |least| least.lines_with(&[("model", PAPERS_MODEL)]));
        for plot in plots {
            let of_sensors = |line: &&TableLine<'_>| plot.title == format!("{} sensors", line.text("sensors"));
            let Some(line) = least.iter().find(of_sensors) else { continue };
            let [at, largest] = ["for that of the largest", "largest"].map(|column| line.value(column));
            let text = if at < largest {
                format!("{at:.0} are enough for {PAPERS_MODEL}")
            } else {
                format!("{PAPERS_MODEL}: fewer than {at:.0} are not enough")
            };
            plot.references.extend((!at.is_nan()).then_some(ReferenceLine { horizontal: false, at, text }));
        }
        vec![figure]
    }
}

/// Fewest training grasps of a model whose interval reaches the interval of the usual number, and of the largest.
struct Enough {
    kind: Kind<usize>,
    of_usual: Option<usize>,
    of_largest: Option<usize>,
    largest: usize,
}

impl Enough {
    fn all(rows: &[Row<usize>]) -> Vec<Self> {
        let of_model = by_model(rows).into_iter().filter_map(|own| {
            let reaching = |wanted: Option<&&Row<usize>>| -> Option<usize> {
                let low = wanted?.f1?.low;
                Some(own.iter().find(|row| row.f1.is_some_and(|f1| f1.high >= low))?.kind.factor)
            };
            let usual = own.iter().find(|row| row.kind.factor == USUAL);
            let kind = own.last()?.kind;
            Some(Self { kind, of_usual: reaching(usual), of_largest: reaching(own.last()), largest: kind.factor })
        });
        of_model.collect()
    }

    fn table(all: &[Self]) -> StudyTable {
        let title = format!(
            "Fewest training grasps of each object whose 95 % interval reaches that of {USUAL}, and of the largest number"
        );
        TableRows::new("training-size-least", title, all).columns(&[
            Column("sensors", "", &|own| own.kind.sensors.name().into()),
            Column("model", "", &|own| own.kind.method.key.into()),
            Column("for that of 50", "grasps", &|own| own.of_usual.into()),
            Column("for that of the largest", "grasps", &|own| own.of_largest.into()),
            Column("largest", "grasps", &|own| own.largest.into()),
        ])
    }
}

fn findings(rows: &[Row<usize>]) -> Vec<Finding> {
    let gains = |group: MethodKind| {
        gains_over(rows, |kind| {
            let others = MODELS.into_iter().filter_map(method).filter(|own| own.kind == group);
            let others = others.filter(|_| kind.method.key == PAPERS_MODEL).map(|method| {
                let sensors_and_size = format!("{}, {} grasps", kind.sensors.name(), kind.factor);
                (sensors_and_size, format!("over {}", method.key), Kind { method, ..*kind })
            });
            others.collect()
        })
    };
    // A claim for all sizes together: one size refutes it.
    let at_every_size = |claim: &str, why: &str, gains: Vec<(String, Gains)>, rule: Rule| {
        Claim("V-C", claim, why).on_groups(POINTS, [(rule, gains.into_iter().flat_map(named_gains).collect())])
    };
    vec![
        fewer_is_worse(rows),
        gains_shrink(rows),
        at_every_size(
            "The dual-stage LSTM outperforms other single models at every size",
            "Agrees where every paired 95 % interval at every size is above zero, disagrees where one is below",
            gains(MethodKind::Single),
            Rule::AllAbove(0.0),
        ),
        at_every_size(
            "The dual-stage LSTM remains comparable to ensembles at every size",
            "Disagrees where the paired 95 % interval of an ensemble excludes zero in its favour",
            gains(MethodKind::Ensemble),
            Rule::NoneBelow(0.0),
        ),
    ]
}

/// Each model from the smallest to the largest size that it was trained on.
fn fewer_is_worse(rows: &[Row<usize>]) -> Finding {
    let gains = grouped(by_model(rows).into_iter().filter_map(|own| {
        let (first, last) = (own[0], own.last()?);
        let Kind { sensors, method, .. } = first.kind;
        let name = format!("{} from {} to {}", method.key, first.kind.factor, last.kind.factor);
        Some((sensors.name().to_owned(), (name, last.pool.against(&first.pool)?.f1)))
    }));
    let rule = "Agrees where every model gains from the fewest to the most grasps: paired 95 % interval above zero";
    Claim("V-C", "Fewer training grasps give worse results", rule).on_gains(Rule::AllAbove(0.0), gains)
}

/// The paper's model: gain of the first doubling against that of the last, which is the line.
fn gains_shrink(rows: &[Row<usize>]) -> Finding {
    let (mut measured, mut verdicts) = (Vec::new(), Vec::new());
    for own in by_model(rows).into_iter().filter(|own| own[0].kind.method.key == PAPERS_MODEL) {
        let steps: Vec<_> = own.iter().filter_map(|row| Some((row.kind.factor, row.gain?))).collect();
        let [(first_size, first), .., (last_size, last)] = steps.as_slice() else { continue };
        for (size, gain) in [(first_size, first), (last_size, last)] {
            let what = format!("{}: step to {size} grasps", own[0].kind.model());
            measured.push(ClaimNumber::new(what, Some(*gain), POINTS, last.estimate));
        }
        verdicts.push(match (first.low > last.high, first.high < last.low) {
            (true, _) => Agreement::Agrees,
            (_, true) => Agreement::Disagrees,
            (false, false) => Agreement::Partly,
        });
    }
    let claim = Claim(
        "V-C",
        "With more grasps the gain becomes less pronounced: there is a smallest set that is enough",
        "Agrees where the 95 % interval of the first step's gain is above that of the last, which is the line. Enough is the fewest grasps \
         whose interval reaches that of the most",
    );
    let sentences = [
        "The first step gains more than the last.",
        "The first step gains more than the last in some cases, not in others.",
        "The last step gains more than the first.",
    ];
    claim.finding(measured, Agreement::of_all(verdicts), sentences)
}
