//! Trials as Apache Parquet: a table with one row per sample, for data frames.
//!
//! Columns: `trial`, `label`, `source`, `seed`, `sample`, `t_s`, `line_bar`, `phase`, then a column of every channel. Units
//! stand in the file's key-value metadata under `units`, as JSON.

use crate::content::{TrialContent, channels_of};
use crate::format::{ExchangeError, TrialExport, TrialFormat, Written, new_file};
use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::Type;
use palpate_store::{FileKind, NewFile};
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
