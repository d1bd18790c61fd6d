//! Recognisers that turn a grasp into a row of features and classify the row.
//!
//! Probabilities are calibrated by a temperature and a share of doubt, fitted to the answers on held-out grasps: forests
//! and boosted trees order the classes well, but are far too unsure or too sure of them.

use super::felt_steps::Columns;
use super::geometry::{GeometryEncoder, Shipped};
use super::neighbours::Neighbours;
use super::other::{as_one_of_many, other_weight};
use super::row_model::{RowModel, Rows};
use super::svm::Svm;
use crate::arrays::Arrays;
use crate::data::{Dataset, Sequence};
use crate::features::{self, FeatureKind, Features};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::forest::{
    self, Examples, FeatureSampling, Forest, ForestSettings, GradientBoosting, GradientBoostingSettings, RusBoost,
    RusBoostForm, RusBoostSettings, Table, TreeSettings,
};
use crate::model::{LoadError, ModelCard};
use crate::pmf::Pmf;
use crate::recogniser::{Recogniser, Verdict};
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
    RusBoostSamme,
    Neighbours,
    Svm,
    MeasuresSvm,
    MeasuresForest,
}

/// Features and a classifier of them.
pub(crate) struct Tabular {
    learned: Learned,
    rows: RowMaker,
    model: Box<dyn RowModel>,
    /// The class "other".
    other: Option<usize>,
}

/// Features of a grasp, with those of the geometry encoder for classifiers that read them.
struct RowMaker {
    features: Features,
    encoder: Option<ReadEncoder>,
}

/// The geometry encoder with the columns of its channels.
struct ReadEncoder {
    encoder: Arc<GeometryEncoder>,
    columns: Columns,
}

impl ReadEncoder {
    /// The encoder on readings of these channels; none where they lack one of its own.
    fn on(encoder: Arc<GeometryEncoder>, channels: &[String]) -> Option<Self> {
        let columns = Columns::of(encoder.channels(), channels)?;
        Some(Self { encoder, columns })
    }

    fn features(&self, grasp: &Sequence) -> Vec<f32> {
        self.encoder.features(&self.columns.pick(grasp))
    }
}

impl RowMaker {
    fn width(&self) -> usize {
        self.features.width() + self.encoder.as_ref().map_or(0, |own| own.encoder.width())
    }

    /// Features of a grasp, and of its mirror image where it can be mirrored.
    fn views(&self, grasp: &Sequence) -> (Vec<f32>, Option<Vec<f32>>) {
        let (mut own, mut mirrored) = (self.features.row(grasp), self.features.mirrored(grasp));
        if let Some(encoder) = &self.encoder {
            // They are means over both views.
            let encoded = encoder.features(grasp);
            own.extend_from_slice(&encoded);
            mirrored.iter_mut().for_each(|row| row.extend_from_slice(&encoded));
        }
        (own, mirrored)
    }
}

/// Beginning of the names of the encoder's arrays in a model file.
const ENCODER: &str = "encoder.";

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
}

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
            Self::MeasuresSvm | Self::MeasuresForest => FeatureKind::Measures,
            Self::ExtraTrees | Self::GeometryTrees => FeatureKind::ExtendedCourse,
            Self::DecisionTree
            | Self::RandomForest
            | Self::BaggedTrees
            | Self::GradientBoosting
            | Self::RusBoostM2
            | Self::RusBoostSamme
            | Self::Neighbours
            | Self::Svm => FeatureKind::Course,
        }
    }

    fn reads_geometry(self) -> bool {
        self == Self::GeometryTrees
    }

    fn wants_scaling(self) -> bool {
        matches!(self, Self::Neighbours | Self::Svm | Self::MeasuresSvm)
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
            Self::GradientBoosting | Self::RusBoostM2 | Self::RusBoostSamme | Self::Svm | Self::MeasuresSvm => 3,
            _ => 6,
        }
    }

    fn classifier(self) -> Classifier {
        let rus = |form: RusBoostForm, max_depth: Option<usize>| {
            let base = RusBoostSettings::default();
            let tree = TreeSettings { max_depth, ..base.tree };
            Classifier::RusBoost(RusBoostSettings { form, tree, ..base })
        };
        match self {
            Self::DecisionTree => Classifier::Forest(ForestSettings::decision_tree()),
            Self::RandomForest | Self::MeasuresForest => Classifier::Forest(ForestSettings::random_forest()),
            Self::BaggedTrees => Classifier::Forest(ForestSettings::bagged_trees()),
            Self::ExtraTrees | Self::GeometryTrees => Classifier::Forest(ForestSettings::extra_trees()),
            Self::GradientBoosting => {
                let base = GradientBoostingSettings::default();
                let tree = TreeSettings { min_leaf: 10, features: FeatureSampling::Sqrt, ..base.tree };
                Classifier::GradientBoosting(GradientBoostingSettings { tree, ..base })
            }
            Self::RusBoostM2 => rus(RusBoostForm::M2, None),
            Self::RusBoostSamme => rus(RusBoostForm::Samme, Some(4)),
            Self::Neighbours => Classifier::Neighbours,
            Self::Svm | Self::MeasuresSvm => Classifier::Svm,
        }
    }

    /// Everything that decides a fit, besides the data, the seed and the options of the fit.
    pub(crate) fn decided_by(self) -> serde_json::Value {
        let classifier = match self.classifier() {
            Classifier::Neighbours => Neighbours::DESCRIPTION.to_owned(),
            Classifier::Svm => Svm::decided_by(),
            trees => format!("{trees:?}, revision {}", forest::REVISION),
        };
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
        let weights = rows.weights.as_deref();
        let examples = Examples { table, labels: &rows.labels, classes: rows.classes, weights };
        Ok(match self {
            Self::Forest(settings) => (Box::new(Forest::fit(&examples, settings)?), format!("{settings:?}")),
            Self::GradientBoosting(settings) => {
                (Box::new(GradientBoosting::fit(&examples, settings)?), format!("{settings:?}"))
            }
            Self::RusBoost(settings) => (Box::new(RusBoost::fit(&examples, settings)?), format!("{settings:?}")),
            Self::Neighbours => (Box::new(Neighbours::fit(rows)?), Neighbours::DESCRIPTION.to_owned()),
            Self::Svm => {
                let model = Svm::fit(rows, fitting)?;
                let description = model.described();
                (Box::new(model), description)
            }
        })
    }
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

    /// Fits without each part of the grasps and answers that part; returns the calibration and the
    /// negative log-likelihood with it.
    fn calibrated(
        &self,
        (kind, classifier): (TabularKind, &Classifier),
        mirroring: Mirroring,
        fitting: &Fitting<'_>,
        progress: &dyn Fn(f64),
    ) -> Result<(Calibration, f64), LearnError> {
        let parts = kind.parts();
        let part_of = &self.data.folds(parts, fitting.seed ^ 0xca11b)[..];
        let mut answers: Vec<(Pmf, usize)> = Vec::new();
        for part in 0..parts {
            let of = |inside: bool| (0..part_of.len()).filter(move |k| (part_of[*k] == part) == inside);
            if of(true).next().is_none() {
                continue;
            }
            fitting.check()?;
            let within = Fitting { progress: &|_| (), settings: fitting.settings.clone(), ..*fitting };
            let (model, _) = classifier.fit(&self.rows(of(false), mirroring), &within)?;
            for k in of(true) {
                let pmf = self.answer(model.as_ref(), k, mirroring);
                answers.push((pmf, self.data.examples[k].class));
            }
            progress((part + 1) as f64 / parts as f64);
        }
        let truths: Vec<usize> = answers.iter().map(|(_, truth)| *truth).collect();
        let other = other_weight(self.data.labels.other(), &truths);
        let weight = |class: usize| other.filter(|(other, _)| *other == class).map_or(1.0, |(_, weight)| weight);
        Ok(Calibration::fit(&answers, weight, &TEMPERATURES))
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
        let encoder = kind.reads_geometry().then(|| encoder_of(data)).transpose()?;
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
        let calibrated = |number: usize, mirroring: Mirroring| {
            let progress = |share: f64| (fitting.progress)(0.1 + 0.6 * (number as f64 + share) / tried.len() as f64);
            grasps.calibrated((kind, &classifier), mirroring, fitting, &progress)
        };
        let (mut mirroring, (mut calibration, mut least)) = (tried[0], calibrated(0, tried[0])?);
        for (number, other) in tried.iter().enumerate().skip(1) {
            let (with_other, loss) = calibrated(number, *other)?;
            if loss < least {
                (mirroring, calibration, least) = (*other, with_other, loss);
            }
        }
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
            encoder: rows.encoder.as_ref().map(|own| own.encoder.settings()),
            scaling,
            model: description,
            calibration: Some(calibration),
            both_views: mirroring.views && rows.features.has_mirror(),
        };
        Ok(Self { learned, rows, model, other: data.labels.other() })
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, LoadError> {
        let learned: Learned = card.settings_as()?;
        let encoder = learned.encoder.as_ref().map(|settings| load_encoder(settings, &card.channels, arrays));
        let rows = RowMaker { features: learned.features.clone(), encoder: encoder.transpose()? };
        if rows.encoder.is_some() != learned.kind.reads_geometry() {
            return Err(LoadError::Card { part: "the geometry encoder" });
        }
        let (columns, classes) = (rows.width(), card.labels.classes.len());
        let scaled = !learned.kind.wants_scaling() || learned.scaling.len() == columns;
        if !learned.features.is_sound(card.channels.len()) || !scaled {
            return Err(LoadError::Card { part: "the feature definition" });
        }
        if learned.calibration.is_some_and(|own| !own.is_sound(&TEMPERATURES)) {
            return Err(LoadError::Card { part: "the calibration" });
        }
        let model: Box<dyn RowModel> = match learned.kind.classifier() {
            Classifier::Forest(_) => Box::new(Forest::load(arrays, columns, classes)?),
            Classifier::GradientBoosting(_) => Box::new(GradientBoosting::load(arrays, columns, classes)?),
            Classifier::RusBoost(_) => Box::new(RusBoost::load(arrays, columns, classes)?),
            Classifier::Neighbours => Box::new(Neighbours::load(arrays, columns, classes)?),
            Classifier::Svm => Box::new(Svm::load(arrays, columns, classes)?),
        };
        Ok(Self { learned, rows, model, other: card.labels.other() })
    }
}

/// The shipped geometry encoder for such grasps.
fn encoder_of(data: &Dataset) -> Result<ReadEncoder, LearnError> {
    let encoder = Shipped::of(&data.about).encoder().map_err(LearnError::failed)?;
    let needs = encoder.channels().join(", ");
    let found = || data.channels.join(", ");
    ReadEncoder::on(encoder, &data.channels).ok_or_else(|| LearnError::Encoder { needs, found: found() })
}

/// Restores the geometry encoder of a model file.
fn load_encoder(settings: &serde_json::Value, channels: &[String], arrays: &Arrays) -> Result<ReadEncoder, LoadError> {
    let encoder = Arc::new(GeometryEncoder::load_from(settings, arrays, ENCODER)?);
    ReadEncoder::on(encoder, channels).ok_or(LoadError::Card { part: "the geometry encoder" })
}

/// The tree ensembles offer the methods of [`RowModel`] themselves, so that `forest` need not know this trait.
macro_rules! row_models {
    ($($ensemble:ty),*) => {
        $(impl RowModel for $ensemble {
            fn predict(&self, row: &[f32]) -> Vec<f64> {
                self.predict(row)
            }

            fn save(&self, arrays: &mut Arrays) {
                self.save(arrays);
            }
        })*
    };
}

row_models!(Forest, GradientBoosting, RusBoost);

/// Mean and one over the standard deviation of each column; the factor of a constant column is zero.
fn scaling(rows: &Rows) -> Vec<(f32, f32)> {
    let count = rows.labels.len().max(1) as f64;
    (0..rows.columns)
        .map(|column| {
            let values = || rows.values.iter().skip(column).step_by(rows.columns).map(|x| f64::from(*x));
            let mean = values().sum::<f64>() / count;
            let deviation = (values().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
            let factor = if deviation > 1e-6 * mean.abs().max(1e-30) { 1.0 / deviation } else { 0.0 };
            (mean as f32, factor as f32)
        })
        .collect()
}

/// Bound of scaled features: one that hardly varied in training must not dominate later.
const MOST_DEVIATIONS: f32 = 10.0;

fn scale(row: &mut [f32], scaling: &[(f32, f32)]) {
    for (x, (mean, factor)) in row.iter_mut().zip(scaling) {
        *x = ((*x - mean) * factor).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS);
    }
}

impl Recogniser for Tabular {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let scaled = |mut row: Vec<f32>| {
            scale(&mut row, &self.learned.scaling);
            row
        };
        let (own, mirrored) = self.rows.views(grasp);
        let own = scaled(own);
        let mirrored = mirrored.filter(|_| self.learned.both_views).map(scaled);
        let pmf = answer(self.model.as_ref(), &own, mirrored.as_deref());
        let pmf = self.learned.calibration.map_or_else(|| pmf.clone(), |own| own.apply(&pmf));
        let pmf = as_one_of_many(&pmf, self.other);
        let pmf = before.map_or_else(|| pmf.clone(), |before| before.times(&pmf));
        Verdict { pmf, properties: None }
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        self.model.save(&mut arrays);
        if let Some(ReadEncoder { encoder, .. }) = &self.rows.encoder {
            arrays.0.extend(encoder.arrays().0.into_iter().map(|(name, array)| (format!("{ENCODER}{name}"), array)));
        }
        arrays
    }

    fn parameters(&self) -> usize {
        self.arrays().elements()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance_tests::quick;
    use crate::data::{Class, Example, Labels, OTHER};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

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
