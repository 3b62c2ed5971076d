//! How large elements are, at the default accuracy.
//!
//! Radiosity is constant over an element, so elements have to be small against the length over which light falls
//! off. That is the inverse of the leaf area density; near an organ, where its own shape and what is next to it
//! matter, it is a part of the organ.

use super::{Aims, DEFAULT_ACCURACY_PERCENT, Scale};

/// Longest edge of an element, in sides of an organ of average size. Errors go in proportion to it (measured: see
/// `master/docs/accuracy.md`).
const EDGE: f64 = 0.7 / 6.0;

/// The same where organs are small against the length over which light falls off, in such lengths: errs by 0.15 %
/// in NIR (measured there too), but never more than so many sides.
const EDGE_IN_LENGTHS: f64 = 0.05;
const LONGEST_EDGE: f64 = 4.0 * EDGE;

/// Where there is less around an organ than this part of its area in a cube of its side, what it sees is itself.
const ALONE: f64 = 0.01;

/// Longest edge of an element at the default accuracy, m.
pub(super) fn edge_m(scale: &Scale) -> f64 {
    let (density, organ_m) = (scale.leaf_area_density_per_m, scale.organ_m());
    let of_organ = if density * organ_m < ALONE {
        EDGE * organ_m
    } else {
        (EDGE_IN_LENGTHS / density).clamp(EDGE * organ_m, LONGEST_EDGE * organ_m)
    };
    of_organ
        .min((scale.ground_area_m2 / 1000.0).sqrt())
        .max(f64::MIN_POSITIVE)
}

/// What elements err by in NIR, in percent, where light falls off over the length of their edges: 2.3 for maize and
/// bean, 2.5 to 3.6 for small leaves (measured there too).
const OF_A_LENGTH_PERCENT: f64 = 2.5;

/// Part of the error that is asked for which elements may have.
const PART: f64 = 0.6;

/// The aims where elements that would err by too much of what is asked for are finer, so that no second round is
/// needed for their sake.
pub(super) fn fine_enough(aims: Aims, asked_percent: f64, scale: &Scale) -> Aims {
    let at_default = OF_A_LENGTH_PERCENT * scale.leaf_area_density_per_m * edge_m(scale);
    let enough = DEFAULT_ACCURACY_PERCENT * PART * asked_percent / at_default;
    Aims {
        elements_percent: aims.elements_percent.min(enough),
        ..aims
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(organ_m: f64) -> Scale {
        Scale {
            area_m2: 1.0,
            ground_area_m2: 100.0,
            height_m: 1.0,
            organ_area_m2: organ_m * organ_m,
            triangle_area_m2: 1e-4,
            triangle_edge_m: 0.014,
            leaf_area_density_per_m: 0.0,
        }
    }

    fn edge_cm(density_per_m: f64, organ_m: f64) -> f64 {
        let scale = Scale {
            leaf_area_density_per_m: density_per_m,
            ..scale(organ_m)
        };
        100.0 * edge_m(&scale)
    }

    #[test]
    fn small_leaves_are_not_cut_finer_than_light_changes() {
        // maize, bean: as fine as organs ask for
        assert!((edge_cm(2.2, 0.234) - 2.73).abs() < 0.01);
        assert!((edge_cm(12.0, 0.115) - 1.34).abs() < 0.01);
        // leaves of 4 cm2
        assert!((edge_cm(3.0, 0.04) - 1.67).abs() < 0.01);
        assert!((edge_cm(0.3, 0.04) - 4.0 * 0.467).abs() < 0.01);
    }

    #[test]
    fn elements_of_a_dense_canopy_are_finer_where_an_error_is_asked_for() {
        let (bean, maize) = ((12.0, 0.115), (2.2, 0.234));
        let percent = |(density_per_m, organ_m): (f64, f64), asked| {
            let scale = Scale {
                leaf_area_density_per_m: density_per_m,
                ..scale(organ_m)
            };
            fine_enough(Aims::of(asked), asked, &scale).elements_percent
        };
        assert_eq!(percent(maize, 0.5), Aims::of(0.5).elements_percent);
        assert_eq!(percent(bean, 2.0), Aims::of(2.0).elements_percent);
        assert!((percent(bean, 0.5) - 0.373).abs() < 0.01);
        assert_eq!(percent((0.0, 0.1), 0.5), Aims::of(0.5).elements_percent);
    }

    #[test]
    fn what_stands_alone_is_cut_by_its_own_size() {
        assert!((edge_cm(0.0, 0.04) - 0.467).abs() < 0.01);
        assert!((edge_cm(0.1, 0.04) - 0.467).abs() < 0.01);
    }
}
