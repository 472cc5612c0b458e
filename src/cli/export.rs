//! `trimray export`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use crate::export::exact_patches;
use crate::output::{check_writable, write_whole};

use super::{CliError, SceneArgs};

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray export scenes/feng_fig07.toml -o cube.json")]
pub(super) struct ExportArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The file: .json, the exact patches
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// No notes
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(args: &ExportArgs) -> Result<(), CliError> {
    let extension = args.output.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    if !extension.eq_ignore_ascii_case("json") {
        let message =
            format!("{}: unknown kind of export (valid in this version: .json)", args.output.display());
        return Err(CliError::Input(message));
    }
    check_writable(&args.output)?;
    let scene = args.scene.parse()?;
    let built = args.scene.build(&scene, args.quiet)?;
    let bytes = exact_patches(&built).context("the JSON")?;
    write_whole(&args.output, &bytes)?;
    Ok(())
}
