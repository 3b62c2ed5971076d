//! Photons of a joule.

/// Planck constant, J s (SI, exact).
const PLANCK_J_S: f64 = 6.626_070_15e-34;

/// Speed of light, m s⁻¹ (SI, exact).
const LIGHT_M_S: f64 = 299_792_458.0;

/// Avogadro constant, mol⁻¹ (SI, exact).
const AVOGADRO_MOL: f64 = 6.022_140_76e23;

/// Photons of a joule of light whose energy is spread evenly over the wavelengths from one to another, µmol J⁻¹: the mean
/// of `lambda / (h c N_A)`, which is that of the mean wavelength.
pub fn flat_spectrum_umol_J([from_nm, to_nm]: [f64; 2]) -> f64 {
    let mean_m = 0.5e-9 * (from_nm + to_nm);
    1e6 * mean_m / (PLANCK_J_S * LIGHT_M_S * AVOGADRO_MOL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joule_of_par_has_4_6_micromoles() {
        // 550 nm: 217.5 kJ of a mole of photons
        let found = flat_spectrum_umol_J([400.0, 700.0]);
        assert!((found - 1e6 / 217.502e3).abs() < 1e-4, "{found}");
        // the mean over many narrow bands is the same
        let narrow = |n: i32| {
            let from = 400.0 + 3.0 * f64::from(n);
            flat_spectrum_umol_J([from, from + 3.0]) / 100.0
        };
        let mean: f64 = (0..100).map(narrow).sum();
        assert!((found / mean - 1.0).abs() < 1e-12);
    }
}
