//! Scenes rendered and judged by their reference pictures.
//!
//! [`find_tests`] pairs the scenes of a folder with their references, [`run_test`] renders one for [`judge()`], [`bless()`] makes
//! a reference. A reference with the variance of its colours is an estimate: the scene is rendered with other random numbers, and
//! fails if the noise of both does not explain their difference. Any other reference is to be met value by value.

mod bless;
mod folder;
mod judge;
mod picture;
mod run;
#[cfg(test)]
mod tests;

pub use bless::{BlessError, BlessSettings, bless};
pub use folder::{FolderError, SceneTest, TestFolder, find_tests};
pub use judge::{JudgeSettings, Judgement, judge};
pub use picture::{MadePicture, MakeError, files_hash, make_picture};
pub use run::{SEED, TestResult, TestSettings, run_test};
