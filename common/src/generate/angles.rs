//! Leaf-angle distributions: how the inclination of leaves (0 = horizontal, pi/2 = upright) is
//! spread over their area, any azimuth being as likely as any other.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};
use std::str::FromStr;

use thiserror::Error;

/// A distribution of leaf inclination, by area.
///
/// The four trigonometric ones are those of de Wit (1965), written as in Goel & Strebel (1984).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeafAngles {
    /// As the surface of a sphere: density `sin t`.
    Spherical,
    /// All inclinations alike: density `2/pi`.
    Uniform,
    /// Mostly horizontal: density `2/pi (1 + cos 2t)`.
    Planophile,
    /// Mostly upright: density `2/pi (1 - cos 2t)`.
    Erectophile,
    /// Mostly oblique: density `2/pi (1 - cos 4t)`.
    Plagiophile,
    /// Mostly horizontal or upright: density `2/pi (1 + cos 4t)`.
    Extremophile,
    /// All horizontal.
    Horizontal,
    /// As the surface of an ellipsoid of revolution (Campbell 1990): density proportional to
    /// `sin t / (cos² t + chi² sin² t)²`.
    Ellipsoidal {
        /// Horizontal over vertical half-axis, finite and `> 0`; 1 is spherical, more is flatter.
        chi: f64,
    },
}

impl LeafAngles {
    /// The part of all leaf area whose inclination is at most `inclination` (radians, 0 to pi/2).
    pub fn cumulative(self, inclination: f64) -> f64 {
        let t = inclination;
        match self {
            Self::Spherical => 1.0 - t.cos(),
            Self::Uniform => FRAC_2_PI * t,
            Self::Planophile => FRAC_2_PI * (t + 0.5 * (2.0 * t).sin()),
            Self::Erectophile => FRAC_2_PI * (t - 0.5 * (2.0 * t).sin()),
            Self::Plagiophile => FRAC_2_PI * (t - 0.25 * (4.0 * t).sin()),
            Self::Extremophile => FRAC_2_PI * (t + 0.25 * (4.0 * t).sin()),
            Self::Horizontal => 1.0,
            Self::Ellipsoidal { chi } => {
                1.0 - ellipsoidal_integral(t.cos(), chi) / ellipsoidal_integral(1.0, chi)
            }
        }
    }

    /// The inclination (radians, 0 to pi/2) that a part `quantile` (0 to 1) of all area does not
    /// exceed.
    pub fn inclination(self, quantile: f64) -> f64 {
        if self == Self::Horizontal {
            return 0.0;
        }
        // densities may be zero at their ends, which bisection does not mind
        let (mut low, mut high) = (0.0, FRAC_PI_2);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.cumulative(middle) < quantile {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// Integral of `dx / (chi² + (1 - chi²) x²)²` from 0 to `mu`, the cosine of an inclination.
fn ellipsoidal_integral(mu: f64, chi: f64) -> f64 {
    let chi2 = chi * chi;
    let difference = 1.0 - chi2;
    let root = difference.abs().sqrt();
    // integral of dx / (chi² + (1 - chi²) x²)
    let simple = if root < 1e-4 {
        mu / chi2
    } else if difference > 0.0 {
        (mu * root / chi).atan() / (chi * root)
    } else {
        (mu * root / chi).atanh() / (chi * root)
    };
    (mu / (chi2 + difference * mu * mu) + simple) / (2.0 * chi2)
}

impl FromStr for LeafAngles {
    type Err = LeafAnglesError;

    /// A name in lower case; `ellipsoidal:CHI` for an ellipsoidal one.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let refused = || LeafAnglesError {
            given: text.to_owned(),
        };
        match text {
            "spherical" => Ok(Self::Spherical),
            "uniform" => Ok(Self::Uniform),
            "planophile" => Ok(Self::Planophile),
            "erectophile" => Ok(Self::Erectophile),
            "plagiophile" => Ok(Self::Plagiophile),
            "extremophile" => Ok(Self::Extremophile),
            "horizontal" => Ok(Self::Horizontal),
            _ => {
                let chi = text
                    .strip_prefix("ellipsoidal:")
                    .and_then(|chi| chi.parse().ok())
                    .filter(|chi: &f64| chi.is_finite() && *chi > 0.0);
                chi.map(|chi| Self::Ellipsoidal { chi }).ok_or_else(refused)
            }
        }
    }
}

/// Not a leaf-angle distribution.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "leaf angles '{given}': expected spherical, uniform, planophile, erectophile, plagiophile, \
     extremophile, horizontal, or ellipsoidal:CHI with a positive CHI"
)]
pub struct LeafAnglesError {
    /// As given.
    pub given: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean_deg(angles: LeafAngles) -> f64 {
        let n = 20_000;
        let sum: f64 = (0..n)
            .map(|i| angles.inclination((f64::from(i) + 0.5) / f64::from(n)))
            .sum();
        (sum / f64::from(n)).to_degrees()
    }

    #[test]
    fn means_are_those_of_the_closed_forms() {
        // planophile: pi/4 - 1/pi; erectophile: pi/4 + 1/pi; spherical: 1
        for (angles, expected) in [
            (LeafAngles::Spherical, 57.2958),
            (LeafAngles::Uniform, 45.0),
            (LeafAngles::Planophile, 26.7624),
            (LeafAngles::Erectophile, 63.2376),
            (LeafAngles::Plagiophile, 45.0),
            (LeafAngles::Extremophile, 45.0),
            (LeafAngles::Horizontal, 0.0),
            (LeafAngles::Ellipsoidal { chi: 1.0 }, 57.2958),
        ] {
            let mean = mean_deg(angles);
            assert!((mean - expected).abs() < 0.005, "{angles:?}: {mean}");
        }
    }

    /// The density and its normalisation as in Campbell (1990, Agricultural and Forest Meteorology 49:173-176).
    #[test]
    fn the_ellipsoid_has_campbells_density() {
        for chi in [0.2_f64, 0.5, 0.9, 1.1, 2.0, 5.0] {
            let lambda = if chi < 1.0 {
                let e = (1.0 - chi * chi).sqrt();
                chi + e.asin() / e
            } else {
                let e = (1.0 - 1.0 / (chi * chi)).sqrt();
                chi + ((1.0 + e) / (1.0 - e)).ln() / (2.0 * e * chi)
            };
            let angles = LeafAngles::Ellipsoidal { chi };
            for t in [0.1_f64, 0.5, 1.0, 1.5] {
                let shape = t.cos().powi(2) + chi * chi * t.sin().powi(2);
                let density = 2.0 * chi.powi(3) * t.sin() / (lambda * shape * shape);
                let step = 1e-4;
                let slope =
                    (angles.cumulative(t + step) - angles.cumulative(t - step)) / (2.0 * step);
                assert!(
                    (slope - density).abs() < 1e-6 * density.max(1.0),
                    "{chi} {t}"
                );
            }
        }
    }

    #[test]
    fn cumulative_and_quantile_are_inverse() {
        for name in [
            "spherical",
            "uniform",
            "planophile",
            "erectophile",
            "plagiophile",
            "extremophile",
            "ellipsoidal:0.2",
            "ellipsoidal:0.99999",
            "ellipsoidal:1.00001",
            "ellipsoidal:30",
        ] {
            let angles: LeafAngles = name.parse().unwrap();
            assert!(angles.cumulative(0.0).abs() < 1e-12, "{name}");
            assert!((angles.cumulative(FRAC_PI_2) - 1.0).abs() < 1e-12, "{name}");
            for i in 1..100 {
                let quantile = f64::from(i) / 100.0;
                let back = angles.cumulative(angles.inclination(quantile));
                assert!((back - quantile).abs() < 1e-9, "{name}: {quantile}");
            }
        }
    }

    #[test]
    fn what_is_no_distribution_is_refused() {
        for bad in [
            "",
            "Spherical",
            "ellipsoidal",
            "ellipsoidal:0",
            "ellipsoidal:x",
            "ellipsoidal:inf",
        ] {
            assert!(bad.parse::<LeafAngles>().is_err(), "{bad}");
        }
    }
}
