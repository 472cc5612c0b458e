//! Errors as exceptions, with the messages that the program gives.

use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::{PyErr, import_exception};
use trimray::cli::CliError;
use trimray::output;
use trimray::render::RenderError;
use trimray::scene;

import_exception!(trimray._errors, InputError);
import_exception!(trimray._errors, OutOfMemoryError);
import_exception!(trimray._errors, OutputError);
import_exception!(trimray._errors, SceneError);
import_exception!(trimray._errors, WorkError);

/// What is wrong with a scene. The places of one that is in no file mean nothing to its author.
pub(crate) fn scene_error(error: &scene::SceneError, has_file: bool) -> PyErr {
    let lines = error
        .diagnostics
        .iter()
        .map(|fault| if has_file { fault.to_string() } else { fault.message.clone() });
    let text = lines.collect::<Vec<_>>().join("\n");
    if error.lacks_memory() { OutOfMemoryError::new_err(text) } else { SceneError::new_err(text) }
}

/// Input that is wrong.
pub(crate) fn input_error(error: impl ToString) -> PyErr {
    InputError::new_err(error.to_string())
}

/// An argument that is wrong.
pub(crate) fn value_error(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Work that was stopped by Ctrl-C.
pub(crate) fn interrupted() -> PyErr {
    PyKeyboardInterrupt::new_err(())
}

pub(crate) fn output_error(error: &output::OutputError) -> PyErr {
    OutputError::new_err(error.to_string())
}

pub(crate) fn cli_error(error: &CliError) -> PyErr {
    match error {
        CliError::Scene(error) => scene_error(error, true),
        CliError::Input(message) => InputError::new_err(message.clone()),
        CliError::Output(error) => output_error(error),
        CliError::Memory(error) => OutOfMemoryError::new_err(error.to_string()),
        CliError::Interrupted => interrupted(),
        CliError::Failed(error) => WorkError::new_err(format!("{error:#}")),
    }
}

pub(crate) fn render_error(error: &RenderError) -> PyErr {
    match error {
        RenderError::Interrupted => interrupted(),
        RenderError::Film(error) => input_error(error),
        RenderError::Memory(error) => OutOfMemoryError::new_err(error.to_string()),
        RenderError::Output(error) => output_error(error),
        other => WorkError::new_err(other.to_string()),
    }
}
