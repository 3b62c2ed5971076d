//! How finely each source is projected.

use nestrad_common::light::{Source, Sources};
use nestrad_kernel::lattice::Extent;

/// Cross-section of the lines of each source, m², so that all of them together cost what the
/// strongest alone would cost at `finest_m2` several times over, and err least.
///
/// The variance of an organ's light goes with `I² a^(3/2)` (I: irradiance perpendicular to the
/// source, a: cross-section; the variance of an area measured by a lattice of points, Gundersen &
/// Jensen 1987), the cost with `1/a`; the least variance for a given cost has `a ~ I^(-4/5)`.
pub fn spread_effort(
    sources: &Sources,
    extent: &Extent,
    finest_m2: f64,
    ground_area_m2: f64,
) -> Vec<f64> {
    let intensity: Vec<f64> = sources
        .list
        .iter()
        .map(|s| s.irradiance_W_m2.iter().sum::<f64>() / -s.direction.z)
        .collect();
    let strongest = intensity.iter().copied().fold(0.0, f64::max);
    let finest_m2 = finest_m2 * coarser_by_number(&intensity[..sources.sky_directions]);
    let wanted: Vec<f64> = sources
        .list
        .iter()
        .zip(&intensity)
        .map(|(source, i)| {
            let fewest = ground_area_m2 * -source.direction.z / FEWEST_POINTS;
            let part = (i / strongest).powf(-0.8).min(COARSEST);
            let area = (finest_m2 * part).min(fewest).max(f64::MIN_POSITIVE);
            // low light drags the box of an open scene far out
            let most = MOST_TIMES * (ground_area_m2 / finest_m2).max(FEWEST_POINTS);
            area * (extent.lines_through(-source.direction, area) / most).max(1.0)
        })
        .collect();
    let points = |(source, &area): (&Source, &f64)| extent.lines_through(-source.direction, area);
    let all: f64 = sources.list.iter().zip(&wanted).map(points).sum();
    let too_many = (all / MOST_POINTS).max(1.0);
    wanted.iter().map(|area| area * too_many).collect()
}

/// The many directions of a sky have lattices of their own, whose errors cancel: n of one intensity err as one
/// source of all their light does whose lines have `n^(-2/3)` of their cross-section (by the same law).
fn coarser_by_number(sky: &[f64]) -> f64 {
    let (sum, squares) = sky.iter().fold((0.0, 0.0), |(s, q), i| (s + i, q + i * i));
    if squares == 0.0 {
        return 1.0;
    }
    // the pitch was measured with a sun that outshines its sky
    (sum * sum / squares / 2.0)
        .powf(2.0 / 3.0)
        .clamp(1.0, COARSEST_OF_MANY)
}

/// No sky is drawn coarser than this many times a single source, however many directions it has.
const COARSEST_OF_MANY: f64 = 16.0;

/// No source is drawn with more points than this many times those that the strongest has on the ground.
const MOST_TIMES: f64 = 8.0;

/// No source is drawn with lines coarser than this many times those of the strongest.
const COARSEST: f64 = 16.0;

/// No source is drawn with fewer points on the ground than this, however low it stands.
const FEWEST_POINTS: f64 = 1e3;

/// All sources together are not drawn with more points than this: a quarter of an hour or so.
const MOST_POINTS: f64 = 3e10;
