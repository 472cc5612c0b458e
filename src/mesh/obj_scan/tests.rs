use super::*;

fn faults(text: &str) -> Vec<String> {
    match scan(text) {
        Ok(_) => Vec::new(),
        Err(faults) => faults.listed.iter().map(ToString::to_string).collect(),
    }
}

#[test]
fn each_fault_names_its_place_and_what_is_valid() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let cases = [
        ("v 0 0\nf 1 2 4", "4:1: `v` with 2 values; 3 are needed"),
        ("  v 0 0,5 0\nf 1 2 4", "4:7: `0,5` is not a number"),
        ("v 0 nan 0\nf 4 1 2", "4:5: `nan` is not finite"),
        ("v 0 0 -inf\nf 4 1 2", "4:7: `-inf` is not finite"),
        ("v 0 0 -1.#IND\nf 4 1 2", "4:7: `-1.#IND` is not finite"),
        ("v 0 0 1e999\nf 4 1 2", "4:7: `1e999` is not finite"),
        ("vn 1 0\nf 1//1 2 3", "4:1: `vn` with 2 values; 3 are needed"),
        ("vt\nf 1/1 2 3", "4:1: `vt` with 0 values; 1 to 3 are needed"),
        ("vt 0 zero\nf 1/1 2 3", "4:6: `zero` is not a number"),
        ("f 1 2 0", "4:7: vertex index 0; indices start at 1, or at -1 backwards"),
        ("f 1 2 4", "4:7: vertex index 4 is out of range; valid are 1 to 3, or -3 to -1"),
        ("f 1 -4 3", "4:5: vertex index -4 is out of range; valid are 1 to 3, or -3 to -1"),
        ("f 1 2/a 3", "4:5: `2/a` is not a corner; valid are v, v/vt, v//vn and v/vt/vn with whole numbers"),
        (
            "f 1 2 3/1/1/1",
            "4:7: `3/1/1/1` is not a corner; valid are v, v/vt, v//vn and v/vt/vn with whole numbers",
        ),
        (
            "f 1 2 3///",
            "4:7: `3///` is not a corner; valid are v, v/vt, v//vn and v/vt/vn with whole numbers",
        ),
        (
            "f 1 2 \\\n  /3",
            "5:3: `/3` is not a corner; valid are v, v/vt, v//vn and v/vt/vn with whole numbers",
        ),
        (
            "f 1 2 99999999999999999999",
            "4:7: `99999999999999999999` is not a corner; valid are v, v/vt, v//vn and v/vt/vn with whole numbers",
        ),
    ];
    for (line, message) in cases {
        let found = faults(&format!("{triangle}{line}\n"));
        assert_eq!(found.first().map(String::as_str), Some(message), "{line}");
    }
}

#[test]
fn all_faults_come_at_once_in_the_order_of_the_file() {
    let found = faults("v 0 0 0\nf 1 2 9\nv 1 x 0\nv y 1 z\nf 1 2 3\nf 0 1 2\nv x x x\n");
    let places: Vec<_> = found.iter().map(|f| f.split(": ").next().unwrap()).collect();
    assert_eq!(places, ["2:7", "3:5", "4:3", "4:7", "6:3"], "{found:?}");
}

#[test]
fn long_lists_of_faults_are_cut() {
    let text = "v 0 0\n".repeat(15) + &(1..16).map(|i| format!("f {i} {i} 99\n")).collect::<String>();
    let faults = scan(&text).unwrap_err();
    assert_eq!((faults.listed.len(), faults.more), (20, 10));
    assert_eq!(faults.listed[19].line, 20);
}

#[test]
fn what_faces_use_is_kept_in_the_order_of_first_use() {
    let text = "v 0 0 0 # origin\r\nv 2 0 0 2\r\nv 0 1 0 1 0 0\r\nvt 0.5\nl 1 2 3\no A \\\n  part\n#f 9 9 9 \\\nf 2/-1 \\\r\n1 -1\nvp 1\n";
    let scan = scan(text).unwrap();
    assert_eq!(scan.parts.positions, [DVec3::X * 2.0, DVec3::ZERO, DVec3::Y]);
    assert_eq!(scan.parts.uvs, [DVec2::new(0.5, 0.0)]);
    let corners: Vec<_> = scan.parts.corners.iter().map(|corner| (corner.position, corner.uv)).collect();
    assert_eq!(corners, [(0, Some(0)), (1, None), (2, None)]);
    assert_eq!(scan.parts.object_names, ["A part"]);
    assert_eq!((scan.notes.weighted_positions, scan.notes.coloured_positions), (1, 1));
    let ignored = [("l".to_owned(), 1), ("vp".to_owned(), 1)];
    assert_eq!(scan.notes.ignored_statements, ignored);
}

#[test]
fn noise_is_counted_under_few_keywords() {
    let mut text: String = (0..100).map(|i| format!("k{i} 1 2\n")).collect();
    text.push_str(&"x".repeat(1000));
    let scan = scan(&text).unwrap();
    assert!(scan.notes.ignored_statements.len() <= MOST_KEYWORDS + 1);
    let total: usize = scan.notes.ignored_statements.iter().map(|(_, n)| n).sum();
    assert_eq!(total, 101);
}
