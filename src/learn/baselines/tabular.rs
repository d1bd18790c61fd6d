//! Recognisers that turn a grasp into a row of features and classify the row.
//!
//! Probabilities are calibrated by a temperature and a share of doubt, fitted to the answers on held-out grasps: forests
//! and boosted trees order the classes well, but are far too unsure or too sure of them.

use super::feature_rows::{ReadEncoder, RowMaker, scale, scaling};
use super::geometry::Shipped;
use super::neighbours::Neighbours;
use super::other::{as_one_of_many, other_weight};
use super::svm::Svm;
use crate::arrays::{Arrays, ModelError};
use crate::data::{Dataset, Sequence};
use crate::features::{self, FeatureKind, Features, WINDOWS};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::forest::{
    self, Examples, FeatureSampling, Forest, ForestSettings, GradientBoosting, GradientBoostingSettings, RusBoost,
    RusBoostSettings, Table, TreeSettings,
};
use crate::model::ModelCard;
use crate::pmf::Pmf;
use crate::recogniser::{LiveRecogniser, Recogniser, Verdict};
use crate::rows::{RowModel, Rows};
use crate::temperature::{Calibration, Temperatures};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::sync::Arc;

/// Kind of features and classifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum TabularKind {
    DecisionTree,
    RandomForest,
    BaggedTrees,
    ExtraTrees,
    GeometryTrees,
    GradientBoosting,
    RusBoostM2,
    Neighbours,
    Svm,
}

/// Features and a classifier of them. Forests answer on the beginning of a grasp too: features that are not known yet count
/// as either side of a cut.
pub(crate) struct Tabular(Arc<Fitted>);

struct Fitted {
    learned: Learned,
    rows: RowMaker,
    model: Box<dyn RowModel>,
    /// The class "other".
    other: Option<usize>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    kind: TabularKind,
    features: Features,
    /// Settings of the geometry encoder whose features are read too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    encoder: Option<serde_json::Value>,
    /// Mean and one over the standard deviation of each feature; empty for models that need no scaling.
    scaling: Vec<(f32, f32)>,
    /// Settings of the classifier, for people.
    model: String,
    /// Absent in files of versions that did not calibrate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    calibration: Option<Calibration>,
    /// True if the answers on a grasp and on its mirror image are averaged.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    both_views: bool,
    /// Calibration of answers on the beginning of a grasp, for each stage but the last; empty for classifiers that need the
    /// whole grasp.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    so_far: Vec<Calibration>,
}

/// Number of stages of a grasp that are calibrated apart, and windows of features in each.
const STAGES: usize = 10;
const STAGE: usize = WINDOWS / STAGES;
/// Most grasps that calibrate the stages before the last.
const MOST_BEGINNINGS: usize = 200;

/// Use of mirrored grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Mirroring {
    /// Mirrored grasps are training examples too.
    rows: bool,
    /// The answers on a grasp and on its mirror image are averaged.
    views: bool,
}

/// Classifier with its settings.
#[derive(Clone, Copy, Debug)]
enum Classifier {
    Forest(ForestSettings),
    GradientBoosting(GradientBoostingSettings),
    RusBoost(RusBoostSettings),
    Neighbours,
    Svm,
}

/// Largest number of trees or rounds in a quick fit.
const QUICK: usize = 20;
/// Temperatures tried; votes of many trees on many classes are nearly equal and need the lowest.
const TEMPERATURES: Temperatures = Temperatures { range: 0.0005..=10.0, count: 200 };
/// Version of the fit, part of the fingerprint.
const REVISION: u32 = 2;

impl TabularKind {
    fn features(self) -> FeatureKind {
        match self {
            Self::ExtraTrees | Self::GeometryTrees => FeatureKind::ExtendedCourse,
            Self::DecisionTree
            | Self::RandomForest
            | Self::BaggedTrees
            | Self::GradientBoosting
            | Self::RusBoostM2
            | Self::Neighbours
            | Self::Svm => FeatureKind::Course,
        }
    }

    fn reads_geometry(self) -> bool {
        self == Self::GeometryTrees
    }

    fn wants_scaling(self) -> bool {
        matches!(self, Self::Neighbours | Self::Svm)
    }

    /// Uses of mirrored grasps that are tried; the one with the best answers on held-out grasps is kept.
    fn mirrorings(self) -> &'static [Mirroring] {
        const ROWS: Mirroring = Mirroring { rows: true, views: false };
        match self {
            // The fingers of a real gripper differ, and then a mirrored grasp is no example.
            Self::ExtraTrees | Self::GeometryTrees => {
                &[Mirroring { rows: true, views: true }, Mirroring { rows: false, views: false }]
            }
            _ => &[ROWS],
        }
    }

    /// Number of parts of the grasps, each of which is held out once for calibration: more parts are closer to the final fit
    /// and cost more.
    fn parts(self) -> usize {
        match self {
            Self::GradientBoosting | Self::RusBoostM2 | Self::Svm => 3,
            _ => 6,
        }
    }

    fn classifier(self) -> Classifier {
        match self {
            Self::DecisionTree => Classifier::Forest(ForestSettings::decision_tree()),
            Self::RandomForest => Classifier::Forest(ForestSettings::random_forest()),
            Self::BaggedTrees => Classifier::Forest(ForestSettings::bagged_trees()),
            Self::ExtraTrees | Self::GeometryTrees => Classifier::Forest(ForestSettings::extra_trees()),
            Self::GradientBoosting => {
                let base = GradientBoostingSettings::default();
                let tree = TreeSettings { min_leaf: 10, features: FeatureSampling::Sqrt, ..base.tree };
                Classifier::GradientBoosting(GradientBoostingSettings { tree, ..base })
            }
            Self::RusBoostM2 => Classifier::RusBoost(RusBoostSettings::default()),
            Self::Neighbours => Classifier::Neighbours,
            Self::Svm => Classifier::Svm,
        }
    }

    /// Everything that decides a fit, besides the data, the seed and the options of the fit.
    pub(crate) fn decided_by(self) -> serde_json::Value {
        let classifier = match self.classifier() {
            Classifier::Neighbours => Neighbours::DESCRIPTION.to_owned(),
            Classifier::Svm => Svm::decided_by(),
            trees => format!("{trees:?}, revision {}", forest::REVISION),
        };
        // Stored results have the fingerprint of 0.1.0, which had a second form.
        let classifier = classifier.replace("RusBoostSettings {", "RusBoostSettings { form: M2,");
        let mut decided_by = serde_json::json!({
            "features": self.features(),
            "revisions": [REVISION, features::REVISION],
            "parts": self.parts(),
            "mirroring": format!("{:?}", self.mirrorings()),
            "classifier": classifier,
        });
        if self.reads_geometry() {
            decided_by["encoder"] = Shipped::encoders().into();
        }
        decided_by
    }
}

impl Classifier {
    /// The classifier with the seed of a fit, smaller if quick.
    fn of(kind: TabularKind, fitting: &Fitting<'_>) -> Self {
        let seed = fitting.seed;
        let count = |full: usize| if fitting.quick { full.min(QUICK) } else { full };
        match kind.classifier() {
            Self::Forest(own) => Self::Forest(ForestSettings { seed, trees: count(own.trees), ..own }),
            Self::GradientBoosting(own) => {
                Self::GradientBoosting(GradientBoostingSettings { seed, rounds: count(own.rounds), ..own })
            }
            Self::RusBoost(own) => Self::RusBoost(RusBoostSettings { seed, rounds: count(own.rounds), ..own }),
            Self::Neighbours => Self::Neighbours,
            Self::Svm => Self::Svm,
        }
    }

    /// Fits to rows; returns also a description of the settings.
    fn fit(&self, rows: &Rows, fitting: &Fitting<'_>) -> Result<(Box<dyn RowModel>, String), LearnError> {
        let table = Table { values: &rows.values, columns: rows.columns };
        table.check_finite()?;
        let weights = rows.weights.as_deref();
        let examples = Examples { table, labels: &rows.labels, classes: rows.classes, weights };
        Ok(match self {
            Self::Forest(settings) => (Box::new(Forest::fit(&examples, settings)?), format!("{settings:?}")),
            Self::GradientBoosting(settings) => {
                (Box::new(GradientBoosting::fit(&examples, settings)?), format!("{settings:?}"))
            }
            Self::RusBoost(settings) => (Box::new(RusBoost::fit(&examples, settings)?), format!("{settings:?}")),
            Self::Neighbours => (Box::new(Neighbours::fit(rows)), Neighbours::DESCRIPTION.to_owned()),
            Self::Svm => {
                let model = Svm::fit(rows, fitting)?;
                let description = model.described();
                (Box::new(model), description)
            }
        })
    }
}

/// Answers on held-out parts of the grasps.
struct HeldOut {
    /// Part of each grasp.
    part_of: Vec<usize>,
    /// Classifier fitted without each part; none for an empty one.
    models: Vec<Option<Box<dyn RowModel>>>,
    calibration: Calibration,
    /// Negative log-likelihood with it (nat).
    loss: f64,
}

/// Scaled features of all grasps.
struct FeatureRows<'a> {
    data: &'a Dataset,
    columns: usize,
    own: Vec<Vec<f32>>,
    /// Of the mirror images; `None` if grasps cannot be mirrored.
    mirrored: Option<Vec<Vec<f32>>>,
}

impl FeatureRows<'_> {
    fn rows(&self, grasps: impl Iterator<Item = usize>, mirroring: Mirroring) -> Rows {
        let classes = self.data.labels.classes.len();
        let mut rows = Rows { values: Vec::new(), columns: self.columns, labels: Vec::new(), weights: None, classes };
        for k in grasps {
            let mirrored = self.mirrored.as_ref().filter(|_| mirroring.rows).map(|rows| &rows[k]);
            for row in [Some(&self.own[k]), mirrored].into_iter().flatten() {
                rows.values.extend_from_slice(row);
                rows.labels.push(self.data.examples[k].class);
            }
        }
        rows.weights = other_weight(self.data.labels.other(), &rows.labels).map(|(other, weight)| {
            rows.labels.iter().map(|class| if *class == other { weight } else { 1.0 }).collect()
        });
        rows
    }

    /// Mean weights of the classes, over both views if wanted.
    fn answer(&self, model: &dyn RowModel, k: usize, mirroring: Mirroring) -> Pmf {
        let mirrored = self.mirrored.as_ref().filter(|_| mirroring.views).map(|rows| rows[k].as_slice());
        answer(model, &self.own[k], mirrored)
    }

    /// Fits without each part of the grasps and answers that part.
    fn held_out(
        &self,
        (kind, classifier): (TabularKind, &Classifier),
        mirroring: Mirroring,
        fitting: &Fitting<'_>,
        progress: &dyn Fn(f64),
    ) -> Result<HeldOut, LearnError> {
        let parts = kind.parts();
        let part_of = self.data.folds(parts, fitting.seed ^ 0xca11b);
        let mut models: Vec<Option<Box<dyn RowModel>>> = Vec::new();
        let mut answers: Vec<(Pmf, usize)> = Vec::new();
        for part in 0..parts {
            let part_of = &part_of[..];
            let of = |inside: bool| (0..part_of.len()).filter(move |k| (part_of[*k] == part) == inside);
            if of(true).next().is_none() {
                models.push(None);
                continue;
            }
            fitting.check()?;
            let within = Fitting { progress: &|_| (), settings: fitting.settings.clone(), ..*fitting };
            let (model, _) = classifier.fit(&self.rows(of(false), mirroring), &within)?;
            for k in of(true) {
                let pmf = self.answer(model.as_ref(), k, mirroring);
                answers.push((pmf, self.data.examples[k].class));
            }
            models.push(Some(model));
            progress((part + 1) as f64 / parts as f64);
        }
        let (calibration, loss) = self.calibration(&answers);
        Ok(HeldOut { part_of, models, calibration, loss })
    }

    fn calibration(&self, answers: &[(Pmf, usize)]) -> (Calibration, f64) {
        let truths: Vec<usize> = answers.iter().map(|(_, truth)| *truth).collect();
        let other = other_weight(self.data.labels.other(), &truths);
        let weight = |class: usize| other.filter(|(other, _)| *other == class).map_or(1.0, |(_, weight)| weight);
        Calibration::fit(answers, weight, &TEMPERATURES)
    }

    /// Calibrates answers on the beginnings of held-out grasps, for each stage but the last.
    fn so_far(&self, maker: &RowMaker, held_out: &HeldOut, mirroring: Mirroring) -> Vec<Calibration> {
        let answers_in_part = held_out.models.iter().flatten().all(|model| model.answers_in_part());
        if !answers_in_part {
            return Vec::new();
        }
        let every = self.data.examples.len().div_ceil(MOST_BEGINNINGS);
        let calibration = |stage: usize| {
            let answer = |k: usize| {
                let model = held_out.models[held_out.part_of[k]].as_deref()?;
                let example = &self.data.examples[k];
                let beginning = example.grasp.until(maker.features.end_of_window(stage * STAGE));
                let (own, mirrored) = maker.views(&beginning);
                let own = maker.known(stage * STAGE, own);
                let mirrored = mirrored.filter(|_| mirroring.views).map(|row| maker.known(stage * STAGE, row));
                Some((answer(model, &own, mirrored.as_deref()), example.class))
            };
            let answers: Vec<(Pmf, usize)> = (0..self.own.len()).step_by(every).filter_map(answer).collect();
            self.calibration(&answers).0
        };
        (1..STAGES).map(calibration).collect()
    }
}

fn answer(model: &dyn RowModel, row: &[f32], mirrored: Option<&[f32]>) -> Pmf {
    let own = Pmf::from_weights(model.predict(row));
    let other = mirrored.map(|row| Pmf::from_weights(model.predict(row)));
    match &other {
        Some(other) => Pmf::mean([&own, other]).unwrap_or_else(|| own.clone()),
        None => own,
    }
}

impl Tabular {
    /// Fits features, classifier and temperature.
    pub(crate) fn fit(data: &Dataset, kind: TabularKind, fitting: &Fitting<'_>) -> Result<Self, LearnError> {
        check_enough(data, 2)?;
        fitting.refuse_settings()?;
        let features = Features::fit(kind.features(), data);
        let encoder = kind.reads_geometry().then(|| ReadEncoder::shipped_for(data)).transpose()?;
        let rows = RowMaker { features, encoder };
        let (own, mirrored): (Vec<_>, Vec<_>) = data.examples.iter().map(|e| rows.views(&e.grasp)).unzip();
        let mirrored = mirrored.into_iter().collect();
        let mut grasps = FeatureRows { data, columns: rows.width(), own, mirrored };
        let all = || 0..data.examples.len();
        let with_both = Mirroring { rows: true, views: true };
        let scaling = if kind.wants_scaling() { scaling(&grasps.rows(all(), with_both)) } else { Vec::new() };
        grasps.own.iter_mut().chain(grasps.mirrored.iter_mut().flatten()).for_each(|row| scale(row, &scaling));
        (fitting.progress)(0.1);
        fitting.check()?;
        let classifier = Classifier::of(kind, fitting);
        let tried = if grasps.mirrored.is_some() { kind.mirrorings() } else { &kind.mirrorings()[..1] };
        let held_out = |number: usize, mirroring: Mirroring| {
            let progress = |share: f64| (fitting.progress)(0.1 + 0.6 * (number as f64 + share) / tried.len() as f64);
            grasps.held_out((kind, &classifier), mirroring, fitting, &progress)
        };
        let (mut mirroring, mut best) = (tried[0], held_out(0, tried[0])?);
        for (number, other) in tried.iter().enumerate().skip(1) {
            let with_other = held_out(number, *other)?;
            if with_other.loss < best.loss {
                (mirroring, best) = (*other, with_other);
            }
        }
        let so_far = grasps.so_far(&rows, &best, mirroring);
        fitting.check()?;
        let last = Fitting {
            progress: &|share| (fitting.progress)(0.7 + 0.3 * share),
            settings: fitting.settings.clone(),
            ..*fitting
        };
        let (model, description) = classifier.fit(&grasps.rows(all(), mirroring), &last)?;
        (fitting.progress)(1.0);
        let learned = Learned {
            kind,
            features: rows.features.clone(),
            encoder: rows.encoder.as_ref().map(ReadEncoder::settings),
            scaling,
            model: description,
            calibration: Some(best.calibration),
            both_views: mirroring.views && rows.features.has_mirror(),
            so_far,
        };
        Ok(Self(Arc::new(Fitted { learned, rows, model, other: data.labels.other() })))
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, ModelError> {
        let learned: Learned = card.settings_as()?;
        let encoder = learned.encoder.as_ref().map(|settings| ReadEncoder::load(settings, &card.channels, arrays));
        let rows = RowMaker { features: learned.features.clone(), encoder: encoder.transpose()? };
        if rows.encoder.is_some() != learned.kind.reads_geometry() {
            return Err(ModelError::card("the geometry encoder"));
        }
        let (columns, classes) = (rows.width(), card.labels.classes.len());
        let scaled = !learned.kind.wants_scaling() || learned.scaling.len() == columns;
        if !learned.features.is_sound(card.channels.len()) || !scaled {
            return Err(ModelError::card("the feature definition"));
        }
        let in_stages = learned.so_far.is_empty() || learned.so_far.len() == STAGES - 1;
        if !in_stages || learned.calibration.iter().chain(&learned.so_far).any(|own| !own.is_sound(&TEMPERATURES)) {
            return Err(ModelError::card("the calibration"));
        }
        let model: Box<dyn RowModel> = match learned.kind.classifier() {
            Classifier::Forest(_) => Box::new(Forest::load(arrays, columns, classes)?),
            Classifier::GradientBoosting(_) => Box::new(GradientBoosting::load(arrays, columns, classes)?),
            Classifier::RusBoost(_) => Box::new(RusBoost::load(arrays, columns, classes)?),
            Classifier::Neighbours => Box::new(Neighbours::load(arrays, columns, classes)?),
            Classifier::Svm => Box::new(Svm::load(arrays, columns, classes)?),
        };
        if !(learned.so_far.is_empty() || model.answers_in_part()) {
            return Err(ModelError::card("the calibration"));
        }
        Ok(Self(Arc::new(Fitted { learned, rows, model, other: card.labels.other() })))
    }
}

impl Fitted {
    /// Answers on a grasp of which the first windows are over.
    fn recognise(&self, grasp: &Sequence, windows: usize, before: Option<&Pmf>) -> Verdict {
        let scaled = |mut row: Vec<f32>| {
            scale(&mut row, &self.learned.scaling);
            row
        };
        let known = |row| if windows < WINDOWS { self.rows.known(windows, row) } else { row };
        let (own, mirrored) = self.rows.views(grasp);
        let own = scaled(known(own));
        let mirrored = mirrored.filter(|_| self.learned.both_views).map(|row| scaled(known(row)));
        let pmf = answer(self.model.as_ref(), &own, mirrored.as_deref());
        // That of a stage is for its end: until then, less is known.
        let so_far = self.learned.so_far.get((windows / STAGE).max(1) - 1).copied();
        let calibration = so_far.or(self.learned.calibration);
        let pmf = calibration.map_or_else(|| pmf.clone(), |own| own.apply(&pmf));
        let pmf = as_one_of_many(&pmf, self.other);
        let pmf = before.map_or_else(|| pmf.clone(), |before| before.times(&pmf));
        Verdict { pmf, properties: None }
    }
}

impl Recogniser for Tabular {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        self.0.recognise(grasp, WINDOWS, before)
    }

    fn live(&self) -> Option<Box<dyn LiveRecogniser>> {
        let live = || Live { model: Arc::clone(&self.0), before: None, readings: Sequence::default(), windows: 0 };
        (!self.0.learned.so_far.is_empty()).then(|| Box::new(live()) as _)
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        self.0.model.save(&mut arrays);
        if let Some(encoder) = &self.0.rows.encoder {
            encoder.save(&mut arrays);
        }
        arrays
    }

    fn parameters(&self) -> usize {
        self.arrays().elements()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.0.learned).unwrap_or_default()
    }
}

/// A grasp of which the first windows are over.
struct Live {
    model: Arc<Fitted>,
    before: Option<Pmf>,
    readings: Sequence,
    /// Windows that were over at the last answer.
    windows: usize,
}

impl LiveRecogniser for Live {
    fn begin(&mut self, before: Option<&Pmf>) {
        (self.before, self.readings, self.windows) = (before.cloned(), Sequence::default(), 0);
    }

    fn push(&mut self, t: f32, row: &[f32]) -> Option<Verdict> {
        // The first reading of a window ends the one before.
        let windows = self.model.rows.features.window_of(t);
        let is_new = windows > std::mem::replace(&mut self.windows, windows) && !self.readings.is_empty();
        let verdict = is_new.then(|| self.model.recognise(&self.readings, windows, self.before.as_ref()));
        self.readings.t_s.push(t);
        self.readings.values.extend_from_slice(row);
        verdict
    }

    fn finish(&mut self) -> Option<Verdict> {
        (!self.readings.is_empty()).then(|| self.model.recognise(&self.readings, WINDOWS, self.before.as_ref()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance_tests::{made_up, quick};
    use crate::data::{Class, Example, Labels, OTHER};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn features_that_are_not_finite_are_refused() {
        let mut data = made_up(4, 1);
        // The sum of a window is infinite, and infinity minus the mean no number.
        Arc::make_mut(&mut data.examples[5].grasp).values.fill(f32::MAX);
        for kind in [TabularKind::Svm, TabularKind::Neighbours, TabularKind::DecisionTree] {
            let refused = Tabular::fit(&data, kind, &quick(1)).err();
            assert!(refused.is_some_and(|error| error.to_string().contains("not a finite number")), "{kind:?}");
        }
    }

    #[test]
    fn other_has_the_prior_of_one_class_however_many_grasps_it_has() {
        // Readings that tell nothing, many more of them of other objects.
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut grasp = || {
            let t_s: Vec<f32> = (0..40).map(|k| k as f32 * 0.1).collect();
            Arc::new(Sequence { values: t_s.iter().map(|_| random.random()).collect(), t_s })
        };
        let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
        let classes = ["ball", "cube", OTHER].map(class).to_vec();
        let example = |k: i64| Example { id: k, class: (k as usize).min(100) / 50, ..Example::default() };
        let data = Dataset {
            channels: vec!["grip".to_owned()],
            labels: Labels { classes, ..Labels::default() },
            examples: (0..500).map(|k| Example { grasp: grasp(), ..example(k) }).collect(),
            ..Dataset::default()
        };
        let model = Tabular::fit(&data, TabularKind::ExtraTrees, &quick(1)).expect("fits");
        let answers: Vec<Pmf> = (0..100).map(|_| model.recognise(&grasp(), None).pmf).collect();
        let mean = Pmf::mean(&answers).expect("has answers");
        let mean = mean.probabilities();
        // A third each, less the doubt that calibration mixes in; by their number alone the others would have 0.8.
        assert!((0.2..0.4).contains(&mean[2]) && (mean[0] - mean[1]).abs() < 0.08, "{mean:?}");
    }
}
