//! What is taken in, and what is refused.

mod light;
mod random;
mod sensors;

use nestrad_common::canopy::{Canopy, Material};
use nestrad_common::options::{Diameter, Scatter};
use nestrad_proto::v1;
use nestrad_proto::v1::scene_material::Kind;

use super::*;
use nestrad_engine::plan::{Estimator, Settings};

fn header() -> v1::GeometryHeader {
    let material = |name: &str, kind: Kind| v1::SceneMaterial {
        name: name.to_owned(),
        kind: kind.into(),
        solid: None,
    };
    v1::GeometryHeader {
        triangles: 2,
        organs: 2,
        materials: vec![material("leaf", Kind::Leaf), material("stem", Kind::Stem)],
        pattern: Some(v1::PatternRectangle {
            min_x_m: 10.0,
            min_y_m: 20.0,
            max_x_m: 11.0,
            max_y_m: 22.0,
        }),
        soil_z_m: Some(-0.5),
    }
}

fn organs() -> v1::OrganSlice {
    v1::OrganSlice {
        first: 0,
        id: vec!["a".into(), "b".into()],
        plant: vec!["1".into(), "1".into()],
        species: Vec::new(),
    }
}

fn triangles() -> v1::TriangleSlice {
    let one = [10.5, 20.5, 0.0, 10.7, 20.5, 0.1, 10.5, 20.7, 0.2];
    v1::TriangleSlice {
        first: 0,
        vertices_m: [one, one.map(|x| x + 0.25)].concat(),
        organ: vec![0, 1],
        material: vec![0, 1],
    }
}

fn received(
    header: &v1::GeometryHeader,
    organs: v1::OrganSlice,
    triangles: &v1::TriangleSlice,
) -> Result<HeldCanopy, ServiceError> {
    let mut upload = Upload::begin(header)?;
    upload.triangles(triangles)?;
    upload.organs(organs)?;
    upload.finish()
}

fn refusal<T>(result: Result<T, ServiceError>) -> String {
    let error = result.err().unwrap();
    assert_eq!(error.code, ErrorCode::Invalid);
    error.message
}

#[test]
fn a_scene_moves_to_its_local_origin_as_files_do() {
    let held = received(&header(), organs(), &triangles()).unwrap();
    let canopy = &held.canopy;
    assert_eq!(canopy.origin_m, DVec3::new(10.0, 20.0, 0.0));
    assert_eq!(
        canopy.triangle(0).corners_m[1],
        DVec3::new(10.7 - 10.0, 0.5, 0.1)
    );
    assert_eq!(canopy.soil_z_m, Some(-0.5));
    assert_eq!(canopy.materials[1], Material::Stem { species: 2 });
    let second = canopy.triangle(1);
    assert_eq!((second.organ, second.material), (1, 1));
    assert_eq!(held.inspection.plants, 1);
}

#[test]
fn a_scene_at_its_local_origin_stays_there_bit_for_bit() {
    let first = received(&header(), organs(), &triangles()).unwrap().canopy;
    let again = v1::TriangleSlice {
        vertices_m: first
            .corners_m()
            .flatten()
            .flat_map(|v| v.to_array())
            .collect(),
        ..triangles()
    };
    let header = v1::GeometryHeader {
        pattern: Some(v1::PatternRectangle {
            min_x_m: 0.0,
            min_y_m: 0.0,
            max_x_m: 1.0,
            max_y_m: 2.0,
        }),
        ..header()
    };
    let second = received(&header, organs(), &again).unwrap().canopy;
    let mut second = Canopy::clone(&second);
    assert_eq!(second.origin_m, DVec3::ZERO);
    second.origin_m = first.origin_m;
    assert_eq!(second, *first);
}

#[test]
fn the_same_content_has_the_same_name_however_it_is_cut() {
    let whole = received(&header(), organs(), &triangles()).unwrap().id;
    let mut upload = Upload::begin(&header()).unwrap();
    upload.organs(organs()).unwrap();
    let all = triangles();
    for k in 0..2 {
        let slice = v1::TriangleSlice {
            first: k as u64,
            vertices_m: all.vertices_m[9 * k..9 * k + 9].to_vec(),
            organ: vec![all.organ[k]],
            material: vec![all.material[k]],
        };
        upload.triangles(&slice).unwrap();
    }
    assert_eq!(upload.finish().unwrap().id, whole);
    let mut other = triangles();
    other.vertices_m[3] += 1e-9;
    assert_ne!(received(&header(), organs(), &other).unwrap().id, whole);
    let other = v1::GeometryHeader {
        soil_z_m: None,
        ..header()
    };
    assert_ne!(received(&other, organs(), &triangles()).unwrap().id, whole);
}

#[test]
fn kinds_and_species_arrive() {
    let mut header = header();
    for (name, kind, solid) in [
        ("bark", Kind::Stem, Some(false)),
        ("earth", Kind::Soil, None),
        ("clay", Kind::Soil, None),
        ("panel", Kind::Structure, None),
        ("fruit", Kind::Leaf, Some(true)),
    ] {
        header.materials.push(v1::SceneMaterial {
            name: name.to_owned(),
            kind: kind.into(),
            solid,
        });
    }
    let mut organs = organs();
    organs.id[1] = "a".into();
    let message = refusal(received(&header, organs.clone(), &triangles()));
    assert!(message.contains("an organ of its own"), "{message}");
    organs.species = vec!["oak".into()];
    let message = refusal(received(&header, organs.clone(), &triangles()));
    assert!(message.contains("species: expected 2"), "{message}");
    organs.species.push(String::new());
    let held = received(&header, organs, &triangles()).unwrap();
    let canopy = &held.canopy;
    assert_eq!(canopy.organs[0].species, "oak");
    use nestrad_common::canopy::Kind as Own;
    let kinds = [
        Own::Leaf,
        Own::Stem,
        Own::Stem,
        Own::Soil,
        Own::Soil,
        Own::Structure,
        Own::Leaf,
    ];
    assert_eq!(canopy.kinds(), kinds);
    let solid = [false, true, false, false, false, false, true];
    assert_eq!(canopy.may_be_solid(), solid);
    let opaque = Surface::of(canopy)
        .iter()
        .map(Surface::is_opaque)
        .collect::<Vec<_>>();
    assert_eq!(opaque, [false, true, false, true, true, false, true]);
}

#[test]
fn headers_that_cannot_be_are_refused() {
    let with = |change: fn(&mut v1::GeometryHeader)| {
        let mut header = header();
        change(&mut header);
        refusal(received(&header, organs(), &triangles()))
    };
    for (message, said) in [
        (
            with(|h| h.triangles = 0),
            "new_geometry.triangles: expected 1 to",
        ),
        (
            with(|h| h.triangles = u64::MAX),
            "found 18446744073709551615",
        ),
        (with(|h| h.organs = 0), "new_geometry.organs"),
        (
            with(|h| h.organs = 3),
            "expected 3 organs, as announced, found 2",
        ),
        (
            with(|h| h.materials.clear()),
            "materials: expected 1 to 4096, found 0",
        ),
        (with(|h| h.materials[1].name.clear()), "materials[1].name"),
        (
            with(|h| h.materials[1].name = "leaf".into()),
            "found 'leaf' again",
        ),
        (
            with(|h| h.materials[0].kind = 9),
            "materials[0].kind: expected leaf, stem, soil or structure",
        ),
        (
            with(|h| (h.materials[1].kind, h.materials[1].solid) = (3, Some(true))),
            "materials[1].solid: expected false of a structure, found true",
        ),
        (with(|h| h.soil_z_m = Some(f64::NAN)), "soil height"),
        (
            with(|h| h.pattern.as_mut().unwrap().max_x_m = 10.0),
            "pattern: expected",
        ),
        (
            with(|h| h.pattern.as_mut().unwrap().max_x_m = f64::INFINITY),
            "pattern",
        ),
    ] {
        assert!(message.contains(said), "{said}: {message}");
    }
}

#[test]
fn slices_that_cannot_be_are_refused() {
    let with = |change: fn(&mut v1::TriangleSlice, &mut v1::OrganSlice)| {
        let (mut triangles, mut organs) = (triangles(), organs());
        change(&mut triangles, &mut organs);
        refusal(received(&header(), organs, &triangles))
    };
    for (message, said) in [
        (
            with(|t, _| t.first = 1),
            "triangles: first: expected 0, found 1",
        ),
        (
            with(|t, _| t.vertices_m[10] = f64::NAN),
            "triangles[1].vertices_m: y of vertex 1: expected a finite number",
        ),
        (
            with(|t, _| t.vertices_m[17] = 2e12),
            "triangles[1].vertices_m: z of vertex 3",
        ),
        (
            with(|t, _| t.vertices_m.truncate(17)),
            "expected 18 numbers for 2 triangles, found 17",
        ),
        (
            with(|t, _| t.organ[1] = 2),
            "triangles[1].organ: expected a number below 2, found 2",
        ),
        (with(|t, _| t.material[0] = 7), "triangles[0].material"),
        (
            with(|t, _| t.material.push(0)),
            "material: expected 2, found 3",
        ),
        (
            with(|t, _| {
                *t = v1::TriangleSlice {
                    vertices_m: [&t.vertices_m[..], &t.vertices_m[..9]].concat(),
                    organ: vec![0; 3],
                    material: vec![0; 3],
                    first: 0,
                };
            }),
            "triangles: expected 2, as announced, found 3",
        ),
        (
            with(|_, o| o.id[1] = "a".into()),
            "organs[1]: expected an organ of its own",
        ),
        (with(|_, o| o.id[1].clear()), "organs[1].id"),
        (
            with(|_, o| o.plant[0] = "x".repeat(5000)),
            "organs[0].plant: expected 1 to 4096 bytes",
        ),
        (
            with(|_, o| o.plant.truncate(1)),
            "plant: expected 2, found 1",
        ),
    ] {
        assert!(message.contains(said), "{said}: {message}");
    }
}

#[test]
fn options_have_the_defaults_of_the_command_line() {
    let of = |given: v1::SolveOptions| settings(&given, 8.0);
    assert_eq!(of(v1::SolveOptions::default()), Ok(Settings::default()));
    let given = of(v1::SolveOptions {
        diameter_m: Some(f64::INFINITY),
        budget_s: Some(60.0),
        accuracy_percent: Some(1.0),
        memory_gi_b: Some(2.0),
        seed: Some(0),
        estimator: v1::Estimator::Rays.into(),
        scatter: v1::Scatter::None.into(),
    })
    .unwrap();
    assert_eq!((given.diameter, given.seed), (Diameter::Infinite, 0));
    assert_eq!(given.estimator, Estimator::Rays);
    assert_eq!(given.scatter, Scatter::None);
    let with = |change: fn(&mut v1::SolveOptions)| {
        let mut options = v1::SolveOptions::default();
        change(&mut options);
        refusal(of(options))
    };
    for (message, said) in [
        (with(|o| o.diameter_m = Some(0.0)), "options.diameter_m"),
        (
            with(|o| o.diameter_m = Some(f64::NEG_INFINITY)),
            "options.diameter_m",
        ),
        (
            with(|o| o.accuracy_percent = Some(f64::NAN)),
            "options.accuracy_percent",
        ),
        (
            with(|o| o.memory_gi_b = Some(9.0)),
            "options.memory_GiB: expected at most 8",
        ),
        (
            with(|o| o.estimator = 7),
            "options.estimator: expected lines or rays",
        ),
        (
            with(|o| o.scatter = 7),
            "options.scatter: expected all or none",
        ),
    ] {
        assert!(message.contains(said), "{said}: {message}");
    }
}
