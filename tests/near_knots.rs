//! No ray passes a closed solid beside knot planes: a small run of `examples/near_knots`.

#[path = "../examples/near_knots/rays.rs"]
mod rays;
#[path = "../examples/near_knots/solids.rs"]
mod solids;

use rays::{Tally, run};
use solids::{LATTICES, Method, Random, Solid};

#[test]
fn no_ray_passes_beside_a_knot_plane() {
    for lattice in 0..LATTICES {
        for method in Method::ALL {
            let of_size = |(triangles, rays)| {
                let random = &mut Random::new(5, lattice as u64);
                let solid = Solid::new(triangles, lattice, method, random).expect("the volume is one to one");
                run(&solid, rays, random)
            };
            let tally =
                [(200, 6000), (1000, 3000)].map(of_size).into_iter().fold(Tally::default(), Tally::merged);
            assert_eq!(
                tally.passed, 0,
                "of {} in lattice {lattice}, {method:?}: {:?}",
                tally.rays, tally.failures
            );
        }
    }
}
