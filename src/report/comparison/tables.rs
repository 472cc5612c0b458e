//! All figures of all methods, and what they mean.

use maud::html;

use super::{is_exact, name};
use crate::compare::MethodFigures;
use crate::deviation::Deviation;
use crate::report::numbers::{bytes, count, scientific, short};
use crate::report::page::Html;

/// Columns under one heading, which a method has all of or none.
struct Group {
    name: &'static str,
    /// What is measured, in what unit.
    meaning: &'static str,
    columns: &'static [Column],
    /// Why a method has none of them.
    missing: fn(&MethodFigures) -> String,
}

/// A heading and what is below it.
type Column = (&'static str, fn(&MethodFigures) -> Option<String>);

const SHAPE: [Group; 6] = [
    Group {
        name: "made of",
        meaning: "Of the deformed objects: flat triangles, for the exact method the input's; and patches, which the rays meet: for \
                  the exact method Bézier patches, for the others the triangles.",
        columns: &[
            ("triangles", |method| Some(count(method.triangles))),
            ("patches", |method| Some(count(method.patches))),
        ],
        missing: |_| String::new(),
    },
    Group {
        name: "deviation / diagonal",
        meaning: "Distance between the method's shape and the exact one, both ways, in parts of the diagonal of each object's \
                  bounding box; the worst object counts. Max is the greatest distance found (Hausdorff's), and no distance is \
                  greater than the bound, which is certified and within 1 % of it. Mean is over the surface. Of the exact method \
                  it is how far rounding takes points all over it from where the volumes that deform it take them, which is \
                  measured and not certified.",
        columns: &[
            ("max", |method| Some(four_digits(method.deviation?.max))),
            ("bound", |method| Some(certified(method))),
            ("mean", |method| Some(scientific(method.deviation?.mean))),
        ],
        missing: |method| method.deviation_error.clone().unwrap_or_else(|| "not known".to_owned()),
    },
    Group {
        name: "normals, degrees",
        meaning: "Angle between flat triangles and the surface that they stand for: the greatest at corners and centroids, the mean by area at centroids.",
        columns: &[
            ("max", |method| flat(method).map(|found| short(found.normal_max_degrees))),
            ("mean", |method| flat(method).map(|found| short(found.normal_mean_degrees))),
        ],
        missing: |method| if is_exact(method) { "none" } else { "not known" }.to_owned(),
    },
    Group {
        name: "silhouette, px",
        meaning: "Distance between the outlines in the picture, both ways, in pixels: where the object that is seen changes, found \
                  along the lines between pixels.",
        columns: &[
            ("max", |method| Some(short(method.silhouette?.max))),
            ("mean", |method| Some(short(method.silhouette?.mean))),
        ],
        missing: |_| "only one has any".to_owned(),
    },
    Group {
        name: "seconds",
        meaning: "Build: reading, deforming and the acceleration structure. Render: the picture. By the clock, on all threads \
                  together.",
        columns: &[
            ("build", |method| Some(short(method.seconds_of.build))),
            ("render", |method| Some(short(method.seconds_of.render))),
            ("total", |method| Some(short(method.seconds))),
        ],
        missing: |_| String::new(),
    },
    Group {
        name: "memory",
        meaning: "Traced: geometry of all objects and the acceleration structure, as they are held here. Plain: the deformed objects \
                  alone as an indexed mesh, 12 bytes for each triangle and each vertex; of exact patches the control points and \
                  trims. 1 kB is 1000 bytes.",
        columns: &[
            ("traced", |method| Some(bytes(method.bytes as f64))),
            ("plain", |method| Some(bytes(method.bytes_of.plain as f64))),
        ],
        missing: |_| String::new(),
    },
];

const PICTURE: [Group; 4] = [
    Group {
        name: "colours",
        meaning: "Errors of the linear colours against the exact picture, over all pixels and channels: mean absolute, root of the \
                  mean square, greatest; PSNR in decibels for a peak of 1; relMSE, the mean squared error in parts of the squared \
                  reference.",
        columns: &[
            ("mean", |method| Some(short(method.image.as_ref()?.mean_error))),
            ("RMS", |method| Some(short(method.image.as_ref()?.rms_error))),
            ("max", |method| Some(short(method.image.as_ref()?.max_error))),
            ("PSNR, dB", |method| Some(short(method.image.as_ref()?.psnr))),
            ("relMSE", |method| Some(short(method.image.as_ref()?.relmse))),
        ],
        missing: reference,
    },
    Group {
        name: "as seen",
        meaning: "SSIM: structural similarity, 1 for equal pictures. FLIP: mean difference seen when the pictures are flipped \
                  between in place, from 0 to 1; HDR-FLIP is the same over a range of exposures.",
        columns: &[
            ("SSIM", |method| Some(ssim(method.image.as_ref()?.ssim))),
            ("FLIP", |method| Some(short(method.image.as_ref()?.flip))),
            ("HDR-FLIP", |method| Some(short(method.image.as_ref()?.hdrflip))),
        ],
        missing: reference,
    },
    Group {
        name: "normals, degrees",
        meaning: "Angle between the shading normals of the two pictures, pixel by pixel.",
        columns: &[
            ("max", |method| Some(short(method.image.as_ref()?.normal_degrees?.max))),
            ("mean", |method| Some(short(method.image.as_ref()?.normal_degrees?.mean))),
        ],
        missing: |method| {
            if method.image.is_none() { "reference".to_owned() } else { "not known".to_owned() }
        },
    },
    Group {
        name: "objects",
        meaning: "The share of pixels that show the same object.",
        columns: &[("same", |method| Some(percentage(method.image.as_ref()?.same_object)))],
        missing: reference,
    },
];

fn reference(_: &MethodFigures) -> String {
    "reference".to_owned()
}

/// The deviation of flat triangles; of exact patches neither a bound nor normals are measured.
fn flat(method: &MethodFigures) -> Option<Deviation> {
    method.deviation.filter(|_| !is_exact(method))
}

/// As many as tell a distance from its bound, which is within 1 % of it.
fn four_digits(value: f64) -> String {
    if value.is_finite() && value != 0.0 { format!("{value:.3e}") } else { short(value) }
}

/// Rounded up, for it to stay a bound; of what is exact there is none, only rounding at many points.
fn certified(method: &MethodFigures) -> String {
    let value = flat(method).map_or(f64::NAN, |found| found.bound);
    let shown = four_digits(value);
    match shown.parse::<f64>() {
        Ok(rounded) if rounded < value => {
            four_digits(value + 0.5 * libm::exp10(libm::floor(libm::log10(value)) - 3.0))
        }
        _ => shown,
    }
}

fn ssim(value: f64) -> String {
    if value.is_nan() { short(value) } else { format!("{value:.5}") }
}

/// Never 100 % of what is not all.
fn percentage(share: f64) -> String {
    let percent = share * 100.0;
    if percent.is_nan() {
        short(percent)
    } else if percent > 99.999 && percent < 100.0 {
        "> 99.999 %".to_owned()
    } else {
        format!("{percent:.3} %")
    }
}

/// Two tables, so that each fits on a screen: what the methods made, and how far the pictures are off.
pub(super) fn tables(methods: &[MethodFigures], is_explained: bool) -> Html {
    html! {
        h4 { "Shapes, time and memory" }
        (table(methods, &SHAPE, is_explained))
        h4 { "Pictures against the exact one" }
        (table(methods, &PICTURE, is_explained))
        p class="note" {
            "Errors of pictures contain noise; the row “exact, other seed (noise)” is the exact scene with other random numbers, so \
             what it has is noise alone."
        }
    }
}

fn table(methods: &[MethodFigures], groups: &[Group], is_explained: bool) -> Html {
    html! {
        div class="scroll" { table class="figures methods" {
            thead {
                tr { th rowspan="2" { "method" } @for group in groups { th class="first" colspan=(group.columns.len()) { (group.name) } } }
                tr { @for group in groups { @for (index, (name, _)) in group.columns.iter().enumerate() {
                    th class={ "number" @if index == 0 { " first" } } { (name) }
                } } }
            }
            tbody { @for method in methods {
                tr class=[is_exact(method).then_some("exact")] {
                    th scope="row" { (name(method)) }
                    @for group in groups { (cells(method, group)) }
                }
            } }
        } }
        details open[is_explained] {
            summary { "What the columns mean" }
            dl { @for group in groups { dt { (group.name) } dd { (group.meaning) } } }
        }
    }
}

fn cells(method: &MethodFigures, group: &Group) -> Html {
    let cells: Option<Vec<String>> = group.columns.iter().map(|(_, cell)| cell(method)).collect();
    html! {
        @match cells {
            Some(cells) => @for (index, cell) in cells.iter().enumerate() {
                td class={ "number" @if index == 0 { " first" } } { (cell) }
            },
            None => td class="missing first" colspan=(group.columns.len()) { ((group.missing)(method)) },
        }
    }
}
