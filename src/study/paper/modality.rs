//! Curvature, pressure, and both (Fig. 5b to 5d).

use super::prelude::*;
use palpate_sim::objects::titled;
use palpate_tactile::CATALOGUE;

pub(super) struct Modality;

/// The paper's network, strict and tuned, for whole fingers, and a method of seconds for every pattern.
const MODELS: [&str; 3] = ["paper-macro-layer", NETWORK, "extra-trees"];
const NETWORK: &str = "macro-layer";

/// Some channels of a layout: layout, modality, and name of the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pattern(&'static str, &'static str, &'static str);

const CURVATURE: &str = "curvature";
const PRESSURE: &str = "pressure";
const BOTH: &str = "both";

/// Both modalities of whole fingers.
const WHOLE: Pattern = Pattern("C1", BOTH, "C1");

/// Whole fingers, and every other pattern of one modality and of both.
fn patterns() -> Vec<Pattern> {
    let alone = [
        Pattern("C1", CURVATURE, "whole"),
        Pattern("C1", PRESSURE, "whole"),
        WHOLE,
        Pattern("C5", CURVATURE, "halves"),
        Pattern("C2", PRESSURE, "halves"),
        Pattern("C3", PRESSURE, "pairs"),
        Pattern("C4", PRESSURE, "joints"),
    ];
    alone.into_iter().chain(CATALOGUE[1..].iter().map(|layout| Pattern(layout.name, BOTH, layout.name))).collect()
}

impl Factor for Pattern {
    fn name(&self) -> String {
        format!("{} {}", self.1, self.2)
    }
}

/// The data set with some of its channels: those of curvature, those of pressure and force, or all.
fn with_modality(data: &Dataset, modality: &str) -> Result<Dataset, StudyError> {
    let is_kept = |name: &str| modality == BOTH || name.starts_with(CURVATURE) == (modality == CURVATURE);
    let keep: Vec<usize> = (0..data.channels.len()).filter(|k| is_kept(&data.channels[*k])).collect();
    if keep.is_empty() {
        let what = format!("channels of {modality}; the trials have {}", data.channels.join(", "));
        return Err(StudyError::Missing(what));
    }
    let channels = keep.iter().map(|k| data.channels[*k].clone()).collect();
    Ok(data.with_channels(channels, |_, row| keep.iter().map(|k| row[*k]).collect()))
}

impl Crossing for Modality {
    type Factor = Pattern;

    const CARD: StudyCard = StudyCard {
        key: "modality",
        title: "Curvature and pressure",
        about: "curvature alone, pressure alone and both, for each pattern of sensors, and which objects are confused",
        paper: "Fig. 5b to 5d",
    };

    fn grid(plan: &StudyPlan) -> Vec<Fit<Pattern>> {
        crossed(plan, &patterns(), &MODELS, |Kind { method, factor, .. }| {
            let is_network = method.recipe.is_some();
            // The channels of stored trials are fixed.
            if (is_network || plan.query.is_some()) && factor.0 != WHOLE.0 {
                return 0;
            }
            plan.pick(if is_network && method.key != NETWORK { 1 } else { PARTS }, 1, 1)
        })
    }

    fn sets(fit: &Fit<Pattern>, bench: &StudyData<'_>) -> Result<[Dataset; 2], StudyError> {
        let Pattern(layout, modality, _) = fit.kind.factor;
        let [train, test] = fit.sets(bench, |view| view.layout = layout.to_owned())?;
        Ok([with_modality(&train, modality)?, with_modality(&test, modality)?])
    }

    fn compared(rows: &mut [Row<Pattern>]) {
        compare(rows, |kind| Some(kind.with(WHOLE)));
    }

    fn report(plan: &StudyPlan, rows: &[Row<Pattern>]) -> (Vec<StudyTable>, Vec<Finding>) {
        let title = format!("Modalities, {}; differences to both modalities of whole fingers", plan.described());
        let own = [
            Column("modality", "", &|row: &Row<Pattern>| row.kind.factor.1.into()),
            Column("pattern", "", &|row| row.kind.factor.2.into()),
        ];
        let scores = Row::scores("modality", title, rows, &own, Some("F1 against C1"));
        let title = format!("Confusions of {NETWORK} with C1, {}", plan.described());
        let whole = rows.iter().filter(|row| row.kind.method.key == NETWORK && row.kind.factor == WHOLE);
        let pools: Vec<(&str, &Pool)> = whole.map(|row| (row.kind.sensors.name(), &row.pool)).collect();
        let confused = [["jenga", "smallcube"], ["tomato", "lemon"]].map(|pair| are_confused(pair, &pools));
        let confusions = confusion_table("modality-confusion", &title, &pools);
        (vec![scores, confusions], gains(rows).into_iter().chain(confused).collect())
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let columns = "curvature alone (κ), pressure alone (p), both (C1 to C8)";
        let along = Along::Columns(columns, &|line| match (line.text("modality"), line.text("pattern")) {
            (BOTH, pattern) => pattern.to_owned(),
            (CURVATURE, pattern) => format!("κ {pattern}"),
            (_, pattern) => format!("p {pattern}"),
        });
        let patterns = Facets { along, shift: 0.16, columns: 1, size: [1080, 760], ..Facets::USUAL };
        let note = "Rows: true object, with its number; columns: predicted object.";
        let title = |kind: &str| Some(format!("{kind} sensors"));
        let confusions = confusion_figure(report, "modality-confusion", title, [1080, 560], note);
        vec![patterns.figure(report, "modality"), confusions]
    }
}

/// Both modalities over either, and clean sensors over real ones.
fn gains(rows: &[Row<Pattern>]) -> [Finding; 2] {
    let both = gains_over(rows, |kind| {
        let modalities = [CURVATURE, PRESSURE].into_iter().filter(move |_| kind.factor == WHOLE);
        modalities
            .map(move |alone| (kind.model(), format!("over {alone} alone"), kind.with(Pattern("C1", alone, "whole"))))
    });
    let clean = gains_over(rows, |kind| {
        let is_clean = kind.sensors == SensorModel::Virtual && kind.method.key == NETWORK && kind.factor == WHOLE;
        let noisy = Kind { sensors: SensorModel::PhysicalLike, ..*kind };
        is_clean.then(|| (NETWORK.to_owned(), "virtual over physical-like".to_owned(), noisy))
    });
    let claims = [
        ("Both modalities are better than either alone, in simulation and on the physical gripper", both),
        ("The physical gripper performs worse than the simulated one", clean),
    ];
    claims.map(|(claim, gains)| Claim("V-B", claim, ALL_GAIN).on_gains(Rule::AllAbove(0.0), gains))
}

/// Two objects that the paper names as confused: are they confused more often than two objects are on average?
fn are_confused([a, b]: [&str; 2], whole: &[(&str, &Pool)]) -> Finding {
    let of_sensors = whole.iter().filter_map(|(sensors, pool)| {
        let (share, average) = pool.taken_for_each_other([a, b])?;
        Some((Rule::AllAbove(average), vec![(format!("{sensors}: taken for each other"), share)]))
    });
    let claim = format!("{} and {} are confused, since shape and size are similar", titled(a), titled(b));
    let rule = "Agrees where the 95 % interval of the share is above the average of all pairs, disagrees where it is below; partly \
         where sensors differ";
    Claim("V-B", &claim, rule).on_groups(PERCENT, of_sensors)
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
