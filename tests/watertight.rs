//! No ray leaks through a closed deformed solid: a small run of `examples/watertight`.

#[path = "../examples/watertight/aim.rs"]
mod aim;
#[path = "../examples/watertight/checks.rs"]
mod checks;
#[path = "../examples/watertight/solids.rs"]
mod solids;

use glam::DVec3;
use trimray::trace::Ray;

use aim::{Aims, Random};
use checks::{Checker, Tally, Test, describe};
use solids::Solid;

const SEED: u64 = 7;

fn run(name: &str, rational: bool, test: Test, rays: u64, farthest: f64) -> (Tally, String) {
    let solid = Solid::named(name, rational).expect("the solid is closed and its volume one to one");
    let aims = Aims::new(&solid, &mut Random::new(SEED, u64::MAX));
    let checker = Checker { solid: &solid, aims: &aims, farthest };
    let chunks = (0..4).map(|chunk| checker.run(test, rays / 4, &mut Random::new(SEED, chunk)));
    let tally = chunks.fold(Tally::default(), Tally::merged);
    let failure = tally.failures.iter().min_by_key(|failure| failure.fault as usize);
    let failure = failure.map(|f| format!("{:?} of {:?}\n{}", f.fault, f.ray, describe(&solid, &f.ray)));
    (tally, failure.unwrap_or_default())
}

#[test]
fn rays_from_inside_and_lines_are_balanced() {
    for name in ["cube", "slivers"] {
        for test in [Test::Inside, Test::Lines] {
            let (tally, failure) = run(name, false, test, 20_000, 1.0);
            assert_eq!(tally.failed(), 0, "{name} {test:?}: {failure}");
            assert!(tally.hits > tally.rays / 4, "{name} {test:?}: {} hits", tally.hits);
            assert!(tally.touching < tally.rays / 1000, "{name} {test:?}: {} touch", tally.touching);
        }
    }
}

#[test]
fn rays_aimed_at_the_borders_of_a_cube_enter_it() {
    for rational in [false, true] {
        let (tally, failure) = run("cube", rational, Test::Aimed, 20_000, 3.0);
        let [leaks, contradictions, unbalanced, _, at_border] = tally.faults;
        assert_eq!([leaks, contradictions, unbalanced, at_border], [0; 4], "rational {rational}: {failure}");
        assert!(tally.on_border > tally.rays / 10, "{} rays on a border", tally.on_border);
    }
}

#[test]
fn rays_aimed_at_the_borders_of_slivers_enter_them() {
    let (tally, failure) = run("slivers", false, Test::Aimed, 20_000, 1.0);
    let [leaks, contradictions, unbalanced, ..] = tally.faults;
    assert_eq!([leaks, contradictions, unbalanced], [0; 3], "{failure}");
}

#[test]
fn rays_aimed_at_the_borders_of_slivers_are_balanced() {
    let (tally, failure) = run("slivers", false, Test::Aimed, 20_000, 1.0);
    assert_eq!(tally.faults, [0; 5], "{failure}");
}

#[test]
fn rays_from_far_away_enter_the_solid() {
    for farthest in [1e2, 1e4, 1e6] {
        let (tally, failure) = run("cube", false, Test::Aimed, 50_000, farthest);
        let [leaks, contradictions, unbalanced, _, at_border] = tally.faults;
        assert_eq!(
            [leaks, contradictions, unbalanced, at_border],
            [0; 4],
            "from {farthest} diagonals: {failure}"
        );
    }
}

#[test]
fn rays_aimed_at_the_borders_of_slivers_do_not_leak() {
    let (tally, failure) = run("slivers", false, Test::Aimed, 200_000, 10.0);
    assert_eq!(tally.faults[0], 0, "{failure}");
}

/// Patches of 1e-7 have tolerances larger than themselves; roots far outside their unit squares are noise.
#[test]
fn hits_of_tiny_patches_are_on_their_rays() {
    let rays = [
        [-20.300422798257500, 21.446414702374803, 0.037299577891613797],
        [18.971659854434705, -21.977992536441114, -0.037979008785456229],
        [39.756240181217464, -24.869228002903291, -0.035416008727710467],
        [-39.042635282042667, 25.915571909390067, 0.032110934383314589],
    ]
    .map(DVec3::from_array);
    let solid = Solid::named("slivers", false).unwrap();
    let aims = Aims::new(&solid, &mut Random::new(SEED, u64::MAX));
    let checker = Checker { solid: &solid, aims: &aims, farthest: 1.0 };
    let mut tally = Tally::default();
    for ray in rays.chunks_exact(2) {
        checker.check(&Ray { t_max: 1.0, ..Ray::new(ray[0], ray[1]) }, 1, &mut tally);
    }
    assert!(tally.hits >= 4 && tally.from_ray < 1e-11, "{tally:?}");
}

#[test]
fn an_open_mesh_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("open.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n").unwrap();
    let refused = Solid::named(path.to_str().unwrap(), false).err();
    assert!(refused.as_ref().is_some_and(|message| message.contains("not closed")), "{refused:?}");
}
