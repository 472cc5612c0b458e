//! Drags on lattices of many kinds.

use glam::DVec3;
use nalgebra::DMatrix;

use super::*;
use crate::spline::{Axis, ControlLattice};
use crate::test_support::Noise;

/// A deformed lattice over the unit cube, rational if asked for.
fn lattice(noise: &mut Noise, counts: [usize; 3], hold: usize, rational: bool) -> ControlLattice {
    let mut lattice = ControlLattice::identity([3; 3], counts, [DVec3::ZERO, DVec3::ONE], hold).unwrap();
    lattice.twist(Axis::Z, 30.0);
    if rational {
        for flat in 0..lattice.points().len() {
            let index = lattice.index_of(flat);
            if !lattice.is_held(index) {
                lattice.set_weight(index, 1.0 + noise.next()).unwrap();
            }
        }
    }
    lattice
}

fn points(noise: &mut Noise, count: usize) -> Vec<DVec3> {
    (0..count).map(|_| DVec3::splat(0.5) + 0.9 * noise.vector()).collect()
}

fn position(lattice: &ControlLattice, source: DVec3) -> DVec3 {
    lattice.volume().unwrap().eval(source).unwrap().position
}

fn difference(a: &ControlLattice, b: &ControlLattice) -> f64 {
    a.points().iter().zip(b.points()).map(|(a, b)| (a - b).length()).fold(0.0, f64::max)
}

#[test]
fn drags_reach_their_targets_with_the_least_change() {
    let mut noise = Noise(31);
    for (counts, hold, count, rational) in [
        ([4; 3], 0, 1, false),
        ([4, 7, 4], 0, 5, true),
        ([6; 3], 1, 20, true),
        ([12; 3], 0, 200, false),
        ([12; 3], 3, 60, true),
    ] {
        let before = lattice(&mut noise, counts, hold, rational);
        let sources = points(&mut noise, count);
        let manipulation = DirectManipulation::try_new(&before, &sources).unwrap();
        assert_eq!(manipulation.rank(), count);
        let displacements: Vec<DVec3> = sources.iter().map(|_| 0.1 * noise.vector()).collect();
        let solution = manipulation.solve(&displacements).unwrap();
        let mut after = before.clone();
        solution.apply(&mut after);
        for (source, displacement) in sources.iter().zip(&displacements) {
            let off = position(&after, *source).distance(position(&before, *source) + displacement);
            assert!(off < 1e-12, "{count} drags: off by {off:e}");
        }
        let back = manipulation.inverse(&displacements);
        let mut restored = after.clone();
        back.apply(&mut restored);
        assert!(difference(&restored, &before) < 1e-13, "{count} drags");
        assert!(
            (solution.objective - pseudo_inverse_objective(&before, &sources, &displacements)).abs()
                < 1e-10 * solution.objective
        );
    }
}

/// Σ |δ|² by the pseudo-inverse of the matrix of rational basis values, from a singular value decomposition.
fn pseudo_inverse_objective(lattice: &ControlLattice, sources: &[DVec3], displacements: &[DVec3]) -> f64 {
    let mut r = DMatrix::<f64>::zeros(lattice.points().len(), sources.len());
    let volume = lattice.volume().unwrap();
    for (column, source) in sources.iter().enumerate() {
        let basis = lattice.basis(*source).unwrap();
        let total: f64 = basis.iter().map(|&(flat, value)| value * lattice.points()[flat].w).sum();
        let mut sum = DVec3::ZERO;
        for (flat, value) in basis {
            let rational = value * lattice.points()[flat].w / total;
            sum += rational * lattice.points()[flat].truncate();
            if !lattice.is_held(lattice.index_of(flat)) {
                r[(flat, column)] = rational;
            }
        }
        assert!(sum.distance(volume.eval(*source).unwrap().position) < 1e-14);
    }
    // |δ|² = Dᵀ G⁺ D, with the singular values of R themselves
    let svd = r.svd(false, true);
    let v = svd.v_t.unwrap();
    (0..3)
        .map(|axis| {
            let d = nalgebra::DVector::from_fn(sources.len(), |i, _| displacements[i][axis]);
            let along = &v * d;
            along.iter().zip(svd.singular_values.iter()).map(|(a, s)| (a / s) * (a / s)).sum::<f64>()
        })
        .sum()
}

#[test]
fn decompositions_give_the_same_lattice_in_any_order() {
    let mut noise = Noise(32);
    let before = lattice(&mut noise, [5, 6, 4], 0, true);
    let sources = points(&mut noise, 12);
    let displacements: Vec<DVec3> = sources.iter().map(|_| 0.2 * noise.vector()).collect();
    let manipulation = DirectManipulation::try_new(&before, &sources).unwrap();
    let mut together = before.clone();
    manipulation.solve(&displacements).unwrap().apply(&mut together);
    let alone = manipulation.decompose(&displacements);
    let mut order: Vec<usize> = (0..sources.len()).collect();
    for _ in 0..20 {
        let keys: Vec<f64> = order.iter().map(|_| noise.next()).collect();
        order.sort_by(|&a, &b| keys[a].total_cmp(&keys[b]));
        let mut steps = before.clone();
        for &q in &order {
            let one = DirectManipulation::try_new(&steps, &sources[q..=q]).unwrap();
            one.solve(&alone[q..=q]).unwrap().apply(&mut steps);
        }
        assert!(difference(&steps, &together) < 1e-11, "{order:?}");
    }
    assert!(
        alone.iter().zip(&displacements).any(|(a, d)| a.distance(*d) > 1e-3),
        "they are not the displacements"
    );
}

#[test]
fn one_point_moves_its_own_control_points_by_the_explicit_formula() {
    let mut noise = Noise(33);
    let before = lattice(&mut noise, [7; 3], 0, false);
    let source = DVec3::new(0.3, 0.6, 0.45);
    let manipulation = DirectManipulation::try_new(&before, &[source]).unwrap();
    let displacement = DVec3::new(0.1, -0.2, 0.05);
    let solution = manipulation.solve(&[displacement]).unwrap();
    let basis = before.basis(source).unwrap();
    let sum_sq: f64 = basis.iter().map(|(_, r)| r * r).sum();
    assert_eq!(solution.moves.len(), basis.len());
    for (flat, offset) in &solution.moves {
        let (_, r) = basis.iter().find(|(other, _)| other == flat).unwrap();
        assert!((*offset - displacement * (r / sum_sq)).length() < 1e-15);
    }
}

#[test]
fn impossible_drags_are_named() {
    let mut noise = Noise(34);
    let mut before = lattice(&mut noise, [4; 3], 0, false);
    let p = DVec3::new(0.2, 0.3, 0.4);
    let outside = DirectManipulation::try_new(&before, &[p, DVec3::new(0.2, 1.3, 0.0)]).unwrap_err();
    assert!(
        outside.to_string().starts_with("drag 2: its source [0.2, 1.3, 0] is outside the lattice's box"),
        "{outside}"
    );
    // one source, two targets
    let twice = DirectManipulation::try_new(&before, &[DVec3::splat(0.7), p, p]).unwrap();
    assert_eq!(twice.rank(), 2);
    let displacements = [DVec3::X, 0.1 * DVec3::Y, 0.3 * DVec3::Y];
    let error = twice.solve(&displacements).unwrap_err();
    let DragError::Inconsistent { drags, count: 3, rank: 2, residual } = &error else { panic!("{error}") };
    assert_eq!(drags, &[2, 3]);
    assert!((residual - 0.1).abs() < 1e-12, "{residual}");
    assert!(error.to_string().starts_with("drags 2 and 3 cannot all be met: 3 drags have rank 2"), "{error}");
    twice.solve_least_squares(&displacements).apply(&mut before);
    // the compromise is in the middle
    let start = lattice(&mut noise, [4; 3], 0, false);
    let off = position(&before, p) - position(&start, p);
    assert!(off.distance(0.2 * DVec3::Y) < 1e-12, "{off}");
    // the same target twice is no contradiction
    assert!(twice.solve(&[DVec3::X, DVec3::Y, DVec3::Y]).is_ok());
    // more drags than the 64 control points can meet
    let many = points(&mut noise, 80);
    let crowded = DirectManipulation::try_new(&start, &many).unwrap();
    assert_eq!(crowded.rank(), 64);
    let wild: Vec<DVec3> = many.iter().map(|_| noise.vector()).collect();
    assert!(matches!(crowded.solve(&wild), Err(DragError::Inconsistent { rank: 64, count: 80, .. })));
    let held = lattice(&mut noise, [8; 3], 3, false);
    let error = DirectManipulation::try_new(&held, &[DVec3::splat(0.01)]).unwrap_err();
    assert!(matches!(error, DragError::Held { drag: 1, .. }), "{error}");
}

#[test]
fn weights_reach_targets_by_the_least_change() {
    let mut noise = Noise(35);
    for (counts, count, size) in
        [([4; 3], 1, 0.05), ([5; 3], 3, 0.02), ([12; 3], 60, 0.01), ([12; 3], 200, 2e-4)]
    {
        let before = lattice(&mut noise, counts, 0, true);
        let drags: Vec<Drag> = points(&mut noise, count)
            .into_iter()
            .map(|source| Drag { source, target: position(&before, source) + size * noise.vector() })
            .collect();
        let solution = solve_weights(&before, &drags, 1e-3).unwrap();
        let mut after = before.clone();
        solution.apply(&mut after);
        for drag in &drags {
            let off = position(&after, drag.source).distance(drag.target);
            assert!(off < 1e-12, "{count} drags: off by {off:e}");
        }
        let least = before.points().iter().map(|p| p.w).fold(f64::INFINITY, f64::min);
        assert!(after.points().iter().all(|p| p.w >= 1e-3 * least));
        assert!(after.points().iter().zip(before.points()).all(|(a, b)| a.truncate() == b.truncate()));
        // any other change that keeps the targets is larger: the change is square to the equations' null space
        if solution.at_bound == 0 && count < 10 {
            let change: Vec<f64> =
                after.points().iter().zip(before.points()).map(|(a, b)| a.w - b.w).collect();
            let system = weight_matrix(&after, &drags);
            let null = null_component(&system, &change);
            assert!(null < 1e-10, "{count} drags: {null:e}");
        }
    }
}

/// The equations of weights, a row each.
fn weight_matrix(lattice: &ControlLattice, drags: &[Drag]) -> DMatrix<f64> {
    let mut a = DMatrix::<f64>::zeros(3 * drags.len(), lattice.points().len());
    for (i, drag) in drags.iter().enumerate() {
        for (flat, value) in lattice.basis(drag.source).unwrap() {
            for axis in 0..3 {
                a[(3 * i + axis, flat)] += value * (lattice.points()[flat].truncate() - drag.target)[axis];
            }
        }
    }
    a
}

/// Length of what of a vector is in the null space of a matrix.
fn null_component(a: &DMatrix<f64>, x: &[f64]) -> f64 {
    let x = nalgebra::DVector::from_column_slice(x);
    let pseudo_inverse = a.clone().pseudo_inverse(1e-10).unwrap();
    (&x - pseudo_inverse * (a * &x)).norm()
}

#[test]
fn weights_stay_above_their_bound() {
    // so far towards one corner of the hull that unbounded weights would be negative
    let before = ControlLattice::identity([3; 3], [4; 3], [DVec3::ZERO, DVec3::ONE], 0).unwrap();
    let source = DVec3::splat(0.5);
    let mut at_bound = 0;
    for far in [0.1, 0.3, 0.4, 0.45] {
        let drag = Drag { source, target: source + DVec3::new(far, 0.8 * far, 0.9 * far) };
        let solution = solve_weights(&before, &[drag], 1e-3).unwrap();
        at_bound += solution.at_bound;
        let mut after = before.clone();
        solution.apply(&mut after);
        assert!(position(&after, source).distance(drag.target) < 1e-12, "{far}");
        assert!(after.points().iter().all(|p| p.w >= 1e-3));
        // Karush, Kuhn, Tucker: changes are combinations of the equations, but at the bound they are more
        let change: Vec<f64> = after.points().iter().map(|p| p.w - 1.0).collect();
        let a = weight_matrix(&after, &[drag]);
        let free: Vec<usize> = (0..change.len()).filter(|&i| after.points()[i].w > 1e-3).collect();
        let columns = DMatrix::from_fn(3, free.len(), |i, j| a[(i, free[j])]);
        let x = nalgebra::DVector::from_fn(free.len(), |i, _| change[free[i]]);
        let multipliers = columns.transpose().svd(true, true).solve(&x, 1e-12).unwrap();
        assert!((columns.transpose() * &multipliers - &x).norm() < 1e-9, "{far}");
        for i in (0..change.len()).filter(|i| !free.contains(i)) {
            let combined: f64 = (0..3).map(|row| a[(row, i)] * multipliers[row]).sum();
            assert!(combined <= change[i] + 1e-9, "{far}: {combined} {}", change[i]);
        }
    }
    assert!(at_bound > 0, "no bound was met");
    let beyond = Drag { source, target: DVec3::new(1.2, 0.5, 0.5) };
    let error = solve_weights(&before, &[beyond], 1e-3).unwrap_err();
    assert_eq!(error, DragError::OutsideHull { drag: 1, target: beyond.target });
    // one source cannot be in two places
    let twice = [0.1, 0.2].map(|x| Drag { source, target: source + DVec3::X * x });
    let error = solve_weights(&before, &twice, 1e-3).unwrap_err();
    assert!(matches!(&error, DragError::NoWeights { drags, .. } if *drags == [1, 2]), "{error}");
}
