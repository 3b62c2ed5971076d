//! How the exchange and the far field are sampled for an accuracy.
//!
//! The variance of what an organ gathers is taken as `(1 + w / L) / n` for `n` directions of `L` lines on an
//! organ each: what differs from direction to direction, and from line to line within one. A direction costs
//! `n (d T + e N L)`, for `T` triangles that are drawn and `N` organs on which lines meet, so the least cost of a
//! variance has `L = sqrt(w d T / (e N))`: dense lines where organs are meshes of many triangles, thin ones where
//! an organ is a triangle or two.

use nestrad_common::canopy::Canopy;
use nestrad_kernel::cost::{DRAWN_NS, MET_NS};
use nestrad_kernel::directions::Axes;

use super::limits::LEAST_ACCURACY_PERCENT;
use super::{Aims, DEFAULT_ACCURACY_PERCENT, Estimator, FarPlan, Scale, Settings};
use crate::exchange::{FarSampling, HALF_BATCHES, Sampling};

/// Lines on an organ whose variance is that between directions: 2 for flat leaves, 16 to 25 for maize and bean
/// (measured: `master/docs/accuracy.md`). Its root counts.
const WITHIN: f64 = 16.0;

/// Triangles that take as long to draw as it takes to begin with a direction.
const OF_A_DIRECTION: f64 = 10_000.0;

/// Lines on an organ in a direction, at least and at most.
const FEWEST_ON_ORGAN: f64 = 2.0;
const MOST_ON_ORGAN: f64 = 75.0;

/// Where fewer meet an organ than this, there are more directions in proportion: 256 of them leave 1.27, 1.12 and
/// 0.87 % of the exchange in NIR for flat leaves with 2.6, 3.8 and 6.9 lines on each, and 0.48 % for maize and bean,
/// with 26 and more (measured there too).
const ENOUGH_ON_ORGAN: f64 = 14.0;

/// Lines that meet an element of average size, all directions of a half together: with fewer, rays would have to
/// make up for many.
const ON_ELEMENT: f64 = 10.0;

/// Lines of a direction, at most: some, and what the leaves of a canopy of a tenth of a square metre of
/// leaf per square metre ask for. Where leaves are fewer still, most lines would meet none of them.
const LINES_ANYWHERE: f64 = 1e5;
const LINES_PER_ORGAN: f64 = 1500.0;
const LINES_PER_TRIANGLE: f64 = 3.0;

/// Rays from each face in each half, at the default accuracy.
const RAYS: f64 = 64.0;

/// Sets of axes for each batch at the default accuracy, where there are lines enough on an organ.
const SETS: f64 = 1.9;

/// Lines are not thinned by more than this, and a face has a chance at least of some sample in each half.
const MOST_THINNED: f64 = 64.0;
const LEAST_SAMPLES: f64 = 0.5;

/// Sampling of the exchange of a scene that is cut into so many elements. 16 batches of 2 sets of 16 axes give 0.3
/// to 0.45 % in NIR.
pub(super) fn lines(
    canopy: &Canopy,
    scale: &Scale,
    elements: u64,
    settings: &Settings,
    aims: &Aims,
) -> Sampling {
    let finer = aims.exchange_percent / DEFAULT_ACCURACY_PERCENT;
    let (sets_per_batch, least_samples) = match settings.estimator {
        // a twentieth too few is not worth another set
        Estimator::Lines => (
            (SETS * thin(canopy, scale) / (finer * finer)).ceil() as u32,
            4.0,
        ),
        Estimator::Rays => {
            let fewest = if aims.thin { 1.0 } else { 8.0 };
            (0, (RAYS / (finer * finer)).round().clamp(fewest, 1e6))
        }
    };
    let axes = Axes::Both;
    let most_lines = LINES_ANYWHERE
        + LINES_PER_ORGAN * canopy.organs.len() as f64
        + LINES_PER_TRIANGLE * canopy.len() as f64;
    let directions = HALF_BATCHES as f64 * f64::from(sets_per_batch.max(1) * axes.count());
    // lines see |cos| of an area, whose mean over the hemisphere is 1/2
    let of_organs = 0.5 * scale.organ_area_m2 / lines_on_organ(canopy, scale);
    let of_elements = 0.5 * scale.area_m2 / elements.max(1) as f64 * directions / ON_ELEMENT;
    let line_area_m2 = of_organs
        .min(of_elements)
        .min(4.5 * scale.triangle_area_m2)
        .min(scale.ground_area_m2 / 1000.0)
        .max(scale.ground_area_m2 / most_lines)
        .max(f64::MIN_POSITIVE);
    let thinned = if aims.thin && sets_per_batch == 1 {
        (aims.exchange_percent / coarsest_percent(canopy, scale))
            .powi(2)
            .clamp(1.0, MOST_THINNED)
    } else {
        1.0
    };
    Sampling {
        batches: 2 * HALF_BATCHES as u32,
        axes,
        sets_per_batch,
        line_area_m2: line_area_m2 * thinned,
        // as many rays would have to make up for lines as are saved
        least_samples: if thinned > 1.0 {
            (least_samples / thinned).max(LEAST_SAMPLES)
        } else {
            least_samples
        },
        seed: settings.seed,
    }
}

/// The number of lines on an organ of average size that gives a variance for the least time.
fn lines_on_organ(canopy: &Canopy, scale: &Scale) -> f64 {
    let organs = (scale.area_m2 / scale.organ_area_m2).max(1.0);
    let triangles = canopy.len() as f64;
    (WITHIN * DRAWN_NS * (triangles + OF_A_DIRECTION) / (MET_NS * organs))
        .sqrt()
        .clamp(FEWEST_ON_ORGAN, MOST_ON_ORGAN)
}

/// How many times as many directions there are, because few lines meet an organ.
fn thin(canopy: &Canopy, scale: &Scale) -> f64 {
    (ENOUGH_ON_ORGAN / lines_on_organ(canopy, scale)).max(1.0)
}

/// Planning for a larger error than this makes the exchange no coarser: a batch has a set of axes at least.
pub(super) fn coarsest_percent(canopy: &Canopy, scale: &Scale) -> f64 {
    DEFAULT_ACCURACY_PERCENT * (SETS * thin(canopy, scale)).sqrt()
}

/// Directions, in parts of those that are enough on average, that are enough nearly always: where a round that
/// misses by little would have to be done again, some more cost less than the risk.
const NEARLY_ALWAYS: f64 = 1.25;

/// The aims with the exchange so fine that the first round is nearly always enough. Small organs have as much to
/// spare already.
pub(super) fn with_a_margin(aims: Aims, canopy: &Canopy, scale: &Scale) -> Aims {
    let more = (NEARLY_ALWAYS / thin(canopy, scale)).max(1.0);
    Aims {
        // the finest that may be asked for is not to be refused
        exchange_percent: (aims.exchange_percent / more.sqrt())
            .max(LEAST_ACCURACY_PERCENT.min(aims.exchange_percent)),
        ..aims
    }
}

pub(super) fn far_field(settings: &Settings, finer: f64) -> FarPlan {
    let more = 1.0 / (finer * finer);
    FarPlan {
        levels: 65,
        bins: 6,
        sampling: FarSampling {
            sets_per_batch: (2.0 * more).round().clamp(1.0, 32.0) as u32,
            lines: (24_000.0 * more).clamp(1e4, 1e6) as u32,
            seed: settings.seed,
        },
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use nestrad_common::canopy::{Mesh, Organ, Triangle};

    use super::*;

    /// So many organs of so many triangles each, 1 cm² a triangle.
    fn canopy(organs: u32, triangles: u32) -> (Canopy, Scale) {
        let all = organs * triangles;
        let organ = Organ {
            id: "leaf".to_owned(),
            plant: "plant".to_owned(),
            ..Organ::default()
        };
        let triangle = |organ| Triangle {
            corners_m: [DVec3::ZERO; 3],
            organ,
            material: 0,
        };
        let mesh: Mesh = (0..all).map(|t| triangle(t / triangles)).collect();
        let mut canopy = Canopy::of_meshes(vec![mesh]);
        canopy.organs = vec![organ; organs as usize];
        let scale = Scale {
            area_m2: 1e-4 * f64::from(all),
            ground_area_m2: 1.0,
            height_m: 1.0,
            organ_area_m2: 1e-4 * f64::from(triangles),
            triangle_area_m2: 1e-4,
            triangle_edge_m: 0.014,
            leaf_area_density_per_m: 1.0,
        };
        (canopy, scale)
    }

    fn on_organ(organs: u32, triangles: u32) -> f64 {
        let (canopy, scale) = canopy(organs, triangles);
        lines_on_organ(&canopy, &scale)
    }

    #[test]
    fn lines_are_thin_where_organs_are_a_triangle_or_two() {
        let (meshes, flat) = (on_organ(100, 600), on_organ(100_000, 2));
        assert!((30.0..60.0).contains(&meshes), "{meshes}");
        assert!((2.0..5.0).contains(&flat), "{flat}");
        // what a direction costs at least is not saved
        assert_eq!(on_organ(3, 2), MOST_ON_ORGAN);
    }

    #[test]
    fn a_margin_refuses_nothing_that_may_be_asked_for() {
        let (meshes, scale) = canopy(100, 600);
        let aims = |asked| with_a_margin(Aims::of(asked), &meshes, &scale).exchange_percent;
        assert_eq!(aims(LEAST_ACCURACY_PERCENT), LEAST_ACCURACY_PERCENT);
        assert!(aims(0.5) < 0.46);
        // what is refused anyway
        assert_eq!(aims(0.005), 0.005);
    }

    #[test]
    fn where_lines_are_thin_there_are_more_directions() {
        let sets = |organs, triangles| {
            let (canopy, scale) = canopy(organs, triangles);
            let aims = Aims::of(DEFAULT_ACCURACY_PERCENT);
            lines(&canopy, &scale, 0, &Settings::default(), &aims).sets_per_batch
        };
        assert_eq!(sets(100, 600), 2);
        assert!((8..16).contains(&sets(100_000, 2)));
        // a batch has one set at the error that it says is the coarsest
        for (organs, triangles) in [(100, 600), (100_000, 2)] {
            let (canopy, scale) = canopy(organs, triangles);
            let coarsest = coarsest_percent(&canopy, &scale);
            let aims = Aims::of(coarsest * 1.000_001);
            let sampling = lines(&canopy, &scale, 0, &Settings::default(), &aims);
            assert_eq!(sampling.sets_per_batch, 1);
            let aims = Aims::of(coarsest * 0.99);
            let sampling = lines(&canopy, &scale, 0, &Settings::default(), &aims);
            assert_eq!(sampling.sets_per_batch, 2);
        }
    }
}
