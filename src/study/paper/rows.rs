//! Studies that cross factors: fits of methods to grasps read by sensors, pooled over parts into rows, and compared in pairs.

use super::answers::{ModelAnswers, ModelCost, PARTS, Pool, TestAnswers, TestPart, mean, usual_grasps};
use super::bench::StudyData;
use super::plan::StudyPlan;
use super::study::Study;
use crate::frame::{
    Column, Finding, Gains, LinkedFigure, PERCENT, POINTS, StudyCard, StudyCell, StudyError, StudyReport, StudyTable,
    TableRows, grouped, unique,
};
use palpate_lab::datasets::SensorView;
use palpate_learn::metrics::{Interval, holm};
use palpate_learn::{Dataset, Method, method};
use palpate_tactile::model::SensorModel;

/// A study that crosses sensors, methods and a factor: every fit is judged, and compared with a reference.
pub(super) trait Crossing: Sync {
    /// What it varies beside sensors and methods.
    type Factor: Factor;

    /// Name and purpose.
    const CARD: StudyCard;

    /// Fits, in the order of work.
    fn grid(plan: &StudyPlan) -> Vec<Fit<Self::Factor>>;

    /// Training and test grasps of a fit.
    fn sets(fit: &Fit<Self::Factor>, bench: &StudyData<'_>) -> Result<[Dataset; 2], StudyError>;

    /// Compares each row with its reference.
    fn compared(rows: &mut [Row<Self::Factor>]);

    /// Tables and findings.
    fn report(plan: &StudyPlan, rows: &[Row<Self::Factor>]) -> (Vec<StudyTable>, Vec<Finding>);

    /// Figures, drawn from the tables.
    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>>;
}

impl<S: Crossing> Study for S {
    type Cell = Fit<S::Factor>;
    type Found = TestAnswers;

    const CARD: StudyCard = S::CARD;

    fn grid(plan: &StudyPlan) -> Vec<Self::Cell> {
        S::grid(plan)
    }

    fn measure(fit: &Self::Cell, bench: &StudyData<'_>) -> Result<TestAnswers, StudyError> {
        bench.judge(fit.kind.method, &S::sets(fit, bench)?)
    }

    fn report(plan: &StudyPlan, found: Vec<(Self::Cell, TestAnswers)>) -> StudyReport {
        let mut rows = pooled(found.into_iter().map(|(fit, judged)| (fit.kind, judged)));
        S::compared(&mut rows);
        let (tables, findings) = S::report(plan, &rows);
        StudyReport::new(described(&rows), tables, findings)
    }

    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        S::figures(report)
    }
}

/// What a study varies beside sensors and methods.
pub(super) trait Factor: Clone + PartialEq + Sync + 'static {
    /// Its name; empty where [`Self::named`] needs none.
    fn name(&self) -> String {
        String::new()
    }

    /// Name of a fit, for the names of results.
    fn named(&self, sensors: &str, method: &str) -> String {
        format!("{sensors}, {}, {method}", self.name())
    }
}

impl Factor for () {
    fn named(&self, sensors: &str, method: &str) -> String {
        format!("{sensors}, {method}")
    }
}

/// Fits of one kind: grasps read by sensors, a method, and the factor of the study.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind<F> {
    pub(super) sensors: SensorModel,
    pub(super) method: &'static Method,
    pub(super) factor: F,
}

impl<F: PartialEq> PartialEq for Kind<F> {
    fn eq(&self, other: &Self) -> bool {
        (self.sensors, self.method.key, &self.factor) == (other.sensors, other.method.key, &other.factor)
    }
}

impl<F> Kind<F> {
    /// The same sensors and method with another factor.
    pub(super) fn with<G>(&self, factor: G) -> Kind<G> {
        Kind { sensors: self.sensors, method: self.method, factor }
    }

    /// Parts on which a study tests: the fits of networks on any but the first sensors take too long for more than one.
    pub(super) fn usual_parts(&self, plan: &StudyPlan) -> usize {
        let once = self.method.recipe.is_some() && plan.sensors.first() != Some(&self.sensors);
        plan.pick(if once { 1 } else { PARTS }, 1, 1)
    }

    /// Fits on so many parts.
    pub(super) fn fits(&self, parts: usize) -> Vec<Fit<F>>
    where
        F: Clone,
    {
        (0..parts).map(|part| Fit { kind: self.clone(), part }).collect()
    }

    /// Sensors and method.
    pub(super) fn model(&self) -> String {
        format!("{}, {}", self.sensors.name(), self.method.key)
    }
}

/// A cell: a kind of fits, judged on one part of the grasps.
pub(super) struct Fit<F> {
    pub(super) kind: Kind<F>,
    pub(super) part: usize,
}

impl<F> Fit<F> {
    /// Training and test set of the usual grasps, seen in a way that `view` sets.
    pub(super) fn sets(
        &self,
        bench: &StudyData<'_>,
        view: impl FnOnce(&mut SensorView),
    ) -> Result<[Dataset; 2], StudyError> {
        let mut wanted = usual_grasps(bench.plan(), self.kind.sensors);
        view(&mut wanted.view);
        bench.split(wanted, self.kind.method, TestPart::usual(bench.plan(), self.part))
    }
}

impl<F: Factor> StudyCell for Fit<F> {
    fn name(&self) -> String {
        let Kind { sensors, method, factor } = &self.kind;
        format!("{}, part {}", factor.named(sensors.name(), method.key), self.part + 1)
    }

    fn method(&self) -> Option<&'static Method> {
        Some(self.kind.method)
    }
}

/// Grid of the plan's sensors, the values of a factor and methods, each with as many parts as `parts` says.
pub(super) fn crossed<F: Clone>(
    plan: &StudyPlan,
    factors: &[F],
    methods: &[&str],
    parts: impl Fn(&Kind<F>) -> usize,
) -> Vec<Fit<F>> {
    let mut cells = Vec::new();
    for &sensors in &plan.sensors {
        for factor in factors {
            for method in methods.iter().filter_map(|key| method(key)) {
                let kind = Kind { sensors, method, factor: factor.clone() };
                cells.extend(kind.fits(parts(&kind)));
            }
        }
    }
    cells
}

/// Answers of one kind of fits, pooled over parts.
pub(super) struct Row<F> {
    pub(super) kind: Kind<F>,
    pub(super) parts: Vec<TestAnswers>,
    pub(super) pool: Pool,
    pub(super) f1: Option<Interval>,
    pub(super) accuracy: Option<Interval>,
    /// Difference of macro F1 to the reference.
    pub(super) gain: Option<Interval>,
    /// p-value of that difference with Holm's correction.
    pub(super) p: Option<f64>,
}

impl<F: 'static> Row<F> {
    pub(super) const SENSORS: Column<'static, Self> = Column("sensors", "", &|row| row.kind.sensors.name().into());
    pub(super) const MODEL: Column<'static, Self> = Column("model", "", &|row| row.kind.method.key.into());
    pub(super) const F1: Column<'static, Self> = Column("F1", PERCENT, &|row| row.f1.into());
    pub(super) const ACCURACY: Column<'static, Self> = Column("accuracy", PERCENT, &|row| row.accuracy.into());
    pub(super) const HOLM: Column<'static, Self> = Column("p (Holm)", "", &|row| row.p.into());
    pub(super) const TESTED: Column<'static, Self> = Column("tested", "grasps", &|row| row.pool.len().into());

    /// Column of differences to the reference.
    pub(super) const fn gain(name: &'static str) -> Column<'static, Self> {
        Column(name, POINTS, &|row| row.gain.into())
    }

    /// Table of rows with some misjudged trials behind each.
    pub(super) fn table<'a>(name: &'a str, title: impl Into<String>, rows: &'a [Self]) -> TableRows<'a, Self> {
        TableRows::new(name, title, rows)
            .with_trials(&|row| row.pool.misjudged())
            .read_through(&|row| Some(SensorView { sensors: row.kind.sensors, ..SensorView::default() }))
    }

    /// The same with columns of the study's own between the model and its scores; `gain` names the difference to the
    /// reference, where there is one.
    pub(super) fn scores(
        name: &str,
        title: impl Into<String>,
        rows: &[Self],
        own: &[Column<'_, Self>],
        gain: Option<&'static str>,
    ) -> StudyTable {
        let gain = gain.map_or(Vec::new(), |name| vec![Self::gain(name), Self::HOLM]);
        let columns =
            [&[Self::SENSORS, Self::MODEL][..], own, &[Self::F1, Self::ACCURACY], &gain, &[Self::TESTED]].concat();
        Self::table(name, title, rows).columns(&columns)
    }
}

impl<F> Row<F> {
    /// Row of a pool of decisions.
    pub(super) fn of_pool(kind: Kind<F>, pool: Pool) -> Self {
        let (f1, accuracy) = (pool.f1(), pool.accuracy());
        Self { kind, parts: Vec::new(), pool, f1, accuracy, gain: None, p: None }
    }

    /// Mean over the parts; none where a part has none.
    pub(super) fn mean(&self, pick: impl Fn(&ModelAnswers) -> Option<f64>) -> Option<f64> {
        mean(self.parts.iter().filter_map(TestAnswers::answers), pick)
    }

    /// Cost of the model of the first part, whose size stands for all.
    pub(super) fn cost(&self) -> Option<&ModelCost> {
        Some(&self.parts.iter().find_map(TestAnswers::answers)?.cost)
    }

    /// Reason why it could not be fitted, where it could not.
    pub(super) fn remark(&self) -> &str {
        self.parts.iter().find_map(TestAnswers::reason).unwrap_or_default()
    }
}

/// The answers of all kinds of fits, in the order in which the kinds first came.
pub(super) fn pooled<F: PartialEq>(answers: impl IntoIterator<Item = (Kind<F>, TestAnswers)>) -> Vec<Row<F>> {
    let row = |(kind, parts): (Kind<F>, Vec<TestAnswers>)| {
        let pool = Pool::of_parts(&parts);
        Row { parts, ..Row::of_pool(kind, pool) }
    };
    grouped(answers).into_iter().map(row).collect()
}

/// Descriptions of the data behind rows.
pub(super) fn described<F>(rows: &[Row<F>]) -> Vec<String> {
    let answers = rows.iter().flat_map(|row| &row.parts).filter_map(TestAnswers::answers);
    unique(answers.map(|answers| answers.data.clone()))
}

/// Rows of the same sensors and method.
pub(super) fn by_model<'a, F: 'a>(rows: impl IntoIterator<Item = &'a Row<F>>) -> Vec<Vec<&'a Row<F>>> {
    let groups = grouped(rows.into_iter().map(|row| (row.kind.with(()), row)));
    groups.into_iter().map(|(_, rows)| rows).collect()
}

/// Row of a kind.
pub(super) fn find<'a, F: PartialEq>(rows: &'a [Row<F>], kind: &Kind<F>) -> Option<&'a Row<F>> {
    rows.iter().find(|row| row.kind == *kind)
}

/// Sets the paired difference of each row to its reference, and its p-value with Holm's correction over all rows.
pub(super) fn compare<F: PartialEq>(rows: &mut [Row<F>], reference: impl Fn(&Kind<F>) -> Option<Kind<F>>) {
    let difference = |row: &Row<F>| {
        let other = reference(&row.kind).filter(|other| *other != row.kind)?;
        row.pool.against(&find(rows, &other)?.pool)
    };
    let differences: Vec<_> = rows.iter().map(difference).collect();
    let mut corrected =
        holm(&differences.iter().flatten().map(|difference| difference.p).collect::<Vec<_>>()).into_iter();
    for (row, difference) in rows.iter_mut().zip(differences) {
        (row.gain, row.p) = (difference.map(|own| own.f1), difference.and_then(|_| corrected.next()));
    }
}

/// Gains of macro F1 of rows over others that `others` names, each with its group and its name.
pub(super) fn gains_over<'a, F: PartialEq, O: IntoIterator<Item = (String, String, Kind<F>)>>(
    rows: &'a [Row<F>],
    others: impl Fn(&'a Kind<F>) -> O,
) -> Vec<(String, Gains)> {
    let pairs = rows.iter().flat_map(|row| others(&row.kind).into_iter().map(move |other| (row, other)));
    grouped(pairs.filter_map(|(row, (group, name, other))| {
        Some((group, (name, row.pool.against(&find(rows, &other)?.pool)?.f1)))
    }))
}
