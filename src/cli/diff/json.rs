//! What `trimray diff --json` prints.

use std::io;

use serde_json::{Value, json};

use trimray::difference::{Figures, LayerDifference, Mismatch};
use trimray::export::to_json;

use super::Found;

/// JSON of pictures that cannot be compared.
pub(super) fn different(mismatch: &Mismatch) -> io::Result<String> {
    print(&json!({ "status": "different", "notes": mismatch.reasons }))
}

fn print(value: &Value) -> io::Result<String> {
    String::from_utf8(to_json(value)?).map_err(io::Error::other)
}

impl Found<'_> {
    pub(super) fn json(&self) -> io::Result<String> {
        let found = &self.comparison;
        let mut all = figures(&found.figures);
        let more = json!({
            "status": found.status,
            "reference": self.paths[0].to_string_lossy(),
            "test": self.paths[1].to_string_lossy(),
            "pixels": found.pixels,
            "failing": found.failing,
            "failing_percent": percent(found.failing, found.pixels),
            "warning": found.warning,
            "warning_percent": percent(found.warning, found.pixels),
            "metric": found.metrics.first().map(|metric| json!({ "name": metric.name, "mean": metric.mean })),
            "metrics": found.metrics,
            "layers": found.layers.iter().map(layer).collect::<Vec<_>>(),
            "ztest": found.ztest,
            "notes": self.notes,
            "worst": found.worst.iter().map(|worst| json!({
                "x": worst.x, "y": worst.y, "part": worst.part, "error": worst.error, "command": self.command(worst),
            })).collect::<Vec<_>>(),
        });
        merge(&mut all, more);
        print(&all)
    }
}

fn merge(all: &mut Value, more: Value) {
    if let (Value::Object(all), Value::Object(more)) = (all, more) {
        all.extend(more);
    }
}

fn percent(count: u64, pixels: usize) -> f64 {
    100.0 * count as f64 / pixels.max(1) as f64
}

/// The figures that the whole, layers and channels have. Infinite ones are null.
fn figures(figures: &Figures) -> Value {
    let place = figures.max_place.as_ref();
    json!({
        "mean_error": figures.mean_error(),
        "rms_error": figures.rms_error(),
        "psnr": figures.psnr(),
        "max_error": {
            "value": figures.max_error,
            "x": place.map(|place| place.x),
            "y": place.map(|place| place.y),
            "part": place.map(|place| &place.part).filter(|part| !part.is_empty()),
            "channel": place.map(|place| &place.channel),
            "reference": place.map(|place| place.reference),
            "test": place.map(|place| place.test),
        },
        "max_ulp": figures.max_ulp,
        "equal_share": figures.equal_share(),
        "values": figures.values,
        "non_finite": {
            "count": figures.non_finite,
            "first": figures.non_finite_place,
            "equal": figures.equal_non_finite,
        },
    })
}

fn layer(layer: &LayerDifference) -> Value {
    let mut all = figures(&layer.figures);
    let channels = layer.channels.iter().map(|(name, of_channel)| {
        let mut channel = figures(of_channel);
        merge(&mut channel, json!({ "name": name }));
        channel
    });
    let mut thresholds = json!(layer.thresholds);
    if layer.thresholds.ulp == u64::MAX {
        thresholds["ulp"] = Value::Null;
    }
    let more = json!({
        "part": layer.part,
        "name": layer.name,
        "kind": layer.kind,
        "status": layer.status,
        "judged_by": layer.judge,
        "failing": layer.failing,
        "failing_percent": percent(layer.failing, layer.pixels),
        "warning": layer.warning,
        "degrees": layer.angles,
        "thresholds": thresholds,
        "channels": channels.collect::<Vec<_>>(),
    });
    merge(&mut all, more);
    all
}
