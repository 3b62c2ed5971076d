//! Bands, sources and skies.

use nestrad_common::canopy::Kind;
use nestrad_common::light::Light;

use super::*;

pub(super) fn band(name: &str) -> v1::BandOptics {
    let optics = v1::MaterialOptics {
        rho_upper: 0.4,
        tau_upper: 0.0,
        rho_lower: 0.3,
        tau_lower: 0.0,
    };
    v1::BandOptics {
        name: name.to_owned(),
        soil_albedo: 0.2,
        materials: vec![optics; 2],
    }
}

pub(super) fn sun() -> v1::ParallelSource {
    v1::ParallelSource {
        direction_x: 3.0,
        direction_y: 0.0,
        direction_z: -4.0,
        irradiance_w_m2: vec![100.0],
    }
}

pub(super) fn surfaces() -> [Surface; 2] {
    let leaf = Surface::new(0, "leaf", Kind::Leaf, false);
    [leaf, Surface::new(1, "stem", Kind::Stem, true)]
}

fn light_of(source: v1::ParallelSource) -> Result<Light, ServiceError> {
    let header = v1::SceneHeader {
        bands: vec![band("PAR")],
        sources: vec![source],
        ..v1::SceneHeader::default()
    };
    lighting(&header, &surfaces()).map(|lighting| Light::clone(&lighting.light))
}

#[test]
fn directions_become_unit_vectors_once() {
    let direction = light_of(sun()).unwrap().suns[0].direction;
    assert!(direction.abs_diff_eq(DVec3::new(0.6, 0.0, -0.8), 1e-15));
    for k in 0..1000 {
        let turned = DVec3::new(0.1 + 1e-3 * f64::from(k), 0.3, -0.7).normalize();
        let given = v1::ParallelSource {
            direction_x: turned.x,
            direction_y: turned.y,
            direction_z: turned.z,
            ..sun()
        };
        assert_eq!(light_of(given).unwrap().suns[0].direction, turned);
    }
}

#[test]
fn light_that_cannot_be_is_refused() {
    let with = |change: fn(&mut Vec<v1::BandOptics>, &mut v1::ParallelSource)| {
        let (mut bands, mut source) = (vec![band("PAR")], sun());
        change(&mut bands, &mut source);
        let header = v1::SceneHeader {
            bands,
            sources: vec![source],
            ..v1::SceneHeader::default()
        };
        refusal(lighting(&header, &surfaces()))
    };
    for (message, said) in [
        (with(|b, _| b.clear()), "bands: expected 1 to 256, found 0"),
        (
            with(|b, _| b.push(band("PAR"))),
            "bands[1].name: expected a name of its own",
        ),
        (with(|b, _| b[0].name.clear()), "bands[0].name"),
        (
            with(|b, _| b[0].soil_albedo = 1.1),
            "bands[0].soil_albedo: expected an albedo from 0 to 1",
        ),
        (with(|b, _| b[0].soil_albedo = f64::NAN), "found NaN"),
        (
            with(|b, _| b[0].materials.truncate(1)),
            "expected 2, one per material, found 1",
        ),
        (
            with(|b, _| b[0].materials[0].tau_upper = 0.61),
            "bands[0].materials[0]: expected finite numbers of at least 0 with rho + tau <= 1, \
             found rho = 0.4 and tau = 0.61",
        ),
        (
            with(|b, _| b[0].materials[0].rho_lower = -0.1),
            "rho = -0.1",
        ),
        (
            with(|b, _| b[0].materials[1].tau_lower = 0.1),
            "tau = 0 of soil and of what is solid",
        ),
        (
            with(|_, s| s.irradiance_w_m2.clear()),
            "sources[0].irradiance_W_m2: expected 1",
        ),
        (
            with(|_, s| s.irradiance_w_m2[0] = -1.0),
            "sources[0].irradiance_W_m2[0]",
        ),
        (
            with(|_, s| s.irradiance_w_m2[0] = f64::INFINITY),
            "found inf",
        ),
        (
            with(|_, s| s.irradiance_w_m2[0] = 1e101),
            "sources[0].irradiance_W_m2[0]: expected 0 or 1e-100 to 1e100",
        ),
        (
            with(|_, s| s.direction_z = 4.0),
            "sources[0]: direction: expected",
        ),
        (with(|_, s| s.direction_z = f64::NAN), "points down"),
        (with(|_, s| s.direction_z = -1e-9), "points down"),
    ] {
        assert!(message.contains(said), "{said}: {message}");
    }
}

pub(super) fn sky() -> v1::SkyLight {
    use v1::sky_light::Radiance;
    v1::SkyLight {
        radiance: Some(Radiance::CieClear(v1::CieClearSky {
            towards_sun: Some(v1::Vector {
                x: 0.6,
                y: 0.0,
                z: 0.8,
            }),
        })),
        irradiance_w_m2: vec![500.0],
        diffuse_fraction: 0.3,
    }
}

#[test]
fn skies_that_cannot_be_are_refused() {
    use v1::sky_light::Radiance;
    let with = |change: fn(&mut v1::SkyLight)| {
        let mut sky = sky();
        change(&mut sky);
        let header = v1::SceneHeader {
            bands: vec![band("PAR")],
            sky: Some(sky),
            ..v1::SceneHeader::default()
        };
        lighting(&header, &surfaces())
    };
    let taken = with(|_| {}).unwrap().light;
    let towards_sun = DVec3::new(0.6, 0.0, 0.8);
    let radiance = taken.sky.as_ref().unwrap().radiance;
    assert_eq!(
        radiance,
        nestrad_common::light::Radiance::Cie {
            kind: nestrad_common::light::CieType::CLEAR,
            towards_sun
        }
    );
    for (result, said) in [
        (
            with(|s| s.radiance = None),
            "sky.radiance: expected uniform",
        ),
        (
            with(|s| s.radiance = Some(Radiance::CieClear(v1::CieClearSky::default()))),
            "sky.cie_clear.towards_sun: expected a direction that points up",
        ),
        (
            with(|s| s.diffuse_fraction = 0.0),
            "sky.diffuse_fraction: expected above 0 to 1",
        ),
        (
            with(|s| s.diffuse_fraction = f64::NAN),
            "sky.diffuse_fraction",
        ),
        (
            with(|s| s.irradiance_w_m2.push(1.0)),
            "sky.irradiance_W_m2: expected 1, one per band, found 2",
        ),
        (
            with(|s| s.irradiance_w_m2[0] = -1.0),
            "sky.irradiance_W_m2[0]",
        ),
    ] {
        let message = refusal(result);
        assert!(message.contains(said), "{said}: {message}");
    }
}
