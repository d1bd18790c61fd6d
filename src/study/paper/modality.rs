//! Curvature, pressure, and both (Fig. 5b to 5d).

use super::prelude::*;

pub(super) struct Modality;

/// The paper's network, strict and tuned, for whole fingers, and a method of seconds for every pattern.
const MODELS: [&str; 3] = ["paper-macro-layer", NETWORK, "extra-trees"];
const NETWORK: &str = "macro-layer";

/// Some channels of a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pattern {
    layout: &'static str,
    modality: &'static str,
    /// Name of the sensors that it has.
    name: &'static str,
}

const fn pattern(layout: &'static str, modality: &'static str, name: &'static str) -> Pattern {
    Pattern { layout, modality, name }
}

const CURVATURE: &str = "curvature";
const PRESSURE: &str = "pressure";
const BOTH: &str = "both";

/// Both modalities of whole fingers.
const WHOLE: Pattern = pattern("C1", BOTH, "C1");

/// Whole fingers, and every other pattern of one modality and of both.
const PATTERNS: [Pattern; 14] = [
    pattern("C1", CURVATURE, "whole"),
    pattern("C1", PRESSURE, "whole"),
    WHOLE,
    pattern("C5", CURVATURE, "halves"),
    pattern("C2", PRESSURE, "halves"),
    pattern("C3", PRESSURE, "pairs"),
    pattern("C4", PRESSURE, "joints"),
    pattern("C2", BOTH, "C2"),
    pattern("C3", BOTH, "C3"),
    pattern("C4", BOTH, "C4"),
    pattern("C5", BOTH, "C5"),
    pattern("C6", BOTH, "C6"),
    pattern("C7", BOTH, "C7"),
    pattern("C8", BOTH, "C8"),
];

impl Factor for Pattern {
    fn named(&self, sensors: &str, method: &str) -> String {
        format!("{sensors}, {} {}, {method}", self.modality, self.name)
    }
}

/// The data set with some of its channels: those of curvature, those of pressure and force, or all.
fn with_modality(data: &Dataset, modality: &str) -> Result<Dataset, StudyError> {
    let of_curvature = |name: &String| name.starts_with(CURVATURE);
    let keep: Vec<usize> = (0..data.channels.len())
        .filter(|k| modality == BOTH || of_curvature(&data.channels[*k]) == (modality == CURVATURE))
        .collect();
    if keep.is_empty() {
        return Err(StudyError::Missing(format!(
            "channels of {modality}; the trials have {}",
            data.channels.join(", ")
        )));
    }
    let thinned = |example: &Example| {
        let values =
            example.grasp.rows().flat_map(|(_, row)| keep.iter().map(|k| row[*k]).collect::<Vec<_>>()).collect();
        Example { grasp: Arc::new(Sequence { t_s: example.grasp.t_s.clone(), values }), ..example.clone() }
    };
    Ok(Dataset {
        channels: keep.iter().map(|k| data.channels[*k].clone()).collect(),
        labels: data.labels.clone(),
        examples: data.examples.iter().map(thinned).collect(),
        about: data.about.clone(),
    })
}

impl Study for Modality {
    type Cell = Fit<Pattern>;
    type Found = TestAnswers;

    const CARD: StudyCard = StudyCard {
        key: "modality",
        title: "Curvature and pressure",
        about: "curvature alone, pressure alone and both, for each pattern of sensors, and which objects are confused",
        paper: "Fig. 5b to 5d",
        budget: "about 30 CPU minutes",
    };

    fn grid(plan: &StudyPlan) -> Vec<Self::Cell> {
        crossed(plan, &PATTERNS, &MODELS, |Kind { method, factor, .. }| {
            let is_network = method.recipe.is_some();
            // The channels of stored trials are fixed.
            if (is_network || plan.query.is_some()) && factor.layout != "C1" {
                return 0;
            }
            plan.pick(if is_network && method.key != NETWORK { 1 } else { PARTS }, 1, 1)
        })
    }

    fn measure(Fit { kind, part }: &Self::Cell, bench: &StudyData<'_>) -> Result<TestAnswers, StudyError> {
        let mut wanted = usual_grasps(bench.plan(), kind.sensors);
        wanted.view.layout = kind.factor.layout.to_owned();
        let [train, test] = bench.split(wanted, kind.method, TestPart::usual(bench.plan(), *part))?;
        let modality = kind.factor.modality;
        bench.judge(kind.method, &[with_modality(&train, modality)?, with_modality(&test, modality)?])
    }

    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, TestAnswers)>) -> StudyReport {
        let mut rows = pooled(found.into_iter().map(|(fit, judged)| (fit.kind, judged)));
        compare(&mut rows, |kind| Some(kind.with(WHOLE)));
        let title = format!("Modalities, {}; differences to both modalities of whole fingers", plan.described());
        let whole = rows.iter().filter(|row| row.kind.method.key == NETWORK && row.kind.factor == WHOLE);
        let whole: Vec<&Row<Pattern>> = whole.collect();
        let pools: Vec<_> = whole.iter().map(|row| (row.kind.sensors.name(), &row.pool)).collect();
        let confused_title = format!("Confusions of {NETWORK} with C1, {}", plan.described());
        let confusions = confusion_table("modality-confusion", &confused_title, &pools);
        let tables = vec![
            Row::table("modality", title, &rows).columns(&[
                Row::SENSORS,
                Row::MODEL,
                Column("modality", "", &|row| row.kind.factor.modality.into()),
                Column("pattern", "", &|row| row.kind.factor.name.into()),
                Row::F1,
                Row::ACCURACY,
                Row::gain("F1 against C1"),
                Row::HOLM,
                Row::TESTED,
            ]),
            confusions,
        ];
        let [both, worse] = gains(&rows);
        let pairs = [["jenga", "smallcube"], ["tomato", "lemon"]].map(|pair| confused(pair, &whole));
        StudyReport::new(described(&rows), tables, [both, worse].into_iter().chain(pairs).collect())
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let along = Along::Columns("curvature alone (κ), pressure alone (p), both (C1 to C8)", &|line| {
            let pattern = line.text("pattern");
            match line.text("modality") {
                BOTH => pattern.to_owned(),
                CURVATURE => format!("κ {pattern}"),
                _ => format!("p {pattern}"),
            }
        });
        let patterns = Facets { along, shift: [0.0, 0.16], columns: 1, size: [1080, 760], ..Facets::USUAL };
        let note = "Rows: true object, with its number; columns: predicted object.";
        let title = |kind: &str| Some(format!("{kind} sensors"));
        let confusions = confusion_figure(report, "modality-confusion", title, [1080, 560], note);
        vec![patterns.figure(report, "modality"), confusions]
    }
}

/// Both modalities over either, and clean sensors over real ones.
fn gains(rows: &[Row<Pattern>]) -> [Finding; 2] {
    let both = gains_over(rows, |kind| {
        let over = |modality: &'static str| {
            let other = kind.with(pattern("C1", modality, "whole"));
            (kind.model(), format!("over {modality} alone"), other)
        };
        if kind.factor == WHOLE { [CURVATURE, PRESSURE].map(over).to_vec() } else { Vec::new() }
    });
    let clean = gains_over(rows, |kind| {
        let is_clean = kind.sensors == SensorModel::Virtual && kind.method.key == NETWORK && kind.factor == WHOLE;
        let noisy = Kind { sensors: SensorModel::PhysicalLike, ..*kind };
        let over = || (NETWORK.to_owned(), "virtual over physical-like".to_owned(), noisy);
        is_clean.then(over).into_iter().collect()
    });
    let claims = [
        "Both modalities are better than either alone, in simulation and on the physical gripper",
        "The physical gripper performs worse than the simulated one",
    ];
    let [better, worse] = claims.map(|claim| Claim("V-B", claim, ALL_GAIN));
    [better.on_gains(Rule::AllAbove(0.0), both), worse.on_gains(Rule::AllAbove(0.0), clean)]
}

/// Two objects that the paper names as confused: are they confused more often than two objects are on average?
fn confused([a, b]: [&str; 2], whole: &[&Row<Pattern>]) -> Finding {
    let of_sensors = |row: &&Row<Pattern>| {
        let at = |name: &str| row.pool.classes.iter().position(|class| class == name);
        let (first, second, cells) = (at(a)?, at(b)?, row.pool.confusions());
        let count = |is: &dyn Fn(usize, usize) -> bool| -> usize {
            cells.iter().filter(|((truth, decided), _)| is(*truth, *decided)).map(|(_, (count, _))| count).sum()
        };
        let pair = [first, second];
        let taken = count(&|truth, decided| truth != decided && pair.contains(&truth) && pair.contains(&decided));
        let share = Interval::of_share(taken, count(&|truth, _| pair.contains(&truth)));
        let wrong = count(&|truth, decided| truth != decided) as f64 / count(&|_, _| true).max(1) as f64;
        let average = wrong / (row.pool.classes.len() as f64 - 1.0).max(1.0);
        Some((Rule::AllAbove(average), vec![(format!("{}: taken for each other", row.kind.sensors.name()), share)]))
    };
    let claim = format!("{a} and {b} are confused, since shape and size are similar");
    let rule =
        "Agrees where the 95 % interval of the share is above the average of all pairs, disagrees where it is below";
    Claim("V-B", &claim, rule).on_groups(PERCENT, whole.iter().filter_map(of_sensors))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_modality_keeps_its_channels_and_the_order_of_time() -> Result<(), StudyError> {
        let channels = ["curvature_left", "pressure_left", "force_left"].map(str::to_owned).to_vec();
        let grasp = Arc::new(Sequence { t_s: vec![0.0, 1.0], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] });
        let data = Dataset { channels, examples: vec![Example { grasp, ..Example::default() }], ..Dataset::default() };
        let values = |modality: &str| with_modality(&data, modality).map(|d| d.examples[0].grasp.values.clone());
        assert_eq!((values(CURVATURE)?, values(PRESSURE)?), (vec![1.0, 4.0], vec![2.0, 3.0, 5.0, 6.0]));
        assert_eq!(with_modality(&data, BOTH)?, data);
        let none = Dataset { channels: vec!["grip".to_owned()], ..Dataset::default() };
        assert!(with_modality(&none, CURVATURE).is_err_and(|cause| cause.to_string().contains("grip")));
        Ok(())
    }
}
