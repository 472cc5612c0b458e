//! Tables, or one JSON object a line.

use serde_json::json;

use crate::common::objects::Subject;
use crate::common::rays::RaySet;
use crate::peer::PeerMesh;

/// How results are printed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Report {
    /// One JSON object a line.
    pub(crate) json: bool,
}

/// A tessellation and what it cost.
#[derive(Debug)]
pub(crate) struct BuildRow {
    /// The error asked for.
    pub(crate) label: String,
    /// Each triangle was cut into n × n; `None` if adaptive.
    pub(crate) n: Option<u32>,
    /// Number of triangles.
    pub(crate) triangles: usize,
    /// Error measured, in parts of the diagonal.
    pub(crate) error: f64,
    /// Time of tessellating and deforming.
    pub(crate) tessellate_seconds: f64,
    /// What Embree made of it.
    pub(crate) mesh: PeerMesh,
}

/// Rays whose hits differ.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Agreement {
    /// Rays that only trimray hits.
    pub(crate) only_trimray: usize,
    /// Rays that only Embree hits.
    pub(crate) only_embree: usize,
    /// Rays whose hits are farther apart, across the surface, than twice the tessellation's error and rounding.
    pub(crate) elsewhere: usize,
}

/// Rates on one set of rays and one tessellation, in rays a second.
#[derive(Debug)]
pub(crate) struct RateRow {
    /// The tessellation.
    pub(crate) label: String,
    /// Rays that hit, by trimray.
    pub(crate) hits: usize,
    /// Of each of trimray's ways.
    pub(crate) trimray: Vec<f64>,
    /// `rtcIntersect1`.
    pub(crate) intersect1: f64,
    /// `rtcIntersect16`.
    pub(crate) intersect16: f64,
    /// `rtcIntersect16` with the flag for coherent rays.
    pub(crate) coherent16: Option<f64>,
    /// Differing hits.
    pub(crate) agreement: Agreement,
}

impl Report {
    /// The object and the versions.
    pub(crate) fn heading(self, subject: &Subject, version: &str) {
        if !self.json {
            println!("\nobject {}: {}", subject.name, subject.description);
            println!(
                "one thread; Embree {version}; times in ms, memory in MB, rates in million rays a second\n"
            );
        }
    }

    /// trimray's build.
    pub(crate) fn trimray(self, subject: &Subject, leaves: usize, build_seconds: f64, bytes: usize) {
        if self.json {
            println!(
                "{}",
                json!({"object": subject.name, "table": "trimray", "leaves": leaves, "build_seconds": build_seconds, "bytes": bytes})
            );
            return;
        }
        println!(
            "trimray: {leaves} leaves, built in {:.2} ms, {:.3} MB",
            1e3 * build_seconds,
            bytes as f64 / 1e6
        );
        println!(
            "\n{:17} {:>4} {:>9} {:>9} {:>10} {:>8} {:>8} {:>8} | {:>12} {:>11} {:>8}",
            "tessellation",
            "n",
            "triangles",
            "error",
            "tessellate",
            "build",
            "BVH",
            "mesh",
            "build ratio",
            "with tess.",
            "memory"
        );
    }

    /// A tessellation; ratios are Embree / trimray.
    pub(crate) fn build(self, subject: &Subject, build_seconds: f64, bytes: usize, row: &BuildRow) {
        let memory = row.mesh.bvh_bytes + row.mesh.mesh_bytes;
        if self.json {
            println!(
                "{}",
                json!({
                    "object": subject.name, "table": "build", "tessellation": row.label, "n": row.n,
                    "triangles": row.triangles, "error": row.error, "tessellate_seconds": row.tessellate_seconds,
                    "build_seconds": row.mesh.build_seconds, "bvh_bytes": row.mesh.bvh_bytes,
                    "mesh_bytes": row.mesh.mesh_bytes, "build_ratio": row.mesh.build_seconds / build_seconds,
                    "memory_ratio": memory as f64 / bytes as f64
                })
            );
            return;
        }
        println!(
            "{:17} {:>4} {:>9} {:>9.2e} {:>10.1} {:>8.1} {:>8.2} {:>8.2} | {:>12.3} {:>11.3} {:>8.3}",
            row.label,
            row.n.map_or_else(|| "-".to_owned(), |n| n.to_string()),
            row.triangles,
            row.error,
            1e3 * row.tessellate_seconds,
            1e3 * row.mesh.build_seconds,
            row.mesh.bvh_bytes as f64 / 1e6,
            row.mesh.mesh_bytes as f64 / 1e6,
            row.mesh.build_seconds / build_seconds,
            (row.mesh.build_seconds + row.tessellate_seconds) / build_seconds,
            memory as f64 / bytes as f64
        );
    }

    /// Above the rates; `ways` are the names of trimray's.
    pub(crate) fn rates_heading(self, ways: &[&str]) {
        if self.json {
            return;
        }
        print!("\n{:13} {:>8} {:>5}", "rays", "number", "hit");
        for way in ways {
            print!(" {way:>8}");
        }
        println!(
            " | {:17} {:>7} {:>7} {:>7} | {:>9} {:>8} {:>8} | differ: trimray only, Embree only, elsewhere",
            "tessellation", "I1", "I16", "I16coh", "single/I1", "best/I16", "best/coh"
        );
    }

    /// The rates on one set of rays and one tessellation.
    pub(crate) fn rates(self, subject: &Subject, set: &RaySet, ways: &[&str], row: &RateRow) {
        let best = row.trimray.iter().fold(0.0, |best: f64, &rate| best.max(rate));
        let to_intersect1 = row.trimray[0] / row.intersect1;
        let to_intersect16 = best / row.intersect16;
        let Agreement { only_trimray, only_embree, elsewhere } = row.agreement;
        if self.json {
            let rates: serde_json::Map<_, _> =
                ways.iter().zip(&row.trimray).map(|(way, &rate)| ((*way).to_owned(), rate.into())).collect();
            println!(
                "{}",
                json!({
                    "object": subject.name, "table": "rates", "rays": set.kind, "hits_only": set.hits_only,
                    "number": set.rays.len(), "hits": row.hits, "tessellation": row.label, "trimray": rates,
                    "intersect1": row.intersect1, "intersect16": row.intersect16,
                    "single_to_intersect1": to_intersect1, "best_to_intersect16": to_intersect16,
                    "coherent16": row.coherent16, "best_to_coherent16": row.coherent16.map(|rate| best / rate),
                    "only_trimray": only_trimray, "only_embree": only_embree, "elsewhere": elsewhere
                })
            );
            return;
        }
        print!("{:13} {:>8} {:>5.3}", set.name(), set.rays.len(), row.hits as f64 / set.rays.len() as f64);
        for rate in &row.trimray {
            print!(" {:>8.3}", rate / 1e6);
        }
        println!(
            " | {:17} {:>7.2} {:>7.2} {:>7} | {to_intersect1:>9.3} {to_intersect16:>8.3} {:>8} | {only_trimray} {only_embree} {elsewhere}",
            row.label,
            row.intersect1 / 1e6,
            row.intersect16 / 1e6,
            row.coherent16.map_or_else(|| "-".to_owned(), |rate| format!("{:.2}", rate / 1e6)),
            row.coherent16.map_or_else(|| "-".to_owned(), |rate| format!("{:.3}", best / rate)),
        );
    }
}
