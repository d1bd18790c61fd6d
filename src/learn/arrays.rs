//! Named arrays of numbers: what a recogniser has learned, and the tensors of a model file.
//!
//! Arrays from a file are untrusted. Every accessor checks type, shape and finiteness, so that a recogniser built from
//! them cannot panic later.

use std::collections::BTreeMap;

/// Numbers of one type.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
    /// Counts and indices.
    I64(Vec<i64>),
    /// Readings on a scale of their own, to save space.
    I16(Vec<i16>),
}

impl Numbers {
    /// Type name: `f32`, `f64`, `i64` or `i16`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::F32(_) => "f32",
            Self::F64(_) => "f64",
            Self::I64(_) => "i64",
            Self::I16(_) => "i16",
        }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::F64(values) => values.len(),
            Self::I64(values) => values.len(),
            Self::I16(values) => values.len(),
        }
    }

    /// True without elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Index of the first element that is not a number, or so large that no training gives it.
    fn first_absurd(&self) -> Option<usize> {
        match self {
            Self::F32(values) => values.iter().position(|x| x.is_nan() || x.abs() >= LARGEST),
            Self::F64(values) => values.iter().position(|x| x.is_nan() || x.abs() >= f64::from(LARGEST)),
            Self::I64(_) | Self::I16(_) => None,
        }
    }
}

/// Dense array, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Length of each axis; the product is the number of elements.
    pub shape: Vec<usize>,
    /// The elements.
    pub numbers: Numbers,
}

/// Numbers of a model are far below this.
const LARGEST: f32 = 1e30;

/// Arrays by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arrays(pub BTreeMap<String, Array>);

/// Reason why a model, or an array of its file, cannot be used, as a sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ModelError(pub String);

impl ModelError {
    /// Wraps the error of a library.
    pub(crate) fn failed(cause: impl std::fmt::Display) -> Self {
        Self(cause.to_string())
    }

    /// A file that holds no complete model.
    pub(crate) fn malformed(name: &str, cause: impl std::fmt::Display) -> Self {
        Self(format!("\"{name}\" is not a complete Palpate model: {cause}; train or copy it again"))
    }

    /// A file whose card and parameters contradict each other or the method.
    pub(crate) fn invalid(name: &str, cause: &Self) -> Self {
        Self(format!("\"{name}\" is not a valid Palpate model: {cause}; train or copy it again"))
    }

    /// A part of the card, as a noun phrase, that is invalid or contradicts the channels or labels.
    pub(crate) fn card(part: &str) -> Self {
        Self(format!("{part} on its card is invalid or does not match its channels and labels"))
    }

    /// An array of the wrong shape.
    pub(crate) fn shape(name: &str, found: &[usize], expected: &[usize]) -> Self {
        Self(format!("array \"{name}\" has shape {found:?} instead of {expected:?}"))
    }

    /// An element out of range.
    pub(crate) fn value(name: &str, index: usize, expected: &str) -> Self {
        Self(format!("element {index} of array \"{name}\" must be {expected}"))
    }

    /// Elements of the wrong type.
    pub(crate) fn kind(name: &str, found: &str, expected: &str) -> Self {
        Self(format!("array \"{name}\" holds {found} instead of {expected}"))
    }
}

impl Arrays {
    /// Adds single-precision numbers of a shape.
    pub fn put(&mut self, name: impl Into<String>, shape: &[usize], values: Vec<f32>) {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "elements of shape {shape:?}");
        self.0.insert(name.into(), Array { shape: shape.to_vec(), numbers: Numbers::F32(values) });
    }

    /// Adds a vector of double-precision numbers.
    pub fn put_f64(&mut self, name: impl Into<String>, values: Vec<f64>) {
        self.0.insert(name.into(), Array { shape: vec![values.len()], numbers: Numbers::F64(values) });
    }

    /// Adds a vector of integers.
    pub fn put_integers(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = usize>) {
        self.put_signed(name, values.into_iter().map(|value| value as i64).collect());
    }

    /// Adds a vector of integers that may be negative.
    pub fn put_signed(&mut self, name: impl Into<String>, values: Vec<i64>) {
        self.0.insert(name.into(), Array { shape: vec![values.len()], numbers: Numbers::I64(values) });
    }

    /// Adds small integers of a shape.
    pub fn put_small(&mut self, name: impl Into<String>, shape: &[usize], values: Vec<i16>) {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "elements of shape {shape:?}");
        self.0.insert(name.into(), Array { shape: shape.to_vec(), numbers: Numbers::I16(values) });
    }

    /// Gives an array of single-precision numbers more rows, of zeros.
    pub(crate) fn extend_rows(&mut self, name: &str, rows: usize) {
        if let Some(Array { shape, numbers: Numbers::F32(values) }) = self.0.get_mut(name)
            && let [own, rest @ ..] = &mut shape[..]
        {
            *own = rows.max(*own);
            values.resize(*own * rest.iter().product::<usize>(), 0.0);
        }
    }

    /// Takes a row out of an array of single-precision numbers.
    pub(crate) fn remove_row(&mut self, name: &str, row: usize) {
        if let Some(Array { shape, numbers: Numbers::F32(values) }) = self.0.get_mut(name)
            && let [rows, rest @ ..] = &mut shape[..]
            && row < *rows
        {
            let width = rest.iter().product::<usize>();
            *rows -= 1;
            values.drain(row * width..(row + 1) * width);
        }
    }

    /// Number of elements of all arrays.
    pub fn elements(&self) -> usize {
        self.0.values().map(|array| array.numbers.len()).sum()
    }

    /// Finite single-precision numbers of a shape.
    pub fn f32s(&self, name: &str, shape: &[usize]) -> Result<&[f32], ModelError> {
        match &self.of_shape(name, shape)?.numbers {
            Numbers::F32(values) => Ok(values),
            other => Err(ModelError::kind(name, other.kind(), "f32")),
        }
    }

    /// Finite single-precision numbers, `[rows][columns]` with any number of rows.
    pub fn f32_rows(&self, name: &str, columns: usize) -> Result<&[f32], ModelError> {
        let rows = self.array(name)?.numbers.len() / columns.max(1);
        self.f32s(name, &[rows, columns])
    }

    /// Vector of finite single-precision numbers.
    pub fn f32_vector(&self, name: &str) -> Result<&[f32], ModelError> {
        self.f32s(name, &[self.array(name)?.numbers.len()])
    }

    /// Vector of finite double-precision numbers.
    pub fn f64_vector(&self, name: &str) -> Result<&[f64], ModelError> {
        match &self.of_shape(name, &[self.array(name)?.numbers.len()])?.numbers {
            Numbers::F64(values) => Ok(values),
            other => Err(ModelError::kind(name, other.kind(), "f64")),
        }
    }

    /// Vector of integers.
    pub fn integers(&self, name: &str) -> Result<&[i64], ModelError> {
        match &self.of_shape(name, &[self.array(name)?.numbers.len()])?.numbers {
            Numbers::I64(values) => Ok(values),
            other => Err(ModelError::kind(name, other.kind(), "i64")),
        }
    }

    /// Small integers of a shape.
    pub fn small(&self, name: &str, shape: &[usize]) -> Result<&[i16], ModelError> {
        match &self.of_shape(name, shape)?.numbers {
            Numbers::I16(values) => Ok(values),
            other => Err(ModelError::kind(name, other.kind(), "i16")),
        }
    }

    /// Vector of indices below a bound.
    pub fn indices(&self, name: &str, below: usize, expected: &str) -> Result<Vec<usize>, ModelError> {
        let index = |(index, value): (usize, &i64)| {
            let value = usize::try_from(*value).ok().filter(|value| *value < below);
            value.ok_or_else(|| ModelError::value(name, index, expected))
        };
        self.integers(name)?.iter().enumerate().map(index).collect()
    }

    /// Refuses an array whose shape contradicts another array.
    pub fn require(&self, name: &str, shape: &[usize], other: &str) -> Result<(), ModelError> {
        let found = &self.array(name)?.shape;
        if found == shape {
            return Ok(());
        }
        Err(ModelError(format!("array \"{name}\" has shape {found:?}, but array \"{other}\" requires {shape:?}")))
    }

    /// Refuses arrays that a recogniser made from these would not save in the same form.
    pub fn require_same_form(&self, saved: &Self) -> Result<(), ModelError> {
        for (name, array) in &self.0 {
            let found = &array.shape;
            match saved.0.get(name) {
                None => {
                    return Err(ModelError(format!("array \"{name}\" of shape {found:?} is not part of this method")));
                }
                Some(own) if own.shape != *found => return Err(ModelError::shape(name, found, &own.shape)),
                Some(_) => {}
            }
        }
        Ok(())
    }

    fn array(&self, name: &str) -> Result<&Array, ModelError> {
        self.0.get(name).ok_or_else(|| ModelError(format!("array \"{name}\" is missing")))
    }

    fn of_shape(&self, name: &str, shape: &[usize]) -> Result<&Array, ModelError> {
        let array = self.array(name)?;
        if array.shape != shape {
            return Err(ModelError::shape(name, &array.shape, shape));
        }
        match array.numbers.first_absurd() {
            Some(index) => Err(ModelError(format!(
                "element {index} of array \"{name}\" is not a number, or far larger than any training gives"
            ))),
            None => Ok(array),
        }
    }
}

/// Refuses the first element that is out of range.
pub(crate) fn check_each<T>(
    name: &str,
    values: &[T],
    expected: &str,
    is_allowed: impl Fn(&T) -> bool,
) -> Result<(), ModelError> {
    match values.iter().position(|value| !is_allowed(value)) {
        Some(index) => Err(ModelError::value(name, index, expected)),
        None => Ok(()),
    }
}
