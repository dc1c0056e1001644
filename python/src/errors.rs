//! The library's errors as exceptions of Python, with the place where the trouble is.

use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyLookupError, PyOSError, PyValueError};
use pyo3::prelude::*;
use slipwatch::reading::SelectError;
use slipwatch::runtime::ingest::IngestError;
use slipwatch::runtime::replay::ReplayError;
use std::error::Error;
use std::path::Path;

create_exception!(
    _core,
    ReadingError,
    PyValueError,
    "A file that holds what it should not; file, line, column and value say where, None where that is unknown."
);
create_exception!(
    _core,
    SelectionError,
    PyLookupError,
    "No series fits what was asked for, or several do."
);
create_exception!(
    _core,
    SlipwatchError,
    PyException,
    "Something else that cannot be done."
);

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("ReadingError", py.get_type::<ReadingError>())?;
    module.add("SelectionError", py.get_type::<SelectionError>())?;
    module.add("SlipwatchError", py.get_type::<SlipwatchError>())
}

/// An argument that cannot be meant.
pub(crate) fn bad_input(what: &str) -> PyErr {
    PyValueError::new_err(what.to_owned())
}

pub(crate) fn not_there(what: &str) -> PyErr {
    SelectionError::new_err(what.to_owned())
}

/// The exception of an error.
pub(crate) fn raise<E: Error + 'static>(error: E) -> PyErr {
    let text = sentence(&error);
    let error: &(dyn Error + 'static) = &error;
    if let Some(error) = error.downcast_ref::<IngestError>() {
        if error.is_io() {
            return PyOSError::new_err(text);
        }
        return located(error, text);
    }
    if error.is::<SelectError>() {
        return SelectionError::new_err(text);
    }
    if matches!(error.downcast_ref(), Some(ReplayError::NothingUntil { .. })) {
        return PyValueError::new_err(text);
    }
    SlipwatchError::new_err(text)
}

/// With its causes.
fn sentence(error: &dyn Error) -> String {
    let (mut text, mut cause) = (error.to_string(), error.source());
    while let Some(one) = cause {
        text = format!("{text}: {one}");
        cause = one.source();
    }
    text
}

type Place<'a> = (
    Option<&'a Path>,
    Option<u64>,
    Option<&'a str>,
    Option<&'a str>,
);

fn place(error: &IngestError) -> Place<'_> {
    match error {
        IngestError::Field {
            file,
            line,
            column,
            value,
            ..
        } => (Some(file), Some(*line), Some(column), Some(value)),
        IngestError::Header {
            file, line, column, ..
        } => (Some(file), Some(*line), Some(column), None),
        IngestError::BadHeader { file, line, found }
        | IngestError::Torn { file, line, found }
        | IngestError::Line {
            file, line, found, ..
        }
        | IngestError::Inconsistent {
            file, line, found, ..
        } => (Some(file), Some(*line), None, Some(found)),
        IngestError::NoHeader { file, line } => (Some(file), Some(*line), None, None),
        IngestError::Record {
            file,
            line,
            problem,
        } => (
            Some(file),
            Some(*line),
            Some(problem.field),
            Some(&problem.value),
        ),
        IngestError::Message { file, problem, .. } => {
            (Some(file), None, Some(problem.field), Some(&problem.value))
        }
        IngestError::EmptyColumn { file, column } => (Some(file), None, Some(column), None),
        IngestError::UnknownFormat { file }
        | IngestError::Workbook { file }
        | IngestError::Empty { file, .. }
        | IngestError::NoChannels { file }
        | IngestError::Damaged { file, .. }
        | IngestError::MessageCount { file, .. }
        | IngestError::NoTopics { file, .. } => (Some(file), None, None, None),
        _ => (None, None, None, None),
    }
}

fn located(error: &IngestError, text: String) -> PyErr {
    let (file, line, column, value) = place(error);
    let raised = ReadingError::new_err(text);
    let set = Python::attach(|py| {
        let one = raised.value(py);
        one.setattr("file", file.map(|file| file.display().to_string()))?;
        one.setattr("line", line)?;
        one.setattr("column", column)?;
        one.setattr("value", value)
    });
    match set {
        Ok(()) => raised,
        Err(error) => error,
    }
}
