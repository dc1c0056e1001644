//! Results as the rows of a table, for programs that read columns: `--format parquet`.

#[cfg(feature = "parquet")]
mod columns;
#[cfg(feature = "parquet")]
mod parquet_rows;

use super::args::OutputFormat;
use super::exit::UsageError;
use schemars::JsonSchema;
use serde_json::Value;

/// How results look of commands whose results are rows too.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum RowsFormat {
    /// For people.
    #[default]
    Text,
    /// For programs.
    Json,
    /// A table in Parquet, for a file or a pipe; needs the feature `parquet` of the build.
    Parquet,
}

/// `--format` of such a command.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct TableArgs {
    /// How results look on stdout; parquet is a table of columns, for a file or a pipe
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT")]
    format: RowsFormat,
}

/// Takes one row after another.
pub(super) trait RowSink {
    /// Takes the JSON object of a row.
    ///
    /// # Errors
    /// When it cannot be written.
    fn row(&mut self, row: &Value) -> anyhow::Result<()>;

    /// Writes what is left.
    ///
    /// # Errors
    /// When it cannot be written.
    fn finish(self: Box<Self>) -> anyhow::Result<()>;
}

impl TableArgs {
    /// How lines look; of a table nobody reads lines.
    pub(super) fn lines(self) -> OutputFormat {
        match self.format {
            RowsFormat::Text => OutputFormat::Text,
            RowsFormat::Json | RowsFormat::Parquet => OutputFormat::Json,
        }
    }

    /// A table on stdout whose rows are of `T`, where one is asked for.
    ///
    /// # Errors
    /// [`UsageError`] where this program cannot write one, or a person would see it.
    pub(super) fn table<T: JsonSchema>(self) -> anyhow::Result<Option<Box<dyn RowSink>>> {
        match self.format {
            RowsFormat::Parquet => begin::<T>().map(Some),
            RowsFormat::Text | RowsFormat::Json => Ok(None),
        }
    }
}

#[cfg(feature = "parquet")]
fn begin<T: JsonSchema>() -> anyhow::Result<Box<dyn RowSink>> {
    use std::io::IsTerminal;
    if std::io::stdout().is_terminal() {
        let what = "--format parquet is for a file or a pipe: slipwatch ... > table.parquet";
        return Err(UsageError(what.to_owned()).into());
    }
    let columns = columns::of::<T>();
    Ok(Box::new(parquet_rows::ParquetRows::new(&columns)?))
}

#[cfg(not(feature = "parquet"))]
#[expect(
    clippy::extra_unused_type_parameters,
    reason = "the builds with the feature use it"
)]
fn begin<T: JsonSchema>() -> anyhow::Result<Box<dyn RowSink>> {
    let what = "--format parquet: this slipwatch was built without it; \
                build it with: cargo build --release --features parquet";
    Err(UsageError(what.to_owned()).into())
}
