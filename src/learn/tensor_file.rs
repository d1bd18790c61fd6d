//! Safetensors files: named arrays, with a card as JSON in the header.

use crate::arrays::{Array, Arrays, ModelError, Numbers};
use safetensors::{Dtype, SafeTensors, View};
use std::borrow::Cow;
use std::collections::HashMap;

/// Key of the card in the header.
const CARD_KEY: &str = "palpate";

/// Encodes a card and arrays; the error is a sentence.
pub fn encode(card: String, arrays: &Arrays) -> Result<Vec<u8>, String> {
    let header = HashMap::from([(CARD_KEY.to_owned(), card)]);
    safetensors::serialize(&arrays.0, Some(header)).map_err(|error| error.to_string())
}

/// A decoded file, its arrays unread.
pub struct TensorFile<'b> {
    /// The card as JSON.
    pub card: String,
    tensors: SafeTensors<'b>,
}

impl<'b> TensorFile<'b> {
    /// Decodes a file; the error is a sentence.
    pub fn decode(bytes: &'b [u8]) -> Result<Self, String> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|error| error.to_string())?;
        let card = header.metadata().as_ref().and_then(|metadata| metadata.get(CARD_KEY).cloned());
        let card = card.ok_or("its header has no card")?;
        let tensors = SafeTensors::deserialize(bytes).map_err(|error| error.to_string())?;
        Ok(Self { card, tensors })
    }

    /// Reads the arrays.
    pub fn arrays(&self) -> Result<Arrays, ModelError> {
        fn numbers<T, const N: usize>(bytes: &[u8], from: fn([u8; N]) -> T) -> Vec<T> {
            bytes.as_chunks::<N>().0.iter().map(|bytes| from(*bytes)).collect()
        }
        let mut arrays = Arrays::default();
        for (name, tensor) in self.tensors.iter() {
            let bytes = tensor.data();
            let numbers = match tensor.dtype() {
                Dtype::F32 => Numbers::F32(numbers(bytes, f32::from_le_bytes)),
                Dtype::F64 => Numbers::F64(numbers(bytes, f64::from_le_bytes)),
                Dtype::I64 => Numbers::I64(numbers(bytes, i64::from_le_bytes)),
                Dtype::I16 => Numbers::I16(numbers(bytes, i16::from_le_bytes)),
                other => {
                    let found = format!("{other:?}").to_lowercase();
                    return Err(ModelError::kind(name, &found, "f32, f64, i64 or i16"));
                }
            };
            arrays.0.insert(name.to_owned(), Array { shape: tensor.shape().to_vec(), numbers });
        }
        Ok(arrays)
    }
}

impl View for &Array {
    fn dtype(&self) -> Dtype {
        match self.numbers {
            Numbers::F32(_) => Dtype::F32,
            Numbers::F64(_) => Dtype::F64,
            Numbers::I64(_) => Dtype::I64,
            Numbers::I16(_) => Dtype::I16,
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
            Numbers::I16(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
        })
    }

    fn data_len(&self) -> usize {
        let bytes = match self.numbers {
            Numbers::I16(_) => 2,
            Numbers::F32(_) => 4,
            Numbers::F64(_) | Numbers::I64(_) => 8,
        };
        self.numbers.len() * bytes
    }
}
