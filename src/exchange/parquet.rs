//! Trials as Apache Parquet: a table with one row per sample, for data frames.
//!
//! Columns: `trial`, `label`, `source`, `seed`, `sample`, `t_s`, `line_bar`, `phase`, then a column of every channel. Units
//! stand in the file's key-value metadata under `units`, as JSON.

use crate::content::{TrialContent, channels_of};
use crate::csv_files::read_made;
use crate::format::{ExchangeError, Import, ImportError, TrialExport, TrialFormat, Written, file_name, new_file};
use crate::mapping::Mapping;
use crate::series::{Lines, quoted};
use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::reader::{ChunkReader, FileReader as _, Length};
use ::parquet::file::serialized_reader::SerializedFileReader;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::record::reader::RowIter;
use ::parquet::record::{Field, Row};
use ::parquet::schema::types::Type;
use palpate_store::{FileKind, NewFile};
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// Columns before the channels.
const FIXED: [(&str, Physical); 8] = [
    ("trial", Physical::INT64),
    ("label", Physical::BYTE_ARRAY),
    ("source", Physical::BYTE_ARRAY),
    ("seed", Physical::INT64),
    ("sample", Physical::INT64),
    ("t_s", Physical::DOUBLE),
    ("line_bar", Physical::DOUBLE),
    ("phase", Physical::BYTE_ARRAY),
];

/// Tables of Parquet, a row group for each trial.
pub(crate) struct Parquet;

impl TrialFormat for Parquet {
    fn kind(&self) -> FileKind {
        FileKind::Other { title: "Parquet file", endings: &["parquet"], begin: b"PAR1" }
    }

    fn write(&self, export: &TrialExport<'_>, path: &Path) -> Result<Written, ExchangeError> {
        let failed = |error: &dyn std::fmt::Display| ExchangeError::cannot_write(path, error);
        let file = new_file(path, self.kind())?;
        // Every trial has to be seen before the columns are known.
        let trials = export.contents()?.collect::<Result<Vec<_>, _>>()?;
        let written = table(&trials, &channels_of(&trials), file).map_err(|e| failed(&e))?;
        written.finish().map_err(|e| failed(&e))?;
        Ok(Written::whole(path))
    }

    fn read(&self, path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
        let file = palpate_geometry::open_regular(path).map_err(|cause| ImportError::of(path, cause))?;
        contained(path, || read_table(file, path, mapping))
    }

    fn columns(&self, path: &Path, _mapping: &Mapping) -> Result<Vec<String>, ImportError> {
        let file = palpate_geometry::open_regular(path).map_err(|cause| ImportError::of(path, cause))?;
        contained(path, || {
            let reader = SerializedFileReader::new(Bounded(file));
            reader.and_then(|reader| names_of(&reader)).map_err(|error| ImportError::of(path, why(&error)))
        })
    }
}

thread_local! {
    static CONTAINED: Cell<bool> = const { Cell::new(false) };
}

/// True while a panic of this thread is the fault of a damaged file, and becomes an error.
pub fn is_contained() -> bool {
    CONTAINED.get()
}

/// Reads a file with a library that panics at some damaged ones.
fn contained<T>(path: &Path, read: impl FnOnce() -> Result<T, ImportError>) -> Result<T, ImportError> {
    CONTAINED.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(read));
    CONTAINED.set(false);
    outcome.unwrap_or_else(|_panic| Err(ImportError::of(path, "it is not a sound Parquet file")))
}

/// Largest page, unpacked (bytes). Programs write pages of about a megabyte.
const MOST_OF_A_PAGE: u64 = 16 << 20;

/// Part of a page in which its head is sought (bytes).
const LONGEST_HEAD: u64 = 8192;

/// A file in which no page may claim to unpack to more than that: the library would take the memory before it looks.
struct Bounded(File);

impl Length for Bounded {
    fn len(&self) -> u64 {
        self.0.len()
    }
}

impl ChunkReader for Bounded {
    type T = <File as ChunkReader>::T;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let head = self.0.get_bytes(start, self.len().saturating_sub(start).min(LONGEST_HEAD) as usize)?;
        match unpacked_size(&head) {
            Some(claimed) if claimed > MOST_OF_A_PAGE => Err(ParquetError::General(format!(
                "a page claims to unpack to {claimed} bytes; write it with pages of at most {MOST_OF_A_PAGE}"
            ))),
            _ => self.0.get_read(start),
        }
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<bytes::Bytes, ParquetError> {
        match start.checked_add(length as u64) {
            Some(end) if end <= self.len() => self.0.get_bytes(start, length),
            _ => Err(ParquetError::EOF(format!("{length} bytes at {start}, beyond the end"))),
        }
    }
}

/// The largest unpacked size that the head of a page claims: field 2 of `PageHeader` (parquet.thrift), in Thrift's compact
/// form, in which fields may come in any order and more than once. None where there is none, or the head is damaged before it.
fn unpacked_size(head: &[u8]) -> Option<u64> {
    const SIZE: i64 = 2;
    let (mut rest, mut field, mut claimed) = (head, 0, None);
    while let Some(kind) = field_of(&mut rest, &mut field) {
        let before = rest;
        if skipped(&mut rest, kind, 0).is_none() {
            break;
        }
        if field == SIZE && (4..=6).contains(&kind) {
            claimed = claimed.max(varint(&mut { before }).map(|number| number >> 1));
        }
    }
    claimed
}

/// Deepest nesting of a head that is followed.
const DEEPEST: usize = 8;

/// Kind of the next field, whose number is put into `field`; none at the end.
fn field_of(rest: &mut &[u8], field: &mut i64) -> Option<u8> {
    let byte = *rest.split_off_first().filter(|byte| **byte & 15 != 0)?;
    *field = match byte >> 4 {
        0 => varint(rest).map(|number| (number >> 1) as i64 ^ -((number & 1) as i64))?,
        step => field.wrapping_add(i64::from(step)),
    };
    Some(byte & 15)
}

/// Passes over a value of some kind.
fn skipped(rest: &mut &[u8], kind: u8, depth: usize) -> Option<()> {
    let over = |rest: &mut &[u8], count: u64| rest.split_off(..usize::try_from(count).ok()?).map(|_| ());
    match kind {
        // Truth values are part of their kind.
        1 | 2 => Some(()),
        3 => over(rest, 1),
        4..=6 => varint(rest).map(|_| ()),
        7 => over(rest, 8),
        8 => {
            let length = varint(rest)?;
            over(rest, length)
        }
        12 if depth < DEEPEST => {
            let mut field = 0;
            while let Some(kind) = field_of(rest, &mut field) {
                skipped(rest, kind, depth + 1)?;
            }
            Some(())
        }
        // Heads have no lists and maps.
        _ => None,
    }
}

/// A number of seven bits to a byte.
fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for place in 0.. {
        let byte = *rest.split_off_first()?;
        number |= u64::from(byte & 0x7f).checked_shl(7 * place).unwrap_or(0);
        if byte & 0x80 == 0 {
            break;
        }
    }
    Some(number)
}

/// Names of the columns of all rows, in their order: later lists may be longer.
fn names_of(reader: &SerializedFileReader<Bounded>) -> Result<Vec<String>, ParquetError> {
    let mut names: Vec<String> = Vec::new();
    let mut known = BTreeSet::new();
    for row in reader.get_row_iter(None)? {
        let mut before = 0;
        cells(&row?, &mut |name, _| {
            if names.get(before) == Some(&name) {
                before += 1;
            } else if known.contains(&name) {
                before = names.iter().position(|own| *own == name).map_or(before, |at| at + 1);
            } else {
                names.insert(before, name.clone());
                known.insert(name);
                before += 1;
            }
        });
        if names.len() > MOST_COLUMNS {
            return Err(ParquetError::General(format!("it has more than {MOST_COLUMNS} columns")));
        }
    }
    Ok(names)
}

/// Reads a table with a row for each sample. Lists become a column for each of their elements, groups one for each member.
fn read_table(file: File, path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
    let failed = |error: ParquetError| ImportError::of(path, why(&error));
    let reader = SerializedFileReader::new(Bounded(file)).map_err(failed)?;
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let of_metadata = |key: &str| pairs?.iter().find(|pair| pair.key == key)?.value.as_deref();
    let is_own = of_metadata("palpate").is_some();
    let units: BTreeMap<String, String> =
        of_metadata("units").and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default();
    let own = Mapping {
        ignore: FIXED
            .iter()
            .map(|(name, _)| *name)
            .filter(|name| !OWN_ROLES.contains(name))
            .map(str::to_owned)
            .collect(),
        ..Mapping::default()
    };
    let mapping = if is_own && !mapping.has_roles() { &own } else { mapping };
    let names = names_of(&reader).map_err(failed)?;
    let places: BTreeMap<&str, usize> = names.iter().map(String::as_str).zip(0..).collect();
    let mut rows = RowIter::from_file_into(Box::new(reader)).peekable();
    let wanted = mapping.time.as_deref().unwrap_or("t_s");
    if let Some(Ok(first)) = rows.peek()
        && !is_own
        && first.get_column_iter().any(|(name, cell)| name == wanted && is_whole(cell))
    {
        let text =
            format!("the times \"{wanted}\" are whole numbers of no unit; name it, as in --time \"{wanted} [ns]\"");
        return Err(ImportError::of(path, text));
    }
    let with_unit = |name: &String| match units.get(name).filter(|unit| !unit.is_empty()) {
        Some(unit) => quoted(&format!("{name} [{unit}]")),
        None => quoted(name),
    };
    let header: Vec<String> = names.iter().map(with_unit).collect();
    let lines = rows.map(|row| {
        let mut texts = vec![String::new(); names.len()];
        cells(&row.map_err(|error| std::io::Error::other(why(&error)))?, &mut |name, text| {
            if let Some(place) = places.get(name.as_str()) {
                texts[*place] = text;
            }
        });
        let line: Vec<String> = texts.iter().map(|text| quoted(text)).collect();
        let line = format!("\n{}", line.join(",")).into_bytes();
        Ok(line)
    });
    let text = Lines { rest: header.join(",").into_bytes(), at: 0, lines };
    read_made(text, &file_name(path), mapping, &mapping.label_of(path))
}

/// Why a table cannot be read.
fn why(error: &ParquetError) -> String {
    let text = error.to_string();
    match text.split_once("compile time: ") {
        Some((_, packing)) => format!("it is packed with {packing}, which is not read here; write it with snappy"),
        None => format!("it cannot be read as Parquet: {text}"),
    }
}

/// Columns of this program's tables that an import reads besides the channels.
const OWN_ROLES: [&str; 3] = ["trial", "label", "t_s"];
/// Most columns.
const MOST_COLUMNS: usize = 2000;

/// True for a whole number without a unit of its type.
fn is_whole(cell: &Field) -> bool {
    matches!(
        cell,
        Field::Byte(_)
            | Field::Short(_)
            | Field::Int(_)
            | Field::Long(_)
            | Field::UInt(_)
            | Field::ULong(_)
            | Field::UShort(_)
    )
}

/// Names and texts of the cells of a row.
fn cells(row: &Row, take: &mut dyn FnMut(String, String)) {
    for (name, cell) in row.get_column_iter() {
        cell_texts(name, cell, take);
    }
}

fn cell_texts(name: &str, cell: &Field, take: &mut dyn FnMut(String, String)) {
    let text = match cell {
        Field::Null | Field::Bytes(_) | Field::MapInternal(_) | Field::Date(_) => String::new(),
        Field::Bool(value) => u8::from(*value).to_string(),
        Field::Str(text) => text.clone(),
        Field::TimeMillis(ms) => (f64::from(*ms) * 1e-3).to_string(),
        Field::TimestampMillis(ms) => (*ms as f64 * 1e-3).to_string(),
        Field::TimeMicros(us) | Field::TimestampMicros(us) => (*us as f64 * 1e-6).to_string(),
        Field::Float(value) => value.to_string(),
        Field::Double(value) => value.to_string(),
        Field::Group(row) => {
            return row.get_column_iter().for_each(|(own, cell)| cell_texts(&format!("{name}.{own}"), cell, take));
        }
        Field::ListInternal(list) => {
            let elements = list.elements().iter().take(MOST_COLUMNS).enumerate();
            return elements.for_each(|(k, cell)| cell_texts(&format!("{name}_{k}"), cell, take));
        }
        other => other.to_string(),
    };
    take(name.to_owned(), text);
}

fn table(trials: &[TrialContent], channels: &[(&str, &'static str)], file: NewFile) -> Result<NewFile, ParquetError> {
    let field = |name: &str, physical: Physical| -> Result<Arc<Type>, ParquetError> {
        let text = (physical == Physical::BYTE_ARRAY).then_some(LogicalType::String);
        let field = Type::primitive_type_builder(name, physical).with_repetition(Repetition::REQUIRED);
        Ok(Arc::new(field.with_logical_type(text).build()?))
    };
    let fixed = FIXED.iter().map(|(name, physical)| field(name, *physical));
    let numbers = channels.iter().map(|(name, _)| field(name, Physical::FLOAT));
    let fields = fixed.chain(numbers).collect::<Result<Vec<_>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("palpate").with_fields(fields).build()?);
    let units: serde_json::Map<String, serde_json::Value> =
        channels.iter().map(|(name, unit)| ((*name).to_owned(), (*unit).into())).collect();
    let metadata = [
        ("units".to_owned(), serde_json::Value::from(units).to_string()),
        ("palpate".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
    ];
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(metadata.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect()))
        .build();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties))?;
    for trial in trials {
        let mut group = writer.next_row_group()?;
        let mut place = 0;
        while let Some(mut column) = group.next_column()? {
            match FIXED.get(place) {
                Some((name, _)) => fixed_column(&mut column, name, trial)?,
                None => {
                    let own = trial.open.columns.iter().find(|own| own.name == channels[place - FIXED.len()].0);
                    let value = |k: &usize| own.map_or(f32::NAN, |own| own.values[*k]);
                    let values: Vec<f32> = trial.samples.iter().map(value).collect();
                    column.typed::<FloatType>().write_batch(&values, None, None)?;
                }
            }
            column.close()?;
            place += 1;
        }
        group.close()?;
    }
    writer.into_inner()
}

fn fixed_column(column: &mut SerializedColumnWriter<'_>, name: &str, trial: &TrialContent) -> Result<(), ParquetError> {
    let open = &trial.open;
    let phase = |t_s: f64| open.phases.iter().rfind(|span| span.from_s <= t_s).map_or("", |span| span.phase.name());
    let whole = |value: &dyn Fn(usize, usize) -> i64| -> Vec<i64> {
        trial.samples.iter().enumerate().map(|(n, k)| value(n, *k)).collect()
    };
    let real = |values: &[f64]| -> Vec<f64> { trial.samples.iter().map(|k| values[*k]).collect() };
    let text = |value: &dyn Fn(usize) -> String| -> Vec<ByteArray> {
        trial.samples.iter().map(|k| ByteArray::from(value(*k).into_bytes())).collect()
    };
    match name {
        "label" => column.typed::<ByteArrayType>().write_batch(&text(&|_| open.header.object.clone()), None, None),
        "source" => column.typed::<ByteArrayType>().write_batch(&text(&|_| open.source.name().to_owned()), None, None),
        "phase" => column.typed::<ByteArrayType>().write_batch(&text(&|k| phase(open.t_s[k]).to_owned()), None, None),
        "t_s" => column.typed::<DoubleType>().write_batch(&real(&open.t_s), None, None),
        "line_bar" => column.typed::<DoubleType>().write_batch(&real(&open.line_bar), None, None),
        "seed" => {
            let seed = open.header.seed.cast_signed();
            column.typed::<Int64Type>().write_batch(&whole(&|_, _| seed), None, None)
        }
        "sample" => column.typed::<Int64Type>().write_batch(&whole(&|n, _| n as i64), None, None),
        _ => column.typed::<Int64Type>().write_batch(&whole(&|_, _| open.id), None, None),
    }
    .map(drop)
}

#[cfg(test)]
mod tests {
    use super::unpacked_size;

    #[test]
    fn the_size_of_a_page_is_read_from_its_head() {
        // By pyarrow: a page of 406 bytes, and one whose size was replaced by 200 000 000.
        assert_eq!(unpacked_size(&[0x15, 0x00, 0x15, 0xac, 0x06, 0x15, 0xbc, 0x04]), Some(406));
        assert_eq!(unpacked_size(&[0x15, 0x00, 0x15, 0x80, 0x88, 0xde, 0xbe, 0x01, 0x15]), Some(200_000_000));
        for head in
            [&[][..], &[0x15], &[0x15, 0x80], &[0x15, 0, 0x15, 0xff], &[0x15, 0, 0x25, 2], &[0x15, 0], &[0x2c, 1]]
        {
            assert_eq!(unpacked_size(head), None, "{head:x?}");
        }
        // Its number in full, another order, and twice with a struct in between.
        assert_eq!(unpacked_size(&[0x05, 0x04, 0x80, 0x01]), Some(64));
        assert_eq!(unpacked_size(&[0x35, 0x06, 0x05, 0x04, 0x80, 0x01, 0x00]), Some(64));
        assert_eq!(unpacked_size(&[0x25, 0x02, 0x3c, 0x18, 0x01, 0x78, 0x00, 0x05, 0x04, 0x80, 0x01]), Some(64));
        assert!(unpacked_size(&[&[0x15, 0, 0x15][..], &[0xff; 9], &[1]].concat()).is_some_and(|size| size > 1 << 40));
    }
}
