//! Recognisers that turn a grasp into a row of features and classify the row.

use super::neighbours::Neighbours;
use super::row_model::{RowModel, Rows};
use super::svm::Svm;
use crate::arrays::Arrays;
use crate::data::{Dataset, Sequence};
use crate::features::{FeatureKind, Features};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::forest::{
    Examples, FeatureSampling, Forest, ForestSettings, GradientBoosting, GradientBoostingSettings, RusBoost,
    RusBoostForm, RusBoostSettings, Table, TreeSettings,
};
use crate::model::{LoadError, ModelCard};
use crate::pmf::Pmf;
use crate::recogniser::{Recogniser, Verdict};
use serde::{Deserialize, Serialize};

/// Kind of features and classifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum TabularKind {
    DecisionTree,
    RandomForest,
    BaggedTrees,
    GradientBoosting,
    RusBoostM2,
    RusBoostSamme,
    Neighbours,
    Svm,
    MeasuresSvm,
    MeasuresForest,
}

/// Features and a classifier of them.
#[derive(Debug)]
pub(crate) struct Tabular {
    learned: Learned,
    model: Box<dyn RowModel>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    kind: TabularKind,
    features: Features,
    /// Mean and one over the standard deviation of each feature; empty for models that need no scaling.
    scaling: Vec<(f32, f32)>,
    /// Settings of the classifier, for people.
    model: String,
}

impl TabularKind {
    fn features(self) -> FeatureKind {
        match self {
            Self::MeasuresSvm | Self::MeasuresForest => FeatureKind::Measures,
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

    fn wants_scaling(self) -> bool {
        matches!(self, Self::Neighbours | Self::Svm | Self::MeasuresSvm)
    }
}

impl Tabular {
    /// Fits features and classifier. Mirrored grasps are added as examples.
    pub(crate) fn fit(data: &Dataset, kind: TabularKind, fitting: &Fitting<'_>) -> Result<Self, LearnError> {
        check_enough(data, 2)?;
        fitting.refuse_settings()?;
        let features = Features::fit(kind.features(), data);
        let mut rows = Rows {
            values: Vec::new(),
            columns: features.width(),
            labels: Vec::new(),
            classes: data.labels.classes.len(),
        };
        for example in &data.examples {
            for row in [Some(features.row(&example.grasp)), features.mirrored(&example.grasp)].into_iter().flatten() {
                rows.values.extend(row);
                rows.labels.push(example.class);
            }
        }
        let scaling = if kind.wants_scaling() { scaling(&rows) } else { Vec::new() };
        for row in rows.values.chunks_exact_mut(rows.columns.max(1)) {
            scale(row, &scaling);
        }
        (fitting.progress)(0.1);
        fitting.check()?;
        let (model, description) = fit_model(&rows, kind, fitting)?;
        (fitting.progress)(1.0);
        Ok(Self { learned: Learned { kind, features, scaling, model: description }, model })
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, LoadError> {
        let learned: Learned = card.settings_as()?;
        let (columns, classes) = (learned.features.width(), card.labels.classes.len());
        let scaled = !learned.kind.wants_scaling() || learned.scaling.len() == columns;
        if !learned.features.is_sound(card.channels.len()) || !scaled {
            return Err(LoadError::Card { part: "the feature definition" });
        }
        let model: Box<dyn RowModel> = match learned.kind {
            TabularKind::DecisionTree
            | TabularKind::RandomForest
            | TabularKind::BaggedTrees
            | TabularKind::MeasuresForest => Box::new(Forest::load(arrays, columns, classes)?),
            TabularKind::GradientBoosting => Box::new(GradientBoosting::load(arrays, columns, classes)?),
            TabularKind::RusBoostM2 | TabularKind::RusBoostSamme => Box::new(RusBoost::load(arrays, columns, classes)?),
            TabularKind::Neighbours => Box::new(Neighbours::load(arrays, columns, classes)?),
            TabularKind::Svm | TabularKind::MeasuresSvm => Box::new(Svm::load(arrays, columns, classes)?),
        };
        Ok(Self { learned, model })
    }
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

/// Largest number of trees or rounds in a quick fit.
const QUICK: usize = 20;

/// Fits the classifier of a kind; returns it with a description of its settings.
fn fit_model(rows: &Rows, kind: TabularKind, fitting: &Fitting<'_>) -> Result<(Box<dyn RowModel>, String), LearnError> {
    let table = Table { values: &rows.values, columns: rows.columns };
    let examples = Examples { table, labels: &rows.labels, classes: rows.classes, weights: None };
    let seed = fitting.seed;
    let count = |full: usize| if fitting.quick { full.min(QUICK) } else { full };
    let forest = |settings: ForestSettings| -> Result<(Box<dyn RowModel>, String), LearnError> {
        let settings = ForestSettings { seed, trees: count(settings.trees), ..settings };
        Ok((Box::new(Forest::fit(&examples, &settings)?), format!("{settings:?}")))
    };
    let rus = |form: RusBoostForm, max_depth: Option<usize>| -> Result<(Box<dyn RowModel>, String), LearnError> {
        let base = RusBoostSettings::default();
        let tree = TreeSettings { max_depth, ..base.tree };
        let settings = RusBoostSettings { form, seed, rounds: count(base.rounds), tree, ..base };
        Ok((Box::new(RusBoost::fit(&examples, &settings)?), format!("{settings:?}")))
    };
    match kind {
        TabularKind::DecisionTree => forest(ForestSettings::decision_tree()),
        TabularKind::RandomForest | TabularKind::MeasuresForest => forest(ForestSettings::random_forest()),
        TabularKind::BaggedTrees => forest(ForestSettings::bagged_trees()),
        TabularKind::GradientBoosting => {
            let base = GradientBoostingSettings::default();
            let tree = TreeSettings { min_leaf: 10, features: FeatureSampling::Sqrt, ..base.tree };
            let settings = GradientBoostingSettings { seed, rounds: count(base.rounds), tree, ..base };
            Ok((Box::new(GradientBoosting::fit(&examples, &settings)?), format!("{settings:?}")))
        }
        TabularKind::RusBoostM2 => rus(RusBoostForm::M2, None),
        TabularKind::RusBoostSamme => rus(RusBoostForm::Samme, Some(4)),
        TabularKind::Neighbours => Ok((Box::new(Neighbours::fit(rows)?), Neighbours::DESCRIPTION.to_owned())),
        TabularKind::Svm | TabularKind::MeasuresSvm => {
            let model = Svm::fit(rows, fitting)?;
            let description = model.described();
            Ok((Box::new(model), description))
        }
    }
}

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
        let mut row = self.learned.features.row(grasp);
        scale(&mut row, &self.learned.scaling);
        let pmf = Pmf::from_weights(self.model.predict(&row));
        Verdict { pmf: before.map_or_else(|| pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        self.model.save(&mut arrays);
        arrays
    }

    fn parameters(&self) -> usize {
        self.arrays().elements()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}
