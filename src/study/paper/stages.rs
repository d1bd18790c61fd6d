//! The two stages (Fig. 6a and 6b): how well stage one tells size and shape, and what stage two makes of it.
//!
//! Stage one is two models, one of sizes and one of shapes, each trained on one half of the training grasps. Stage two is
//! trained on the other half, for which stage one's probabilities are further channels, constant over a grasp. In place of
//! them it gets nothing (uniform probabilities), one of both, or the true size and shape.

use super::prelude::*;

pub(super) struct Stages;

/// The network of both stages, and a method of seconds.
const MODELS: [&str; 2] = ["macro-layer", "extra-trees"];

/// What stage two knows beside the grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ShownProperties {
    name: &'static str,
    size: Source,
    shape: Source,
}

/// Source of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// Uniform probabilities.
    Uniform,
    /// Probabilities of stage one.
    StageOne,
    Truth,
}

const NOTHING: &str = "nothing";
const SIZE: &str = "size";
const SHAPE: &str = "shape";
const BOTH: &str = "size and shape";
const TRUTH: &str = "true size and shape";
/// One model of all training grasps, as a fair rival of two stages.
const ONE_STAGE: &str = "one stage, all grasps";

const KNOWN: [ShownProperties; 7] = [
    ShownProperties { name: NOTHING, size: Source::Uniform, shape: Source::Uniform },
    ShownProperties { name: SIZE, size: Source::StageOne, shape: Source::Uniform },
    ShownProperties { name: SHAPE, size: Source::Uniform, shape: Source::StageOne },
    ShownProperties { name: BOTH, size: Source::StageOne, shape: Source::StageOne },
    ShownProperties { name: "true size", size: Source::Truth, shape: Source::Uniform },
    ShownProperties { name: "true shape", size: Source::Uniform, shape: Source::Truth },
    ShownProperties { name: TRUTH, size: Source::Truth, shape: Source::Truth },
];

/// Properties in tables, and the paper's F1 of stage one.
const PROPERTIES: [(&str, f64); 2] = [(SIZE, 0.90), (SHAPE, 0.81)];
/// Distance within which an F1 is that of the paper.
const NEAR: f64 = 0.05;

/// Result of a unit: answers of stage one, and of stage two by what it knows.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct StagesResult {
    /// Of sizes and of shapes.
    stage_one: [TestAnswers; 2],
    stage_two: Vec<(String, TestAnswers)>,
}

/// The data set with sizes, or with shapes, as its classes.
fn of_property(data: &Dataset, property: usize) -> Option<Dataset> {
    let labels = &data.labels;
    let names = if property == 0 { &labels.sizes } else { &labels.shapes };
    let pick = |class: &Class| if property == 0 { class.size } else { class.shape };
    let class = |name: &String| Class { name: name.clone(), size: None, shape: None };
    let examples: Option<Vec<Example>> = data
        .examples
        .iter()
        .map(|example| Some(Example { class: pick(&labels.classes[example.class])?, ..example.clone() }))
        .collect();
    let labels = Labels { classes: names.iter().map(class).collect(), ..Labels::default() };
    Some(Dataset { labels, examples: examples?, channels: data.channels.clone(), about: data.about.clone() })
}

/// Probabilities of size and shape of a grasp.
type Estimates = [Pmf; 2];

/// The data set with properties as further channels. Each stands on both fingers, so that grasps can still be mirrored.
fn with_known(data: &Dataset, estimates: &[Estimates], known: ShownProperties) -> Dataset {
    let labels = &data.labels;
    let both = |name: &String| ["left", "right"].map(|side| format!("known_{name}_{side}"));
    let further = labels.sizes.iter().chain(&labels.shapes).flat_map(both);
    let property = |source: Source, estimate: &Pmf, truth: Option<usize>| -> Vec<f32> {
        let count = estimate.classes();
        match source {
            Source::Uniform => vec![1.0 / count as f32; count],
            Source::StageOne => estimate.probabilities().iter().map(|p| *p as f32).collect(),
            Source::Truth => (0..count).map(|k| if truth == Some(k) { 1.0 } else { 0.0 }).collect(),
        }
    };
    let shown = |(example, [size, shape]): (&Example, &Estimates)| -> Vec<f32> {
        let class = &labels.classes[example.class];
        let properties = [property(known.size, size, class.size), property(known.shape, shape, class.shape)].concat();
        properties.into_iter().flat_map(|p| [p, p]).collect()
    };
    let shown: Vec<Vec<f32>> = data.examples.iter().zip(estimates).map(shown).collect();
    data.with_channels(data.channels.iter().cloned().chain(further).collect(), |k, row| [row, &shown[k]].concat())
}

impl Study for Stages {
    type Cell = Fit<()>;
    type Found = StagesResult;

    const CARD: StudyCard = StudyCard {
        key: "stages",
        title: "Two stages",
        about: "confusions of size and shape in stage one, and stage two with size, shape, both, the true ones or none",
        paper: "Fig. 6a and 6b",
    };

    fn grid(plan: &StudyPlan) -> Vec<Self::Cell> {
        crossed(plan, &[()], &MODELS, |kind| kind.usual_parts(plan))
    }

    fn measure(fit: &Self::Cell, bench: &StudyData<'_>) -> Result<StagesResult, StudyError> {
        let (plan, method) = (bench.plan(), fit.kind.method);
        let [train, test] = fit.sets(bench, |_| ())?;
        let [first, second] = TestPart { of: 2, part: 0, train: usize::MAX }.split(&train, plan.seed)?;
        let first_stage = |property: usize| {
            let (train, test) = of_property(&first, property)
                .zip(of_property(&test, property))
                .ok_or_else(|| StudyError::missing("a size and a shape of every object"))?;
            bench.judged_model(method, &[train, test])
        };
        let ((sizes, of_size), (shapes, of_shape)) = (first_stage(0)?, first_stage(1)?);
        let (stage_one, mut stage_two) = ([of_size, of_shape], Vec::new());
        let (Some(sizes), Some(shapes)) = (sizes, shapes) else { return Ok(StagesResult { stage_one, stage_two }) };
        let estimates = |data: &Dataset| -> Vec<Estimates> {
            let of = |model: &Model, example: &Example| model.recogniser.recognise(&example.grasp, None).pmf;
            data.examples.iter().map(|example| [of(&sizes, example), of(&shapes, example)]).collect()
        };
        let (of_second, of_test) = (estimates(&second), estimates(&test));
        for known in KNOWN {
            let sets = [with_known(&second, &of_second, known), with_known(&test, &of_test, known)];
            stage_two.push((known.name.to_owned(), bench.judge(method, &sets)?));
        }
        stage_two.push((ONE_STAGE.to_owned(), bench.judge(method, &[train, test])?));
        Ok(StagesResult { stage_one, stage_two })
    }

    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, StagesResult)>) -> StudyReport {
        let (mut ones, mut twos) = (Vec::new(), Vec::new());
        for (Fit { kind, .. }, StagesResult { stage_one, stage_two }) in found {
            let named = PROPERTIES.into_iter().zip(stage_one);
            ones.extend(named.map(|((property, _), judged)| (kind.with(property.to_owned()), judged)));
            twos.extend(stage_two.into_iter().map(|(known, judged)| (kind.with(known), judged)));
        }
        let (first, mut second) = (pooled(ones), pooled(twos));
        compare(&mut second, |kind| Some(kind.with(NOTHING.to_owned())));
        let factor = |name| [Column(name, "", &|row: &Row<String>| row.kind.factor.as_str().into())];
        let [one, confused] =
            ["Stage one", "Confusions of stage one"].map(|what| format!("{what}, {}", plan.described()));
        let two = format!("Stage two by its extra input, {}; differences to none", plan.described());
        let names: Vec<String> = first.iter().map(|row| format!("{}, {}", row.kind.model(), row.kind.factor)).collect();
        let pools: Vec<(&str, &Pool)> =
            names.iter().map(String::as_str).zip(first.iter().map(|row| &row.pool)).collect();
        let tables = vec![
            Row::scores("stages-first", one, &first, &factor("property"), None),
            confusion_table("stages-confusion", &confused, &pools),
            Row::scores("stages", two, &second, &factor("known"), Some("F1 against nothing")),
        ];
        StudyReport::new(described(&second), tables, findings(&first, &second))
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let of_network = |kind: &str| kind.contains(MODELS[0]).then(|| kind.to_owned());
        let note = "Rows: true size or shape; columns: predicted.";
        let confusions = confusion_figure(report, "stages-confusion", of_network, [900, 700], note);
        let along = Along::Rows(&|line| line.text("known").to_owned());
        let note = "Macro F1 of stage two after one grasp, with 95 % intervals, by its input beside the grasp.";
        let second = Facets { along, shift: -0.16, size: [1080, 420], note, ..Facets::USUAL };
        vec![confusions, second.figure(report, "stages")]
    }
}

fn findings(first: &[Row<String>], second: &[Row<String>]) -> Vec<Finding> {
    let stage_one = PROPERTIES.map(|(property, papers)| {
        let of_network = first.iter().filter(|row| row.kind.method.key == MODELS[0] && row.kind.factor == property);
        let found = of_network.filter_map(|row| Some((row.kind.model(), row.f1?)));
        let claim = format!("Stage one recognises the {property} with an F1 of {:.0} %", 100.0 * papers);
        let rule = "Agrees where the 95 % interval comes within 5 points of the paper's number";
        Claim("V-C", &claim, rule).on_each(PERCENT, Rule::Within(papers - NEAR, papers + NEAR), found)
    });
    let gains = |claim: &str, name: &str, over: &[&str]| {
        let gains = gains_over(second, |kind| {
            let over = over.iter().filter(|_| kind.factor == name);
            over.map(|other| (kind.model(), format!("over {other}"), kind.with((*other).to_owned())))
                .collect::<Vec<_>>()
        });
        Claim("V-C", claim, ALL_GAIN).on_gains(Rule::AllAbove(0.0), gains)
    };
    let stage_two = [
        gains(
            "Size and shape from stage one improve the recognition of the object, more together than alone",
            BOTH,
            &[NOTHING, SIZE, SHAPE],
        ),
        gains("Known size and shape would improve the recognition of the object", TRUTH, &[NOTHING, BOTH]),
        gains("Two stages on one half of the grasps each are better than one stage on all of them", BOTH, &[ONE_STAGE]),
    ];
    stage_one.into_iter().chain(stage_two).collect()
}
