use super::*;
use crate::arrays::{NamedArray, Values, write_npy, write_npz};
use crate::spline::KnotLayout;

/// A lattice of Bernstein polynomials over a box of 2 x 1 x 1 at (1, 0, 0).
fn lattice() -> Lattice {
    let bounds = Some([DVec3::X, DVec3::new(3.0, 1.0, 1.0)]);
    Lattice { bounds, ..Lattice::new([2, 1, 1], [3, 2, 2]) }
}

fn read(
    name: &str,
    content: impl AsRef<[u8]>,
    block: Option<Block>,
    lattice: &Lattice,
) -> Result<Vec<DVec4>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, content).unwrap();
    let read = read_lattice(&path, block.as_ref(), lattice, MemoryLimit::NONE);
    read.map_err(|message| message.replace(&format!("{}/", folder.path().display()), ""))
}

/// Control points (i, 10 j, 100 k).
fn numbered() -> Vec<DVec4> {
    let index = |flat: usize| [flat / 4, flat / 2 % 2, flat % 2].map(|i| i as f64);
    (0..12).map(index).map(|[i, j, k]| DVec4::new(i, 10.0 * j, 100.0 * k, 1.0)).collect()
}

const PLOT3D: &str = "2\n2 2 2  3 2 2\n0 1 0 1 0 1 0 1\n0 0 1 1 0 0 1 1\n0 0 0 0 1 1 1 1\n\
                      0 1 2 0 1 2 0 1 2 0 1 2\n0 0 0 10 10 10 0 0 0 10 10 10\n0 0 0 0 0 0 100 100 100 100 100 1.0e+02\n";

#[test]
fn plot3d_has_grids_with_the_first_index_fastest() {
    let of_block = |number| read("a.xyz", PLOT3D, Some(Block::Number(number)), &lattice());
    assert_eq!(of_block(2).unwrap(), numbered());
    assert_eq!(
        of_block(1).unwrap_err(),
        "a.xyz: has 2 x 2 x 2 control points, but the lattice 3 x 2 x 2; points = [2, 2, 2] would fit"
    );
    assert_eq!(of_block(3).unwrap_err(), "a.xyz: has no grid 3; there are 1: 2 x 2 x 2, 2: 3 x 2 x 2");
    let without = read("a.xyz", PLOT3D, None, &lattice()).unwrap_err();
    assert_eq!(without, "a.xyz: has 2 grids; block = 1 and so on says which (1: 2 x 2 x 2, 2: 3 x 2 x 2)");
    let cases = [
        (
            "10 10 10 0 0 0",
            "10 1o 10 0 0 0",
            "a.xyz:7: \"1o\" is not a finite number; y 5 of 12 of grid 2 is needed",
        ),
        ("1.0e+02", "", "a.xyz: ends where z 12 of 12 of grid 2 is needed"),
        ("1.0e+02", "inf", "a.xyz:8: \"inf\" is not a finite number; z 12 of 12 of grid 2 is needed"),
        ("3 2 2", "3 0 2", "a.xyz: grid 2 has the extents [3, 0, 2]; all above 0"),
        ("3 2 2", "3 2 99999999", "a.xyz: grid 2 has the extents [3, 2, 99999999]; all above 0"),
    ];
    for (from, to, want) in cases {
        let message =
            read("a.xyz", PLOT3D.replacen(from, to, 1), Some(Block::Number(2)), &lattice()).unwrap_err();
        assert!(message.starts_with(want), "{want}:\n{message}");
    }
}

const SU2: &str = "NDIME= 3\nFFD_NBOX= 2\nFFD_NLEVEL= 1\nFFD_TAG= TAIL\nFFD_DEGREE_I= 1\nFFD_TAG= WING\nFFD_LEVEL= 0\n\
                   FFD_DEGREE_I= 2\nFFD_DEGREE_J= 1\nFFD_DEGREE_K= 1\nFFD_BLENDING= BEZIER\nFFD_PARENTS= 0\nFFD_CHILDREN= 0\n\
                   FFD_CORNER_POINTS= 8\n1 0 0\n3 0 0\n3 1 0\n1 1 0\n1 0 1\n3 0 1\n3 1 1\n1 1 1\nFFD_CONTROL_POINTS= 12\n";

fn su2() -> String {
    let mut text = SU2.to_owned();
    for (flat, point) in numbered().into_iter().enumerate() {
        let [i, j, k] = [flat / 4, flat / 2 % 2, flat % 2];
        text += &format!("{i}\t{j}\t{k}\t{:e}\t{}\t{}\n", point.x, point.y, point.z);
    }
    text + "FFD_SURFACE_POINTS= 0\n"
}

#[test]
fn su2_has_boxes_with_names() {
    let of_box = |text: &str| read("a.su2", text, Some(Block::Name("WING".into())), &lattice());
    assert_eq!(of_box(&su2()).unwrap(), numbered());
    let spline = su2()
        .replace("BEZIER", "BSPLINE_UNIFORM\nBSPLINE_ORDER_I= 3\nBSPLINE_ORDER_J= 2\nBSPLINE_ORDER_K= 4");
    assert_eq!(of_box(&spline).unwrap(), numbered(), "orders are the number of points at most");
    let missing = read("a.su2", su2(), Some(Block::Name("FIN".into())), &lattice()).unwrap_err();
    assert_eq!(missing, "a.su2: has no box \"FIN\"; there are \"TAIL\", \"WING\"");
    assert!(
        read("a.su2", su2(), None, &lattice())
            .unwrap_err()
            .starts_with("a.su2: has 2 boxes; block = \"NAME\" says")
    );
    assert_eq!(
        read("a.su2", "NDIME= 3\n", None, &lattice()).unwrap_err(),
        "a.su2: has no FFD_TAG=, and so no box"
    );
    let cases = [
        ("BEZIER", "NURBS", "a.su2:11: FFD_BLENDING= \"NURBS\"; valid are BEZIER and BSPLINE_UNIFORM"),
        ("_I= 2", "_I= two", "a.su2:8: FFD_DEGREE_I= \"two\"; a whole number is needed"),
        ("FFD_DEGREE_K= 1\n", "", "a.su2:6: box \"WING\": needs FFD_DEGREE_K= from 1 on"),
        (
            "POINTS= 12",
            "POINTS= 11",
            "a.su2:6: box \"WING\": has 11 control points of 12; SU2_DEF computes them",
        ),
        ("FFD_CORNER_POINTS= 8", "FFD_CORNER_POINTS= 4", "a.su2:6: box \"WING\": 4 corners; 8 are needed"),
        ("3 1 0", "3.5 1 0", "a.su2:6: box \"WING\": its corners are no box along the axes"),
        ("2\t1\t1\t", "2\t1\t2\t", "a.su2:35: there is no control point [2, 1, 2]; the last is [2, 1, 1]"),
        (
            "2\t1\t1\t",
            "2\t1\t0\t",
            "a.su2:6: box \"WING\": control point [2, 1, 1] is not given, another one twice",
        ),
        ("2\t1\t1\t", "2\t1\tx\t", "a.su2:35: "),
        ("2\t1\t1\t2e0\t", "2\t1\t", "a.su2:35: 4 numbers; a control point is i j k x y z"),
    ];
    for (from, to, want) in cases {
        assert!(su2().contains(from), "{from}");
        let message = of_box(&su2().replace(from, to)).unwrap_err();
        assert!(message.starts_with(want), "{want}:\n{message}");
    }
    let wider = su2().replace("\n3 ", "\n4 ");
    assert_eq!(
        of_box(&wider).unwrap_err(),
        "a.su2: is made for another box than the lattice's; bounds = [[1.0, 0.0, 0.0], [4.0, 1.0, 1.0]] would fit"
    );
    let higher = Lattice { degree: [1, 1, 1], ..lattice() };
    let message = read("a.su2", su2(), Some(Block::Number(2)), &higher).unwrap_err();
    assert_eq!(message, "a.su2: is of degree [2, 1, 1], but the lattice of degree [1, 1, 1]");
}

const PRM: &str = "# PyGeM\n[Box info]\nn control points x: 3\nn control points y: 2\nn control points z: 2\n\n\
                   box length x: 2.0\nbox length y: 1.0\nbox length z: 1.0\nbox origin x: 1.0\nbox origin y: 0\nbox origin z: 0\n\
                   rotation angle x: 0\nrotation angle y: 0\nrotation angle z: 0.0\n\n[Parameters weights]\n\
                   parameter x: 0   0   0    0.25\n             2   1   1   -0.5\nparameter y:\nparameter z: 1 0 1 1\n";

#[test]
fn pygem_moves_points_by_parts_of_the_box() {
    let points = read("a.prm", PRM, None, &lattice()).unwrap();
    let box_points = [0, 1, 2].map(|i| f64::from(i) / 2.0);
    for (flat, point) in points.into_iter().enumerate() {
        let [i, j, k] = [flat / 4, flat / 2 % 2, flat % 2];
        let mut want = DVec4::new(1.0 + 2.0 * box_points[i], j as f64, k as f64, 1.0);
        match [i, j, k] {
            [0, 0, 0] => want.x += 0.5,
            [2, 1, 1] => want.x -= 1.0,
            [1, 0, 1] => want.z += 1.0,
            _ => {}
        }
        assert_eq!(point, want, "{:?}", [i, j, k]);
    }
    let cases = [
        (
            "n control points y: 2\n",
            "",
            "a.prm: [Box info] has no `n control points y: `, a whole number from 2 on",
        ),
        (
            "n control points y: 2",
            "n control points y: 1",
            "a.prm: n control points [3, 1, 2]; 2 each at least",
        ),
        (
            "box length x: 2.0",
            "box length x: 0",
            "a.prm: box length [0.0, 1.0, 1.0]; numbers above 0 are valid",
        ),
        (
            "box length x: 2.0",
            "box length x: two",
            "a.prm:7: box length x is \"two\"; a finite number above 0 is needed",
        ),
        (
            "rotation angle x: 0",
            "rotation angle x: 30",
            "a.prm: rotation angles [30.0, 0.0, 0.0]: boxes along the axes alone",
        ),
        (
            "2   1   1   -0.5",
            "2   1   2   -0.5",
            "a.prm:19: there is no control point [2, 1, 2]; the last is [2, 1, 1]",
        ),
        ("2   1   1   -0.5", "2   1   1", "a.prm:19: 3 words; three indices of a control point and its move"),
        (
            "box origin z: 0",
            "box origin z 0",
            "a.prm:12: \"box origin z 0\" is neither `key: value` nor a [section]",
        ),
        (
            "box origin x: 1.0",
            "box origin x: 0.5",
            "a.prm: is made for another box than the lattice's; bounds = [[0.5,",
        ),
    ];
    for (from, to, want) in cases {
        let message = read("a.prm", PRM.replacen(from, to, 1), None, &lattice()).unwrap_err();
        assert!(message.starts_with(want), "{want}:\n{message}");
    }
    assert!(
        read("a.prm", PRM, Some(Block::Number(1)), &lattice())
            .unwrap_err()
            .contains("block is for files of several")
    );
}

#[test]
fn archives_say_which_lattice_they_are_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let flat: Vec<f64> = numbered().into_iter().flat_map(|p| p.truncate().to_array()).collect();
    // arrays of more extents are NumPy's alone; those of the tests are written one by one
    let array = |shape: &[usize], values: &[f64]| {
        let one = folder.path().join("one.npy");
        write_npy(&one, shape, values).unwrap();
        fs::read(one).unwrap()
    };
    let write = |arrays: &[(&str, Vec<u8>)]| {
        let mut archive = zip::ZipWriter::new(fs::File::create(&path).unwrap());
        let stored =
            zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        for (name, bytes) in arrays {
            archive.start_file(format!("{name}.npy"), stored).unwrap();
            std::io::Write::write_all(&mut archive, bytes).unwrap();
        }
        archive.finish().unwrap();
    };
    let read = |lattice: &Lattice| {
        let read = read_lattice(&path, None, lattice, MemoryLimit::NONE);
        read.map_err(|message| message.replace(&format!("{}/", folder.path().display()), ""))
    };
    let weights: Vec<f64> = (1..=12).map(f64::from).collect();
    let knots = [
        ("knots_x", [5., 5., 5., 7., 7., 7.].as_slice()),
        ("knots_y", &[0., 0., 1., 1.]),
        ("knots_z", &[0., 0., 1., 1.]),
    ];
    let mut arrays = vec![
        ("control_points", array(&[3, 2, 2, 3], &flat)),
        ("weights", array(&[3, 2, 2], &weights)),
        ("degrees", array(&[3], &[2., 1., 1.])),
    ];
    arrays.extend(knots.map(|(name, list)| (name, array(&[list.len()], list))));
    write(&arrays);
    let points = read(&lattice()).unwrap();
    assert_eq!(points[7], numbered()[7].truncate().extend(8.0));
    let uniform = Lattice { knots: KnotLayout::Uniform, ..lattice() };
    assert!(
        read(&uniform)
            .unwrap_err()
            .starts_with("a.npz: its knots along x are not the lattice's; knots = [[5.0, 5.0, 5.0, 7.0,")
    );
    arrays[2].1 = array(&[3], &[2., 1., 2.]);
    write(&arrays);
    assert_eq!(
        read(&lattice()).unwrap_err(),
        "a.npz: is of degree [2, 1, 2], but the lattice of degree [2, 1, 1]"
    );
    arrays[2].1 = array(&[2], &[2., 1.]);
    write(&arrays);
    assert!(read(&lattice()).unwrap_err().contains("three whole numbers are needed"));
    write(&arrays[1..]);
    assert!(read(&lattice()).unwrap_err().starts_with("a.npz: has no array control_points"));
    let whole = [NamedArray { name: "degrees", columns: 1, values: Values::I64(vec![2, 1, 1]) }];
    write_npz(&path, &whole).unwrap();
    assert_eq!(crate::arrays::read_archive(&path, &["degrees"]).unwrap()[0].1.values, [2.0, 1.0, 1.0]);
}
