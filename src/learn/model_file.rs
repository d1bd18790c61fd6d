//! Models on disk: a safetensors file whose header carries a card, so that neither can lose the other. The card is also
//! written beside it as JSON, for people.

use super::data::{DataCard, Labels};
use super::methods::method;
use super::{Recogniser, Rejection, StopRule};
use candle_core::{DType, Device, Tensor};
use safetensors::SafeTensors;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a recogniser has learned, by name.
#[derive(Clone, Debug, Default)]
pub struct Arrays(pub BTreeMap<String, Tensor>);

/// Everything about a model but its numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCard {
    /// Key of the method.
    pub method: String,
    /// Channels it reads, in order.
    pub channels: Vec<String>,
    /// What it can answer.
    pub labels: Labels,
    /// The data it was fitted to.
    pub data: DataCard,
    /// Settings and what was found while fitting.
    pub settings: serde_json::Value,
    /// When to stop grasping.
    pub stop: StopRule,
    /// From which agreement on an object counts as known.
    pub rejection: Option<Rejection>,
    /// Seed of the fit.
    pub seed: u64,
    /// Whether it was fitted in the quick form.
    #[serde(default)]
    pub quick: bool,
    /// Numbers learned.
    pub parameters: usize,
    /// CPU time of the fit (s).
    pub train_cpu_s: f64,
    /// What it reached on grasps it had not seen, where that was measured.
    #[serde(default)]
    pub metrics: serde_json::Value,
    /// Version of the program that made it.
    pub version: String,
}

/// A recogniser with its card.
#[derive(Clone)]
pub struct Model {
    /// What it is.
    pub card: ModelCard,
    /// What it does.
    pub recogniser: Arc<dyn Recogniser>,
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model").field("card", &self.card).finish_non_exhaustive()
    }
}

/// Why a model cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The file.
    #[error("cannot read the model \"{path}\": {cause}", path = path.display())]
    Unreadable {
        /// The path.
        path: PathBuf,
        /// What the system says.
        cause: String,
    },
    /// The file cannot be written.
    #[error("cannot write the model \"{path}\": {cause}", path = path.display())]
    Unwritable {
        /// The path.
        path: PathBuf,
        /// What the system says.
        cause: String,
    },
    /// Not a model, or one cut short.
    #[error("\"{name}\" is not a whole model of Palpate's: {cause}; train or copy it again")]
    Malformed {
        /// The file.
        name: String,
        /// What is wrong.
        cause: String,
    },
    /// A method this program does not know.
    #[error("\"{name}\" was made by the method \"{method}\", which this version does not know; update Palpate")]
    UnknownMethod {
        /// The file.
        name: String,
        /// The method.
        method: String,
    },
    /// Channels that do not fit.
    #[error("the model reads other channels than there are: {difference}")]
    Channels {
        /// Which are missing, and which are not known to it.
        difference: String,
    },
}

const CARD_KEY: &str = "palpate";
/// A model larger than this is refused (bytes).
const LARGEST_FILE: u64 = 1 << 30;

impl Model {
    /// Refuses channels that the model was not made for, by the names that differ.
    pub fn check_channels(&self, channels: &[String]) -> Result<(), ModelError> {
        let own = &self.card.channels;
        if own == channels {
            return Ok(());
        }
        let only =
            |a: &[String], b: &[String]| -> Vec<String> { a.iter().filter(|c| !b.contains(c)).cloned().collect() };
        let (missing, extra) = (only(own, channels), only(channels, own));
        let mut parts = Vec::new();
        if !missing.is_empty() {
            parts.push(format!("it needs {}", missing.join(", ")));
        }
        if !extra.is_empty() {
            parts.push(format!("it does not know {}", extra.join(", ")));
        }
        if parts.is_empty() {
            parts.push(format!("the order differs; it reads {}", own.join(", ")));
        }
        Err(ModelError::Channels { difference: parts.join(", and ") })
    }

    /// The bytes of a safetensors file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ModelError> {
        let failed = |cause: String| ModelError::Malformed { name: self.card.method.clone(), cause };
        let card = serde_json::to_string(&self.card).map_err(|e| failed(e.to_string()))?;
        let header = HashMap::from([(CARD_KEY.to_owned(), card)]);
        let arrays = self.recogniser.arrays();
        safetensors::serialize(arrays.0.iter().map(|(name, tensor)| (name.as_str(), tensor)), Some(header))
            .map_err(|e| failed(e.to_string()))
    }

    /// Writes the model, and its card beside it; a kill leaves the old file or the new one.
    pub fn save(&self, path: &Path) -> Result<(), ModelError> {
        let card = serde_json::to_string_pretty(&self.card)
            .map_err(|e| ModelError::Malformed { name: path.display().to_string(), cause: e.to_string() })?;
        write_whole(path, &self.to_bytes()?)?;
        write_whole(&card_path(path), (card + "\n").as_bytes())
    }

    /// Reads a model from a file.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let unreadable =
            |cause: std::io::Error| ModelError::Unreadable { path: path.to_owned(), cause: cause.to_string() };
        let size = std::fs::metadata(path).map_err(unreadable)?.len();
        if size > LARGEST_FILE {
            let cause = format!("it has {size} bytes");
            return Err(ModelError::Malformed { name: path.display().to_string(), cause });
        }
        Self::from_bytes(&path.display().to_string(), &std::fs::read(path).map_err(unreadable)?)
    }

    /// A model from the bytes of its file; `name` is for messages.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, ModelError> {
        let bad = |cause: String| ModelError::Malformed { name: name.to_owned(), cause };
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|e| bad(e.to_string()))?;
        let card =
            header.metadata().as_ref().and_then(|m| m.get(CARD_KEY)).ok_or_else(|| bad("it has no card".into()))?;
        let card: ModelCard = serde_json::from_str(card).map_err(|e| bad(format!("its card: {e}")))?;
        let tensors = candle_core::safetensors::load_buffer(bytes, &Device::Cpu).map_err(|e| bad(e.to_string()))?;
        let Some(method) = method(&card.method) else {
            return Err(ModelError::UnknownMethod { name: name.to_owned(), method: card.method });
        };
        let arrays = Arrays(tensors.into_iter().collect());
        let recogniser = (method.load)(&card, &arrays).map_err(bad)?;
        Ok(Self { card, recogniser: Arc::from(recogniser) })
    }
}

impl ModelCard {
    /// The card that stands beside a model as JSON.
    pub fn beside(model: &Path) -> Result<Self, ModelError> {
        let path = card_path(model);
        let text = std::fs::read_to_string(&path)
            .map_err(|error| ModelError::Unreadable { path: path.clone(), cause: error.to_string() })?;
        serde_json::from_str(&text)
            .map_err(|error| ModelError::Malformed { name: path.display().to_string(), cause: error.to_string() })
    }

    /// In a line: `Macro-layer, 4 classes, 128 grasps, macro F1 0.93`.
    pub fn described(&self) -> String {
        let title = method(&self.method).map_or(self.method.as_str(), |method| method.title);
        let mut parts = vec![
            title.to_owned(),
            format!("{} classes", self.labels.classes.len()),
            format!("{} grasps", self.data.grasps),
        ];
        parts.extend(self.metrics["f1_macro"].as_f64().map(|f1| format!("macro F1 {f1:.2}")));
        parts.join(", ")
    }
}

/// Where the card of a model stands: `live.safetensors` has `live.json`.
fn card_path(path: &Path) -> PathBuf {
    path.with_extension("json")
}

fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ModelError> {
    let unfinished = path.with_extension("unfinished");
    let written = (|| {
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(&unfinished, bytes)?;
        std::fs::rename(&unfinished, path)
    })();
    written.map_err(|cause| {
        // The remains are of no use; that they may not be removable either adds nothing to the message.
        let _gone = std::fs::remove_file(&unfinished);
        ModelError::Unwritable { path: path.to_owned(), cause: cause.to_string() }
    })
}

impl Arrays {
    /// Adds numbers under a name, in a shape.
    pub fn put(&mut self, name: impl Into<String>, shape: &[usize], values: &[f32]) {
        if let Ok(tensor) = Tensor::from_slice(values, shape, &Device::Cpu) {
            self.0.insert(name.into(), tensor);
        }
    }

    /// Adds double-precision numbers under a name.
    pub fn put_f64(&mut self, name: impl Into<String>, values: &[f64]) {
        if let Ok(tensor) = Tensor::from_slice(values, values.len(), &Device::Cpu) {
            self.0.insert(name.into(), tensor);
        }
    }

    /// Adds whole numbers under a name.
    pub fn put_integers(&mut self, name: impl Into<String>, values: &[i64]) {
        if let Ok(tensor) = Tensor::from_slice(values, values.len(), &Device::Cpu) {
            self.0.insert(name.into(), tensor);
        }
    }

    /// The numbers under a name, finite and of a shape; or what is wrong with them.
    pub fn get(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, String> {
        let tensor = self.tensor(name, DType::F32)?;
        if tensor.dims() != shape {
            return Err(format!("array {name} has shape {:?} instead of {shape:?}", tensor.dims()));
        }
        let values: Vec<f32> = tensor.flatten_all().and_then(|t| t.to_vec1()).map_err(|e| e.to_string())?;
        if values.iter().all(|v| v.is_finite()) { Ok(values) } else { Err(format!("array {name} holds no numbers")) }
    }

    /// All numbers under a name.
    pub fn get_f32(&self, name: &str) -> Result<Vec<f32>, String> {
        let dims = self.tensor(name, DType::F32)?.dims().to_vec();
        self.get(name, &dims)
    }

    /// All double-precision numbers under a name.
    pub fn get_f64(&self, name: &str) -> Result<Vec<f64>, String> {
        let tensor = self.tensor(name, DType::F64)?;
        let values: Vec<f64> = tensor.flatten_all().and_then(|t| t.to_vec1()).map_err(|e| e.to_string())?;
        if values.iter().all(|v| v.is_finite()) { Ok(values) } else { Err(format!("array {name} holds no numbers")) }
    }

    /// All whole numbers under a name.
    pub fn get_integers(&self, name: &str) -> Result<Vec<i64>, String> {
        let tensor = self.tensor(name, DType::I64)?;
        tensor.flatten_all().and_then(|t| t.to_vec1()).map_err(|e| e.to_string())
    }

    fn tensor(&self, name: &str, kind: DType) -> Result<&Tensor, String> {
        let tensor = self.0.get(name).ok_or_else(|| format!("array {name} is missing"))?;
        if tensor.dtype() == kind { Ok(tensor) } else { Err(format!("array {name} is not of {kind:?}")) }
    }
}

static SHIPPED: &[u8] = include_bytes!("../../models/live.safetensors");

/// The model that comes with the program: it recognises the sixteen and the empty hand.
pub fn shipped_model() -> Result<Model, ModelError> {
    Model::from_bytes("models/live.safetensors", SHIPPED)
}
