//! The `trimray` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    trimray::cli::run(std::env::args_os())
}
