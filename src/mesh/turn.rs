//! Which way three points of a plane turn.

use glam::DVec2;
use robust::{Coord, orient2d};

/// Twice the signed area of `a b c`, with the right sign: positive where they turn left (Shewchuk 1997).
pub(super) fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}
