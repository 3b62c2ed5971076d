//! How many steps a lattice has along x and y.

use glam::{DVec2, DVec3};

use super::Extent;

/// Lines that fill an extent, and how many of them along y.
pub(super) fn wanted(direction: DVec3, extent: &Extent, line_area_m2: f64) -> (f64, f64) {
    let d = direction;
    let (_, size) = extent.sheared(DVec2::new(d.x / d.z, d.y / d.z));
    // Cross-sections stay close to squares: what a slanted direction stretches is the step
    // along its azimuth.
    let side = line_area_m2.sqrt();
    let horizontal = d.x * d.x + d.y * d.y;
    let along_x = if horizontal > 0.0 {
        d.x * d.x / horizontal
    } else {
        0.5
    };
    let lines = size.x * size.y * d.z / line_area_m2;
    let mut wanted_y = (size.y / (side * d.z.powf(along_x - 1.0))).clamp(1.0, MAX_SIDE);
    if !extent.periodic && lines >= FEWEST_ALONG * FEWEST_ALONG {
        wanted_y = wanted_y.clamp(FEWEST_ALONG, lines / FEWEST_ALONG);
    }
    (lines, wanted_y)
}

/// The sides of a lattice of `lines` points, of which one is near `wanted_y`.
pub(super) fn sides(lines: f64, wanted_y: f64, random: f64) -> [f64; 2] {
    // a pattern that is narrower than a step has one column of all lines, not none of long ones
    let wanted_y = wanted_y.min(lines.max(1.0));
    let off = |ny: f64| ((lines / ny).round() * ny / lines - 1.0).abs();
    let tried = (0..SIDES_TRIED).map(|k| {
        (wanted_y * (0.75 + 0.5 * k as f64 / SIDES_TRIED as f64))
            .round()
            .max(1.0)
    });
    let best = tried.fold(wanted_y.round(), |best, ny| {
        if off(ny) < off(best) { ny } else { best }
    });
    let nx = if off(best) < 1e-3 {
        (lines / best).round()
    } else {
        (lines / best + random).floor()
    };
    [nx.min(MAX_SIDE), best]
}

/// Sides that are tried to find a lattice of the wanted number of lines.
const SIDES_TRIED: u32 = 32;

/// Largest number of steps along one side; keeps every coordinate exact in f64.
pub(super) const MAX_SIDE: f64 = (1u64 << 24) as f64;

/// An open lattice has at least this many points along each side, if it has so many: between the two rows of a
/// long and narrow one, what lies along it would be met by no line at all.
const FEWEST_ALONG: f64 = 16.0;
