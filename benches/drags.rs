//! How long drags of many points take to solve: `cargo bench --bench drags`.
//!
//! The least time of several, on one thread, of the whole work: basis functions, factorisation, solution, decomposition.

use std::time::Instant;

use glam::{DVec3, Vec3Swizzles};
use trimray::manipulate::{DirectManipulation, Drag, solve_weights};
use trimray::spline::{Axis, ControlLattice};

/// Times that each case is timed.
const ROUNDS: usize = 9;

/// Points of the unit cube, well spread (R3 of Roberts 2018).
fn points(count: usize) -> Vec<DVec3> {
    let step = DVec3::new(0.819_172_513, 0.671_043_607, 0.549_700_478);
    (1..=count).map(|i| (0.5 + step * i as f64).fract()).collect()
}

fn least(mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let started = Instant::now();
        work();
        started.elapsed().as_secs_f64() * 1e3
    };
    (0..ROUNDS).map(time).fold(f64::INFINITY, f64::min)
}

fn main() {
    println!("drags   lattice     points ms  weights ms");
    for (count, size) in [(1, 4), (4, 6), (20, 8), (60, 12), (200, 12)] {
        let mut lattice = ControlLattice::identity([3; 3], [size; 3], [DVec3::ZERO, DVec3::ONE], 0)
            .expect("a valid lattice");
        lattice.twist(Axis::Z, 30.0);
        let sources = points(count);
        let displacements: Vec<DVec3> = points(count).iter().map(|p| 2e-4 * (*p - 0.5).yzx()).collect();
        let by_points = least(|| {
            let manipulation = DirectManipulation::try_new(&lattice, &sources).expect("in the box");
            let solution = manipulation.solve(&displacements).expect("consistent");
            assert!(!solution.moves.is_empty());
            assert_eq!(manipulation.decompose(&displacements).len(), count);
        });
        let drag = |(&source, displacement): (&DVec3, &DVec3)| Drag {
            source,
            target: lattice.position(source).expect("in the box") + displacement,
        };
        let drags: Vec<Drag> = sources.iter().zip(&displacements).map(drag).collect();
        let by_weights = least(|| {
            assert!(solve_weights(&lattice, &drags, 1e-3).is_ok());
        });
        println!("{count:5}   {size:2} x {size:2} x {size:2} {by_points:10.3} {by_weights:11.3}");
    }
}
