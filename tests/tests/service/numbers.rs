//! Every number of a scene is held to the same, whichever way it comes in.

use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client, one_leaf, upload};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, said};
use tonic::Code;
use v1::scene_header::Geometry;
use v1::scene_slice::Part;

/// A leaf of OBJ with all that can be said of it, `{...}` where a number is to stand.
const SCENE: &str = "scene = 'leaf.obj'\npattern = [{min_x}, 0.0, {max_x}, 1.0]\nsoil = {soil}\n\
                     light = 'sun.light'\n[[bands]]\nname = 'PAR'\nsoil_albedo = {albedo}\n[bands.materials]\n\
                     leaf = { upper = { rho = {rho}, tau = {tau} }, lower = { rho = 0.0, tau = 0.0 } }\n";

/// A number, what it is by default, and where it stands in a message.
type Number = (&'static str, f64, fn(&mut Sent, f64));

/// What is sent, in parts.
struct Sent {
    header: v1::SceneHeader,
    geometry: v1::GeometryHeader,
    triangles: v1::TriangleSlice,
}

const NUMBERS: [Number; 11] = [
    ("min_x", 0.0, |sent, x| pattern(sent).min_x_m = x),
    ("max_x", 1.0, |sent, x| pattern(sent).max_x_m = x),
    ("soil", 0.0, |sent, x| sent.geometry.soil_z_m = Some(x)),
    ("albedo", 0.2, |sent, x| {
        sent.header.bands[0].soil_albedo = x
    }),
    ("rho", 0.1, |sent, x| optics(sent).rho_upper = x),
    ("tau", 0.1, |sent, x| optics(sent).tau_upper = x),
    ("x", 0.0, |sent, x| sent.triangles.vertices_m[0] = x),
    ("irradiance", 100.0, |sent, x| {
        sent.header.sources[0].irradiance_w_m2[0] = x;
    }),
    ("dx", 0.0, |sent, x| sent.header.sources[0].direction_x = x),
    ("dz", -1.0, |sent, x| sent.header.sources[0].direction_z = x),
    ("again", 0.0, |sent, x| {
        sent.header.sources[1].irradiance_w_m2[0] = x;
    }),
];

fn pattern(sent: &mut Sent) -> &mut v1::PatternRectangle {
    sent.geometry.pattern.as_mut().unwrap()
}

fn optics(sent: &mut Sent) -> &mut v1::MaterialOptics {
    &mut sent.header.bands[0].materials[0]
}

/// What is tried in place of every number.
const TRIED: [f64; 22] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    -1.0,
    -0.0,
    0.5,
    1.0,
    1.000_000_000_000_000_2,
    1.000_000_1,
    1.5,
    -1e-5,
    1e-5,
    1e-9,
    1e-320,
    1e-101,
    1e-100,
    1e12,
    -1e12,
    1.1e12,
    1e100,
    1.1e100,
    1e300,
];

fn values(changed: Option<(&str, f64)>) -> impl Fn(&str) -> f64 {
    let changed = changed.map(|(name, value)| (name.to_owned(), value));
    move |name| match &changed {
        Some((own, value)) if own == name => *value,
        _ => NUMBERS.iter().find(|n| n.0 == name).unwrap().1,
    }
}

fn sent(changed: Option<(&str, f64)>) -> [v1::SceneSlice; 3] {
    let value = values(changed);
    let [header, organs, triangles] = one_leaf();
    let (Some(Part::Header(mut header)), Some(Part::Triangles(mut triangles))) =
        (header.part, triangles.part)
    else {
        panic!("a header and triangles");
    };
    let Some(Geometry::NewGeometry(geometry)) = header.geometry.take() else {
        panic!("a geometry");
    };
    triangles.vertices_m = vec![0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0];
    header.sources.push(header.sources[0].clone());
    let mut sent = Sent {
        header,
        geometry,
        triangles,
    };
    for (name, _, put) in NUMBERS {
        put(&mut sent, value(name));
    }
    sent.header.geometry = Some(Geometry::NewGeometry(sent.geometry));
    let [header, triangles] = [Part::Header(sent.header), Part::Triangles(sent.triangles)]
        .map(|part| v1::SceneSlice { part: Some(part) });
    [header, organs, triangles]
}

/// Whether files are taken: `check` looks at them alone.
fn files_are_taken(desk: &Desk, changed: Option<(&str, f64)>) -> Result<(), String> {
    let value = values(changed);
    let toml = |x: f64| match x {
        x if x.is_nan() => "nan".to_owned(),
        x if x.is_infinite() => if x > 0.0 { "inf" } else { "-inf" }.to_owned(),
        x => format!("{x:?}"),
    };
    let mut scene = SCENE.to_owned();
    for (name, ..) in NUMBERS {
        scene = scene.replace(&format!("{{{name}}}"), &toml(value(name)));
    }
    let leaf = format!(
        "o plant\ng blade\nusemtl leaf\nv {:?} 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n",
        value("x")
    );
    let (dx, dz) = (value("dx"), value("dz"));
    let light = format!(
        "{:?} {dx:?} 0 {dz:?}\n{:?} 0 0 -1\n",
        value("irradiance"),
        value("again")
    );
    for (name, text) in [("s.toml", scene), ("leaf.obj", leaf), ("sun.light", light)] {
        std::fs::write(desk.path(name), text).unwrap();
    }
    let loaded = nestrad_common::assemble::load_scene_file(&desk.path("s.toml"))
        .and_then(|inputs| nestrad_common::assemble::load(&inputs));
    loaded.map(|_| ()).map_err(|error| error.to_string())
}

#[test]
fn grpc_took_what_files_refuse() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let mut refused = 0;
    block_on(async {
        let mut client = client(&master);
        for changed in std::iter::once(None).chain(
            NUMBERS
                .iter()
                .flat_map(|n| TRIED.map(|value| Some((n.0, value)))),
        ) {
            let here = files_are_taken(&desk, changed);
            let there = upload(&mut client, sent(changed)).await;
            // corners may come in any order in a file
            if let Some(("min_x" | "max_x", value)) = changed
                && here.is_ok()
                && (value == -1.0 || value >= 1.0 || value <= 0.0)
            {
                continue;
            }
            if let Err(status) = &there {
                assert_eq!(status.code(), Code::InvalidArgument, "{status}");
            }
            assert_eq!(
                here.is_ok(),
                there.is_ok(),
                "{changed:?}: {here:?}, {there:?}"
            );
            refused += usize::from(there.is_err());
        }
    });
    assert!(refused > 80, "{refused}");
}

#[test]
fn a_sky_too_dim_for_its_square_is_refused_both_ways() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    for (diffuse_fraction, taken) in [(0.3, true), (1e-200, false), (1e-90, true), (1.5, false)] {
        let fraction = format!("{diffuse_fraction:?}");
        let args = [
            "check",
            "scene.toml",
            "--sky",
            "clear",
            "--irradiance",
            "PAR=400",
            "--irradiance",
            "NIR=300",
            "--time",
            "2024-06-21T12:00:00Z",
            "--latitude",
            "43",
            "--longitude",
            "3",
            "--diffuse-fraction",
            &fraction,
        ];
        let checked = desk.run(&args);
        assert_eq!(
            checked.status.success(),
            taken,
            "{fraction}: {}",
            said(&checked)
        );
        let sent = block_on(async {
            let mut slices = one_leaf();
            if let Some(Part::Header(header)) = &mut slices[0].part {
                header.sky = Some(v1::SkyLight {
                    radiance: Some(v1::sky_light::Radiance::Uniform(v1::UniformSky {})),
                    irradiance_w_m2: vec![400.0],
                    diffuse_fraction,
                });
            }
            upload(&mut client(&master), slices).await
        });
        assert_eq!(sent.is_ok(), taken, "{fraction}: {sent:?}");
    }
}
