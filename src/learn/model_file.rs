//! Models on disk: a safetensors file with the card in its header. A copy of the card is written beside it as JSON for
//! people.

use crate::arrays::{Array, ArrayError, Arrays, Numbers};
use crate::data::{Class, Labels};
use crate::methods::method;
use crate::model::{LoadError, Model, ModelCard, ModelError};
use crate::signatures::Signatures;
use safetensors::{Dtype, SafeTensors, View};
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Key of the card in the header.
const CARD_KEY: &str = "palpate";
/// Largest file that is read (bytes).
const LARGEST_FILE: u64 = 1 << 30;

static SHIPPED: &[u8] = include_bytes!("../../models/live.safetensors");

/// Loads the model that ships with the program: the sixteen objects and the empty hand.
pub fn shipped_model() -> Result<Model, ModelError> {
    Model::from_bytes("models/live.safetensors", SHIPPED)
}

impl Model {
    /// Encodes the model as a safetensors file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ModelError> {
        let failed = |cause: String| ModelError::Malformed { name: self.card.method.clone(), cause };
        let card = serde_json::to_string(&self.card).map_err(|e| failed(e.to_string()))?;
        let header = HashMap::from([(CARD_KEY.to_owned(), card)]);
        let mut arrays = self.recogniser.arrays();
        if let Some(signatures) = &self.signatures {
            signatures.put_into(&mut arrays);
        }
        safetensors::serialize(&arrays.0, Some(header)).map_err(|e| failed(e.to_string()))
    }

    /// Writes the model and its card into a folder that exists. Interrupted writes leave the old file intact.
    pub fn save(&self, path: &Path) -> Result<(), ModelError> {
        let card = serde_json::to_string_pretty(&self.card)
            .map_err(|e| ModelError::Malformed { name: path.display().to_string(), cause: e.to_string() })?;
        replace_file(path, &self.to_bytes()?)?;
        replace_file(&card_path(path), (card + "\n").as_bytes())
    }

    /// Reads a model from a file.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let unreadable =
            |cause: std::io::Error| ModelError::Unreadable { path: path.to_owned(), cause: cause.to_string() };
        let size = std::fs::metadata(path).map_err(unreadable)?.len();
        if size > LARGEST_FILE {
            let cause = format!("{size} bytes is too large");
            return Err(ModelError::Malformed { name: path.display().to_string(), cause });
        }
        Self::from_bytes(&path.display().to_string(), &std::fs::read(path).map_err(unreadable)?)
    }

    /// Decodes a model. `name` is the file name in errors.
    ///
    /// Refuses files that are damaged, and arrays that are missing, unexpected, of the wrong type or shape, or not
    /// finite; the error names the array.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, ModelError> {
        let malformed = |cause: String| ModelError::Malformed { name: name.to_owned(), cause };
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|e| malformed(e.to_string()))?;
        let card = header.metadata().as_ref().and_then(|m| m.get(CARD_KEY));
        let card = card.ok_or_else(|| malformed("its header has no card".to_owned()))?;
        let card = ModelCard::parse(card).map_err(|e| malformed(format!("invalid card: {e}")))?;
        let file = SafeTensors::deserialize(bytes).map_err(|e| malformed(e.to_string()))?;
        let Some(method) = method(&card.method) else {
            return Err(ModelError::UnknownMethod { name: name.to_owned(), method: card.method });
        };
        let load = || -> Result<_, LoadError> {
            card.labels.check()?;
            let mut arrays = read_arrays(&file)?;
            let signatures = match &card.signature_grasps {
                Some(grasps) if grasps.len() != card.labels.classes.len() => {
                    return Err(LoadError::Card { part: "the number of grasps in the signatures" });
                }
                Some(grasps) => Some(Signatures::take_from(&mut arrays, &card.channels, grasps)?),
                None => None,
            };
            let recogniser = (method.load)(&card, &arrays)?;
            arrays.require_same_form(&recogniser.arrays())?;
            Ok((recogniser, signatures))
        };
        let (recogniser, signatures) = load().map_err(|cause| ModelError::Invalid { name: name.to_owned(), cause })?;
        Ok(Self { card, recogniser: Arc::from(recogniser), signatures: signatures.map(Arc::new) })
    }
}

impl Labels {
    /// Refuses labels from a file that have no class, or a class with an unknown size or shape.
    fn check(&self) -> Result<(), LoadError> {
        let known = |class: &Class| {
            class.size.is_none_or(|size| size < self.sizes.len())
                && class.shape.is_none_or(|shape| shape < self.shapes.len())
        };
        if self.classes.is_empty() || !self.classes.iter().all(known) {
            return Err(LoadError::Card { part: "the list of classes" });
        }
        Ok(())
    }
}

impl ModelCard {
    /// Reads the card beside a model file.
    pub fn beside(model: &Path) -> Result<Self, ModelError> {
        let path = card_path(model);
        let text = std::fs::read_to_string(&path)
            .map_err(|error| ModelError::Unreadable { path: path.clone(), cause: error.to_string() })?;
        Self::parse(&text)
            .map_err(|error| ModelError::Malformed { name: path.display().to_string(), cause: error.to_string() })
    }

    /// One-line summary: `Macro-layer, 4 classes, 128 grasps, macro F1 0.93`.
    pub fn described(&self) -> String {
        let title = method(&self.method).map_or(self.method.as_str(), |method| method.title);
        let mut parts = vec![
            title.to_owned(),
            format!("{} classes", self.labels.classes.len()),
            format!("{} grasps", self.data.grasps),
        ];
        parts.extend(self.metrics["f1_macro"].as_f64().map(|f1| format!("macro F1 {f1:.2}")));
        parts.extend(self.only_simulated().then(|| "contact pressure: simulation only".to_owned()));
        parts.join(", ")
    }
}

/// Path of a model's card: `live.json` for `live.safetensors`.
fn card_path(path: &Path) -> PathBuf {
    path.with_extension("json")
}

fn replace_file(path: &Path, bytes: &[u8]) -> Result<(), ModelError> {
    let unfinished = path.with_extension("unfinished");
    let written = (|| {
        std::fs::write(&unfinished, bytes)?;
        std::fs::rename(&unfinished, path)
    })();
    written.map_err(|cause| {
        // A leftover file does no harm, and failing to remove it adds nothing to the message.
        let _removed = std::fs::remove_file(&unfinished);
        ModelError::Unwritable { path: path.to_owned(), cause: cause.to_string() }
    })
}

fn read_arrays(file: &SafeTensors<'_>) -> Result<Arrays, ArrayError> {
    fn numbers<T, const N: usize>(bytes: &[u8], from: fn([u8; N]) -> T) -> Vec<T> {
        bytes.as_chunks::<N>().0.iter().map(|bytes| from(*bytes)).collect()
    }
    let mut arrays = Arrays::default();
    for (name, tensor) in file.iter() {
        let bytes = tensor.data();
        let numbers = match tensor.dtype() {
            Dtype::F32 => Numbers::F32(numbers(bytes, f32::from_le_bytes)),
            Dtype::F64 => Numbers::F64(numbers(bytes, f64::from_le_bytes)),
            Dtype::I64 => Numbers::I64(numbers(bytes, i64::from_le_bytes)),
            other => {
                let found = format!("{other:?}").to_lowercase();
                return Err(ArrayError::Kind { name: name.to_owned(), found, expected: "f32, f64 or i64" });
            }
        };
        arrays.0.insert(name.to_owned(), Array { shape: tensor.shape().to_vec(), numbers });
    }
    Ok(arrays)
}

impl View for &Array {
    fn dtype(&self) -> Dtype {
        match self.numbers {
            Numbers::F32(_) => Dtype::F32,
            Numbers::F64(_) => Dtype::F64,
            Numbers::I64(_) => Dtype::I64,
        }
    }

    fn shape(&self) -> &[usize] {
        &self.shape
    }

    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Owned(match &self.numbers {
            Numbers::F32(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Numbers::F64(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Numbers::I64(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
        })
    }

    fn data_len(&self) -> usize {
        let bytes = if matches!(self.numbers, Numbers::F32(_)) { 4 } else { 8 };
        self.numbers.len() * bytes
    }
}
