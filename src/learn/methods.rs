//! The list of recognisers. Adding one is adding a line.

use super::data::Dataset;
use super::model_file::{Arrays, Model, ModelCard};
use super::network::{Recipe, TactileNetwork};
use super::rivals::{Convolution, Tabular, TabularKind, Warping};
use super::{FitError, Fitting, Recogniser, StopRule};
use std::sync::Arc;

/// What a method is among the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A network of the paper, or one that goes on from it.
    Network,
    /// A single model that the paper compares with.
    Single,
    /// An ensemble that the paper compares with.
    Ensemble,
    /// A rival that the paper does not name.
    Further,
}

type Fit = fn(&Dataset, &Fitting<'_>) -> Result<Box<dyn Recogniser>, FitError>;
type Load = fn(&ModelCard, &Arrays) -> Result<Box<dyn Recogniser>, String>;

/// A way to recognise.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Names it on the command line and in files.
    pub key: &'static str,
    /// What people call it.
    pub title: &'static str,
    /// What it is among the others.
    pub kind: Kind,
    /// What it is, in a sentence.
    pub about: &'static str,
    /// Its settings before anything is changed, for networks.
    pub recipe: Option<fn() -> Recipe>,
    /// Fits it to data.
    pub fit: Fit,
    /// Brings it back from a file; the text says what is wrong.
    pub load: Load,
}

macro_rules! network {
    ($key:literal, $title:literal, $about:literal, $recipe:expr) => {
        Method {
            key: $key,
            title: $title,
            kind: Kind::Network,
            about: $about,
            recipe: Some(|| $recipe),
            fit: |data, fitting| Ok(Box::new(TactileNetwork::fit(data, $recipe.adjusted(fitting)?, $title, fitting)?)),
            load: |card, arrays| Ok(Box::new(TactileNetwork::load(card, arrays)?)),
        }
    };
}

macro_rules! tabular {
    ($key:literal, $title:literal, $kind:ident, $about:literal, $tabular:ident) => {
        Method {
            key: $key,
            title: $title,
            kind: Kind::$kind,
            about: $about,
            recipe: None,
            fit: |data, fitting| Ok(Box::new(Tabular::fit(data, TabularKind::$tabular, fitting)?)),
            load: |card, arrays| Ok(Box::new(Tabular::load(card, arrays)?)),
        }
    };
}

impl Method {
    /// Fits it to data and writes the card.
    pub fn train(&self, data: &Dataset, fitting: &Fitting<'_>) -> Result<Model, FitError> {
        // A pool of one thread: candle would spread over all cores and be slower for it, and its time is told whole.
        let failed = |e: rayon::ThreadPoolBuildError| FitError::Failed { cause: e.to_string() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(failed)?;
        let (recogniser, train_cpu_s) = pool.install(|| {
            let start = cpu_time::ThreadTime::now();
            (self.fit)(data, fitting).map(|recogniser| (recogniser, start.elapsed().as_secs_f64()))
        })?;
        let card = ModelCard {
            method: self.key.to_owned(),
            channels: data.channels.clone(),
            labels: data.labels.clone(),
            data: data.about.clone(),
            settings: recogniser.settings(),
            stop: StopRule::default(),
            rejection: recogniser.rejection().cloned(),
            seed: fitting.seed,
            quick: fitting.quick,
            parameters: recogniser.parameters(),
            train_cpu_s,
            metrics: serde_json::Value::Null,
            version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        Ok(Model { card, recogniser: Arc::from(recogniser) })
    }
}

/// All methods, the paper's own first.
pub const METHODS: [Method; 20] = [
    network!(
        "ds-lstm",
        "DS-LSTM",
        "The paper's dual-stage LSTM: size and shape first, on one half of the data, then \
        the class, on the other half",
        Recipe::dual_stage()
    ),
    network!(
        "ids-lstm",
        "iDS-LSTM",
        "The paper's iterated DS-LSTM: the PMF of earlier grasps is fed back",
        Recipe::iterated()
    ),
    network!(
        "ds-lstm-cross",
        "DS-LSTM, cross-fitted",
        "The dual-stage LSTM with both stages on all data: stage two \
        learns from what first stages say of grasps they have not seen",
        Recipe::dual_stage().cross_fitted()
    ),
    network!(
        "ids-lstm-cross",
        "iDS-LSTM, cross-fitted",
        "The iterated DS-LSTM on all data, by cross-fitting; the live \
        model is of this kind",
        Recipe::iterated().cross_fitted()
    ),
    network!(
        "macro-layer",
        "Macro-layer",
        "The paper's recurrent macro-layer by itself: LSTM, fully connected, \
        dropout, fully connected",
        Recipe::macro_layer()
    ),
    network!(
        "committee",
        "Committee",
        "Four macro-layers that began from other weights and answer together",
        Recipe::committee()
    ),
    network!(
        "zuo",
        "Zuo et al.",
        "The four-layer network from which the paper starts: LSTM, dropout, fully connected",
        Recipe::zuo()
    ),
    tabular!("decision-tree", "Decision tree", Single, "One tree on the course of all channels", DecisionTree),
    tabular!("knn", "KNN", Single, "Seven nearest neighbours on the course of all channels", Neighbours),
    tabular!("svm", "SVM", Single, "Support vectors with a Gaussian kernel on the course of all channels", Svm),
    Method {
        key: "lstm",
        title: "LSTM",
        kind: Kind::Single,
        about: "A plain LSTM, read out at the end, without augmentation or regularisation",
        recipe: Some(Recipe::plain_lstm),
        fit: |data, fitting| {
            Ok(Box::new(TactileNetwork::fit(data, Recipe::plain_lstm().adjusted(fitting)?, "LSTM", fitting)?))
        },
        load: |card, arrays| Ok(Box::new(TactileNetwork::load(card, arrays)?)),
    },
    tabular!("random-forest", "Random forest", Ensemble, "200 trees on the course of all channels", RandomForest),
    tabular!("bagged-trees", "Bagged trees", Ensemble, "100 bagged trees on the course of all channels", BaggedTrees),
    tabular!(
        "gradient-boosting",
        "Gradient boosting",
        Ensemble,
        "100 rounds of regression trees on the softmax \
        deviance",
        GradientBoosting
    ),
    tabular!(
        "rusboost",
        "RUSBoost (M2)",
        Ensemble,
        "AdaBoost.M2 over rounds with as many grasps of each class",
        RusBoostM2
    ),
    tabular!(
        "rusboost-samme",
        "RUSBoost (SAMME)",
        Ensemble,
        "The same in the SAMME form of imbalanced-learn",
        RusBoostSamme
    ),
    tabular!("measures-svm", "Measures + SVM", Further, "Support vectors on hand-made measures", MeasuresSvm),
    tabular!("measures-forest", "Measures + forest", Further, "A random forest on hand-made measures", MeasuresForest),
    Method {
        key: "dtw-knn",
        title: "DTW-kNN",
        kind: Kind::Further,
        about: "Five nearest neighbours by dynamic time warping",
        recipe: None,
        fit: |data, fitting| Ok(Box::new(Warping::fit(data, fitting)?)),
        load: |card, arrays| Ok(Box::new(Warping::load(card, arrays)?)),
    },
    Method {
        key: "convolution",
        title: "Convolutional",
        kind: Kind::Further,
        about: "A small convolutional network over time, in plain candle",
        recipe: None,
        fit: |data, fitting| Ok(Box::new(Convolution::fit(data, fitting)?)),
        load: |card, arrays| Ok(Box::new(Convolution::load(card, arrays)?)),
    },
];

/// A method by its key.
pub fn method(key: &str) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.key == key)
}
