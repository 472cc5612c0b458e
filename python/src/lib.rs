//! trimray in Python: what NumPy's arrays and Python's objects are to the library. What users see is in `python/trimray`.

mod arrays;
mod errors;
mod lattice;
mod mesh;
mod picture;
mod scene;
mod wait;

use std::ffi::OsString;
use std::process::ExitCode;

use pyo3::prelude::*;

/// Runs the program on a command line, the program's name first; its exit code.
#[pyfunction]
fn run_program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    let code = py.detach(|| trimray::cli::run(arguments));
    // the program's codes are few, and Rust does not tell them
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(1)
}

/// The native half of the package.
#[pymodule]
mod _trimray {
    #[pymodule_export]
    use super::{
        lattice::Lattice,
        mesh::Mesh,
        picture::{Picture, diff},
        run_program,
        scene::Scene,
    };

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
