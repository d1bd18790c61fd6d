//! How many grasps a model has to learn from (Fig. 6c).

use super::prelude::*;

pub(super) struct TrainingSize;

/// Models of the figure, the paper's and what it is compared with: most training grasps of each object with the first sensors,
/// and with others. Networks are trained for minutes, and so are support vector machines on noisy readings: 16 CPU minutes with
/// 400 grasps of each object, three times that with 800. All others have what the paper had, but for some that are cheap.
const MODELS: [(&str, [usize; 2]); 9] = [
    (PAPERS_MODEL, [200, USUAL]),
    (TUNED, [400, USUAL]),
    ("lstm", [USUAL; 2]),
    ("decision-tree", [USUAL; 2]),
    ("knn", [USUAL; 2]),
    ("svm", [MOST, 400]),
    ("random-forest", [MOST; 2]),
    ("rusboost", [USUAL; 2]),
    ("extra-trees", [MOST; 2]),
];
/// Most training grasps of each object: more than a hand collects in a day.
const MOST: usize = 800;
/// The paper's model, strict and tuned.
const PAPERS_MODEL: &str = "paper-ds-lstm";
const TUNED: &str = "ds-lstm";
/// Training grasps of each object that the paper had.
const USUAL: usize = 50;
/// Grasps of each object to test in each part, and parts.
const TEST: usize = 100;
const PARTS: usize = 3;
fn sizes(plan: &StudyPlan) -> &'static [usize] {
    plan.pick(&[5, 10, 20, 50, 100, 200, 400, 800][..], &[5, 10, 20][..], &[2, 4][..])
}

/// Training grasps of each object.
impl Factor for usize {
    fn named(&self, sensors: &str, method: &str) -> String {
        format!("{sensors}, {method} of {self} grasps")
    }
}

impl Crossing for TrainingSize {
    type Factor = usize;

    const CARD: StudyCard = StudyCard {
        key: "training-size",
        title: "Size of the training set",
        about: "models over 5 to 800 training grasps of each object (networks and noisy SVMs to fewer), and the fewest that are enough",
        paper: "Fig. 6c",
    };

    fn grid(plan: &StudyPlan) -> Vec<Fit<usize>> {
        crossed(plan, sizes(plan), &MODELS.map(|(model, _)| model), |kind| {
            let is_first = plan.sensors.first() == Some(&kind.sensors);
            let most = MODELS.iter().find(|(model, _)| *model == kind.method.key).map(|(_, most)| most);
            if most.is_none_or(|most| kind.factor > most[usize::from(!is_first)]) {
                return 0;
            }
            let is_costly = kind.method.recipe.is_some() && (!is_first || kind.method.key != PAPERS_MODEL);
            plan.pick(if is_costly || kind.factor > USUAL { 1 } else { PARTS }, 1, 1)
        })
    }

    fn sets(Fit { kind, part }: &Fit<usize>, bench: &StudyData<'_>) -> Result<[Dataset; 2], StudyError> {
        let plan = bench.plan();
        let wanted = plan.wanted(plan.grasps(MOST + TEST, 40), kind.sensors);
        let of = plan.pick((MOST + TEST) / TEST, 2, 3);
        bench.split(wanted, kind.method, TestPart { of, part: *part, train: kind.factor })
    }

    /// Half as many grasps, or the next fewer.
    fn compared(rows: &mut [Row<usize>]) {
        let kinds: Vec<Kind<usize>> = rows.iter().map(|row| row.kind).collect();
        compare(rows, |kind| {
            let smaller = kinds.iter().filter(|own| own.factor < kind.factor && own.with(()) == kind.with(()));
            smaller.max_by_key(|own| own.factor).copied()
        });
    }

    fn report(plan: &StudyPlan, rows: &[Row<usize>]) -> (Vec<StudyTable>, Vec<Finding>) {
        let title = format!("Models by the number of training grasps of each object, {}", plan.described());
        let scores = Row::table("training-size", title, rows).columns(&[
            Row::SENSORS,
            Row::MODEL,
            Column("training grasps", "", &|row| row.kind.factor.into()),
            Row::F1,
            Row::ACCURACY,
            Row::gain("gain of doubling"),
            Row::TESTED,
        ]);
        (vec![scores, enough_table(rows)], findings(rows))
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let axis = |_: &[TableLine<'_>]| PlotAxis::logarithmic("training grasps of each object");
        let least = LinkedPlots::of(report, "training-size-least");
        let least = least.map_or_else(Vec::new, |least| least.lines_with(&[("model", PAPERS_MODEL)]));
        let enough = |plot: &str| {
            let line = least.iter().find(|line| plot == format!("{} sensors", line.text("sensors")))?;
            let [at, largest] = ["for that of the largest", "largest"].map(|column| line.value(column));
            let text = if at < largest {
                format!("{at:.0} are enough for {PAPERS_MODEL}")
            } else {
                format!("{PAPERS_MODEL}: fewer than {at:.0} are not enough")
            };
            (!at.is_nan()).then_some(ReferenceLine { horizontal: false, at, text })
        };
        let facets = Facets {
            along: Along::Axis(&axis, &|line| line.value("training grasps")),
            look: &|model, colour| lines(colour, model == PAPERS_MODEL),
            size: [1080, 520],
            reference: &enough,
            ..Facets::USUAL
        };
        vec![facets.figure(report, "training-size")]
    }
}

/// Fewest training grasps of a model whose interval reaches that of another row.
fn enough(own: &[&Row<usize>], wanted: Option<&&Row<usize>>) -> Option<usize> {
    let low = wanted?.f1?.low;
    Some(own.iter().find(|row| row.f1.is_some_and(|f1| f1.high >= low))?.kind.factor)
}

fn enough_table(rows: &[Row<usize>]) -> StudyTable {
    let title = format!(
        "Fewest training grasps of each object whose 95 % interval reaches that of {USUAL}, and of the largest number"
    );
    TableRows::new("training-size-least", title, &by_model(rows)).columns(&[
        Column("sensors", "", &|own| own[0].kind.sensors.name().into()),
        Column("model", "", &|own| own[0].kind.method.key.into()),
        Column("for that of 50", "grasps", &|own| enough(own, own.iter().find(|row| row.kind.factor == USUAL)).into()),
        Column("for that of the largest", "grasps", &|own| enough(own, own.last()).into()),
        Column("largest", "grasps", &|own| own.last().map(|row| row.kind.factor).into()),
    ])
}

fn findings(rows: &[Row<usize>]) -> Vec<Finding> {
    // A claim for all sizes together: one size refutes it.
    let at_every_size = |claim: &str, why: &str, group: MethodKind, rule: Rule| {
        let gains = gains_over(rows, |kind| {
            let others = MODELS.into_iter().filter_map(|(model, _)| method(model));
            let others = others.filter(move |own| own.kind == group && kind.method.key == PAPERS_MODEL);
            let size = format!("{}, {} grasps", kind.sensors.name(), kind.factor);
            others.map(move |method| (size.clone(), format!("over {}", method.key), Kind { method, ..*kind }))
        });
        Claim("V-C", claim, why).on_all_gains(rule, gains)
    };
    vec![
        fewer_is_worse(rows),
        gains_shrink(rows),
        at_every_size(
            "The dual-stage LSTM outperforms other single models at every size",
            "Agrees where every paired 95 % interval at every size is above zero, disagrees where one is below",
            MethodKind::Single,
            Rule::AllAbove(0.0),
        ),
        at_every_size(
            "The dual-stage LSTM remains comparable to ensembles at every size",
            "Disagrees where the paired 95 % interval of an ensemble excludes zero in its favour",
            MethodKind::Ensemble,
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
    for own in by_model(rows.iter().filter(|row| row.kind.method.key == PAPERS_MODEL)) {
        let steps: Vec<(usize, Interval)> = own.iter().filter_map(|row| Some((row.kind.factor, row.gain?))).collect();
        let [first, .., last] = steps.as_slice() else { continue };
        for (size, gain) in [first, last] {
            let what = format!("{}: step to {size} grasps", own[0].kind.model());
            measured.push(ClaimNumber::new(what, Some(*gain), POINTS, last.1.estimate));
        }
        let (low, high) = (first.1.low - last.1.high, first.1.high - last.1.low);
        verdicts.push(Agreement::of_gain(Some(Interval { estimate: 0.0, low, high })));
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
