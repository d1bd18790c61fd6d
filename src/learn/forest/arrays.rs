//! Models as flat arrays of numbers, and back. What is read is believed in nothing: every length, index and number is
//! checked before a model is made of it, so that a model from a damaged file predicts nonsense at worst.

/// Numbers of one kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Array {
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
    /// Counts and indices.
    I32(Vec<i32>),
}

/// Why arrays are no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArrayError {
    /// An array is not there.
    #[error("the array \"{name}\" is missing")]
    Missing {
        /// Its name.
        name: &'static str,
    },
    /// An array has numbers of another kind.
    #[error("the array \"{name}\" should hold {expected}")]
    Kind {
        /// Its name.
        name: &'static str,
        /// `f32`, `f64` or `i32`.
        expected: &'static str,
    },
    /// An array has too many or too few numbers.
    #[error("the array \"{name}\" has {length} numbers; it should have {expected}")]
    Length {
        /// Its name.
        name: &'static str,
        /// Numbers it has.
        length: usize,
        /// How many it should have.
        expected: &'static str,
    },
    /// A number that cannot be.
    #[error("number {index} of the array \"{name}\" should be {expected}")]
    Number {
        /// Name of the array.
        name: &'static str,
        /// Where in it, from 0.
        index: usize,
        /// What it should be.
        expected: &'static str,
    },
}

impl Array {
    pub(super) fn shape(columns: usize, classes: usize) -> (String, Self) {
        ("shape".to_owned(), Self::I32(vec![columns as i32, classes as i32]))
    }
}

/// Memory that a prediction may need is bounded by this, and not by what a file says.
const MOST_CLASSES: i32 = 65_536;

pub(super) struct Reader<'a> {
    arrays: &'a [(String, Array)],
}

impl<'a> Reader<'a> {
    pub(super) fn new(arrays: &'a [(String, Array)]) -> Self {
        Self { arrays }
    }

    fn array(&self, name: &'static str) -> Result<&'a Array, ArrayError> {
        let found = self.arrays.iter().find(|(known, _)| known == name);
        found.map(|(_, array)| array).ok_or(ArrayError::Missing { name })
    }

    /// Counts or indices.
    pub(super) fn i32s(&self, name: &'static str) -> Result<&'a [i32], ArrayError> {
        match self.array(name)? {
            Array::I32(numbers) => Ok(numbers),
            Array::F32(_) | Array::F64(_) => Err(ArrayError::Kind { name, expected: "i32" }),
        }
    }

    /// Finite numbers.
    pub(super) fn f32s(&self, name: &'static str) -> Result<&'a [f32], ArrayError> {
        let numbers = match self.array(name)? {
            Array::F32(numbers) => numbers,
            Array::F64(_) | Array::I32(_) => return Err(ArrayError::Kind { name, expected: "f32" }),
        };
        all(name, numbers, "a finite number", |number| number.is_finite())?;
        Ok(numbers)
    }

    /// So many finite numbers.
    pub(super) fn f64s(&self, name: &'static str, count: usize) -> Result<&'a [f64], ArrayError> {
        let numbers = match self.array(name)? {
            Array::F64(numbers) => numbers,
            Array::F32(_) | Array::I32(_) => return Err(ArrayError::Kind { name, expected: "f64" }),
        };
        all(name, numbers, "a finite number", |number| number.is_finite())?;
        same_length(name, numbers.len(), count)?;
        Ok(numbers)
    }

    /// Columns and classes, both at least 1.
    pub(super) fn shape(&self) -> Result<(usize, usize), ArrayError> {
        let name = "shape";
        let &[columns, classes] = self.i32s(name)? else {
            return Err(ArrayError::Length { name, length: self.i32s(name)?.len(), expected: "two" });
        };
        all(name, &[columns, classes], "at least 1", |number| *number >= 1)?;
        if classes > MOST_CLASSES {
            return Err(ArrayError::Number { name, index: 1, expected: "at most 65536" });
        }
        Ok((columns as usize, classes as usize))
    }

    /// Indices below `below`, each greater than the one before; at least one.
    pub(super) fn ascending(&self, name: &'static str, below: usize) -> Result<Vec<usize>, ArrayError> {
        let numbers = self.i32s(name)?;
        let expected = "an index in its range, greater than the one before";
        all(name, numbers, expected, |number| usize::try_from(*number).is_ok_and(|number| number < below))?;
        if let Some(at) = numbers.windows(2).position(|pair| pair[0] >= pair[1]) {
            return Err(ArrayError::Number { name, index: at + 1, expected });
        }
        if numbers.is_empty() {
            return Err(ArrayError::Length { name, length: 0, expected: "at least one" });
        }
        Ok(numbers.iter().map(|number| *number as usize).collect())
    }
}

/// Refuses the first number that is not good.
pub(super) fn all<T>(
    name: &'static str,
    numbers: &[T],
    expected: &'static str,
    is_good: impl Fn(&T) -> bool,
) -> Result<(), ArrayError> {
    match numbers.iter().position(|number| !is_good(number)) {
        Some(index) => Err(ArrayError::Number { name, index, expected }),
        None => Ok(()),
    }
}

pub(super) fn same_length(name: &'static str, length: usize, wanted: usize) -> Result<(), ArrayError> {
    let expected = "as many as other arrays say";
    if length == wanted { Ok(()) } else { Err(ArrayError::Length { name, length, expected }) }
}

#[cfg(test)]
mod tests {
    use super::super::*;

    type Arrays = Vec<(String, Array)>;

    fn models() -> Result<(Forest, GradientBoosting, RusBoost), FitError> {
        let data = peers::Data::new(0..90);
        let forest = ForestSettings { trees: 3, ..ForestSettings::default() };
        let boosting = GradientBoostingSettings { rounds: 2, ..Default::default() };
        let rusboost = RusBoostSettings { rounds: 3, ..Default::default() };
        let examples = data.examples();
        Ok((
            Forest::fit(&examples, &forest)?,
            GradientBoosting::fit(&examples, &boosting)?,
            RusBoost::fit(&examples, &rusboost)?,
        ))
    }

    #[test]
    fn models_return_as_they_were() -> Result<(), FitError> {
        let (forest, boosting, rusboost) = models()?;
        assert_eq!(Forest::from_arrays(&forest.to_arrays()), Ok(forest));
        assert_eq!(GradientBoosting::from_arrays(&boosting.to_arrays()), Ok(boosting));
        assert_eq!(RusBoost::from_arrays(&rusboost.to_arrays()), Ok(rusboost));
        Ok(())
    }

    /// The same arrays but for one number.
    fn spoilt(arrays: &Arrays, array: usize, index: usize, number: f64) -> Arrays {
        let mut arrays = arrays.clone();
        match &mut arrays[array].1 {
            Array::F32(numbers) => numbers[index] = number as f32,
            Array::F64(numbers) => numbers[index] = number,
            Array::I32(numbers) => numbers[index] = number as i32,
        }
        arrays
    }

    fn length(array: &Array) -> usize {
        match array {
            Array::F32(numbers) => numbers.len(),
            Array::F64(numbers) => numbers.len(),
            Array::I32(numbers) => numbers.len(),
        }
    }

    /// Reads every way of spoiling one thing; whatever is accepted must predict without panic and without end.
    fn attack(arrays: &Arrays, read: impl Fn(&Arrays) -> Result<Vec<f64>, ArrayError>) {
        assert!(read(arrays).is_ok());
        for array in 0..arrays.len() {
            let mut fewer = arrays.clone();
            let (name, _) = fewer.remove(array);
            assert!(matches!(read(&fewer), Err(ArrayError::Missing { .. })), "without {name}");
            fewer.insert(array, (name.clone(), Array::I32(vec![])));
            assert!(read(&fewer).is_err(), "{name} empty");
            for index in 0..length(&arrays[array].1).min(60) {
                for number in [-2.0, -1.0, 0.0, 1.0, 2.0, 5.0, 1e9, 2_147_483_647.0] {
                    if let Ok(probabilities) = read(&spoilt(arrays, array, index, number)) {
                        let sum: f64 = probabilities.iter().sum();
                        assert!((sum - 1.0).abs() < 1e-9, "{name}[{index}] = {number}: {sum}");
                    }
                }
                if !matches!(arrays[array].1, Array::I32(_)) {
                    for number in [f64::NAN, f64::INFINITY] {
                        assert!(read(&spoilt(arrays, array, index, number)).is_err(), "{name}[{index}] = {number}");
                    }
                }
            }
        }
    }

    #[test]
    fn damaged_arrays_are_refused_or_harmless() -> Result<(), FitError> {
        let (forest, boosting, rusboost) = models()?;
        let row = peers::Data::new(0..1).row(0).to_vec();
        // Columns may have become fewer or more.
        let row_for = |arrays: &Arrays| match arrays[0].1 {
            Array::I32(ref shape) => (0..shape[0].min(100) as usize).map(|k| row[k % row.len()]).collect(),
            _ => row.clone(),
        };
        let is_small = |arrays: &Arrays| matches!(&arrays[0].1, Array::I32(shape) if shape.iter().all(|n| *n < 100));
        let guard = |arrays: &Arrays, predict: &dyn Fn(&[f32]) -> Vec<f64>| {
            if is_small(arrays) { predict(&row_for(arrays)) } else { vec![1.0] }
        };
        attack(&forest.to_arrays(), |a| Forest::from_arrays(a).map(|m| guard(a, &|row| m.predict(row))));
        attack(&boosting.to_arrays(), |a| GradientBoosting::from_arrays(a).map(|m| guard(a, &|row| m.predict(row))));
        attack(&rusboost.to_arrays(), |a| RusBoost::from_arrays(a).map(|m| guard(a, &|row| m.predict(row))));
        Ok(())
    }

    #[test]
    fn errors_say_what_is_wrong() -> Result<(), FitError> {
        let arrays = models()?.0.to_arrays();
        let text = |array, index, number| {
            Forest::from_arrays(&spoilt(&arrays, array, index, number)).map_err(|error| error.to_string())
        };
        let refused = |text: &str| Err(text.to_owned());
        assert_eq!(text(4, 0, 0.0), refused("number 0 of the array \"link\" should be a later node of the tree"));
        assert_eq!(text(2, 0, 1e6), refused("number 0 of the array \"feature\" should be a column, or -1"));
        assert_eq!(text(1, 0, 0.0), refused("number 0 of the array \"tree_nodes\" should be at least 1"));
        assert_eq!(Forest::from_arrays(&[]).map_err(|e| e.to_string()), refused("the array \"shape\" is missing"));
        Ok(())
    }
}
