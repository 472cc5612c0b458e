//! The page of scenes by several methods, each against the exact one.

mod chooser;
mod plots;
mod summary;
mod tables;
#[cfg(test)]
mod tests;

use maud::html;
use thiserror::Error;

use super::numbers::{about, count, scientific, short};
use super::page::{Html, page};
use crate::compare::{MethodFigures, Needed, SceneFigures};

/// Why there is no page.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct PageError(String);

impl From<String> for PageError {
    fn from(reason: String) -> Self {
        Self(reason)
    }
}

/// A scene's figures with the pictures of its methods, in the same order.
#[derive(Clone, Copy, Debug)]
pub struct ShownScene<'a> {
    /// The figures.
    pub figures: &'a SceneFigures,
    /// The pictures, all of one size.
    pub pictures: &'a [MethodPictures],
}

/// PNG files of one method.
#[derive(Clone, Debug)]
pub struct MethodPictures {
    /// The picture.
    pub png: Vec<u8>,
    /// LDR-FLIP against the exact picture, as magma from 0 to 1; none of the exact one.
    pub heat_map: Option<Vec<u8>>,
}

/// A page with each scene's summary, the levels of subdivision it takes, its pictures to wipe, plots and tables.
///
/// # Errors
/// If a scene has more or fewer pictures than methods, or a plot cannot be drawn.
pub fn comparison_page(scenes: &[ShownScene<'_>]) -> Result<String, PageError> {
    let shown = scenes.iter().enumerate().map(|(index, shown)| scene(index, shown));
    let shown: Vec<Html> = shown.collect::<Result<_, _>>()?;
    let body = html! {
        p {
            "Each scene's deformed objects were made by several methods and rendered with the same camera, light and random \
             numbers. "
            b { "exact" } " keeps the deformed shape as trimmed Bézier patches, without approximation; "
            b { "pointwise:" i { "n" } } " splits each triangle into 4" sup { i { "n" } } " and deforms the corners alone; "
            b { "adaptive:" i { "t" } } " halves triangles until they are within " i { "t" } " world units of the shape."
        }
        @if scenes.len() > 1 {
            nav { ul { @for (index, shown) in scenes.iter().enumerate() {
                li { a href={ "#scene-" (index) } { (shown.figures.scene) } }
            } } }
        }
        @for scene in shown { (scene) }
    };
    Ok(page("Exact against pointwise and adaptive deformation", &body))
}

fn scene(index: usize, shown: &ShownScene<'_>) -> Result<Html, String> {
    let figures = shown.figures;
    let (pictures, methods) = (shown.pictures.len(), figures.methods.len());
    if pictures != methods {
        return Err(format!("{}: {pictures} pictures of {methods} methods", figures.scene));
    }
    let plots = plots::plots(&figures.methods).map_err(|error| format!("{}: {error}", figures.scene))?;
    let [width, height] = figures.size;
    Ok(html! {
        section id={ "scene-" (index) } {
            h2 { (figures.scene) }
            p {
                (width) " × " (height) " pixels, " (count(usize::try_from(figures.spp).unwrap_or(usize::MAX)))
                @if figures.spp == 1 { " sample each" } @else { " samples each" }
            }
            p { @for sentence in summary::summary(figures) { (sentence) " " } }
            h3 { "What level of subdivision does it take?" }
            (needed(&figures.needed))
            h3 { "Pictures" }
            (chooser::chooser(shown))
            h3 { "Plots" }
            p { "Numbers beside the marks are levels (pointwise) and tolerances (adaptive)." }
            div class="plots" { @for plot in plots { (plot) } }
            h3 { "All methods" }
            (tables::tables(&figures.methods, index == 0))
        }
    })
}

/// How a method is called on the page.
fn name(method: &MethodFigures) -> String {
    if method.noise { format!("{}, other seed (noise)", method.method) } else { method.method.clone() }
}

/// Whether it is the reference, or one that is as exact.
fn is_exact(method: &MethodFigures) -> bool {
    method.kind.is_exact()
}

fn needed(rows: &[Needed]) -> Html {
    let goal = |row: &Needed| match row.quantity {
        "deviation" => {
            format!("deviation below {} of the diagonal", scientific(row.below).replace(".0e", "e"))
        }
        "silhouette" => {
            format!("silhouette within {} px", short(row.below).trim_end_matches('0').trim_end_matches('.'))
        }
        other => format!("{other} below {}", short(row.below)),
    };
    html! {
        @if rows.is_empty() {
            p { "Not known: no level of pointwise deformation was measured." }
        } @else {
            div class="scroll" { table class="figures" {
                thead { tr {
                    th { "pointwise, for a" }
                    th class="number" { "level" }
                    th class="number" { "triangles" }
                    th { "known by" }
                } }
                tbody { @for row in rows {
                    tr class=[row.extrapolated.then_some("guess")] {
                        td { (goal(row)) }
                        td class="number" { (row.level) }
                        td class="number" { @if row.extrapolated { "about " } (about(row.triangles)) }
                        td { @if row.extrapolated { "extrapolation" } @else { "measurement" } }
                    }
                } }
            } }
            p class="note" {
                "The first level whose error is below; of deviations the certified bound counts. Extrapolated levels assume that \
                 the error falls by four with each level, from the finest one measured."
            }
        }
    }
}
