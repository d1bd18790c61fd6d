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

/// Layout and signals of perfect sensors.
impl Factor for SensorView {
    fn name(&self) -> String {
        let Self { layout, signals, .. } = self;
        if *signals == SignalDefinition::Parts { layout.clone() } else { format!("{layout} {}", signals.name()) }
    }
}

/// All layouts as real sensors measure them; all with the contact pressure that only a simulation knows, without and with
/// force; and C1 with pressure over the hull of the contacts, as in the paper.
fn views() -> Vec<SensorView> {
    let view = |layout, signals| SensorView { layout, signals, ..SensorView::default() };
    let all = |signals, force| CATALOGUE.iter().map(move |layout| view(format!("{}{force}", layout.name), signals));
    all(SignalDefinition::Parts, "")
        .chain(all(SignalDefinition::Contact, ""))
        .chain(all(SignalDefinition::Contact, "+F"))
        .chain([view(SIMPLEST.to_owned(), SignalDefinition::Hull)])
        .collect()
}

/// True for what can be built.
fn is_of_parts(row: &&Row<SensorView>) -> bool {
    row.kind.factor.signals == SignalDefinition::Parts
}

/// Number of channels on both fingers.
fn channels(row: &Row<SensorView>) -> Option<usize> {
    let SensorView { layout, signals, .. } = &row.kind.factor;
    Some(SensorLayout::named(layout).ok()?.channels(&GripperModel::default(), *signals).ok()?.len())
}

impl Crossing for Layouts {
    type Factor = SensorView;

    const CARD: StudyCard = StudyCard {
        key: "layouts",
        title: "Sensor layouts",
        about: "layouts C1 to C8 of real parts and of contact pressure, with and without force, and the layout with the fewest channels that is as good as the best",
        paper: "Fig. 5a",
    };

    fn grid(plan: &StudyPlan) -> Vec<Fit<SensorView>> {
        crossed(plan, &views(), &MODELS, |Kind { sensors, method, factor }| {
            let of_parts = factor.signals == SignalDefinition::Parts;
            let simple = [SIMPLEST, "C1+F"].contains(&factor.layout.as_str());
            if method.recipe.is_none() {
                return if of_parts || *sensors != SensorModel::PhysicalLike { plan.pick(PARTS, 1, 1) } else { 0 };
            }
            // A network takes minutes to train: perfect sensors only, and of the simulation's own signals only C1.
            let in_full = of_parts || (simple && method.key == MODELS[0]);
            let is_wanted = if plan.size == StudySize::Full { in_full } else { of_parts && simple };
            usize::from(is_wanted && *sensors == SensorModel::Virtual)
        })
    }

    fn sets(fit: &Fit<SensorView>, bench: &StudyData<'_>) -> Result<[Dataset; 2], StudyError> {
        let sets = fit.sets(bench, |view| *view = SensorView { sensors: view.sensors, ..fit.kind.factor.clone() })?;
        if sets[0].about.object == "recorded" {
            return Err(StudyError::missing(
                "simulated trials: the channels of recorded and imported trials are fixed",
            ));
        }
        Ok(sets)
    }

    fn compared(rows: &mut [Row<SensorView>]) {
        compare(rows, |kind| Some(kind.with(SensorView::default())));
    }

    fn report(plan: &StudyPlan, rows: &[Row<SensorView>]) -> (Vec<StudyTable>, Vec<Finding>) {
        let title = format!("Sensor layouts, {}; differences to {SIMPLEST}", plan.described());
        let own = [
            Column("layout", "", &|row: &Row<SensorView>| row.kind.factor.name().into()),
            Column("channels", "", &|row| channels(row).into()),
        ];
        let mut scores = Row::scores("layouts", title, rows, &own, Some("F1 against C1"));
        for (line, row) in scores.rows.iter_mut().zip(rows) {
            let view = SensorView { sensors: row.kind.sensors, ..row.kind.factor.clone() };
            line.sensors = line.sensors.take().map(|_| view);
        }
        (vec![scores, recommended(rows)], vec![simplest_is_enough(rows), better_than_zuo(rows)])
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let along = Along::Rows(&|line| line.text("layout").to_owned());
        vec![Facets { along, shift: -0.2, ..Facets::USUAL }.figure(report, "layouts")]
    }
}

/// The best layout of parts, and the one with the fewest channels whose F1 lies inside the interval of the best.
fn recommended(rows: &[Row<SensorView>]) -> StudyTable {
    let f1 = |row: &Row<SensorView>| row.f1.map_or(f64::NEG_INFINITY, |f1| f1.estimate);
    let of_model = by_model(rows.iter().filter(is_of_parts)).into_iter().filter_map(|own| {
        let best = own.iter().copied().max_by(|a, b| f1(a).total_cmp(&f1(b)))?;
        let low = best.f1?.low;
        let inside = own.into_iter().filter(|row| f1(row) >= low);
        let fewest = inside.min_by(|a, b| channels(a).cmp(&channels(b)).then(f1(b).total_cmp(&f1(a))))?;
        Some([best, fewest])
    });
    let title = "Fewest channels whose F1 is inside the best layout's 95 % interval";
    TableRows::new("layouts-recommended", title, &of_model.collect::<Vec<_>>()).columns(&[
        Column("sensors", "", &|[best, _]| best.kind.sensors.name().into()),
        Column("model", "", &|[best, _]| best.kind.method.key.into()),
        Column("best", "", &|[best, _]| best.kind.factor.name().into()),
        Column("F1 of the best", PERCENT, &|[best, _]| best.f1.into()),
        Column("recommended", "", &|[_, fewest]| fewest.kind.factor.name().into()),
        Column("channels", "", &|[_, fewest]| channels(fewest).into()),
        Column("F1", PERCENT, &|[_, fewest]| fewest.f1.into()),
    ])
}

fn simplest_is_enough(rows: &[Row<SensorView>]) -> Finding {
    let most = by_model(rows.iter().filter(is_of_parts)).into_iter().filter_map(|own| {
        let gains = own.into_iter().filter_map(|row| Some((row, row.gain?)));
        let (row, gain) = gains.max_by(|a, b| a.1.estimate.total_cmp(&b.1.estimate))?;
        Some((format!("{}: {} over {SIMPLEST}", row.kind.model(), row.kind.factor.name()), gain))
    });
    let claim = Claim(
        "V-B",
        "The simplest layout, C1, is enough: more sensors add little or nothing",
        "Agrees where no layout gains more than 2 points over C1, with its paired 95 % interval, disagrees where it gains more. The \
         paper numbers its layouts without saying which is which, but for C1",
    );
    claim.on_each(POINTS, Rule::AllBelow(MINIMAL), most)
}

fn better_than_zuo(rows: &[Row<SensorView>]) -> Finding {
    let gains = gains_over(rows, |kind| {
        let method = method(MODELS[1]).filter(|_| kind.method.key == MODELS[0])?;
        let name = format!("{} over {}", kind.factor.name(), method.key);
        Some((kind.sensors.name().to_owned(), name, Kind { method, ..kind.clone() }))
    });
    let claim = "The macro-layer is more accurate than the network of Zuo et al.";
    let rule = "Agrees where the paired 95 % interval is above zero for every layout, disagrees where one is below";
    Claim("V-B", claim, rule).on_gains(Rule::AllAbove(0.0), gains)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ListedStudy;

    #[test]
    fn models_stand_around_the_line_of_their_layout() -> Result<(), Box<dyn std::error::Error>> {
        let shown = Layouts.shipped()?.ok_or("it comes with the program")?;
        let figure = &shown.figures.first().ok_or("a figure")?.figure;
        for plot in &figure.plots {
            let places: Vec<f64> =
                plot.series.iter().flat_map(|series| &series.points).map(|point| point.at[1]).collect();
            let mut lines: Vec<i64> = places.iter().map(|y| y.round() as i64).collect();
            lines.sort_unstable();
            lines.dedup();
            for line in lines {
                let off: Vec<f64> = places.iter().map(|y| y - line as f64).filter(|off| off.abs() < 0.5).collect();
                // One alone lies on it.
                assert!(off.iter().sum::<f64>().abs() < 1e-9, "{} {line}: {off:?}", plot.title);
            }
        }
        Ok(())
    }
}
