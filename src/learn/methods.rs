//! Table of recognition methods. To add one, add a line to [`METHODS`].

use crate::arrays::{Arrays, ModelError};
use crate::baselines::{Candle, Convolution, GeometryNetwork, Tabular, TabularKind, Warping};
use crate::belief::StopRule;
use crate::data::{Class, Dataset, fnv_1a};
use crate::fitting::{Fitting, LearnError};
use crate::gaps;
use crate::learned::LearnedGrasps;
use crate::model::{Model, ModelCard};
use crate::network::{self, Recipe};
use crate::recogniser::{Pupil, Recogniser};
use crate::signatures::Signatures;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Group of a method in tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodKind {
    /// Network of the paper or derived from one.
    Network,
    /// Single model that the paper compares with (section III-A).
    Single,
    /// Ensemble that the paper compares with (section III-A).
    Ensemble,
    /// Baseline that the paper does not name.
    Further,
}

impl MethodKind {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::Single => "single model",
            Self::Ensemble => "ensemble",
            Self::Further => "further",
        }
    }
}

type Fit = fn(&Dataset, &Fitting<'_>) -> Result<Box<dyn Recogniser>, LearnError>;
type Load = fn(&ModelCard, &Arrays) -> Result<Box<dyn Recogniser>, ModelError>;

/// Recognition method.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Key on the command line and in files.
    pub key: &'static str,
    /// Display name.
    pub title: &'static str,
    /// Group in tables.
    pub kind: MethodKind,
    /// One-line description.
    pub about: &'static str,
    /// Default settings; networks only.
    pub recipe: Option<fn() -> Recipe>,
    /// Fits a recogniser to data.
    pub fit: Fit,
    /// Restores a recogniser from the card and arrays of a model file.
    pub load: Load,
    /// Everything that decides a fit, besides the data, the seed and the options of the fit.
    decided_by: fn() -> serde_json::Value,
}

macro_rules! network {
    ($key:literal, $title:literal, $kind:ident, $about:literal, $recipe:expr) => {
        Method {
            key: $key,
            title: $title,
            kind: MethodKind::$kind,
            about: $about,
            recipe: Some(|| $recipe),
            fit: |data, fitting| network::fit(data, $recipe.adjusted(fitting)?, $title, fitting),
            load: network::load,
            decided_by: || network::decided_by(&$recipe),
        }
    };
}

macro_rules! baseline {
    ($key:literal, $title:literal, $kind:ident, $about:literal, $fit:expr, $type:ty, $decided_by:expr) => {
        Method {
            key: $key,
            title: $title,
            kind: MethodKind::$kind,
            about: $about,
            recipe: None,
            fit: |data, fitting| Ok(Box::new($fit(&*fitting.joined(data)?, fitting)?)),
            load: |card, arrays| Ok(Box::new(<$type>::load(card, arrays)?)),
            decided_by: $decided_by,
        }
    };
}

macro_rules! tabular {
    ($key:literal, $title:literal, $kind:ident, $about:literal, $tabular:ident) => {
        baseline!(
            $key,
            $title,
            $kind,
            $about,
            |data, fitting| Tabular::fit(data, TabularKind::$tabular, fitting),
            Tabular,
            || TabularKind::$tabular.decided_by()
        )
    };
}

macro_rules! candle {
    ($key:literal, $title:literal, $kind:ident, $about:literal, $network:ident) => {
        baseline!(
            $key,
            $title,
            $kind,
            $about,
            Candle::<$network>::fit,
            Candle<$network>,
            Candle::<$network>::decided_by
        )
    };
}

impl Method {
    /// Fits a model to data, fills in its card and adds the class signatures. Runs on one thread, whose CPU time is recorded.
    pub fn train(&self, data: &Dataset, fitting: &Fitting<'_>) -> Result<Model, LearnError> {
        let (readings, second) = (data.with_further(), fitting.second.map(Dataset::with_further));
        let fitting_all = Fitting { second: second.as_deref(), settings: fitting.settings.clone(), ..*fitting };
        let (recogniser, train_cpu_s) = on_one_thread(|| (self.fit)(&readings, &fitting_all))?;
        let data = fitting.joined(data)?;
        let deviations = self.recipe.map(|recipe| recipe().deviations_with(&fitting.settings)).transpose()?;
        let card = ModelCard {
            method: self.key.to_owned(),
            channels: data.channels.clone(),
            labels: data.labels.clone(),
            data: data.about.clone(),
            learned: LearnedGrasps::of(&data),
            settings: recogniser.settings(),
            fingerprint: Some(self.fingerprint()),
            deviations: deviations.unwrap_or_default(),
            stop: StopRule::default(),
            rejection: recogniser.rejection().cloned(),
            answer_sets: None,
            seed: fitting.seed,
            quick: fitting.quick,
            parameters: recogniser.parameters(),
            train_cpu_s,
            metrics: serde_json::Value::Null,
            signature_grasps: None,
            taught: Vec::new(),
            taught_from: BTreeMap::new(),
            lessons: Vec::new(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        let model = Model { card, recogniser: Arc::from(recogniser), signatures: None };
        Ok(model.with_signatures(Signatures::of(&gaps::filled_data(&data))))
    }

    /// Fingerprint of everything that decides a fit besides the data, the seed and the options of the fit: settings, features,
    /// and the versions of their code. Results with another one are of another method.
    pub fn fingerprint(&self) -> String {
        let decided_by = (self.decided_by)().to_string();
        let hash = fnv_1a(self.key.bytes().chain(decided_by.bytes()));
        format!("{:08x}", hash as u32 ^ (hash >> 32) as u32)
    }

    /// True for networks as the paper has them, which read whole grasps.
    pub fn is_strict(&self) -> bool {
        self.recipe.is_some_and(|recipe| recipe().strict)
    }

    /// Differences from the network of the paper that it stands for; empty for strict recipes as they stand and for
    /// methods that the paper does not define.
    pub fn deviations(&self) -> Vec<String> {
        self.recipe.map(|recipe| recipe().deviations()).unwrap_or_default()
    }
}

impl Model {
    /// True if it can be taught new objects.
    pub fn learns_new_objects(&self) -> bool {
        self.recogniser.as_pupil().is_some()
    }

    /// Refuses a model that cannot be taught new objects.
    pub fn check_learns_new_objects(&self) -> Result<(), LearnError> {
        self.pupil().map(|_pupil| ())
    }

    fn pupil(&self) -> Result<&dyn Pupil, LearnError> {
        self.recogniser.as_pupil().ok_or_else(|| {
            let title = method(&self.card.method).map_or(self.card.method.as_str(), |method| method.title);
            LearnError::Refused(format!(
                "this model ({title}) cannot learn new objects by itself; use one of the method geometry-network, such as \
                 those that come with Palpate, or train again with grasps of all objects"
            ))
        })
    }

    /// Learns grasps of new objects, besides what it knows: a class for each that it does not know yet, and more grasps of
    /// those that it knows. Results on its card were measured before and are left out. Runs on one thread.
    pub fn taught(&self, grasps: &Dataset, fitting: &Fitting<'_>) -> Result<Self, LearnError> {
        let known = &self.card.labels;
        let labels = known.with(&grasps.labels);
        let lessons = grasps.relabelled(&labels).ok_or_else(LearnError::no_data)?;
        let pupil = self.pupil()?;
        let (recogniser, train_cpu_s) = on_one_thread(|| pupil.taught(&lessons.with_further(), fitting))?;
        let signatures = self.signatures.as_ref().map(|own| own.with_new_classes(&gaps::filled_data(&lessons)));
        let mut card = self.card.clone();
        let is_new = |class: &Class| known.class(&class.name).is_none();
        card.taught.extend(labels.classes.iter().filter(|class| is_new(class)).map(|class| class.name.clone()));
        card.data.grasps += lessons.examples.len();
        card.learned.extend(&lessons);
        card.labels = labels;
        card.settings = recogniser.settings();
        card.parameters = recogniser.parameters();
        card.train_cpu_s += train_cpu_s;
        card.metrics = serde_json::Value::Null;
        // They were calibrated for other classes.
        card.answer_sets = None;
        Ok(Self { card, recogniser: Arc::from(recogniser), signatures: None }.with_signatures(signatures))
    }
}

impl Model {
    /// Forgets a class that it was taught; the answers for the others stay in the same proportions.
    pub fn without(&self, name: &str) -> Result<Self, LearnError> {
        let taught = |name: &str| self.card.taught.iter().any(|own| own == name);
        let class = self.card.labels.class(name).filter(|_| taught(name));
        let class = class.ok_or_else(|| LearnError::Refused(format!("the model was not taught \"{name}\"")))?;
        let recogniser = self.pupil()?.without(class)?;
        let signatures = self.signatures.as_ref().map(|own| own.without(class));
        let mut card = self.card.clone();
        card.taught.retain(|own| own != name);
        card.taught_from.remove(name);
        card.lessons.retain(|lesson| lesson.name != name);
        card.labels.classes.remove(class);
        card.settings = recogniser.settings();
        card.parameters = recogniser.parameters();
        Ok(Self { card, recogniser: Arc::from(recogniser), signatures: None }.with_signatures(signatures))
    }

    /// Gives a class that it was taught another name.
    pub fn renamed(&self, name: &str, new: &str) -> Self {
        let mut model = self.clone();
        let card = &mut model.card;
        let names = card.labels.classes.iter_mut().map(|class| &mut class.name).chain(&mut card.taught);
        names.filter(|own| *own == name).for_each(|own| new.clone_into(own));
        if let Some(from) = card.taught_from.remove(name) {
            card.taught_from.insert(new.to_owned(), from);
        }
        for lesson in &mut card.lessons {
            if lesson.name == name {
                new.clone_into(&mut lesson.name);
            }
            if let Some(count) = lesson.taken_for.remove(name) {
                lesson.taken_for.insert(new.to_owned(), count);
            }
        }
        model
    }
}

/// What a fit makes, and its CPU time (s).
fn on_one_thread<T: Send>(fit: impl FnOnce() -> Result<T, LearnError> + Send) -> Result<(T, f64), LearnError> {
    let timed = || {
        let start = cpu_time::ThreadTime::now();
        fit().map(|made| (made, start.elapsed().as_secs_f64()))
    };
    // candle would spread over all cores, which is slower for models this small. A caller with a thread of
    // its own counts the CPU time of the fit there.
    let has_own_thread = rayon::current_thread_index().is_some() && rayon::current_num_threads() == 1;
    if has_own_thread {
        timed()
    } else {
        rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(LearnError::failed)?.install(timed)
    }
}

/// All methods: the paper's networks first, then its baselines, then further ones.
pub const METHODS: [Method; 22] = [
    network!(
        "ds-lstm",
        "DS-LSTM",
        Network,
        "The paper's dual-stage LSTM: stage one estimates size and shape, stage two the class, each trained on one half \
         of the data",
        Recipe::dual_stage()
    ),
    network!(
        "ids-lstm",
        "iDS-LSTM",
        Network,
        "The paper's iterated DS-LSTM: the PMF of earlier grasps is fed back",
        Recipe::iterated()
    ),
    network!(
        "ds-lstm-cross",
        "DS-LSTM, cross-fitted",
        Network,
        "Dual-stage LSTM with both stages trained on all data: stage two learns from first stages applied to held-out \
         grasps",
        Recipe::dual_stage().cross_fitted()
    ),
    network!(
        "ids-lstm-cross",
        "iDS-LSTM, cross-fitted",
        Network,
        "Iterated DS-LSTM trained on all data by cross-fitting; used by the live model",
        Recipe::iterated().cross_fitted()
    ),
    network!(
        "macro-layer",
        "Macro-layer",
        Network,
        "The paper's recurrent macro-layer alone: LSTM, fully connected, dropout, fully connected",
        Recipe::macro_layer()
    ),
    network!(
        "paper-macro-layer",
        "Macro-layer, strict",
        Network,
        "The macro-layer as the paper has it: 75 Hz, channels as they are, one output at the end, nothing else",
        Recipe::paper_macro_layer()
    ),
    network!(
        "paper-ds-lstm",
        "DS-LSTM, strict",
        Network,
        "The dual-stage LSTM as the paper has it: stage two reads the size and shape that stage one decides",
        Recipe::paper_dual_stage()
    ),
    network!(
        "paper-ids-lstm",
        "iDS-LSTM, strict",
        Network,
        "The iterated DS-LSTM as the paper has it: trained on pairs of grasps, the PMF of the earlier one by a mock network",
        Recipe::paper_iterated()
    ),
    network!(
        "zuo",
        "Zuo et al.",
        Network,
        "The four-layer network that the paper builds on, as strict as the three before: LSTM, dropout, fully connected",
        Recipe::zuo()
    ),
    tabular!("decision-tree", "Decision tree", Single, "One tree on windowed means of all channels", DecisionTree),
    tabular!("knn", "KNN", Single, "Seven nearest neighbours on windowed means of all channels", Neighbours),
    tabular!("svm", "SVM", Single, "Support vector machine, Gaussian kernel, on windowed means of all channels", Svm),
    network!(
        "lstm",
        "LSTM",
        Single,
        "Plain LSTM with one output at the end, without augmentation or regularisation",
        Recipe::plain_lstm()
    ),
    tabular!("random-forest", "Random forest", Ensemble, "200 trees on windowed means of all channels", RandomForest),
    tabular!(
        "bagged-trees",
        "Bagged trees",
        Ensemble,
        "100 bagged trees on windowed means of all channels",
        BaggedTrees
    ),
    tabular!(
        "gradient-boosting",
        "Gradient boosting",
        Ensemble,
        "100 rounds of regression trees on the softmax deviance",
        GradientBoosting
    ),
    tabular!("rusboost", "RUSBoost (M2)", Ensemble, "AdaBoost.M2 on class-balanced random subsets", RusBoostM2),
    tabular!(
        "extra-trees",
        "Extra-trees",
        Further,
        "250 extremely randomised trees on windowed means, sums and differences of both fingers, and events",
        ExtraTrees
    ),
    tabular!(
        "geometry-trees",
        "Geometry trees",
        Further,
        "Extra-trees on the same features and those of the geometry encoder, which has learned from random shapes",
        GeometryTrees
    ),
    baseline!(
        "geometry-network",
        "Geometry network",
        Further,
        "The geometry encoder, fine-tuned to the classes; answers from the beginning of a grasp on",
        GeometryNetwork::fit,
        GeometryNetwork,
        GeometryNetwork::decided_by
    ),
    baseline!(
        "dtw-knn",
        "DTW-kNN",
        Further,
        "Five nearest neighbours by dynamic time warping",
        Warping::fit,
        Warping,
        Warping::decided_by
    ),
    candle!(
        "convolution",
        "Convolutional",
        Further,
        "Three convolutions over time and a dense layer, in plain candle",
        Convolution
    ),
];

/// Finds a method by its key.
pub fn method(key: &str) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.key == key)
}
