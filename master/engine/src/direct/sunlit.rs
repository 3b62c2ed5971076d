//! The area of each organ that the sun reaches: of its elements, by the part of their points that see it.

use nestrad_common::light::Sources;

use super::dealing::Beam;
use super::lit_areas::{LitAreas, Scratch, SunlitArea};
use super::outlines;
use super::probe::Thin;

/// The number of the sun: of the sources that are not directions of a sky, the one with the most light perpendicular to
/// itself, in all bands together; the first of equals.
pub(super) fn sun_of(sources: &Sources) -> Option<usize> {
    let mut strongest = (None, 0.0);
    for (k, source) in sources.list.iter().enumerate().skip(sources.sky_directions) {
        let intensity = source.intensity_W_m2();
        if intensity > strongest.1 {
            strongest = (Some(k), intensity);
        }
    }
    strongest.0
}

/// What is known of an organ's elements.
#[derive(Clone, Copy, Default)]
struct Known {
    lit_m2: f64,
    /// Of elements of which nothing is known.
    unmet_m2: f64,
    /// What was looked at, and what of it is lit: points, or area perpendicular to the source.
    looked: f64,
    seen: f64,
}

/// Of each organ. An element is lit by the part of its points that see the source (of its rays, where the organ has
/// those); one that no point meets is lit as its organ is. So no organ is lit by more than its area.
pub(super) fn of_organs(
    beam: &Beam,
    thin: &Thin,
    scratch: &Scratch,
    lit: &LitAreas,
) -> Vec<SunlitArea> {
    let Beam { frame, areas, .. } = *beam;
    let mut known = vec![Known::default(); frame.organs];
    let mut by_rays = vec![None; frame.area_m2.len()];
    for of in &scratch.lit {
        by_rays[of.element] = Some(of.area_m2);
    }
    for (e, &t) in frame.triangle_of_element.iter().enumerate() {
        let o = frame.organ[t as usize] as usize;
        let (looked, seen) = if thin.organ[o] {
            let projected_m2 = areas.projected_m2(frame, e, beam.towards).abs();
            (projected_m2, by_rays[e].unwrap_or(0.0))
        } else {
            let seen = scratch.visible[2 * e] + scratch.visible[2 * e + 1];
            (f64::from(scratch.met[e]), f64::from(seen))
        };
        let organ = &mut known[o];
        if looked > 0.0 {
            organ.lit_m2 += frame.area_m2[e] * seen / looked;
        } else {
            organ.unmet_m2 += frame.area_m2[e];
        }
        organ.looked += looked;
        organ.seen += seen;
    }
    let mut variances_m4 = vec![0.0; frame.organs];
    for outlines in lit.outlines.chunk_by(|a, b| a.organ == b.organ) {
        let points = outlines::variance(outlines, |_| 1.0);
        variances_m4[outlines[0].organ as usize] += points * lit.line_area_m2 * lit.line_area_m2;
    }
    for unsure in &lit.unsure {
        variances_m4[unsure.organ as usize] += unsure.variance_m4;
    }
    let organs = known.iter().zip(variances_m4).enumerate();
    let sunlit = organs.map(|(o, (known, variance_m4))| {
        let part = known.seen / known.looked.max(f64::MIN_POSITIVE);
        let projected_m2 = thin.projected_m2[o];
        // of the organ, over what it shows of it
        let scale = if projected_m2 > 0.0 {
            areas.organ_m2[o] / projected_m2
        } else {
            0.0
        };
        let of_outline = variance_m4 * scale * scale;
        let variance_m4 = if thin.organ[o] {
            of_outline
        } else {
            // a lattice counts better than points at random, and an outline of its own does not move the part that is lit
            let part = (known.seen + 0.5) / (known.looked + 1.0);
            let at_random = part * (1.0 - part) / known.looked.max(1.0);
            of_outline.min(at_random * areas.organ_m2[o] * areas.organ_m2[o])
        };
        SunlitArea {
            area_m2: known.lit_m2 + part * known.unmet_m2,
            variance_m4,
        }
    });
    sunlit.collect()
}
