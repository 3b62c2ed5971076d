//! No bytes, however wrong, may make a parser panic, hang, or give out what is not sound.

use std::path::Path;

use proptest::prelude::*;
use proptest::sample::{Index, select};

use super::error::FormatError;
use super::*;
use crate::bounded::Limit;

const SAMPLES: &[&str] = &[
    "# c\np 1 100001000001 3 -0.3 -0.36 0.0003 -0.29 -0.365 0.035 -0.292 -0.365 3.06e-05\n\
     p 2 100001002001 5 4 2 0 1 0.5 0.5 1 0 2 1 0 0 1\n\n",
    "# near infrared\nn 1\ns d 0.25\ne d 0.50   d 0.44 0.45   d 0.46 0.44\n",
    "400.0 0.55667 -0.321394 -0.766044\n0.047259 -0.999941 -0.0 -0.01087\n",
    "-0.4 -0.75\n0.4 0.75\n",
    "o a\ng b d\nusemtl c # e\nf 1 2 \\\n3\nbevel on\nsurf 1\nv 0 0 0\nv 1 0 0\nv 0 1 0 1\nvt 1 1\nf 1 2 3\nf -1/1 -2//3 1/2/3\n",
    "scene = 'a'\npattern = [0, 0, 1, 1]\n[light.sky]\nkind = 'clear'\nirradiance_W_m2 = { A = 1 }\n\
     [[bands]]\nname = 'A'\n[bands.materials]\nm = { rho = 0.1, tau = 1e-3 }\n[options]\ndiameter = inf\n",
];

/// Every parser on the same bytes: a file may well be of another format than its name says.
fn all_parsers_hold(bytes: &[u8]) {
    for mesh in [can::parse("f", bytes), obj::parse("f", bytes)] {
        if let Some(mesh) = checked(mesh, bytes) {
            sound(&mesh);
        }
    }
    if let Some(opt) = checked(opt::parse("f", bytes), bytes) {
        assert!((0.0..=1.0).contains(&opt.soil_albedo));
        assert!(
            opt.species
                .iter()
                .all(|species| species.leaf.check().is_ok())
        );
    }
    for source in checked(light::parse("f", bytes), bytes).unwrap_or_default() {
        assert!(source.irradiance_W_m2.is_finite() && source.irradiance_W_m2 >= 0.0);
        assert!((source.direction.length() - 1.0).abs() < 1e-12);
        assert!(source.direction.z <= -crate::light::MIN_DESCENT);
    }
    if let Some(rectangle) = checked(pattern::parse("f", bytes), bytes) {
        assert!((rectangle.max - rectangle.min).min_element() >= pattern::MIN_SIDE);
    }
    checked(scene_file::parse("f", bytes, Path::new("")), bytes);
    // what starts as gzip does, and whatever comes out of it
    let unpacked = read::gunzip(bytes.to_vec(), Limit::fixed(1 << 20));
    assert!(unpacked.is_ok_and(|bytes| bytes.len() <= 1 << 20) || bytes.starts_with(b"\x1f\x8b"));
}

/// An error has to be short, and about a line that the file has.
fn checked<T>(result: Result<T, FormatError>, bytes: &[u8]) -> Option<T> {
    let error = match result {
        Ok(value) => return Some(value),
        Err(error) => error,
    };
    let ends = bytes.iter().filter(|byte| matches!(byte, b'\n' | b'\r'));
    let lines = 1 + ends.count();
    let place = error.place();
    assert_eq!(place.file, "f");
    assert!(
        place.line.is_none_or(|line| (1..=lines).contains(&line)),
        "{error}"
    );
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    assert!(text.len() < 1000, "{text}");
    None
}

fn sound(file: &GeometryFile) {
    let mesh = &file.mesh;
    assert_eq!(
        [file.line.len(), mesh.organ.len(), mesh.material.len()],
        [mesh.len(); 3]
    );
    let near = |x: f64| x.abs() <= MAX_COORDINATE;
    for vertex in &mesh.vertices {
        assert!(vertex.to_array().into_iter().all(near));
    }
    let below = |list: &[u32], end: usize| list.iter().all(|&i| (i as usize) < end);
    assert!(below(mesh.triangles.as_flattened(), mesh.vertices.len()));
    assert!(below(&mesh.organ, file.organs.len()));
    assert!(below(&mesh.material, file.materials.len()));
}

/// One thing that may happen to a file.
#[derive(Clone, Debug)]
enum Damage {
    Cut(Index),
    Replace(Index, u8),
    Insert(Index, Vec<u8>),
    Remove(Index, usize),
    Repeat(Index, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let token = select(vec![
        "nan",
        "-inf",
        "1e999",
        "-1",
        "0",
        "18446744073709551616",
        "4294967295",
        "\n",
        "\r",
        "#",
        " ",
        "\0",
        "\u{1f}\u{8b}",
        "\\\n",
        "f",
        "p",
        "[[",
        "{",
        "'",
        "=",
        "/",
        "-",
        "0.5",
        "1e-320",
    ]);
    prop_oneof![
        1 => any::<Index>().prop_map(Damage::Cut),
        3 => (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Damage::Replace(at, byte)),
        6 => (any::<Index>(), token)
            .prop_map(|(at, token)| Damage::Insert(at, token.as_bytes().to_vec())),
        2 => (any::<Index>(), 1..20_usize).prop_map(|(at, count)| Damage::Remove(at, count)),
        2 => (any::<Index>(), 1..80_usize).prop_map(|(at, count)| Damage::Repeat(at, count)),
    ]
}

fn damaged(mut bytes: Vec<u8>, damages: Vec<Damage>) -> Vec<u8> {
    for damage in damages {
        let length = bytes.len();
        match damage {
            _ if length == 0 => {}
            Damage::Cut(at) => bytes.truncate(at.index(length)),
            Damage::Replace(at, byte) => bytes[at.index(length)] = byte,
            Damage::Insert(at, token) => {
                let at = at.index(length);
                bytes.splice(at..at, token);
            }
            Damage::Remove(at, count) => {
                let at = at.index(length);
                bytes.drain(at..length.min(at + count));
            }
            Damage::Repeat(at, count) => {
                let at = at.index(length);
                let again = bytes[at..length.min(at + count)].to_vec();
                bytes.splice(at..at, again);
            }
        }
    }
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        all_parsers_hold(&bytes);
    }

    #[test]
    fn damaged_files_never_panic(
        sample in select(SAMPLES),
        damages in prop::collection::vec(damage(), 1..6),
    ) {
        all_parsers_hold(&damaged(sample.as_bytes().to_vec(), damages));
    }
}

#[test]
fn the_undamaged_samples_are_valid() {
    let samples: Vec<&[u8]> = SAMPLES.iter().map(|sample| sample.as_bytes()).collect();
    assert!(can::parse("f", samples[0]).is_ok());
    assert!(opt::parse("f", samples[1]).is_ok());
    assert!(light::parse("f", samples[2]).is_ok());
    assert!(pattern::parse("f", samples[3]).is_ok());
    assert!(obj::parse("f", samples[4]).is_ok());
    // its sky lacks a place and a time, which only the last check sees
    let error = scene_file::parse("f", samples[5], Path::new("")).unwrap_err();
    assert!(error.to_string().contains("time_utc"), "{error}");
    for sample in samples {
        all_parsers_hold(sample);
    }
}
