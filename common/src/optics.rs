//! Optical properties: what a face does with the light of a band.

use thiserror::Error;

/// Reflectance and transmittance of one face, for light that *arrives* on that face.
///
/// `rho` leaves from the same face, `tau` from the other one, both Lambertian. Dimensionless;
/// valid when both are finite, `>= 0` and `rho + tau <= 1`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceOptics {
    /// Hemispherical reflectance.
    pub rho: f64,
    /// Hemispherical transmittance.
    pub tau: f64,
}

impl FaceOptics {
    /// The part of arriving light that stays, `1 - rho - tau`; never below zero.
    pub fn absorptance(self) -> f64 {
        (1.0 - self.rho - self.tau).max(0.0)
    }

    fn check(self) -> Result<(), OpticsFault> {
        let Self { rho, tau } = self;
        let proper = |x: f64| x.is_finite() && x >= 0.0;
        if !proper(rho) || !proper(tau) {
            return Err(OpticsFault::Negative { rho, tau });
        }
        // one unit of rounding per decimal that a file may carry
        if rho + tau > 1.0 + 4.0 * f64::EPSILON {
            return Err(OpticsFault::MoreThanOne { rho, tau });
        }
        Ok(())
    }
}

/// Optical properties of a material: of its upper face (towards which the right-hand normal
/// points) and of its lower face.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafOptics {
    /// For light that arrives on the upper face.
    pub upper: FaceOptics,
    /// For light that arrives on the lower face.
    pub lower: FaceOptics,
}

impl LeafOptics {
    /// An opaque material with the same reflectance on both faces.
    pub fn opaque(rho: f64) -> Self {
        let face = FaceOptics { rho, tau: 0.0 };
        Self {
            upper: face,
            lower: face,
        }
    }

    /// The same properties on both faces.
    pub fn symmetric(rho: f64, tau: f64) -> Self {
        let face = FaceOptics { rho, tau };
        Self {
            upper: face,
            lower: face,
        }
    }

    /// What of the light that arrives on a face stays.
    pub fn absorptance(&self, upper: bool) -> f64 {
        let face = if upper { self.upper } else { self.lower };
        face.absorptance()
    }

    /// Radiosities of the upper and of the lower face under these irradiances of them, in the same unit.
    pub fn radiosities(&self, [upper, lower]: [f64; 2]) -> [f64; 2] {
        [
            self.upper.rho * upper + self.lower.tau * lower,
            self.lower.rho * lower + self.upper.tau * upper,
        ]
    }

    /// Refuses what is not physical: negative, not finite, or `rho + tau > 1` on a face.
    pub fn check(&self) -> Result<(), OpticsFault> {
        self.upper.check()?;
        self.lower.check()
    }

    /// Nothing leaves either face.
    pub fn is_black(&self) -> bool {
        *self == Self::default()
    }
}

/// An albedo that is taken, for messages.
pub const AN_ALBEDO: &str = "an albedo from 0 to 1";

/// Whether an albedo of the soil is physical: as strict as the reflectance of an opaque material.
pub fn is_albedo(value: f64) -> bool {
    LeafOptics::opaque(value).check().is_ok()
}

/// The optical properties of a canopy in every band.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Optics {
    /// In the user's order; at least one.
    pub bands: Vec<Band>,
}

impl Optics {
    /// Number of bands.
    pub fn len(&self) -> usize {
        self.bands.len()
    }

    /// No bands at all.
    pub fn is_empty(&self) -> bool {
        self.bands.is_empty()
    }

    /// Names of the bands, in order.
    pub fn names(&self) -> Vec<&str> {
        self.bands.iter().map(|band| band.name.as_str()).collect()
    }
}

/// A named wavelength band: the properties of every material and of the soil in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// The user's name for it, e.g. `PAR`.
    pub name: String,
    /// Lambertian albedo of the soil plane, 0 to 1.
    pub soil_albedo: f64,
    /// One entry per material, in the order of [`crate::canopy::Canopy::materials`].
    pub materials: Vec<LeafOptics>,
}

impl Band {
    /// Nothing in this band scatters: neither a material nor (where there is one) the soil.
    pub fn is_black(&self, has_soil: bool) -> bool {
        self.materials.iter().all(LeafOptics::is_black) && (!has_soil || self.soil_albedo == 0.0)
    }
}

/// Why optical properties were refused.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum OpticsFault {
    /// A value is negative or not a finite number.
    #[error("rho = {rho} and tau = {tau}: expected finite numbers, not negative")]
    Negative {
        /// As given.
        rho: f64,
        /// As given.
        tau: f64,
    },
    /// A face gives out more than it gets.
    #[error("rho = {rho} and tau = {tau}: expected rho + tau <= 1")]
    MoreThanOne {
        /// As given.
        rho: f64,
        /// As given.
        tau: f64,
    },
}

impl OpticsFault {
    /// The values that were refused, for messages that say in their own words what is expected.
    pub fn values(self) -> String {
        let (Self::Negative { rho, tau } | Self::MoreThanOne { rho, tau }) = self;
        format!("rho = {rho} and tau = {tau}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unphysical_optics_are_refused() {
        assert!(LeafOptics::symmetric(0.5, 0.5).check().is_ok());
        assert!(LeafOptics::symmetric(0.1, 0.9).check().is_ok());
        assert!(matches!(
            LeafOptics::symmetric(0.6, 0.41).check(),
            Err(OpticsFault::MoreThanOne { .. })
        ));
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                LeafOptics::opaque(bad).check(),
                Err(OpticsFault::Negative { .. })
            ));
        }
    }

    #[test]
    fn a_band_is_black_only_with_its_soil() {
        let band = Band {
            name: "X".into(),
            soil_albedo: 0.2,
            materials: vec![LeafOptics::default()],
        };
        assert!(band.is_black(false));
        assert!(!band.is_black(true));
    }
}
