//! How bright a sky is, direction by direction.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::perez::Perez;

/// Radiance over the sky, in a unit that is the same for all directions of one sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Radiance {
    /// The same from everywhere.
    Uniform,
    /// Moon & Spencer 1942; also type 16 of the CIE standard (ISO 15469:2004).
    MoonSpencer,
    /// A type of the CIE standard general sky (CIE S 011/E:2003, ISO 15469:2004).
    Cie {
        /// Which one.
        kind: CieType,
        /// Unit vector towards the sun, z >= 0.
        towards_sun: DVec3,
    },
    /// The all-weather model of Perez, Seals & Michalsky 1993.
    Perez(Perez),
}

impl Radiance {
    /// Radiance of a direction above the horizon, 0 or more. That of the zenith is 1, but for a sky of Perez.
    pub fn towards(&self, direction: DVec3) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::MoonSpencer => (1.0 + 2.0 * direction.z) / 3.0,
            Self::Cie { kind, towards_sun } => kind.radiance(direction, *towards_sun),
            Self::Perez(sky) => sky.radiance(direction),
        }
    }

    /// Where its sun stands, if that shapes it.
    pub fn towards_sun(&self) -> Option<DVec3> {
        match self {
            Self::Uniform | Self::MoonSpencer => None,
            Self::Cie { towards_sun, .. } => Some(*towards_sun),
            Self::Perez(sky) => Some(sky.towards_sun),
        }
    }
}

/// One of the fifteen types of the CIE standard general sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CieType(u8);

/// Types that there are, for messages.
pub const CIE_TYPES: &str = "a type of the CIE standard general sky, 1 to 15";

/// Parameters a, b of the gradation and c, d, e of the indicatrix, types 1 to 15: table 1 of ISO 15469:2004.
const PARAMETERS: [[f64; 5]; 15] = [
    [4.0, -0.70, 0.0, -1.0, 0.0],
    [4.0, -0.70, 2.0, -1.5, 0.15],
    [1.1, -0.80, 0.0, -1.0, 0.0],
    [1.1, -0.80, 2.0, -1.5, 0.15],
    [0.0, -1.00, 0.0, -1.0, 0.0],
    [0.0, -1.00, 2.0, -1.5, 0.15],
    [0.0, -1.00, 5.0, -2.5, 0.30],
    [0.0, -1.00, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.30],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

impl CieType {
    /// "CIE standard clear sky, low illuminance turbidity".
    pub const CLEAR: Self = Self(12);

    /// A type by its number, 1 to 15.
    pub fn new(number: u8) -> Option<Self> {
        (1..=15).contains(&number).then_some(Self(number))
    }

    /// Its number, 1 to 15.
    pub fn number(self) -> u8 {
        self.0
    }

    /// Equation 1 of ISO 15469:2004: gradation phi(Z) times indicatrix f(chi), over those of the zenith.
    fn radiance(self, direction: DVec3, towards_sun: DVec3) -> f64 {
        let [a, b, c, d, e] = PARAMETERS[usize::from(self.0) - 1];
        // phi of the horizon is 1, the limit of b / cos Z
        let gradation = |cos_zenith: f64| 1.0 + a * f64::exp(b / cos_zenith.max(0.0));
        let indicatrix = |cos_chi: f64| {
            let chi = cos_chi.clamp(-1.0, 1.0).acos();
            1.0 + c * (f64::exp(d * chi) - f64::exp(d * FRAC_PI_2)) + e * cos_chi * cos_chi
        };
        gradation(direction.z) * indicatrix(direction.dot(towards_sun))
            / (gradation(1.0) * indicatrix(towards_sun.z))
    }
}

#[cfg(test)]
#[path = "radiance_tests.rs"]
mod tests;
