//! Tears along curves: triangles are cut where a curved border between two sheets of the surface crosses them, if the
//! sheets are apart there.
//!
//! Triangles are halved until a border crosses each at most once and nearly straight, then cut at the points where it
//! crosses their edges: found from the edge alone, so that neighbours share them. Each part then belongs to one sheet, and
//! edges along the border are known, whose middles are moved onto it when they are halved.

use std::collections::{HashMap, HashSet};

use glam::DVec2;

use super::corners::{Mesh, Triangle};
use super::refine::{Refinement, edges_of, ordered};
use super::{TessellateError, index};
use crate::patch::Sheets;

/// Most rounds of halving before triangles are cut: where more than two sheets meet, no halving would do.
const MAX_ROUNDS: usize = 6;

/// Steps along each side of the grids of points at which sheets are told apart.
const STEPS: u32 = 8;

/// How far from an edge a border may be in its middle, in parts of its length, for the triangle to be cut along the edge.
const STRAIGHT: f64 = 0.15;

/// Cuts triangles along the borders of sheets that are apart there.
///
/// # Errors
/// If there are too many triangles, or on cancellation.
pub(super) fn cut_along_tears(refinement: &mut Refinement<'_>) -> Result<(), TessellateError> {
    let mesh = &refinement.mesh;
    let torn: Vec<bool> =
        mesh.parts.iter().map(|part| part.sheets.are_torn(part.outline, mesh.same_position)).collect();
    if !torn.contains(&true) {
        return Ok(());
    }
    for _ in 0..MAX_ROUNDS {
        let mesh = &refinement.mesh;
        let crossed = mesh.triangles.iter().filter(|triangle| {
            torn[triangle.part as usize] && !is_simple(mesh.sheets(triangle), triangle.st)
        });
        let marked: HashSet<[u32; 2]> =
            crossed.flat_map(|triangle| edges_of(triangle.vertices).map(ordered)).collect();
        if marked.is_empty() {
            break;
        }
        refinement.halve(|edge| marked.contains(&edge))?;
    }
    let fractions = crossings(&refinement.mesh, &torn);
    refinement.cut(|edge| fractions.get(&edge).copied(), true)?;
    assign(&mut refinement.mesh, &torn);
    Ok(())
}

/// Whether a triangle is in one sheet, or a border crosses it once and nearly straight.
fn is_simple(sheets: Sheets<'_>, corners: [DVec2; 3]) -> bool {
    let [a, b, c] = corners;
    let at_corners = corners.map(|corner| sheets.holders(corner));
    let mut common = u32::MAX;
    let mut all = 0;
    for i in 0..=STEPS {
        for j in 0..=STEPS - i {
            let [v, w] = [i, j].map(|k| f64::from(k) / f64::from(STEPS));
            let here = sheets.holders(a * (1.0 - v - w) + b * v + c * w);
            common &= here;
            all |= if here.count_ones() == 1 { here } else { 0 };
        }
    }
    if common != 0 {
        return true;
    }
    let mut ends: Vec<DVec2> = Vec::new();
    for edge in 0..3 {
        let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
        let along = |step: u32| sheets.holder(from.lerp(to, (f64::from(step) + 0.5) / f64::from(STEPS)));
        let changes = (1..STEPS).filter(|&step| along(step) != along(step - 1)).count();
        let is_crossed = at_corners[edge] & at_corners[(edge + 1) % 3] == 0;
        if changes > 1 || (changes == 1 && !is_crossed) {
            return false;
        }
        if is_crossed {
            ends.push(from.lerp(to, sheets.crossing([from, to])));
        }
    }
    if let ([_], Some(corner)) = (&*ends, (0..3).find(|&i| at_corners[i].count_ones() > 1)) {
        ends.push(corners[corner]);
    }
    let [from, to] = *ends else { return false };
    let middle = 0.5 * (from + to);
    all.count_ones() == 2
        && sheets
            .on_border([from, to], middle)
            .is_some_and(|place| place.distance(middle) <= STRAIGHT * from.distance(to))
}

/// Where borders cross edges, from the end with the lower index to the other.
fn crossings(mesh: &Mesh<'_>, torn: &[bool]) -> HashMap<[u32; 2], f64> {
    let mut found = HashMap::new();
    for triangle in mesh.triangles.iter().filter(|triangle| torn[triangle.part as usize]) {
        let sheets = mesh.sheets(triangle);
        for (edge, vertices) in edges_of(triangle.vertices).into_iter().enumerate() {
            let [from, to] = [triangle.st[edge], triangle.st[(edge + 1) % 3]];
            if sheets.holders(from) & sheets.holders(to) == 0 {
                let ends = if vertices[0] < vertices[1] { [from, to] } else { [to, from] };
                found.entry(ordered(vertices)).or_insert_with(|| sheets.crossing(ends));
            }
        }
    }
    found
}

/// Gives each triangle to its sheet, with vertices of its own where that is torn, and finds the edges along borders.
fn assign(mesh: &mut Mesh<'_>, torn: &[bool]) {
    let mut triangles = std::mem::take(&mut mesh.triangles);
    let mut sides: HashMap<(u32, usize), u32> = HashMap::new();
    let mut others: HashMap<u32, Vec<u32>> = HashMap::new();
    let chosen: Vec<Option<usize>> = triangles
        .iter()
        .map(|triangle| torn[triangle.part as usize].then(|| sheet_of(mesh.sheets(triangle), triangle)))
        .collect();
    let mut beside: HashMap<(u32, [u32; 2]), usize> = HashMap::new();
    for (triangle, sheet) in triangles.iter().zip(&chosen) {
        let Some(sheet) = *sheet else { continue };
        beside.extend(edges_of(triangle.vertices).map(|edge| ((triangle.part, edge), sheet)));
    }
    for (triangle, sheet) in triangles.iter_mut().zip(chosen) {
        let Some(sheet) = sheet else { continue };
        for (edge, [from, to]) in edges_of(triangle.vertices).into_iter().enumerate() {
            let other = beside.get(&(triangle.part, [to, from]));
            triangle.on_border[edge] = other.is_some_and(|&other| other != sheet);
        }
        for corner in 0..3 {
            let position = mesh.sheets(triangle).faces()[sheet].eval(triangle.st[corner]).position;
            let first = triangle.vertices[corner];
            let known = std::iter::once(&first).chain(others.get(&first).into_iter().flatten());
            let is_same =
                |vertex: &&u32| mesh.positions[**vertex as usize].distance(position) <= mesh.same_position;
            triangle.vertices[corner] = known.clone().find(is_same).copied().unwrap_or_else(|| {
                mesh.positions.push(position);
                let made = index(mesh.positions.len() - 1);
                others.entry(first).or_default().push(made);
                made
            });
        }
        triangle.part = *sides.entry((triangle.part, sheet)).or_insert_with(|| {
            let mut side = mesh.parts[triangle.part as usize].clone();
            side.patch = &side.sheets.faces()[sheet];
            side.is_side = true;
            mesh.parts.push(side);
            index(mesh.parts.len() - 1)
        });
    }
    mesh.triangles = triangles;
}

/// The sheet of a triangle: one that all its corners have, and its middle if possible.
fn sheet_of(sheets: Sheets<'_>, triangle: &Triangle) -> usize {
    let common = triangle.st.iter().fold(u32::MAX, |common, &st| common & sheets.holders(st));
    let middle = sheets.holder(triangle.st.iter().sum::<DVec2>() / 3.0);
    let is_common = |sheet: usize| common >> sheet & 1 == 1;
    if is_common(middle) {
        middle
    } else {
        (0..sheets.faces().len()).find(|&sheet| is_common(sheet)).unwrap_or(middle)
    }
}
