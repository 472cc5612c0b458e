//! Plots with two logarithmic axes as SVG in the page; the only file that names the `plotters` crate.

use std::ops::Range;

use maud::{PreEscaped, html};
use plotters::coord::ranged1d::{DefaultFormatting, Ranged};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::numbers;
use super::page::Html;

/// What the axes say.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Name and unit.
    pub label: &'static str,
    /// Whether these are bytes, which have units of their own.
    pub is_bytes: bool,
}

/// A place on a curve.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub x: f64,
    pub y: f64,
    /// What is written beside it.
    pub label: String,
}

/// Points joined by a line.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    pub name: &'static str,
    pub points: Vec<Point>,
}

/// A value to hold the curves against: a dashed line across the plot.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub name: &'static str,
    pub y: f64,
    /// Where along it there is a mark.
    pub at: Option<f64>,
}

/// A plot. Values that are not above zero have no place on its axes, nor has a level far below all curves: they are drawn at the
/// lower edge, and the caption says so.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    pub title: &'static str,
    pub axes: [Axis; 2],
    /// Two at most.
    pub curves: Vec<Curve>,
    pub level: Option<Level>,
}

const SIZE: (u32, u32) = (560, 380);

/// In the page it is the text's colour, so that light and dark screens show it.
const INK: RGBColor = RGBColor(0, 0, 0);

/// In the page it is dashed.
const LEVEL: RGBColor = RGBColor(0x2e, 0x9e, 0x5b);

/// The colours of the curves: told apart without red and green, and at 3:1 against white and black.
const COLOURS: [RGBColor; 2] = [RGBColor(0x2f, 0x7f, 0xd6), RGBColor(0xd0, 0x68, 0x1c)];

/// How far below all curves a level still has its true place, as a factor.
const REACH: f64 = 1e3;

/// Curves over more than that are cut off below.
const GREATEST_RANGE: f64 = 1e12;

/// A figure with the plot, or with the reason why there is none.
///
/// # Errors
/// If plotters fails.
pub(super) fn plot(plot: &Plot) -> Result<Html, String> {
    let ranges = Ranges::around(plot);
    let drawing = ranges.as_ref().map(|ranges| draw(plot, ranges).map_err(|error| error.to_string()));
    let drawing = drawing.transpose()?;
    let view_box = format!("0 0 {} {}", SIZE.0, SIZE.1);
    let notes = match &ranges {
        Some(ranges) => ranges.notes(plot),
        None => vec!["no value above zero to draw".to_owned()],
    };
    Ok(html! {
        figure class="plot" {
            @if let Some(drawing) = drawing {
                svg viewBox=(view_box) role="img" aria-label=(plot.title) { (PreEscaped(drawing)) }
            }
            figcaption {
                b { (plot.title) }
                @for note in notes { "; " (note) }
            }
        }
    })
}

/// What the axes span.
#[derive(Clone, Debug)]
struct Ranges {
    x: Range<f64>,
    y: Range<f64>,
    /// Heights below are drawn at `edge`.
    lowest: f64,
    edge: f64,
}

impl Ranges {
    /// The ranges around a plot's curves; none if there is nothing to draw.
    fn around(plot: &Plot) -> Option<Self> {
        let points = || plot.curves.iter().flat_map(|curve| &curve.points);
        let level = plot.level.as_ref();
        let x = extent(points().map(|point| point.x).chain(level.and_then(|level| level.at)));
        let curves = extent(points().map(|point| point.y));
        let y = match (curves, level.map(|level| level.y)) {
            (Some(curves), Some(y)) if is_positive(y) && y >= curves.start / REACH => {
                curves.start.min(y)..curves.end.max(y)
            }
            (Some(curves), _) => curves,
            (None, y) => extent(y)?,
        };
        let lowest = y.start.max(y.end / GREATEST_RANGE);
        let mut y = padded(lowest..y.end);
        let mut edge = y.start;
        let is_below = |value: f64| !value.is_nan() && value < lowest;
        if points().map(|point| point.y).chain(level.map(|level| level.y)).any(is_below) {
            let room = (y.end / y.start).powf(0.07).max(1.3);
            edge = y.start / room;
            y.start = edge / room;
        }
        Some(Self { x: padded(x?), y, lowest, edge })
    }

    fn height(&self, y: f64) -> f64 {
        if y < self.lowest { self.edge } else { y }
    }

    /// What is not at its true place.
    fn notes(&self, plot: &Plot) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(level) = plot.level.as_ref().filter(|level| level.y < self.lowest) {
            let value = numbers::scientific(level.y);
            notes.push(format!("{} is at {value}, below the axis: drawn at the lower edge", level.name));
        }
        for curve in &plot.curves {
            let below = curve.points.iter().filter(|point| point.y < self.lowest);
            let below: Vec<&str> = below.map(|point| point.label.as_str()).collect();
            if !below.is_empty() {
                let labels = below.join(", ");
                notes.push(format!("{} {labels}: zero or below the axis, at the lower edge", curve.name));
            }
            let missing = curve.points.iter().filter(|point| !is_drawn(point));
            let missing: Vec<&str> = missing.map(|point| point.label.as_str()).collect();
            if !missing.is_empty() {
                notes.push(format!("{} {}: not known, not drawn", curve.name, missing.join(", ")));
            }
        }
        notes
    }
}

fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

fn is_drawn(point: &Point) -> bool {
    is_positive(point.x) && point.y.is_finite()
}

/// From the least to the greatest positive value.
fn extent(values: impl IntoIterator<Item = f64>) -> Option<Range<f64>> {
    let values = values.into_iter().filter(|&value| is_positive(value));
    let join = |range: Range<f64>, value: f64| range.start.min(value)..range.end.max(value);
    values.map(|value| value..value).reduce(|range, value| join(range, value.start))
}

/// With room on both sides, and wide enough for two labels.
fn padded(range: Range<f64>) -> Range<f64> {
    let middle = range.start.sqrt() * range.end.sqrt();
    let half = ((range.end / range.start).powf(0.5 * 1.16) * 1.1).max(2.5);
    (middle / half).max(f64::MIN_POSITIVE)..(middle * half).min(f64::MAX)
}

/// Where an axis has lines: with labels and without.
struct Ticks {
    labelled: Vec<f64>,
    plain: Vec<f64>,
}

/// At powers of ten; between them where the axis has fewer than three.
fn ticks(range: &Range<f64>) -> Ticks {
    let [first, last] = [range.start, range.end].map(|end| libm::floor(libm::log10(end)));
    let mut decades = Vec::new();
    let mut decade = first;
    while decade <= last {
        decades.push(libm::exp10(decade));
        decade += 1.0;
    }
    let times = |factors: &[f64]| -> Vec<f64> {
        let all = decades.iter().flat_map(|decade| factors.iter().map(move |factor| factor * decade));
        all.filter(|tick| range.contains(tick)).collect()
    };
    let powers = times(&[1.0]);
    let all = || times(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    match powers.len() {
        0..=2 => Ticks { labelled: times(&[1.0, 2.0, 5.0]), plain: all() },
        3..=7 => Ticks { labelled: powers, plain: all() },
        many => Ticks { labelled: powers.iter().copied().step_by(many.div_ceil(7)).collect(), plain: powers },
    }
}

/// The same for all labels of an axis: as they are if none is long, otherwise with powers of ten.
fn tick_label(value: f64, axis: &Axis, range: &Range<f64>) -> String {
    if axis.is_bytes {
        return numbers::bytes(value).replace(".0 ", " ");
    }
    // an exact power's logarithm may fall short of it
    let exponent = libm::floor(libm::log10(value) + 1e-9);
    let factor = (value / libm::exp10(exponent)).round();
    if range.start >= 0.005 && range.end < 1e4 {
        let decimals = if exponent < -1.5 { 2 } else { usize::from(exponent < -0.5) };
        return format!("{value:.decimals$}");
    }
    let power: String = format!("{exponent:.0}").chars().map(superscript).collect();
    if factor > 1.0 { format!("{factor:.0}·10{power}") } else { format!("10{power}") }
}

fn superscript(digit: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let value = digit.to_digit(10).and_then(|value| usize::try_from(value).ok());
    value.and_then(|value| DIGITS.get(value).copied()).unwrap_or('⁻')
}

type DrawingError = DrawingAreaErrorKind<std::io::Error>;

/// What is within the `svg` element.
fn draw(plot: &Plot, ranges: &Ranges) -> Result<String, DrawingError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let [x, y] = [&ranges.x, &ranges.y].map(|range| {
            let ticks = ticks(range);
            let axis = range.clone().log_scale().with_key_points(ticks.labelled);
            axis.with_light_points(ticks.plain)
        });
        let mut chart = ChartBuilder::on(&area)
            .margin(6)
            .margin_right(24)
            .x_label_area_size(46)
            .y_label_area_size(66)
            .build_cartesian_2d(x, y)?;
        let [x_axis, y_axis] = &plot.axes;
        chart
            .configure_mesh()
            .bold_line_style(INK.mix(0.2))
            .light_line_style(INK.mix(0.07))
            .axis_style(INK.mix(0.6))
            .label_style(text(15))
            .axis_desc_style(text(16))
            .x_desc(x_axis.label)
            .y_desc(y_axis.label)
            .x_label_formatter(&|value| tick_label(*value, x_axis, &ranges.x))
            .y_label_formatter(&|value| tick_label(*value, y_axis, &ranges.y))
            .draw()?;
        draw_level(&mut chart, plot, ranges)?;
        for (index, curve) in plot.curves.iter().enumerate() {
            draw_curve(&mut chart, (index, curve), ranges)?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .label_font(text(15))
            .legend_area_size(28)
            .draw()?;
        area.present()?;
    }
    // the element itself is the page's
    let within = svg.split_once('>').map_or("", |(_, within)| within);
    let within = within.trim_end().trim_end_matches("</svg>");
    let level = colour(LEVEL);
    let dashed = format!("stroke={level} stroke-dasharray=\"6 4\"");
    Ok(within.replace(&colour(INK), "\"currentColor\"").replace(&format!("stroke={level}"), &dashed))
}

/// As plotters writes it.
fn colour(RGBColor(r, g, b): RGBColor) -> String {
    format!("\"#{r:02X}{g:02X}{b:02X}\"")
}

fn text(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

type Chart<'a, X, Y> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>;

/// An axis of ours.
trait Scale: Ranged<ValueType = f64, FormatOption = DefaultFormatting> {}
impl<S: Ranged<ValueType = f64, FormatOption = DefaultFormatting>> Scale for S {}

fn draw_level<'a, X: Scale, Y: Scale>(
    chart: &mut Chart<'a, X, Y>,
    plot: &Plot,
    ranges: &Ranges,
) -> Result<(), DrawingError> {
    let Some(level) = plot.level.as_ref().filter(|level| level.y.is_finite()) else { return Ok(()) };
    let y = ranges.height(level.y);
    let line = LineSeries::new([(ranges.x.start, y), (ranges.x.end, y)], LEVEL.stroke_width(2));
    let legend = |(x, y)| PathElement::new([(x, y), (x + 22, y)], LEVEL.stroke_width(2));
    chart.draw_series(line)?.label(level.name).legend(legend);
    let at = level.at.filter(|&x| is_positive(x));
    chart.draw_series(at.map(|x| Circle::new((x, y), 5, LEVEL.filled())))?;
    Ok(())
}

fn draw_curve<'a, X: Scale, Y: Scale>(
    chart: &mut Chart<'a, X, Y>,
    (index, curve): (usize, &Curve),
    ranges: &Ranges,
) -> Result<(), DrawingError> {
    let colour = COLOURS[index % COLOURS.len()];
    let drawn = || curve.points.iter().filter(|point| is_drawn(point));
    let place = |point: &Point| (point.x, ranges.height(point.y));
    if drawn().next().is_none() {
        return Ok(());
    }
    // to the right of the first curve and to the left of the second: they fall and are often close together
    let (offset, anchor) = match index {
        0 => ((7, -5), Pos::new(HPos::Left, VPos::Bottom)),
        _ => ((-7, 5), Pos::new(HPos::Right, VPos::Top)),
    };
    let line = LineSeries::new(drawn().map(place), colour.stroke_width(2));
    chart.draw_series(line)?.label(curve.name).legend(move |(x, y)| {
        EmptyElement::at((x, y))
            + PathElement::new([(0, 0), (22, 0)], colour.stroke_width(2))
            + marker(index, (11, 0), colour)
    });
    chart.draw_series(drawn().map(|point| {
        EmptyElement::at(place(point))
            + marker(index, (0, 0), colour)
            + Text::new(point.label.clone(), offset, text(14).pos(anchor))
    }))?;
    Ok(())
}

/// The marker of a curve, each of a shape of its own: a disc or a triangle.
fn marker<DB: DrawingBackend>(
    index: usize,
    at: (i32, i32),
    colour: RGBColor,
) -> DynElement<'static, DB, (i32, i32)> {
    match index {
        0 => Circle::new(at, 4, colour.filled()).into_dyn(),
        _ => TriangleMarker::new(at, 6, colour.filled()).into_dyn(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: Range<f64>, is_bytes: bool) -> Vec<String> {
        let axis = Axis { label: "", is_bytes };
        ticks(&range).labelled.iter().map(|&tick| tick_label(tick, &axis, &range)).collect()
    }

    #[test]
    fn ticks_are_at_powers_of_ten() {
        assert_eq!(labels(5e-5..2e-2, false), ["10⁻⁴", "10⁻³", "10⁻²"]);
        assert_eq!(labels(0.3..40.0, false), ["0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(labels(3e-4..3e-3, false), ["5·10⁻⁴", "10⁻³", "2·10⁻³"]);
        assert_eq!(labels(1.5e5..4e6, true), ["200 kB", "500 kB", "1 MB", "2 MB"]);
        assert!(labels(1e-200..1e200, false).len() <= 8);
        for value in [1.0, 0.0012, 3e-300, 9.99e20] {
            assert!(labels(padded(value..value), false).len() >= 2, "{value}");
        }
    }

    #[test]
    fn what_is_far_below_is_at_the_lower_edge() {
        let axis = Axis { label: "a < b", is_bytes: false };
        let point = |x, y| Point { x, y, label: format!("{y}") };
        let curve =
            Curve { name: "c", points: vec![point(10.0, 1e-2), point(20.0, 0.0), point(30.0, f64::NAN)] };
        let level = Level { name: "floor", y: 1e-16, at: Some(5.0) };
        let made = Plot { title: "t", axes: [axis; 2], curves: vec![curve], level: Some(level) };
        let ranges = Ranges::around(&made).unwrap();
        assert!(ranges.x.contains(&5.0) && ranges.x.contains(&20.0), "{ranges:?}");
        assert!(
            ranges.y.contains(&ranges.edge) && ranges.edge > 1e-4 && ranges.height(0.0) < 5e-3,
            "{ranges:?}"
        );
        let text = plot(&made).unwrap().into_string();
        for part in [
            "floor is at 1.0e-16, below the axis",
            "c 0: zero or below the axis",
            "c NaN: not known",
            "a &lt; b",
            "currentColor",
            "stroke-dasharray",
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        assert_eq!((text.matches("<svg").count(), text.matches("</svg>").count()), (1, 1));
        // near, it is where it is
        let near = Level { name: "floor", y: 1e-3, at: None };
        let ranges = Ranges::around(&Plot { level: Some(near), ..made.clone() }).unwrap();
        assert!(ranges.y.contains(&1e-3) && ranges.height(1e-3) == 1e-3, "{ranges:?}");
        let none = Plot { level: None, curves: vec![], ..made };
        assert!(plot(&none).unwrap().into_string().contains("no value above zero"));
    }
}
