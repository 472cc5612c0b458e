//! The exact picture against that of a method chosen on the page.

use maud::html;

use super::{MethodPictures, ShownScene, is_exact, name};
use crate::compare::MethodFigures;
use crate::report::numbers::{count, scientific, short};
use crate::report::page::Html;
use crate::report::pictures::{Shown, figure};

/// A wipe between the two with the heat map beside it. Each picture is in the page once: the first choice's where it is shown,
/// the others' with their names in the list, from where the page's script takes them.
pub(super) fn chooser(shown: &ShownScene<'_>) -> Html {
    let methods = &shown.figures.methods;
    let Some(exact) = shown.pictures.first() else { return html! { p { "None." } } };
    let exact = Shown { label: "exact", png: &exact.png };
    let first = methods.iter().position(|method| !is_exact(method));
    let Some(first) = first.or((methods.len() > 1).then_some(1)) else { return figure(&exact) };
    let heat_map = shown.pictures[first].heat_map.as_deref();
    let first_name = name(&methods[first]);
    let others = || methods.iter().zip(shown.pictures).enumerate().skip(1);
    html! {
        div class="chooser" {
            p { label { "Method: " select autocomplete="off" {
                @for (index, (method, pictures)) in others() { (choice(method, pictures, index == first)) }
            } } " " span class="chosen-figures" { (figures(&methods[first])) } }
            div class="pair" {
                figure {
                    div class="wipe" tabindex="0" role="slider" aria-valuemin="0" aria-valuemax="100" aria-valuenow="50"
                        aria-label={ "exact against " (first_name) } {
                        img src=(exact.uri()) alt=(exact.label);
                        img src=(uri(&shown.pictures[first].png)) alt=(first_name);
                        hr;
                    }
                    figcaption { "left: exact; right: " span class="chosen" { (first_name) } " (drag, or arrow keys)" }
                }
                figure class="heat" hidden[heat_map.is_none()] {
                    img src=[heat_map.map(uri)] alt="heat map";
                    figcaption {
                        div class="scale" { span { "0" } span class="magma" {} span { "1" } }
                        "LDR-FLIP of " span class="chosen" { (first_name) } " against exact: 0 is no visible difference, 1 the \
                         greatest there is, when the pictures are flipped between in place"
                    }
                }
            }
        }
    }
}

fn uri(png: &[u8]) -> String {
    Shown { label: "", png }.uri()
}

/// A method to choose; the pictures of the one that is shown at first are elsewhere.
fn choice(method: &MethodFigures, pictures: &MethodPictures, is_first: bool) -> Html {
    let picture = (!is_first).then(|| uri(&pictures.png));
    let heat_map = pictures.heat_map.as_deref().filter(|_| !is_first).map(uri);
    html! {
        option selected[is_first] data-figures=(figures(method)) data-picture=[picture] data-heat-map=[heat_map] {
            (name(method))
        }
    }
}

/// What to know while looking at the picture.
fn figures(method: &MethodFigures) -> String {
    let deviation = method.deviation.map(|deviation| format!("deviation {}", scientific(deviation.max)));
    let silhouette = method.silhouette.map(|silhouette| format!("silhouette {} px", short(silhouette.max)));
    let flip = method.image.as_ref().map(|image| format!("FLIP {}", short(image.flip)));
    let triangles = format!("{} triangles", count(method.triangles));
    let parts = [Some(triangles), deviation, silhouette, flip];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}
