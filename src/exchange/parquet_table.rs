//! Tables of Apache Parquet, written: a group of rows at a time, each column whole.

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::Type;
use palpate_store::NewFile;
use std::sync::Arc;

/// A column of a group of rows.
pub(crate) enum Cells {
    Text(Vec<String>),
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Small(Vec<f32>),
    /// Lists, one after the other, and the length of each; none where a row has no list.
    Lists(Box<Self>, Vec<Option<usize>>),
}

/// Columns of a group of rows with their names.
pub(crate) type Columns = Vec<(String, Cells)>;

/// Levels of a list's cells: how much of it there is, and whether it goes on.
type Levels<'a> = (Option<&'a [i16]>, Option<&'a [i16]>);

impl Cells {
    /// Lists of one length.
    pub(crate) fn lists(cells: Self, rows: usize) -> Self {
        let length = cells.count().checked_div(rows).unwrap_or(0);
        Self::Lists(Box::new(cells), vec![Some(length); rows])
    }

    /// All numbers, those of lists one after the other; none of texts.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Text(_) => Vec::new(),
            Self::Whole(numbers) => numbers.iter().map(|number| *number as f64).collect(),
            Self::Real(numbers) => numbers.clone(),
            Self::Small(numbers) => numbers.iter().map(|number| f64::from(*number)).collect(),
            Self::Lists(cells, _) => cells.numbers(),
        }
    }

    fn count(&self) -> usize {
        match self {
            Self::Text(texts) => texts.len(),
            Self::Whole(numbers) => numbers.len(),
            Self::Real(numbers) => numbers.len(),
            Self::Small(numbers) => numbers.len(),
            Self::Lists(_, lengths) => lengths.len(),
        }
    }

    fn field(&self, name: &str) -> Result<Arc<Type>, ParquetError> {
        let (physical, logical) = match self {
            Self::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Self::Whole(_) => (Physical::INT64, None),
            Self::Real(_) => (Physical::DOUBLE, None),
            Self::Small(_) => (Physical::FLOAT, None),
            Self::Lists(cells, _) => {
                let list = Type::group_type_builder("list").with_repetition(Repetition::REPEATED);
                let list = Arc::new(list.with_fields(vec![cells.field("element")?]).build()?);
                let field = Type::group_type_builder(name).with_repetition(Repetition::OPTIONAL);
                let field = field.with_logical_type(Some(LogicalType::List)).with_fields(vec![list]);
                return field.build().map(Arc::new);
            }
        };
        let field = Type::primitive_type_builder(name, physical).with_repetition(Repetition::REQUIRED);
        field.with_logical_type(logical).build().map(Arc::new)
    }

    fn write(&self, out: &mut SerializedColumnWriter<'_>, (kinds, goes_on): Levels<'_>) -> Result<(), ParquetError> {
        match self {
            Self::Text(texts) => {
                let texts: Vec<ByteArray> = texts.iter().map(|text| ByteArray::from(text.as_str())).collect();
                out.typed::<ByteArrayType>().write_batch(&texts, kinds, goes_on)
            }
            Self::Whole(numbers) => out.typed::<Int64Type>().write_batch(numbers, kinds, goes_on),
            Self::Real(numbers) => out.typed::<DoubleType>().write_batch(numbers, kinds, goes_on),
            Self::Small(numbers) => out.typed::<FloatType>().write_batch(numbers, kinds, goes_on),
            Self::Lists(cells, lengths) => {
                const NO_LIST: i16 = 0;
                const EMPTY: i16 = 1;
                const ELEMENT: i16 = 2;
                let (mut kinds, mut goes_on) = (Vec::new(), Vec::new());
                for length in lengths {
                    goes_on.push(0);
                    match length {
                        None => kinds.push(NO_LIST),
                        Some(0) => kinds.push(EMPTY),
                        Some(length) => kinds.resize(kinds.len() + length, ELEMENT),
                    }
                    goes_on.resize(kinds.len(), 1);
                }
                return cells.write(out, (Some(&kinds), Some(&goes_on)));
            }
        }
        .map(drop)
    }
}

/// A table that is being written. Its first group of rows says which columns it has.
pub(crate) struct TableWriter {
    writer: SerializedFileWriter<NewFile>,
}

impl TableWriter {
    /// Begins a table with the columns of a group, and names and values of its metadata.
    pub(crate) fn create(
        file: NewFile,
        columns: &Columns,
        metadata: impl IntoIterator<Item = (&'static str, String)>,
    ) -> Result<Self, ParquetError> {
        let fields = columns.iter().map(|(name, cells)| cells.field(name)).collect::<Result<Vec<_>, _>>()?;
        let schema = Arc::new(Type::group_type_builder("palpate").with_fields(fields).build()?);
        let pairs = metadata.into_iter().map(|(key, value)| KeyValue::new(key.to_owned(), value)).collect();
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(pairs))
            .build();
        Ok(Self { writer: SerializedFileWriter::new(file, schema, Arc::new(properties))? })
    }

    /// Adds a group of rows.
    pub(crate) fn write(&mut self, columns: &Columns) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for (_, cells) in columns {
            let Some(mut column) = group.next_column()? else { break };
            cells.write(&mut column, (None, None))?;
            column.close()?;
        }
        group.close().map(drop)
    }

    /// Ends the table, whose file appears.
    pub(crate) fn finish(self) -> Result<(), ParquetError> {
        self.writer.into_inner()?.finish().map_err(ParquetError::from)
    }
}
