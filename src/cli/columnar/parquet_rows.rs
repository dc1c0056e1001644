//! Rows into Parquet: every column may be null, packed by zstd; what the columns mean stands in the file's metadata.

use super::RowSink;
use super::columns::{ColumnKind, TableColumn};
use crate::reading::Timestamp;
use anyhow::{Context, ensure};
use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;
use serde_json::{Map, Value};
use std::io::{BufWriter, Stdout};
use std::sync::Arc;

/// Rows that are written together.
const ROWS: usize = 16_384;
/// The key of the file's metadata under which the meaning of each column stands, as JSON.
const MEANING: &str = "slipwatch.columns";

/// The values of a column that wait to be written.
enum ColumnValues {
    Numbers(Vec<f64>),
    Wholes(Vec<i64>),
    Flags(Vec<bool>),
    Texts(Vec<ByteArray>),
}

struct TableColumnWriter {
    column: TableColumn,
    values: ColumnValues,
    /// 1 where a row has a value, 0 where it is null.
    levels: Vec<i16>,
}

/// A table on its way to stdout.
pub(super) struct ParquetRows {
    columns: Vec<TableColumnWriter>,
    writer: SerializedFileWriter<BufWriter<Stdout>>,
    rows: usize,
}

impl ParquetRows {
    pub(super) fn new(columns: &[TableColumn]) -> anyhow::Result<Self> {
        let mut fields = Vec::new();
        let mut meaning = Map::new();
        for column in columns {
            fields.push(Arc::new(field(column)?));
            meaning.insert(column.path.join("."), column.says.clone().into());
        }
        let schema = Type::group_type_builder("slipwatch").with_fields(fields);
        let meaning = KeyValue::new(MEANING.to_owned(), Value::Object(meaning).to_string());
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(concat!("slipwatch ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_key_value_metadata(Some(vec![meaning]));
        let out = BufWriter::new(std::io::stdout());
        let writer = SerializedFileWriter::new(
            out,
            Arc::new(schema.build()?),
            Arc::new(properties.build()),
        )?;
        let columns = columns.iter().map(|column| TableColumnWriter {
            column: column.clone(),
            values: match column.kind {
                ColumnKind::Number => ColumnValues::Numbers(Vec::new()),
                ColumnKind::Whole | ColumnKind::Time => ColumnValues::Wholes(Vec::new()),
                ColumnKind::Flag => ColumnValues::Flags(Vec::new()),
                ColumnKind::Text | ColumnKind::Json => ColumnValues::Texts(Vec::new()),
            },
            levels: Vec::new(),
        });
        Ok(Self {
            columns: columns.collect(),
            writer,
            rows: 0,
        })
    }

    fn write(&mut self) -> anyhow::Result<()> {
        self.rows = 0;
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            let next = group.next_column()?;
            column.write(next.context("a table of fewer columns than were begun")?)?;
        }
        group.close()?;
        Ok(())
    }
}

impl RowSink for ParquetRows {
    fn row(&mut self, row: &Value) -> anyhow::Result<()> {
        for column in &mut self.columns {
            let path = column.column.path.iter();
            let value = path.fold(row, |value, key| &value[key.as_str()]);
            column.take(value)?;
        }
        self.rows += 1;
        if self.rows == ROWS {
            self.write()?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> anyhow::Result<()> {
        if self.rows > 0 {
            self.write()?;
        }
        self.writer.close()?;
        Ok(())
    }
}

impl TableColumnWriter {
    fn take(&mut self, value: &Value) -> anyhow::Result<()> {
        self.levels.push(i16::from(!value.is_null()));
        if value.is_null() {
            return Ok(());
        }
        let (name, kind) = (|| self.column.path.join("."), self.column.kind);
        let wrong = || format!("column {}: {value} is no {kind:?}", name());
        match &mut self.values {
            ColumnValues::Numbers(all) => all.push(value.as_f64().with_context(wrong)?),
            ColumnValues::Flags(all) => all.push(value.as_bool().with_context(wrong)?),
            ColumnValues::Wholes(all) if kind == ColumnKind::Time => {
                let time: Timestamp = value.as_str().with_context(wrong)?.parse()?;
                let nanoseconds = i64::try_from(time.as_nanosecond());
                all.push(nanoseconds.with_context(|| format!("column {}: {time}", name()))?);
            }
            ColumnValues::Wholes(all) => all.push(value.as_i64().with_context(wrong)?),
            ColumnValues::Texts(all) if kind == ColumnKind::Text => {
                all.push(value.as_str().with_context(wrong)?.into());
            }
            ColumnValues::Texts(all) => all.push(value.to_string().into_bytes().into()),
        }
        Ok(())
    }

    fn write(&mut self, mut out: SerializedColumnWriter<'_>) -> anyhow::Result<()> {
        let levels = std::mem::take(&mut self.levels);
        let known = levels.iter().filter(|level| **level == 1).count();
        let written = match &mut self.values {
            ColumnValues::Numbers(all) => {
                let all = std::mem::take(all);
                out.typed::<DoubleType>()
                    .write_batch(&all, Some(&levels), None)
            }
            ColumnValues::Wholes(all) => {
                let all = std::mem::take(all);
                out.typed::<Int64Type>()
                    .write_batch(&all, Some(&levels), None)
            }
            ColumnValues::Flags(all) => {
                let all = std::mem::take(all);
                out.typed::<BoolType>()
                    .write_batch(&all, Some(&levels), None)
            }
            ColumnValues::Texts(all) => {
                let all = std::mem::take(all);
                out.typed::<ByteArrayType>()
                    .write_batch(&all, Some(&levels), None)
            }
        };
        ensure!(written? == known, "a column was not written whole");
        Ok(out.close()?)
    }
}

fn field(column: &TableColumn) -> anyhow::Result<Type> {
    let (physical, logical) = match column.kind {
        ColumnKind::Number => (Physical::DOUBLE, None),
        ColumnKind::Whole => (Physical::INT64, None),
        ColumnKind::Flag => (Physical::BOOLEAN, None),
        ColumnKind::Time => {
            let utc = LogicalType::timestamp(true, TimeUnit::NANOS);
            (Physical::INT64, Some(utc))
        }
        ColumnKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        ColumnKind::Json => (Physical::BYTE_ARRAY, Some(LogicalType::Json)),
    };
    let name = column.path.join(".");
    let field = Type::primitive_type_builder(&name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical);
    Ok(field.build()?)
}
