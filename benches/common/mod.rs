//! What the benchmarks of tracing share: the objects, the rays, and how time is taken.

#![allow(dead_code, reason = "each benchmark uses a part of this module")]

pub(crate) mod objects;
pub(crate) mod rays;
pub(crate) mod timing;
