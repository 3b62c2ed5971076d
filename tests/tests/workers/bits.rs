use super::{SCENE, maize};

#[test]
fn any_number_of_local_workers_gives_the_same_bytes() {
    let (desk, expected) = maize(&[]);
    for workers in ["1", "2", "3", "7"] {
        desk.done(&["solve", SCENE, "--out", "there", "--workers", workers]);
        assert!(expected == desk.tables("there"), "{workers} workers");
    }
}

#[test]
fn a_bounded_sphere_gives_the_same_bytes_too() {
    let (desk, expected) = maize(&["--diameter", "0.3"]);
    let more = ["--diameter", "0.3", "--workers", "2"];
    desk.done(&[&["solve", SCENE, "--out", "there"], &more[..]].concat());
    assert!(expected == desk.tables("there"));
}
