//! The all-weather sky of Perez, Seals & Michalsky 1993: Solar Energy 50:235-245, with the erratum in 51:423.

use glam::DVec3;

/// The radiance of a sky by its clearness, its brightness and where the sun stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perez {
    /// Unit vector towards the sun, z >= 0.
    pub towards_sun: DVec3,
    /// Clearness epsilon, 1 (overcast) to 12.01 (very clear).
    pub clearness: f64,
    /// Brightness Delta, 0.01 to 0.6.
    pub brightness: f64,
}

/// The range of clearness that the model is used in, as in Radiance's gendaylit.
pub const CLEARNESS: (f64, f64) = (1.0, 12.01);

/// The range of brightness, likewise.
pub const BRIGHTNESS: (f64, f64) = (0.01, 0.6);

/// Upper bounds of the classes of clearness; the last has none.
const CLASSES: [f64; 7] = [1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2];

/// Table 1 of the paper: for each class, `x1..x4` of a, of b, of c, of d and of e.
const COEFFICIENTS: [[[f64; 4]; 5]; 8] = [
    [
        [1.3525, -0.2576, -0.2690, -1.4366],
        [-0.7670, 0.0007, 1.2734, -0.1233],
        [2.8000, 0.6004, 1.2375, 1.0000],
        [1.8734, 0.6297, 0.9738, 0.2809],
        [0.0356, -0.1246, -0.5718, 0.9938],
    ],
    [
        [-1.2219, -0.7730, 1.4148, 1.1016],
        [-0.2054, 0.0367, -3.9128, 0.9156],
        [6.9750, 0.1774, 6.4477, -0.1239],
        [-1.5798, -0.5081, -1.7812, 0.1080],
        [0.2624, 0.0672, -0.2190, -0.4285],
    ],
    [
        [-1.1000, -0.2515, 0.8952, 0.0156],
        [0.2782, -0.1812, -4.5000, 1.1766],
        [24.7219, -13.0812, -37.7000, 34.8438],
        [-5.0000, 1.5218, 3.9229, -2.6204],
        [-0.0156, 0.1597, 0.4199, -0.5562],
    ],
    [
        [-0.5484, -0.6654, -0.2672, 0.7117],
        [0.7234, -0.6219, -5.6812, 2.6297],
        [33.3389, -18.3000, -62.2500, 52.0781],
        [-3.5000, 0.0016, 1.1477, 0.1062],
        [0.4659, -0.3296, -0.0876, -0.0329],
    ],
    [
        [-0.6000, -0.3566, -2.5000, 2.3250],
        [0.2937, 0.0496, -5.6812, 1.8415],
        [21.0000, -4.7656, -21.5906, 7.2492],
        [-3.5000, -0.1554, 1.4062, 0.3988],
        [0.0032, 0.0766, -0.0656, -0.1294],
    ],
    [
        [-1.0156, -0.3670, 1.0078, 1.4051],
        [0.2875, -0.5328, -3.8500, 3.3750],
        [14.0000, -0.9999, -7.1406, 7.5469],
        [-3.4000, -0.1078, -1.0750, 1.5702],
        [-0.0672, 0.4016, 0.3017, -0.4844],
    ],
    [
        [-1.0000, 0.0211, 0.5025, -0.5119],
        [-0.3000, 0.1922, 0.7023, -1.6317],
        [19.0000, -5.0000, 1.2438, -1.9094],
        [-4.0000, 0.0250, 0.3844, 0.2656],
        [1.0468, -0.3788, -2.4517, 1.4656],
    ],
    [
        [-1.0500, 0.0289, 0.4260, 0.3590],
        [-0.3250, 0.1156, 0.7781, 0.0025],
        [31.0625, -14.5000, -46.1148, 55.3750],
        [-7.2312, 0.4050, 13.3500, 0.6234],
        [1.5000, -0.6426, 1.8564, 0.5636],
    ],
];

/// What stands for no diffuse light at all, W m⁻².
const LEAST_DIFFUSE_W_M2: f64 = 1e-6;

impl Perez {
    /// The sky of measured irradiances, W m⁻²: diffuse of the horizontal (above 0), direct perpendicular to the beam,
    /// and extraterrestrial perpendicular to the beam on that day.
    ///
    /// Clearness and brightness are equations 1 and 2 of the paper; what lies outside the ranges that they were
    /// fitted in is brought to their ends.
    pub fn of_irradiance(
        towards_sun: DVec3,
        (diffuse_W_m2, direct_normal_W_m2): (f64, f64),
        extraterrestrial_W_m2: f64,
    ) -> Self {
        let zenith = towards_sun.z.clamp(0.0, 1.0).acos();
        let kappa = 1.041 * zenith.powi(3);
        let clearness =
            ((diffuse_W_m2 + direct_normal_W_m2) / diffuse_W_m2 + kappa) / (1.0 + kappa);
        let brightness = diffuse_W_m2 * air_mass(zenith.to_degrees()) / extraterrestrial_W_m2;
        Self {
            towards_sun,
            // of no numbers these are the lower ends
            clearness: clearness.max(CLEARNESS.0).min(CLEARNESS.1),
            brightness: brightness.max(BRIGHTNESS.0).min(BRIGHTNESS.1),
        }
    }

    /// The same of direct and diffuse irradiance of the horizontal. Without diffuse light it is as if there were a little.
    pub fn of_horizontal(
        towards_sun: DVec3,
        (direct_W_m2, diffuse_W_m2): (f64, f64),
        extraterrestrial_W_m2: f64,
    ) -> Self {
        let irradiance = (
            diffuse_W_m2.max(LEAST_DIFFUSE_W_M2),
            direct_W_m2 / towards_sun.z,
        );
        Self::of_irradiance(towards_sun, irradiance, extraterrestrial_W_m2)
    }

    /// Equation 4 of the paper, 0 where it is negative.
    pub(super) fn radiance(&self, direction: DVec3) -> f64 {
        let [a, b, c, d, e] = self.parameters();
        let cos_chi = direction.dot(self.towards_sun).clamp(-1.0, 1.0);
        let gradation = 1.0 + a * (b / direction.z.max(LEAST_COSINE)).exp();
        let indicatrix = 1.0 + c * (d * cos_chi.acos()).exp() + e * cos_chi * cos_chi;
        (gradation * indicatrix).max(0.0)
    }

    /// Equations 6 to 8 of the paper: a to e.
    fn parameters(&self) -> [f64; 5] {
        let class = CLASSES.iter().filter(|&&bound| self.clearness >= bound);
        let class = class.count();
        let zenith = self.towards_sun.z.clamp(0.0, 1.0).acos();
        // skies of middling clearness are not fitted below this: as in gendaylit
        let least = if (1..=4).contains(&class) { 0.2 } else { 0.0 };
        let delta = self.brightness.max(least);
        let x = &COEFFICIENTS[class];
        let of = |[x1, x2, x3, x4]: [f64; 4]| x1 + x2 * zenith + delta * (x3 + x4 * zenith);
        let mut parameters = x.map(of);
        if class == 0 {
            let ([c1, c2, c3, c4], [d1, d2, d3, d4]) = (x[2], x[3]);
            parameters[2] = (delta * (c1 + c2 * zenith)).powf(c3).exp() - c4;
            parameters[3] = -(delta * (d1 + d2 * zenith)).exp() + d3 + delta * d4;
        }
        parameters
    }
}

/// Radiance changes no more below this elevation (0.06 degrees): where b is above 0, it has no limit at the horizon.
const LEAST_COSINE: f64 = 1e-3;

/// Relative optical air mass by the zenith angle, degrees, 90 at most: Kasten & Young 1989, Applied Optics 28:4735.
pub fn air_mass(zenith_deg: f64) -> f64 {
    let zenith_deg = zenith_deg.clamp(0.0, 90.0);
    1.0 / (zenith_deg.to_radians().cos() + 0.50572 * (96.07995 - zenith_deg).powf(-1.6364))
}

#[cfg(test)]
#[path = "perez_tests.rs"]
mod tests;
