//! How finely each source is projected.

use nestrad_common::light::{Source, Sources};
use nestrad_kernel::lattice::Extent;

/// Cross-section of the lines of each source, m², so that all of them together err least for what they cost, and
/// no more than one source of all their light would at `finest_m2`.
///
/// The variance of an organ's light goes with `I² a^(3/2)` (I: irradiance perpendicular to the
/// source, a: cross-section; the variance of an area measured by a lattice of points, Gundersen &
/// Jensen 1987), the cost with `1/a`; the least variance for a given cost has `a ~ I^(-4/5)`.
pub fn spread_effort(
    sources: &Sources,
    extent: &Extent,
    finest_m2: f64,
    (ground_area_m2, leaf_area_m2): (f64, f64),
) -> Vec<f64> {
    let intensity: Vec<f64> = sources.list.iter().map(Source::intensity_W_m2).collect();
    let coarser = coarser(&intensity, sources.sky_directions);
    let wanted: Vec<f64> = sources
        .list
        .iter()
        .zip(&coarser)
        .map(|(source, coarser)| {
            let fewest = ground_area_m2 * -source.direction.z / FEWEST_POINTS;
            let area = (finest_m2 * coarser).min(fewest).max(f64::MIN_POSITIVE);
            // low light drags the box of an open scene far out
            let most = MOST_TIMES * (ground_area_m2 / finest_m2).max(FEWEST_POINTS);
            let lines = extent.lines_through(-source.direction, area);
            let area = area * (lines / most).max(1.0);
            // what reaches into many copies of the pattern is drawn in each of them
            let drawn = leaf_area_m2 / area;
            area * (drawn / MOST_DRAWN.max(MOST_DEEP * lines.min(most))).max(1.0)
        })
        .collect();
    let points = |(source, &area): (&Source, &f64)| extent.lines_through(-source.direction, area);
    let all: f64 = sources.list.iter().zip(&wanted).map(points).sum();
    let too_many = (all / MOST_POINTS).max(1.0);
    wanted.iter().map(|area| area * too_many).collect()
}

/// How many times coarser than the finest each source is drawn, the first `sky` of which are directions of a sky.
fn coarser(intensity: &[f64], sky: usize) -> Vec<f64> {
    let strongest = intensity.iter().copied().fold(0.0, f64::max);
    // without a sky the strongest is drawn as finely as if it were alone
    let law = |of: &dyn Fn(f64) -> f64| intensity.iter().map(|&i| of(i / strongest)).sum::<f64>();
    let of_strongest = match sky {
        0 => 1.0,
        _ => (law(&|i| i).powi(2) / law(&|i| i.powf(0.8))).powf(2.0 / 3.0),
    };
    let most_of_sky = match intensity.len() - sky {
        0 => COARSEST_OF_MANY,
        _ => COARSEST_OF_MANY * COARSEST,
    };
    let of = |(k, i): (usize, &f64)| {
        let part = of_strongest * (i / strongest).powf(-0.8);
        in_steps(if k < sky {
            (OF_SKY * part).clamp(1.0, most_of_sky)
        } else {
            part.min(COARSEST)
        })
    };
    intensity.iter().enumerate().map(of).collect()
}

/// To the next power of four: a direction of a sky that shines a little more or less in the next hour is drawn
/// alike, and what it lights can be kept.
fn in_steps(coarser: f64) -> f64 {
    4f64.powf(coarser.log(4.0).round())
}

/// Directions of a sky are drawn so much more finely than the law asks for: `2^(-2/3)`.
const OF_SKY: f64 = 0.63;

/// No sky without a sun is drawn coarser than this many times a single source, however many directions it has.
const COARSEST_OF_MANY: f64 = 16.0;

/// No source is drawn with more points than this many times those that the strongest has on the ground.
const MOST_TIMES: f64 = 8.0;

/// Nor are more points of surfaces drawn than this, of all that stands behind one another, or than this many for each
/// line where those are more.
const MOST_DRAWN: f64 = 1e8;
const MOST_DEEP: f64 = 200.0;

/// No source is drawn with lines coarser than this many times those of the strongest.
const COARSEST: f64 = 16.0;

/// No source is drawn with fewer points on the ground than this, however low it stands.
const FEWEST_POINTS: f64 = 1e3;

/// All sources together are not drawn with more points than this: a quarter of an hour or so.
const MOST_POINTS: f64 = 3e10;

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// It was drawn 16 times coarser, like the directions of its sky: direct light erred by 8.6 % in place of 0.5 %.
    #[test]
    fn fault_the_sun_of_a_built_in_sky_was_drawn_as_coarsely_as_its_sky() {
        for directions in [16, 200, 1132] {
            let mut list = vec![0.2 / f64::from(directions); directions as usize];
            list.push(0.8);
            let coarser = coarser(&list, directions as usize);
            assert_eq!(coarser[directions as usize], 1.0);
            let variance = |k: usize| list[k] * list[k] * coarser[k].powf(1.5);
            let all: f64 = (0..list.len()).map(variance).sum();
            assert!(all < 1.0, "{directions}: {all}");
            assert!(coarser[0] >= 16.0, "{directions}: {}", coarser[0]);
        }
    }

    #[test]
    fn sources_of_one_strength_err_as_one_of_all_their_light() {
        for sky in [40, 4000] {
            let coarser = coarser(&vec![0.1; sky], sky);
            assert!(coarser[0] > 3.0 && coarser[0] <= 16.0, "{coarser:?}");
        }
        assert_eq!(coarser(&[5.0], 0), [1.0]);
        assert_eq!(coarser(&[5.0, 5.0, 0.001], 0), [1.0, 1.0, 16.0]);
        // without any light, whatever
        assert_eq!(coarser(&[0.0, 1.0], 1).len(), 2);
    }

    /// Of random scene 8100367: a triangle that hangs over thousands of copies of the pattern was drawn in each of them
    /// at a million points, which took minutes.
    #[test]
    fn fault_a_triangle_over_thousands_of_patterns_took_minutes() {
        let extent = Extent {
            min_m: DVec3::ZERO,
            max_m: DVec3::ONE,
            periodic: true,
        };
        let sources = Sources {
            list: vec![Source {
                direction: DVec3::new(0.6, 0.0, -0.8),
                irradiance_W_m2: vec![1.0],
            }],
            sky_directions: 0,
        };
        for (leaf_area_m2, finest_m2) in [(1e4, 1e-6), (1e4, 1e-8), (5.0, 1e-6)] {
            let area = spread_effort(&sources, &extent, finest_m2, (1.0, leaf_area_m2))[0];
            assert!(leaf_area_m2 / area <= 1.0001 * (MOST_DEEP * 0.8 / finest_m2).max(MOST_DRAWN));
            let is_deep = leaf_area_m2 > 1e3;
            assert_eq!(area > finest_m2, is_deep, "{leaf_area_m2} {area}");
        }
    }

    #[test]
    fn a_sky_that_changes_a_little_is_drawn_alike() {
        let of = |sun: f64| {
            let mut list = vec![0.3 / 476.0; 476];
            list.push(sun);
            coarser(&list, 476)
        };
        assert_eq!(of(0.5), of(0.6));
    }
}
