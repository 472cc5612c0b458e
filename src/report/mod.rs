//! What was found, for people as a page of one file, and for build servers as `JUnit`; the only folder that names the `maud` crate.
//!
//! A page needs no network: its pictures, its style and its few lines of script are in it.

mod comparison;
mod difference;
mod junit;
mod numbers;
mod page;
mod pictures;
mod plot;
mod scene_tests;

pub use comparison::{MethodPictures, PageError, ShownScene, comparison_page};
pub use difference::{DifferencePage, difference_page};
pub use junit::{TestCase, junit};
pub use page::{Html, page, table};
pub use pictures::{Shown, figure, flip, wipe};
pub use scene_tests::{SceneTestShown, scene_tests_page};
