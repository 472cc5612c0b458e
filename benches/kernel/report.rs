//! Lines for people, or one JSON object a line.

use serde_json::{Map, Value};
use trimray::trace::TraceStatistics;

/// How results are printed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Report {
    /// One JSON object a line.
    pub(crate) json: bool,
}

impl Report {
    /// Above a section.
    pub(crate) fn heading(self, title: &str, columns: &str) {
        if !self.json {
            println!("\n{title}\n{columns}");
        }
    }

    /// A line of a section.
    pub(crate) fn row(self, json: &Value, text: &str) {
        println!("{}", if self.json { json.to_string() } else { text.to_owned() });
    }
}

/// All counts per ray.
pub(crate) fn per_ray_json(statistics: &TraceStatistics) -> Map<String, Value> {
    statistics.per_ray().map(|(name, count)| (name.to_owned(), count.into())).collect()
}

/// Those counts per ray that are not 0.
pub(crate) fn per_ray_text(statistics: &TraceStatistics) -> String {
    let met = statistics.per_ray().filter(|(_, count)| *count > 0.0);
    let parts: Vec<_> =
        met.map(|(name, count)| format!("{} {}", name.replace('_', " "), three_digits(count))).collect();
    parts.join(", ")
}

/// With three significant digits.
fn three_digits(value: f64) -> String {
    if value < 1e-3 { format!("{value:.1e}") } else { format!("{value:.3}") }
}

/// A degree or other list as "2x4".
pub(crate) fn by(numbers: &[usize]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join("x")
}
