//! Models on disk: a safetensors file with the card in its header. A copy of the card is written beside it as JSON for
//! people.

use crate::arrays::ModelError;
use crate::baselines::Shipped;
use crate::data::{Class, Labels, fnv_1a};
use crate::learned::LearnedGrasps;
use crate::methods::method;
use crate::model::{Model, ModelCard, why_unknown};
use crate::signatures::Signatures;
use crate::tensor_file::{self, TensorFile};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Largest file that is read (bytes).
const LARGEST_FILE: u64 = 1 << 30;

impl Shipped {
    /// Name of the model's file.
    pub fn model_file(self) -> &'static str {
        match self {
            Self::PerfectSensors => "live.safetensors",
            Self::AnyGripper => "any-gripper.safetensors",
            Self::FixedObjects => "fixed.safetensors",
        }
    }

    /// The model of the sixteen objects and the empty hand.
    pub fn model(self) -> Result<Model, ModelError> {
        Model::from_bytes(&format!("models/{}", self.model_file()), self.model_bytes())
    }

    /// Hash of the model's file, by which results of another one are told apart.
    pub fn model_content(self) -> u64 {
        fnv_1a(self.model_bytes().iter().copied())
    }

    fn model_bytes(self) -> &'static [u8] {
        match self {
            Self::PerfectSensors => include_bytes!("../../models/live.safetensors"),
            Self::AnyGripper => include_bytes!("../../models/any-gripper.safetensors"),
            Self::FixedObjects => include_bytes!("../../models/fixed.safetensors"),
        }
    }
}

/// Models in use, one for each kind of grasps; without one, such grasps are not recognised.
#[derive(Clone, Debug, Default)]
pub struct Models([Option<Arc<Model>>; Shipped::ALL.len()]);

impl Models {
    /// The shipped ones.
    pub fn shipped() -> Result<Self, ModelError> {
        let mut own = Self::default();
        for kind in Shipped::ALL {
            own.0[kind as usize] = Some(Arc::new(kind.model()?));
        }
        Ok(own)
    }

    /// One model for all kinds.
    pub fn all(model: &Arc<Model>) -> Self {
        Self(std::array::from_fn(|_| Some(Arc::clone(model))))
    }

    /// The model for a kind of grasps.
    pub fn of(&self, kind: Shipped) -> Option<&Arc<Model>> {
        self.0[kind as usize].as_ref()
    }

    /// With another model for real grippers.
    pub fn with_real(mut self, model: Option<Arc<Model>>) -> Self {
        self.0[Shipped::AnyGripper as usize] = model;
        self
    }

    /// With another model for simulated grasps: of fixed objects or of free ones, whichever it has learned, else of both.
    pub fn with_simulated(mut self, model: &Arc<Model>) -> Self {
        for fixed in model.card.data.supports() {
            self.0[Shipped::simulated(fixed) as usize] = Some(Arc::clone(model));
        }
        self
    }
}

fn unreadable(path: &Path, cause: &std::io::Error) -> ModelError {
    ModelError(format!("cannot read the model \"{}\": {cause}", path.display()))
}

impl Model {
    /// Encodes the model as a safetensors file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ModelError> {
        let card = serde_json::to_string(&self.card).map_err(|e| ModelError::malformed(&self.card.method, e))?;
        let mut arrays = self.recogniser.arrays();
        if let Some(signatures) = &self.signatures {
            signatures.put_into(&mut arrays);
        }
        tensor_file::encode(card, &arrays).map_err(|cause| ModelError::malformed(&self.card.method, cause))
    }

    /// Card for people, as JSON; it stands beside the model.
    pub fn card_text(&self) -> Result<String, ModelError> {
        // The file itself lists the grasps that were learned; nobody reads their hashes.
        let card = ModelCard { learned: LearnedGrasps::default(), ..self.card.clone() };
        let text = serde_json::to_string_pretty(&card).map_err(|e| ModelError::malformed(&self.card.method, e))?;
        Ok(text + "\n")
    }

    /// Reads a model from a file.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let unreadable = |cause: std::io::Error| unreadable(path, &cause);
        let about = std::fs::metadata(path).map_err(unreadable)?;
        if !about.is_file() {
            return Err(ModelError::malformed(&path.display().to_string(), "it is not a regular file"));
        }
        let size = about.len();
        if size > LARGEST_FILE {
            return Err(ModelError::malformed(&path.display().to_string(), format!("{size} bytes is too large")));
        }
        Self::from_bytes(&path.display().to_string(), &std::fs::read(path).map_err(unreadable)?)
    }

    /// Decodes a model. `name` is the file name in errors.
    ///
    /// Refuses files that are damaged, and arrays that are missing, unexpected, of the wrong type or shape, or not
    /// finite; the error names the array.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, ModelError> {
        let file = TensorFile::decode(bytes).map_err(|cause| ModelError::malformed(name, cause))?;
        let card =
            ModelCard::parse(&file.card).map_err(|e| ModelError::malformed(name, format!("invalid card: {e}")))?;
        let Some(method) = method(&card.method) else {
            let (method, why) = (&card.method, why_unknown(&card.method));
            return Err(ModelError(format!("\"{name}\" uses the method \"{method}\", {why}")));
        };
        let load = || -> Result<_, ModelError> {
            card.labels.check()?;
            card.answer_sets.iter().try_for_each(|sets| sets.check(card.labels.classes.len()))?;
            let mut arrays = file.arrays()?;
            let signatures = match &card.signature_grasps {
                Some(grasps) if grasps.len() != card.labels.classes.len() => {
                    return Err(ModelError::card("the number of grasps in the signatures"));
                }
                Some(grasps) => Some(Signatures::take_from(&mut arrays, &card.channels, grasps)?),
                None => None,
            };
            let recogniser = (method.load)(&card, &arrays)?;
            arrays.require_same_form(&recogniser.arrays())?;
            Ok((recogniser, signatures))
        };
        let (recogniser, signatures) = load().map_err(|cause| ModelError::invalid(name, &cause))?;
        Ok(Self { card, recogniser: Arc::from(recogniser), signatures: signatures.map(Arc::new) })
    }
}

impl Labels {
    /// Refuses labels from a file that have no class, or a class with an unknown size or shape.
    fn check(&self) -> Result<(), ModelError> {
        let known = |class: &Class| {
            class.size.is_none_or(|size| size < self.sizes.len())
                && class.shape.is_none_or(|shape| shape < self.shapes.len())
        };
        if self.classes.is_empty() || !self.classes.iter().all(known) {
            return Err(ModelError::card("the list of classes"));
        }
        Ok(())
    }
}

impl ModelCard {
    /// Path of a model's card: `live.json` for `live.safetensors`.
    pub fn path_beside(model: &Path) -> PathBuf {
        model.with_extension("json")
    }

    /// Reads the card beside a model file.
    pub fn beside(model: &Path) -> Result<Self, ModelError> {
        let path = Self::path_beside(model);
        let text = std::fs::read_to_string(&path).map_err(|error| unreadable(&path, &error))?;
        Self::parse(&text).map_err(|error| ModelError::malformed(&path.display().to_string(), error))
    }

    /// One-line summary: `Macro-layer, 4 classes, 128 grasps, macro F1 0.93`.
    pub fn described(&self) -> String {
        let title = method(&self.method).map_or(self.method.as_str(), |method| method.title);
        let mut parts = vec![
            title.to_owned(),
            format!("{} classes", self.labels.classes.len()),
            format!("{} grasps", self.data.grasps),
        ];
        parts.extend((!self.taught.is_empty()).then(|| format!("taught {}", self.taught.join(", "))));
        parts.extend(self.metrics["f1_macro"].as_f64().map(|f1| format!("macro F1 {f1:.2}")));
        parts.extend(self.only_simulated().then(|| "contact pressure: simulation only".to_owned()));
        parts.join(", ")
    }
}
