//! What is odd about a light.

use super::{Light, Source};

/// Irradiance across the sun's beam outside the atmosphere, over all wavelengths, W m⁻².
const SOLAR_CONSTANT: f64 = 1361.0;

/// The part of that which lies in a band, by the band's name: photosynthetically active radiation (PAR, 400 to 700 nm)
/// and near infrared (NIR, from 700 nm on): 530 W m⁻² and 715 W m⁻² up to 4 µm in the extraterrestrial spectrum of ASTM
/// G173-03. A band of another name may be any part of it, so it is taken for the whole.
fn share(band: &str) -> f64 {
    match band.to_ascii_uppercase().as_str() {
        "PAR" => 0.39,
        "NIR" => 0.53,
        _ => 1.0,
    }
}

impl Light {
    /// Each a sentence, lower-case.
    pub fn warnings(&self, bands: &[&str]) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.is_dark() {
            warnings.push("no source has any light in any band".to_owned());
        }
        let brightest = (0..bands.len()).filter_map(|band| self.brighter_than_the_sun(bands, band));
        warnings.extend(brightest);
        warnings
    }

    /// Says which beam is the brightest in a band, where that is brighter than the sun.
    fn brighter_than_the_sun(&self, bands: &[&str], band: usize) -> Option<String> {
        let across = |source: &Source| source.irradiance_W_m2[band] / -source.direction.z;
        let brightest = self
            .suns
            .iter()
            .max_by(|a, b| across(a).total_cmp(&across(b)))?;
        let limit_W_m2 = share(bands[band]) * SOLAR_CONSTANT;
        let found_W_m2 = across(brightest);
        let band = match bands[band] {
            "" => "one band".to_owned(),
            name => format!("band {name}"),
        };
        (found_W_m2 > limit_W_m2).then(|| {
            format!(
                "{band}: a source {:.2} degrees above the horizon has {found_W_m2:.0} W m-2 perpendicular to its direction, \
                 more than the sun outside the atmosphere ({limit_W_m2:.0} W m-2): is its irradiance right?",
                brightest.elevation_deg(),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn warnings(irradiance_W_m2: f64, elevation_deg: f64, band: &str) -> Vec<String> {
        let (sin, cos) = elevation_deg.to_radians().sin_cos();
        let light = Light {
            suns: vec![Source {
                direction: DVec3::new(cos, 0.0, -sin),
                irradiance_W_m2: vec![irradiance_W_m2],
            }],
            sky: None,
        };
        light.warnings(&[band])
    }

    #[test]
    fn fault_a_beam_brighter_than_the_sun_was_silent() {
        assert_eq!(
            warnings(80.0, 0.5, "solar"),
            [
                "band solar: a source 0.50 degrees above the horizon has 9167 W m-2 perpendicular to its direction, \
                 more than the sun outside the atmosphere (1361 W m-2): is its irradiance right?"
            ]
        );
        for (irradiance_W_m2, elevation_deg, band, warns) in [
            (1360.0, 90.0, "solar", false),
            (1362.0, 90.0, "solar", true),
            (680.0, 30.0, "solar", false),
            (681.0, 30.0, "solar", true),
            (530.0, 90.0, "PAR", false),
            (531.0, 90.0, "par", true),
            (721.0, 90.0, "NIR", false),
            (722.0, 90.0, "nir", true),
        ] {
            let found = warnings(irradiance_W_m2, elevation_deg, band);
            assert_eq!(
                !found.is_empty(),
                warns,
                "{irradiance_W_m2} {band}: {found:?}"
            );
        }
    }

    #[test]
    fn a_light_without_any_is_odd() {
        assert_eq!(
            warnings(0.0, 90.0, "X"),
            ["no source has any light in any band"]
        );
        assert_eq!(Light::default().warnings(&[]).len(), 1);
    }
}
