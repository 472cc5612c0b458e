//! Stand-in.
use crate::compare::SceneFigures;
/// .
#[derive(Debug)]
pub struct ShownScene<'a> {
    /// .
    pub figures: &'a SceneFigures,
    /// .
    pub pictures: &'a [MethodPictures],
}
/// .
#[derive(Debug)]
pub struct MethodPictures {
    /// .
    pub png: Vec<u8>,
    /// .
    pub heat_map: Option<Vec<u8>>,
}
/// .
/// # Errors
/// .
pub fn comparison_page(scenes: &[ShownScene<'_>]) -> Result<String, String> {
    Ok(format!("{}", scenes.len()))
}
