//! The page of two compared pictures.

use maud::html;

use super::page::{Html, page, table};
use super::pictures::{Shown, figure, flip, wipe};

/// What the page shows.
#[derive(Clone, Copy, Debug)]
pub struct DifferencePage<'a> {
    /// `pass`, `warn` or `fail`.
    pub status: &'a str,
    /// The reference and the picture that was tested, of one size, if they have colours.
    pub pictures: Option<[Shown<'a>; 2]>,
    /// The heat map, which says what its brightest colour is.
    pub heat_map: Shown<'a>,
    /// Names and values, of the whole.
    pub figures: &'a [Vec<String>],
    /// Headings and cells, layer by layer.
    pub layers: (&'a [&'a str], &'a [Vec<String>]),
    /// Place, error and the command that renders it, of each of the worst pixels.
    pub worst: &'a [Vec<String>],
    /// In plain words.
    pub notes: &'a [String],
}

/// A page with the pictures to wipe and flip, the heat map, the figures, and the worst pixels.
#[must_use]
pub fn difference_page(title: &str, shown: &DifferencePage<'_>) -> String {
    page(title, &body(shown))
}

fn body(shown: &DifferencePage<'_>) -> Html {
    html! {
        p { span class={ "verdict " (shown.status) } { (shown.status.to_uppercase()) } }
        @if let Some([reference, test]) = &shown.pictures {
            h2 { "Reference and test" }
            (wipe(reference, test))
            " "
            (flip(reference, test))
        }
        h2 { "Heat map" }
        (figure(&shown.heat_map))
        h2 { "Figures" }
        (table(&["figure", "value"], shown.figures))
        h2 { "Layers" }
        (table(shown.layers.0, shown.layers.1))
        @if !shown.worst.is_empty() {
            h2 { "Worst pixels" }
            (table(&["pixel", "error", "to render it alone"], shown.worst))
        }
        @if !shown.notes.is_empty() {
            h2 { "Notes" }
            ul { @for note in shown.notes { li { (note) } } }
        }
    }
}
