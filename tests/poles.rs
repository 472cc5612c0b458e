//! Poles are hit, with the limit of the normals: a small run of `examples/poles`.

#[path = "../examples/poles/rays.rs"]
mod rays;
#[path = "../examples/poles/shapes.rs"]
mod shapes;

use rays::{Tally, run};
use shapes::{Random, surfaces};

#[test]
fn poles_are_hit_with_the_limit_of_the_normals() {
    let random = &mut Random::new(3, 0);
    let surfaces = surfaces(random).expect("the surfaces are well made");
    let tallies = surfaces.iter().map(|surface| {
        assert!(!surface.poles.is_empty(), "{}", surface.name);
        run(surface, 100, random)
    });
    let all = tallies.fold(Tally::default(), Tally::merged);
    assert_eq!((all.lost, all.turned), (0, 0), "of {}: {:?}", all.rays, all.failures);
}
