//! E0, the uncollided light: for every source the canopy is projected along its direction, and what
//! is on top keeps the light (DESIGN: sections 2 and 4).
//!
//! An organ gets the light of the lattice points that it shows, which sums to the incoming light
//! exactly; where only a few organs are too small for the lattice, these are probed with rays instead.
//! Within an organ, light is dealt out by how much of each element is seen (visible points over all of
//! its points), so a fully lit leaf is evenly lit however few points its elements have.
//!
//! A direction gives lit areas (`lit_areas.rs`); watts come in with the light of a source.

mod areas;
mod classes;
mod coloured;
mod dealing;
mod effort;
mod kept;
mod lit_areas;
mod outlines;
mod probe;
mod projection;
mod shadow;
mod shares;
mod sky;
mod sunlit;
mod systematic;
mod tally;

use std::sync::OnceLock;

use nestrad_common::light::{Source, Sources};
use nestrad_common::optics::Optics;
use nestrad_kernel::directions::{Purpose, stream};
use rand::RngExt;
use rayon::prelude::*;

pub use effort::spread_effort;
pub use kept::KeptDirections;
pub use lit_areas::SunlitArea;
pub use shares::ShareVariances;

use crate::frame::Frame;
use crate::stop::Stopped;
use areas::Areas;
use classes::{Classes, Face};
use coloured::{Coloured, are_alike};
use lit_areas::{LitAreas, Scratch};
use probe::{Probe, Thin};
use projection::Projection;

/// Uncollided light on everything that has a row.
#[derive(Clone, Debug, Default)]
pub struct Direct {
    /// W m⁻² of one-sided area, indexed `row * bands + band`.
    pub irradiance_W_m2: Vec<f64>,
    /// Variance of what each organ absorbs of it, W², indexed `organ * bands + band`.
    pub organ_variance_W2: Vec<f64>,
    /// Variance of what each element absorbs of it, W², indexed `element * bands + band`.
    pub element_variance_W2: Vec<f64>,
    /// Light that plants keep from the soil around the map of an open scene, W m⁻² of a zone of it, indexed
    /// `zone * bands + band`.
    pub shade_W_m2: Vec<f64>,
    /// Light that comes in, W per band: on the pattern, or on all that an open scene intercepts.
    pub incoming_W: Vec<f64>,
    /// How well it is known what it is shared out to, per band.
    pub share_variances: Vec<ShareVariances>,
    /// Variance of the irradiance of each soil cell, W² m⁻⁴, indexed `cell * bands + band`.
    pub soil_variance_W2_m4: Vec<f64>,
    /// Variance of how much of the light that comes in is not accounted for, W² per band.
    pub closure_variance_W2: Vec<f64>,
    /// Light that passes an open pattern without soil, W per band.
    pub passed_W: Vec<f64>,
    /// Lattice points that were drawn.
    pub lines: u64,
    /// What every other direction of a sky, and the others, would make organs absorb if they stood for all of
    /// it, W, indexed `organ * bands + band`; empty without such a sky.
    pub sky_halves_W: [Vec<f64>; 2],
    /// What the sun reaches of each organ: see [`SunlitArea`]. Empty without a sun.
    pub sunlit: Vec<SunlitArea>,
}

/// Sources are worked off in this many groups, an even number, each in order, which are then added in order: so the
/// result does not depend on the number of threads.
pub(crate) const GROUPS: usize = 8;

/// Projects every source on a frame, with optics in its order. `line_area_m2` holds, per source, the cross-section
/// of a line (m²); `step` is asked before each of them.
pub fn direct_light(
    frame: &Frame,
    optics: &Optics,
    projections: (&Sources, &[f64]),
    seed: u64,
    step: impl Fn() -> Result<(), Stopped> + Sync,
) -> Result<Direct, Stopped> {
    let kept = KeptDirections::default();
    direct_light_keeping(frame, optics, projections, seed, &kept, step)
}

/// The same; what a direction lights is projected once, and kept for this frame if there is room.
pub fn direct_light_keeping(
    frame: &Frame,
    optics: &Optics,
    (sources, line_area_m2): (&Sources, &[f64]),
    seed: u64,
    kept: &KeptDirections,
    step: impl Fn() -> Result<(), Stopped> + Sync,
) -> Result<Direct, Stopped> {
    let (areas, classes) = (Areas::of(frame), Classes::of(frame));
    let thin = |source: &Source, line_area_m2: f64| {
        kept.thin(-source.direction, line_area_m2, || {
            Thin::of(frame, &areas, -source.direction, line_area_m2).count()
        })
    };
    let of_this_light = OnceLock::new();
    let tracer = kept.tracer().unwrap_or(&of_this_light);
    let probe = Probe::new((&sources.list, line_area_m2), thin, (tracer, seed));
    kept.next_light();
    let sun = sunlit::sun_of(sources);
    let parts: Result<Vec<Direct>, Stopped> = groups(sources)
        .into_par_iter()
        .map(|group| {
            let mut part = Direct::dark(frame, optics);
            let mut scratch = Scratch::new(frame, &classes);
            let mut coloured = Coloured::dark(frame, optics.len());
            let alike = |&a: &usize, &b: &usize| are_alike(&sources.list[a], &sources.list[b]);
            for of_colour in group.chunk_by(alike) {
                for &k in of_colour {
                    step()?;
                    let mut rng = stream(seed, Purpose::Direct, k as u64);
                    let source = &sources.list[k];
                    let projection = Projection {
                        k,
                        towards: -source.direction,
                        line_area_m2: line_area_m2[k],
                        random: rng.random(),
                        is_sun: sun == Some(k),
                    };
                    let lit = kept.lit_areas(&projection, seed, probe.serves(k), || {
                        projection.lit_areas(frame, (&areas, &classes), &probe, &mut scratch)
                    });
                    part.add(frame, optics, &lit, source);
                    coloured.add(frame, &lit, source);
                    part.sunlit.extend_from_slice(&lit.sunlit);
                }
                coloured.pour(frame, optics, &mut part);
            }
            Ok(part)
        })
        .collect();
    let parts = parts?;
    let mut sum = Direct::dark(frame, optics);
    for part in &parts {
        let add =
            |to: &mut Vec<f64>, from: &Vec<f64>| to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
        add(&mut sum.irradiance_W_m2, &part.irradiance_W_m2);
        add(&mut sum.organ_variance_W2, &part.organ_variance_W2);
        add(&mut sum.element_variance_W2, &part.element_variance_W2);
        add(&mut sum.shade_W_m2, &part.shade_W_m2);
        add(&mut sum.incoming_W, &part.incoming_W);
        add(&mut sum.closure_variance_W2, &part.closure_variance_W2);
        add(&mut sum.soil_variance_W2_m4, &part.soil_variance_W2_m4);
        for (sum, part) in sum.share_variances.iter_mut().zip(&part.share_variances) {
            sum.add(part);
        }
        add(&mut sum.passed_W, &part.passed_W);
        sum.lines += part.lines;
        sum.sunlit.extend_from_slice(&part.sunlit);
    }
    let of_sky = &parts[..GROUPS.min(sources.sky_directions)];
    let of_sky: Vec<&[f64]> = of_sky.iter().map(|p| &p.irradiance_W_m2[..]).collect();
    sum.sky_halves_W = sky::halves_W(frame, optics, sources, &of_sky);
    Ok(sum)
}

/// The numbers of the sources of each group: those of a sky's directions apart from the others.
fn groups(sources: &Sources) -> Vec<Vec<usize>> {
    let (sky, all) = (sources.sky_directions, sources.list.len());
    let dealt = |from: usize, to: usize| {
        (0..GROUPS.min(to - from)).map(move |g| (from + g..to).step_by(GROUPS).collect())
    };
    dealt(0, sky).chain(dealt(sky, all)).collect()
}

impl Direct {
    fn dark(frame: &Frame, optics: &Optics) -> Self {
        let bands = optics.len();
        Self {
            irradiance_W_m2: vec![0.0; frame.rows() * bands],
            organ_variance_W2: vec![0.0; frame.organs * bands],
            element_variance_W2: vec![0.0; frame.area_m2.len() * bands],
            shade_W_m2: vec![0.0; frame.ends.outer_zones as usize * bands],
            incoming_W: vec![0.0; bands],
            closure_variance_W2: vec![0.0; bands],
            share_variances: vec![ShareVariances::dark(frame.materials.len()); bands],
            soil_variance_W2_m4: vec![0.0; frame.ends.soil_cells as usize * bands],
            passed_W: vec![0.0; bands],
            lines: 0,
            sky_halves_W: Default::default(),
            sunlit: Vec::new(),
        }
    }

    /// Whether a row is lit in any band: a face or the face behind it, which light passes to, or a cell of soil.
    pub fn reaches(&self, row: usize) -> bool {
        let bands = self.incoming_W.len();
        let faces = 2 * self.element_variance_W2.len() / bands.max(1);
        let (first, rows) = if row < faces { (row & !1, 2) } else { (row, 1) };
        let on = &self.irradiance_W_m2[first * bands..(first + rows) * bands];
        on.iter().any(|&e| e > 0.0)
    }

    /// Adds what does not go to single rows of the light of a source.
    fn add(&mut self, frame: &Frame, optics: &Optics, lit: &LitAreas, source: &Source) {
        self.lines += lit.lines;
        let bands = optics.len();
        let periodic = frame.world.extent.periodic;
        for (b, band) in optics.bands.iter().enumerate() {
            // perpendicular to the source
            let intensity = source.irradiance_W_m2[b] / lit.towards.z;
            let point_W = intensity * lit.line_area_m2;
            let absorptance = |face: Face| match face {
                Face::Leaf { material, upper } => {
                    band.materials[material as usize].absorptance(upper)
                }
                Face::Soil => 0.0,
            };
            for outlines in lit.outlines.chunk_by(|a, b| a.organ == b.organ) {
                let variance = outlines::variance(outlines, absorptance);
                self.organ_variance_W2[outlines[0].organ as usize * bands + b] +=
                    variance * point_W * point_W;
            }
            self.share_variances[b].add_direction(frame, band, &lit.scene, point_W);
            let all = lit.lines - if periodic { 0 } else { lit.missed };
            self.incoming_W[b] += point_W * all as f64;
            if periodic {
                self.passed_W[b] += point_W * lit.missed as f64;
            }
            for unsure in &lit.unsure {
                let face = &band.materials[unsure.material as usize];
                let absorbed = intensity * face.absorptance(unsure.upper);
                self.organ_variance_W2[unsure.organ as usize * bands + b] +=
                    absorbed * absorbed * unsure.variance_m4;
            }
            if let Some([projected_m2, lit_m2, shown_m2]) = lit.probed_m2 {
                if periodic {
                    self.closure_variance_W2[b] +=
                        intensity * intensity * projected_m2 * lit.line_area_m2;
                } else {
                    self.incoming_W[b] += intensity * (lit_m2 - shown_m2);
                }
            }
        }
    }
}
