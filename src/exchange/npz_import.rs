//! NPZ archives as trials: those of this program, and those of others whose arrays have the samples, or trials and samples,
//! as their first axes.
//!
//! NPY is a header of text and the numbers in rows or columns. Source: numpy, *numpy.lib.format*, versions 1 to 3.

use crate::csv_files::read_made;
use crate::format::{Import, ImportError, file_name};
use crate::mapping::{Mapping, plain_name};
use crate::series::{Lines, quoted};
use crate::taxels::is_taxels;
use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

/// Most bytes of all arrays, and most arrays.
const MOST_BYTES: u64 = 1 << 30;
const MOST_ARRAYS: usize = 1000;

/// Reads the trials of an archive.
pub(crate) fn read_npz(path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
    let (arrays, mut left_out) = arrays(path).map_err(|fault| ImportError::of(path, fault))?;
    let label = mapping.label_of(path);
    let table = Table::of(&arrays, mapping, &label, &left_out).map_err(|fault| ImportError::of(path, fault))?;
    let mut import = read_made(table.text(), &file_name(path), &table.mapping, &label)?;
    left_out.extend(table.left_out);
    if !left_out.is_empty() {
        import.warnings.insert(0, format!("arrays that are no channels were left out: {}", left_out.join(", ")));
    }
    Ok(import)
}

/// Names of the arrays.
pub(crate) fn names_of(path: &Path) -> Result<Vec<String>, ImportError> {
    let (arrays, _left_out) = arrays(path).map_err(|fault| ImportError::of(path, fault))?;
    Ok(arrays.into_keys().collect())
}

/// The arrays that can be read, and the others with the reason.
type Arrays = (BTreeMap<String, Array>, Vec<String>);

fn arrays(path: &Path) -> Result<Arrays, String> {
    let file = palpate_geometry::open_regular(path).map_err(|cause| cause.to_string())?;
    let no_archive = |cause: &dyn std::fmt::Display| format!("it is not a sound NPZ archive ({cause})");
    let mut archive = zip::ZipArchive::new(file).map_err(|error| no_archive(&error))?;
    if archive.len() > MOST_ARRAYS {
        return Err(format!("it holds more than {MOST_ARRAYS} arrays"));
    }
    let (mut arrays, mut left_out) = (BTreeMap::new(), Vec::new());
    let mut left = MOST_BYTES;
    let is_own = ["values.npy", "channels.npy"].iter().all(|name| archive.index_for_name(name).is_some());
    for place in 0..archive.len() {
        let file = archive.by_index(place).map_err(|error| no_archive(&error))?;
        let name = file.name().map(|name| name.into_owned()).map_err(|error| no_archive(&error))?;
        let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else { continue };
        if is_own && is_taxels(&name) {
            continue;
        }
        let mut bytes = Vec::new();
        file.take(left + 1).read_to_end(&mut bytes).map_err(|error| no_archive(&error))?;
        left = left
            .checked_sub(bytes.len() as u64)
            .ok_or(format!("its arrays take more than {} MiB", MOST_BYTES >> 20))?;
        match Array::read(&bytes) {
            Ok(array) => drop(arrays.insert(name, array)),
            Err(fault) => left_out.push(format!("{name} ({fault})")),
        }
    }
    Ok((arrays, left_out))
}

/// An array: numbers or texts in rows, the last axis first.
struct Array {
    shape: Vec<usize>,
    items: Items,
}

enum Items {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

impl Array {
    fn read(bytes: &[u8]) -> Result<Self, String> {
        let cut = || "it is cut short".to_owned();
        let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("it is not an NPY array")?;
        let (version, rest) = rest.split_at_checked(2).ok_or_else(cut)?;
        let wide = if version[0] == 1 { 2 } else { 4 };
        let (length, rest) = rest.split_at_checked(wide).ok_or_else(cut)?;
        let length = length.iter().rev().fold(0, |length, byte| length << 8 | usize::from(*byte));
        let (header, data) = rest.split_at_checked(length).ok_or_else(cut)?;
        let header = String::from_utf8_lossy(header);
        let value = |key: &str| header.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
        let kind = value("descr").and_then(|rest| rest.strip_prefix('\'')?.split_once('\''));
        let kind = kind.ok_or("it holds records, not numbers")?.0;
        let is_fortran = value("fortran_order").is_some_and(|rest| rest.starts_with("True"));
        let shape = value("shape").and_then(|rest| rest.strip_prefix('(')?.split_once(')')).ok_or("it has no shape")?.0;
        let sides = shape.split(',').map(str::trim).filter(|side| !side.is_empty());
        let shape = sides.map(|side| side.parse().map_err(|_no_number| "its shape is no row of numbers"));
        let shape = shape.collect::<Result<Vec<usize>, _>>()?;
        let count =
            shape.iter().try_fold(1usize, |all, side| all.checked_mul(*side)).ok_or("its shape is too large")?;
        let mut items = Items::read(kind, data, count)?;
        if is_fortran {
            items = items.in_rows(&shape);
        }
        Ok(Self { shape, items })
    }
}

impl Items {
    fn read(kind: &str, data: &[u8], count: usize) -> Result<Self, String> {
        let is_big = kind.starts_with('>');
        let kind = kind.trim_start_matches(['<', '>', '|', '=']);
        let unknown = || format!("its type {kind} holds neither numbers nor texts");
        let (letter, size) = kind.split_at_checked(1).ok_or_else(unknown)?;
        let size: usize = size.parse().map_err(|_no_number| unknown())?;
        let each = if letter == "U" { size.checked_mul(4) } else { Some(size) }.ok_or_else(unknown)?;
        let needed = each.checked_mul(count).filter(|needed| *needed <= data.len()).ok_or("it is cut short")?;
        let items = |item: &dyn Fn(&[u8]) -> f64| -> Vec<f64> {
            let turned = |bytes: &[u8]| -> f64 {
                let mut bytes = bytes.to_vec();
                if is_big {
                    bytes.reverse();
                }
                item(&bytes)
            };
            data[..needed].chunks_exact(each).map(turned).collect()
        };
        macro_rules! number {
            ($number:ty) => {
                items(&|bytes| bytes.try_into().map_or(f64::NAN, |bytes| <$number>::from_le_bytes(bytes) as f64))
            };
        }
        let numbers = match (letter, size) {
            ("f", 2) => {
                items(&|bytes| bytes.try_into().map_or(f64::NAN, |bytes| half::f16::from_le_bytes(bytes).to_f64()))
            }
            ("f", 4) => number!(f32),
            ("f", 8) => number!(f64),
            ("i", 1) => number!(i8),
            ("i", 2) => number!(i16),
            ("i", 4) => number!(i32),
            ("i", 8) => number!(i64),
            ("u" | "b", 1) => number!(u8),
            ("u", 2) => number!(u16),
            ("u", 4) => number!(u32),
            ("u", 8) => number!(u64),
            ("U", 0) | ("S", 0) => return Ok(Self::Texts(vec![String::new(); count])),
            ("U", _) => {
                let letter = |bytes: &[u8; 4]| {
                    let code = if is_big { u32::from_be_bytes(*bytes) } else { u32::from_le_bytes(*bytes) };
                    char::from_u32(code).filter(|letter| *letter != '\0')
                };
                let text = |bytes: &[u8]| bytes.as_chunks().0.iter().filter_map(letter).collect();
                return Ok(Self::Texts(data[..needed].chunks_exact(each).map(text).collect()));
            }
            ("S", _) => {
                let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned();
                return Ok(Self::Texts(data[..needed].chunks_exact(each).map(text).collect()));
            }
            _ => return Err(unknown()),
        };
        Ok(Self::Numbers(numbers))
    }

    /// Items in columns as items in rows.
    fn in_rows(self, shape: &[usize]) -> Self {
        fn turned<T: Clone>(items: &[T], shape: &[usize]) -> Vec<T> {
            let place = |mut row: usize| {
                let mut place = 0;
                for axis in (0..shape.len()).rev() {
                    let stride: usize = shape[..axis].iter().product();
                    place += row % shape[axis] * stride;
                    row /= shape[axis];
                }
                place
            };
            (0..items.len()).map(|row| items[place(row)].clone()).collect()
        }
        match self {
            Self::Numbers(numbers) => Self::Numbers(turned(&numbers, shape)),
            Self::Texts(texts) => Self::Texts(turned(&texts, shape)),
        }
    }

    fn text(&self, place: usize) -> String {
        match self {
            Self::Numbers(numbers) => {
                numbers.get(place).filter(|x| x.is_finite()).map_or_else(String::new, f64::to_string)
            }
            Self::Texts(texts) => texts.get(place).cloned().unwrap_or_default(),
        }
    }
}

/// Columns of a table: the array, and the number of the column in its last axis.
struct Table<'a> {
    names: Vec<String>,
    columns: Vec<(&'a Items, usize, usize)>,
    trials: usize,
    samples: usize,
    /// Samples of each trial that are there.
    lengths: Vec<usize>,
    /// Number or name, and label, of each trial.
    heads: Vec<[String; 2]>,
    mapping: Mapping,
    /// Arrays of other shapes.
    left_out: Vec<String>,
}

impl<'a> Table<'a> {
    fn of(
        arrays: &'a BTreeMap<String, Array>,
        mapping: &Mapping,
        label: &str,
        unread: &[String],
    ) -> Result<Self, String> {
        let listed = || {
            let shown = |(name, array): (&String, &Array)| format!("{name} {:?}", array.shape);
            arrays.iter().take(20).map(shown).collect::<Vec<_>>().join(", ")
        };
        let wanted = mapping.time.as_deref().unwrap_or("t_s");
        let base = plain_name(wanted);
        let unread_one = |name: &str| unread.iter().find(|own| own.starts_with(&format!("{name} (")));
        let time = arrays.get(base).ok_or_else(|| match unread_one(base) {
            Some(why) => format!("the times cannot be read: {why}"),
            None => {
                format!("it has no array \"{base}\" of times; name one, as in --time \"t [s]\". It has {}", listed())
            }
        })?;
        let (trials, samples) = match time.shape[..] {
            [samples] => (1, samples),
            [trials, samples] => (trials, samples),
            _ => {
                return Err(format!(
                    "the times \"{base}\" have the shape {:?}; wanted is (samples) or (trials, samples)",
                    time.shape
                ));
            }
        };
        let axes = &time.shape[..];
        let of_trials = |name: &str| arrays.get(name).filter(|array| array.shape == [trials] && axes.len() == 2);
        let is_own = arrays.contains_key("values") && arrays.contains_key("channels") && mapping.channels.is_empty();
        let mut table = Self {
            names: vec![wanted.to_owned()],
            columns: vec![(&time.items, 1, 0)],
            trials,
            samples,
            lengths: vec![samples; trials],
            heads: Vec::new(),
            mapping: Mapping {
                time: Some(wanted.to_owned()),
                channels: mapping.channels.clone(),
                split_gap_s: mapping.split_gap_s,
                ..Mapping::default()
            },
            left_out: Vec::new(),
        };
        if let Some(Array { items: Items::Numbers(numbers), .. }) = of_trials("samples") {
            table.lengths = numbers.iter().map(|number| (*number as usize).min(samples)).collect();
        }
        // An array of labels that cannot be used must not become a word.
        let wanted_label = mapping.label.as_deref().unwrap_or("label");
        if let Some(why) = unread_one(wanted_label) {
            return Err(format!("the labels cannot be read: {why}"));
        }
        if arrays.contains_key(wanted_label) && of_trials(wanted_label).is_none() {
            let shape = &arrays[wanted_label].shape;
            return Err(format!(
                "the labels \"{wanted_label}\" have the shape {shape:?}; wanted is one for each trial, ({trials})"
            ));
        }
        let trial = of_trials(mapping.trial.as_deref().unwrap_or("trial"));
        let labels = of_trials(mapping.label.as_deref().unwrap_or("label"));
        table.heads = (0..trials)
            .map(|k| {
                let name = trial.map_or_else(|| (k + 1).to_string(), |trial| trial.items.text(k));
                let own = labels.map(|labels| labels.items.text(k)).filter(|own| !own.is_empty());
                [name, own.unwrap_or_else(|| label.to_owned())]
            })
            .collect();
        for (name, array) in arrays.iter().filter(|(name, _)| *name != base) {
            if is_own && name != "values" {
                continue;
            }
            let role = ["trial", "label", "samples", "channels", "units"].contains(&name.as_str())
                || [&mapping.trial, &mapping.label].iter().any(|own| own.as_deref() == Some(name));
            let width = match (&array.items, array.shape.strip_prefix(axes)) {
                (Items::Numbers(_), Some([])) => 1,
                (Items::Numbers(_), Some([width])) => *width,
                _ if role => continue,
                _ => {
                    table.left_out.push(format!("{name} {:?}", array.shape));
                    continue;
                }
            };
            let texts = |name: &str| match arrays.get(name) {
                Some(Array { items: Items::Texts(texts), .. }) if is_own && texts.len() == width => Some(texts),
                _ => None,
            };
            let (channels, units) = (texts("channels"), texts("units"));
            for column in 0..width {
                let own = channels.map(|channels| match units.map(|units| units[column].as_str()) {
                    None | Some("") => channels[column].clone(),
                    Some(unit) => format!("{} [{unit}]", channels[column]),
                });
                let numbered = || if width == 1 { name.clone() } else { format!("{name}_{column}") };
                table.names.push(own.unwrap_or_else(numbered));
                table.columns.push((&array.items, width, column));
            }
        }
        if table.columns.len() == 1 {
            return Err(format!("no array has the axes {axes:?} of \"{base}\", or one more; it has {}", listed()));
        }
        Ok(table)
    }

    /// The table as text.
    fn text(&self) -> impl std::io::Read + '_ {
        let names: Vec<String> =
            ["trial", "label"].into_iter().chain(self.names.iter().map(String::as_str)).map(quoted).collect();
        let lines = (0..self.trials).flat_map(move |trial| {
            let head: Vec<String> = self.heads[trial].iter().map(|text| quoted(text)).collect();
            let head = head.join(",");
            (0..self.lengths[trial]).map(move |sample| {
                let row = trial * self.samples + sample;
                let mut line = format!("\n{head}");
                for (items, width, column) in &self.columns {
                    line.push(',');
                    line.push_str(&items.text(row * width + column));
                }
                Ok(line.into_bytes())
            })
        });
        Lines { rest: names.join(",").into_bytes(), at: 0, lines }
    }
}
