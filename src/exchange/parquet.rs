//! Trials as Apache Parquet: a table with one row per sample, for data frames.
//!
//! Columns: `trial`, `label`, `source`, `seed`, `sample`, `t_s`, `line_bar`, `phase`, then a column of every channel. Units
//! stand in the file's key-value metadata under `units`, as JSON. Taxels are lists, whose shapes stand there under `taxels`.

use crate::content::{TrialContent, channels_of};
use crate::csv_files::read_made;
use crate::format::{ExchangeError, Import, ImportError, TrialExport, TrialFormat, Written, file_name, new_file};
use crate::mapping::Mapping;
use crate::parquet_table::{Cells, Columns, TableWriter};
use crate::series::{Lines, quoted};
use crate::taxels::{NORMAL, SHEAR, is_taxels};
use ::parquet::errors::ParquetError;
use ::parquet::file::reader::{ChunkReader, FileReader as _, Length};
use ::parquet::file::serialized_reader::SerializedFileReader;
use ::parquet::record::reader::RowIter;
use ::parquet::record::{Field, Row};
use ::parquet::schema::types::Type;
use palpate_store::FileKind;
use palpate_tactile::trial::TrialId;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Tables of Parquet, a row group for each trial.
pub(crate) struct Parquet;

impl TrialFormat for Parquet {
    fn kind(&self) -> FileKind {
        FileKind::Other { title: "Parquet file", endings: &["parquet"], begin: b"PAR1" }
    }

    fn write(&self, export: &TrialExport<'_>, path: &Path) -> Result<Written, ExchangeError> {
        let file = new_file(path, self.kind())?;
        // Every trial has to be seen before the columns are known.
        let trials = export.contents()?.collect::<Result<Vec<_>, _>>()?;
        let channels = channels_of(&trials);
        let of = |trial| columns_of(trial, &channels, export.taxels);
        let first =
            trials.first().map(of).ok_or_else(|| ExchangeError::Refused("no trial is left to write".to_owned()))?;
        let written =
            TableWriter::create(file, &first, metadata(&trials, &channels, export.taxels)).and_then(|mut table| {
                trials.iter().try_for_each(|trial| table.write(&of(trial)))?;
                table.finish()
            });
        written.map_err(|error| ExchangeError::cannot_write(path, &error))?;
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

/// True for a file of this program.
fn is_own(reader: &SerializedFileReader<Bounded>) -> bool {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    pairs.is_some_and(|pairs| pairs.iter().any(|pair| pair.key == "palpate"))
}

/// Schema of the columns of a file of this program that can be channels; none where they are all that it has.
fn without_taxels(reader: &SerializedFileReader<Bounded>) -> Result<Option<Type>, ParquetError> {
    let schema = reader.metadata().file_metadata().schema();
    let fields: Vec<_> = schema.get_fields().iter().filter(|field| !is_taxels(field.name())).cloned().collect();
    if !is_own(reader) || fields.len() == schema.get_fields().len() {
        return Ok(None);
    }
    Type::group_type_builder(schema.name()).with_fields(fields).build().map(Some)
}

/// Names of the columns of all rows, in their order: later lists may be longer.
fn names_of(reader: &SerializedFileReader<Bounded>) -> Result<Vec<String>, ParquetError> {
    let mut names: Vec<String> = Vec::new();
    let mut known = BTreeSet::new();
    for row in reader.get_row_iter(without_taxels(reader)?)? {
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
    let is_own = is_own(&reader);
    let units: BTreeMap<String, String> =
        of_metadata("units").and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default();
    let own = Mapping { ignore: NO_CHANNELS.map(str::to_owned).into(), ..Mapping::default() };
    let mapping = if is_own && !mapping.has_roles() { &own } else { mapping };
    let names = names_of(&reader).map_err(failed)?;
    let places: BTreeMap<&str, usize> = names.iter().map(String::as_str).zip(0..).collect();
    let schema = without_taxels(&reader).map_err(failed)?;
    let mut rows = RowIter::from_file_into(Box::new(reader)).project(schema).map_err(failed)?.peekable();
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

/// Columns of this program's tables that an import does not read.
const NO_CHANNELS: [&str; 5] = ["source", "seed", "sample", "line_bar", "phase"];
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

/// Columns of a trial: those of every table, channels, and forces on taxels where they are wanted.
fn columns_of(trial: &TrialContent, channels: &[(&str, &str)], taxels: bool) -> Columns {
    let open = &trial.open;
    let samples = &trial.samples;
    let phase = |t_s: f64| open.phases.iter().rfind(|span| span.from_s <= t_s).map_or("", |span| span.phase.name());
    let text = |text: &str| Cells::Text(vec![text.to_owned(); samples.len()]);
    let whole = |number: i64| Cells::Whole(vec![number; samples.len()]);
    let real = |values: &[f64]| Cells::Real(samples.iter().map(|k| values[*k]).collect());
    let mut columns: Columns = [
        ("trial", whole(open.id)),
        ("label", text(&open.header.object)),
        ("source", text(open.source.name())),
        ("seed", whole(open.header.seed.cast_signed())),
        ("sample", Cells::Whole((0..samples.len() as i64).collect())),
        ("t_s", real(&open.t_s)),
        ("line_bar", real(&open.line_bar)),
        ("phase", Cells::Text(samples.iter().map(|k| phase(open.t_s[*k]).to_owned()).collect())),
    ]
    .map(|(name, cells)| (name.to_owned(), cells))
    .into();
    for (name, _) in channels {
        let own = open.column(name);
        let value = |k: &usize| own.map_or(f32::NAN, |own| own.values[*k]);
        columns.push(((*name).to_owned(), Cells::Small(samples.iter().map(value).collect())));
    }
    if taxels {
        let (mut normal, mut shear) = (Vec::new(), Vec::new());
        for [own, along, across] in trial.taxel_forces(samples.iter().copied()) {
            normal.push(own);
            shear.extend([along, across]);
        }
        let count = trial.taxels().map(|taxels| taxels.count());
        let lists = |numbers, each: usize| {
            Cells::Lists(Box::new(Cells::Small(numbers)), vec![count.map(|count| each * count); samples.len()])
        };
        columns.push((NORMAL.to_owned(), lists(normal, 1)));
        columns.push((SHEAR.to_owned(), lists(shear, 2)));
    }
    columns
}

/// Metadata of the file: units, version, and the pads where forces on taxels are written.
fn metadata(trials: &[TrialContent], channels: &[(&str, &str)], taxels: bool) -> Vec<(&'static str, String)> {
    let forces: &[(&str, &str)] = if taxels { &[(NORMAL, "N"), (SHEAR, "N")] } else { &[] };
    let units: serde_json::Map<String, serde_json::Value> =
        channels.iter().chain(forces).map(|(name, unit)| ((*name).to_owned(), (*unit).into())).collect();
    let mut pairs =
        vec![("units", serde_json::Value::from(units).to_string()), ("palpate", env!("CARGO_PKG_VERSION").to_owned())];
    if taxels {
        pairs.push(("taxels", pads_json(trials).to_string()));
    }
    pairs
}

/// Trials, and the shape of their taxels with the place of each (m).
type Pads = (Vec<TrialId>, [usize; 3], Vec<[f64; 3]>);

/// Pads that trials have: the numbers of these, fingers, rows and columns of taxels, and the place of each (m).
fn pads_json(trials: &[TrialContent]) -> serde_json::Value {
    let mut pads: Vec<Pads> = Vec::new();
    for (id, taxels) in trials.iter().filter_map(|trial| Some((trial.open.id, trial.taxels()?))) {
        let (shape, positions) = (taxels.shape(), taxels.positions());
        match pads.iter_mut().find(|(_, own, places)| *own == shape && *places == positions) {
            Some((ids, ..)) => ids.push(id),
            None => pads.push((vec![id], shape, positions)),
        }
    }
    let pad = |(trials, shape, position)| serde_json::json!({"trials": trials, "shape": shape, "position": position});
    pads.into_iter().map(pad).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{assert_sums, ideal_forces, mixed_store};
    use palpate_lab::inspection::OpenOptions;

    #[test]
    fn lists_of_taxels_add_up_to_the_ideal_force() -> Result<(), Box<dyn std::error::Error>> {
        let (folder, store) = mixed_store();
        let path = folder.path().join("out.parquet");
        let options = OpenOptions::default();
        let export =
            TrialExport { store: &store, ids: &[1, 2], options: &options, taxels: true, is_stopped: &|| false };
        Parquet.write(&export, &path)?;
        let reader = SerializedFileReader::new(File::open(&path)?)?;
        let pairs = reader.metadata().file_metadata().key_value_metadata().expect("has some");
        let pads = pairs.iter().find(|pair| pair.key == "taxels").and_then(|pair| pair.value.as_deref());
        let pads: serde_json::Value = serde_json::from_str(pads.expect("is there"))?;
        assert_eq!((&pads[0]["trials"], &pads[0]["shape"]), (&serde_json::json!([1]), &serde_json::json!([2, 40, 4])));
        assert_eq!(pads[0]["position"].as_array().map(Vec::len), Some(320));
        let wanted = ideal_forces(&store, 1);
        let rows = reader.get_row_iter(None)?.collect::<Result<Vec<Row>, _>>()?;
        for (k, row) in rows.iter().enumerate() {
            let list = |name: &str| row.get_column_iter().find(|(own, _)| *own == name).expect("a column").1;
            let numbers = |name: &str| -> Option<Vec<f32>> {
                let Field::ListInternal(list) = list(name) else { return None };
                let number = |cell: &Field| if let Field::Float(number) = cell { *number } else { f32::NAN };
                Some(list.elements().iter().map(number).collect())
            };
            let Some(wanted) = wanted.get(k) else {
                assert!(*list(NORMAL) == Field::Null && *list(SHEAR) == Field::Null, "an imported trial has none");
                continue;
            };
            assert_sums(&numbers(NORMAL).expect("a list"), *wanted);
            assert_eq!(numbers(SHEAR).map(|shear| shear.len()), Some(640));
        }
        assert_eq!(rows.len(), wanted.len() + 2);
        Ok(())
    }

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
