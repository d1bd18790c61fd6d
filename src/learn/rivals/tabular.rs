//! Recognisers of rows of features: how a grasp becomes a row, and which model answers it.

use super::super::data::{Dataset, Sequence};
use super::super::features::{FeatureKind, Features};
use super::super::forest::{
    Array, Examples, Forest, ForestSettings, GradientBoosting, GradientBoostingSettings, RusBoost, RusBoostForm,
    RusBoostSettings, Table, TreeSettings,
};
use super::super::model_file::{Arrays, ModelCard};
use super::super::{FitError, Fitting, Pmf, Recogniser, Verdict, check_enough};
use super::neighbours::Neighbours;
use super::svm::Svm;
use serde::{Deserialize, Serialize};

/// Which model answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(in super::super) enum TabularKind {
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

/// A model of rows.
#[derive(Debug)]
enum RowModel {
    Forest(Forest),
    Boosting(GradientBoosting),
    RusBoost(RusBoost),
    Neighbours(Neighbours),
    Svm(Svm),
}

/// A recogniser of rows of features.
#[derive(Debug)]
pub(in super::super) struct Tabular {
    learned: Learned,
    model: RowModel,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    kind: TabularKind,
    features: Features,
    /// Mean and one over the deviation of each feature; empty where a model does not care.
    scaling: Vec<(f32, f32)>,
    /// What was chosen for the model, in words.
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

/// Rows of features to learn from.
pub(super) struct Rows {
    pub(super) values: Vec<f32>,
    pub(super) columns: usize,
    pub(super) labels: Vec<usize>,
    pub(super) classes: usize,
}

impl Tabular {
    /// Fits a model; grasps are also shown with left and right exchanged, as to the networks.
    pub(in super::super) fn fit(data: &Dataset, kind: TabularKind, fitting: &Fitting<'_>) -> Result<Self, FitError> {
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
        let (model, words) = fit_model(&rows, kind, fitting)?;
        (fitting.progress)(1.0);
        Ok(Self { learned: Learned { kind, features, scaling, model: words }, model })
    }

    /// Brings a model back from its card and arrays.
    pub(in super::super) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, String> {
        let learned: Learned =
            serde_json::from_value(card.settings.clone()).map_err(|e| format!("its settings: {e}"))?;
        let width = learned.features.width();
        let scaled = !learned.kind.wants_scaling() || learned.scaling.len() == width;
        if !learned.features.is_sound(card.channels.len()) || !scaled {
            return Err("its features do not fit its channels".to_owned());
        }
        let classes = card.labels.classes.len();
        let trees = || tree_arrays(arrays);
        let model = match learned.kind {
            TabularKind::DecisionTree
            | TabularKind::RandomForest
            | TabularKind::BaggedTrees
            | TabularKind::MeasuresForest => {
                RowModel::Forest(Forest::from_arrays(&trees()?).map_err(|e| e.to_string())?)
            }
            TabularKind::GradientBoosting => {
                RowModel::Boosting(GradientBoosting::from_arrays(&trees()?).map_err(|e| e.to_string())?)
            }
            TabularKind::RusBoostM2 | TabularKind::RusBoostSamme => {
                RowModel::RusBoost(RusBoost::from_arrays(&trees()?).map_err(|e| e.to_string())?)
            }
            TabularKind::Neighbours => RowModel::Neighbours(Neighbours::load(arrays, width, classes)?),
            TabularKind::Svm | TabularKind::MeasuresSvm => RowModel::Svm(Svm::load(arrays, width, classes)?),
        };
        let model = Self { learned, model };
        let (columns, found) = model.sizes();
        if (columns, found) != (width, classes) {
            return Err("its trees do not fit its channels and labels".to_owned());
        }
        Ok(model)
    }

    fn sizes(&self) -> (usize, usize) {
        match &self.model {
            RowModel::Forest(model) => (model.columns(), model.classes()),
            RowModel::Boosting(model) => (model.columns(), model.classes()),
            RowModel::RusBoost(model) => (model.columns(), model.classes()),
            RowModel::Neighbours(model) => (model.columns(), model.classes()),
            RowModel::Svm(model) => (model.columns(), model.classes()),
        }
    }
}

/// Trees of an ensemble in a quick fit.
const QUICK: usize = 20;

fn fit_model(rows: &Rows, kind: TabularKind, fitting: &Fitting<'_>) -> Result<(RowModel, String), FitError> {
    let table = Table { values: &rows.values, columns: rows.columns };
    let examples = Examples { table, labels: &rows.labels, classes: rows.classes, weights: None };
    let failed = |e: super::super::forest::FitError| FitError::Failed { cause: e.to_string() };
    let seed = fitting.seed;
    let count = |full: usize| if fitting.quick { full.min(QUICK) } else { full };
    let forest = |settings: ForestSettings| {
        let settings = ForestSettings { seed, trees: count(settings.trees), ..settings };
        let words = format!("{settings:?}");
        Ok((RowModel::Forest(Forest::fit(&examples, &settings).map_err(failed)?), words))
    };
    let rus = |form: RusBoostForm, max_depth: Option<usize>| {
        let base = RusBoostSettings::default();
        let tree = TreeSettings { max_depth, ..base.tree };
        let settings = RusBoostSettings { form, seed, rounds: count(base.rounds), tree, ..base };
        let words = format!("{settings:?}");
        Ok((RowModel::RusBoost(RusBoost::fit(&examples, &settings).map_err(failed)?), words))
    };
    match kind {
        TabularKind::DecisionTree => forest(ForestSettings::decision_tree()),
        TabularKind::RandomForest | TabularKind::MeasuresForest => forest(ForestSettings::random_forest()),
        TabularKind::BaggedTrees => forest(ForestSettings::bagged_trees()),
        TabularKind::GradientBoosting => {
            let base = GradientBoostingSettings::default();
            let tree =
                TreeSettings { min_leaf: 10, features: super::super::forest::FeatureSampling::Sqrt, ..base.tree };
            let settings = GradientBoostingSettings { seed, rounds: count(base.rounds), tree, ..base };
            let words = format!("{settings:?}");
            Ok((RowModel::Boosting(GradientBoosting::fit(&examples, &settings).map_err(failed)?), words))
        }
        TabularKind::RusBoostM2 => rus(RusBoostForm::M2, None),
        TabularKind::RusBoostSamme => rus(RusBoostForm::Samme, Some(4)),
        TabularKind::Neighbours => {
            let model = Neighbours::fit(rows)?;
            let words = model.described();
            Ok((RowModel::Neighbours(model), words))
        }
        TabularKind::Svm | TabularKind::MeasuresSvm => {
            let model = Svm::fit(rows, fitting)?;
            let words = model.described();
            Ok((RowModel::Svm(model), words))
        }
    }
}

/// Mean and one over the deviation of each column; a column that never changes is left out by a factor of zero.
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

/// Features that hardly vary in training may vary wildly later; no single one may decide by its size.
const MOST_DEVIATIONS: f32 = 10.0;

fn scale(row: &mut [f32], scaling: &[(f32, f32)]) {
    for (x, (mean, factor)) in row.iter_mut().zip(scaling) {
        *x = ((*x - mean) * factor).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS);
    }
}

const TREES: &str = "trees.";

fn tree_arrays(arrays: &Arrays) -> Result<Vec<(String, Array)>, String> {
    let own = arrays.0.iter().filter_map(|(name, tensor)| Some((name.strip_prefix(TREES)?, name, tensor)));
    own.map(|(short, name, tensor)| {
        let array = match tensor.dtype() {
            candle_core::DType::F32 => Array::F32(arrays.get_f32(name)?),
            candle_core::DType::F64 => Array::F64(arrays.get_f64(name)?),
            _ => {
                let narrow =
                    |x: i64| i32::try_from(x).map_err(|_large| format!("array {name} holds too large a number"));
                Array::I32(arrays.get_integers(name)?.into_iter().map(narrow).collect::<Result<_, _>>()?)
            }
        };
        Ok((short.to_owned(), array))
    })
    .collect()
}

fn put_trees(arrays: &mut Arrays, trees: Vec<(String, Array)>) {
    for (name, array) in trees {
        let name = format!("{TREES}{name}");
        match array {
            Array::F32(values) => arrays.put(name, &[values.len()], &values),
            Array::F64(values) => arrays.put_f64(name, &values),
            Array::I32(values) => {
                arrays.put_integers(name, &values.into_iter().map(i64::from).collect::<Vec<_>>());
            }
        }
    }
}

impl Recogniser for Tabular {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let mut row = self.learned.features.row(grasp);
        scale(&mut row, &self.learned.scaling);
        let weights = match &self.model {
            RowModel::Forest(model) => model.predict(&row),
            RowModel::Boosting(model) => model.predict(&row),
            RowModel::RusBoost(model) => model.predict(&row),
            RowModel::Neighbours(model) => model.predict(&row),
            RowModel::Svm(model) => model.predict(&row),
        };
        let pmf = Pmf::from_weights(weights);
        Verdict { pmf: before.map_or_else(|| pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        match &self.model {
            RowModel::Forest(model) => put_trees(&mut arrays, model.to_arrays()),
            RowModel::Boosting(model) => put_trees(&mut arrays, model.to_arrays()),
            RowModel::RusBoost(model) => put_trees(&mut arrays, model.to_arrays()),
            RowModel::Neighbours(model) => model.save(&mut arrays),
            RowModel::Svm(model) => model.save(&mut arrays),
        }
        arrays
    }

    fn parameters(&self) -> usize {
        self.arrays().0.values().map(candle_core::Tensor::elem_count).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}
