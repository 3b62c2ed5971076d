//! The light of one source.

use glam::DVec3;
use nestrad_common::ends::Side;
use nestrad_common::lattice::Lattice;
use nestrad_common::optics::Band;
use nestrad_common::problem::Problem;

use super::Direct;
use super::areas::Areas;
use super::buffer::{Buffer, Top};
use super::outlines::Outlines;
use super::probe::{Probe, Thin};
use crate::world::World;

/// Counters, kept from source to source.
pub(super) struct Scratch {
    buffer: Buffer,
    /// Points that show each face.
    visible: Vec<u32>,
    /// Points that meet each element.
    met: Vec<u32>,
    organ: Vec<OfOrgan>,
    lit: Vec<Lit>,
}

/// What an organ shows to the source.
#[derive(Clone, Copy, Default)]
struct OfOrgan {
    /// By its points.
    seen_m2: f64,
    /// By what its elements got.
    dealt_m2: f64,
    /// Points that meet it, seen or not.
    met: u32,
}

/// What rays say of an organ.
#[derive(Clone, Copy, Default)]
struct Probed {
    /// The part of its area whose rays are cast.
    part: f64,
    rays: f64,
    /// Rays that meet nothing.
    free: f64,
}

/// An element that is lit.
struct Lit {
    element: usize,
    upper: bool,
    /// Perpendicular to the source.
    area_m2: f64,
    variance_m4: f64,
}

impl Scratch {
    pub(super) fn new(world: &World, organs: usize) -> Self {
        Self {
            buffer: Buffer::default(),
            visible: vec![0; world.rows()],
            met: vec![0; world.elements.len()],
            organ: vec![OfOrgan::default(); organs],
            lit: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.lit.clear();
        self.visible.fill(0);
        self.met.fill(0);
        self.organ.fill(OfOrgan::default());
    }
}

/// How a source is drawn.
pub(super) struct Drawn {
    /// Its number.
    pub(super) k: usize,
    /// Cross-section of a line, m².
    pub(super) line_area_m2: f64,
    /// See [`Lattice::new`].
    pub(super) random: [f64; 3],
}

/// Adds the light of a source to `direct`.
pub(super) fn add(
    problem: &Problem,
    world: &World,
    areas: &Areas,
    drawn: &Drawn,
    probe: Option<&Probe>,
    scratch: &mut Scratch,
    direct: &mut Direct,
) {
    let &Drawn {
        k,
        line_area_m2,
        random,
    } = drawn;
    let source = &problem.sources[k];
    let bands = problem.bands.len();
    let towards = -source.direction;
    let lattice = Lattice::new(towards, &world.extent, line_area_m2, random);
    // perpendicular to the source
    let intensity: Vec<f64> = source
        .irradiance_W_m2
        .iter()
        .map(|i| i / towards.z)
        .collect();
    let mut missed = 0u64;
    scratch.clear();
    let mut thin = Thin::of(problem, areas, towards, line_area_m2);
    if probe.is_none() {
        thin.forget();
    }
    let point_W: Vec<f64> = intensity.iter().map(|i| i * lattice.line_area_m2).collect();
    let mut outlines = Outlines::new(problem, world, &thin.organ, lattice.nx, &point_W);
    let Scratch {
        buffer,
        visible,
        met,
        ..
    } = scratch;
    buffer.draw(
        &lattice,
        &world.soup,
        &world.elements,
        world.soil.map(|s| s.z_m),
        |element| met[element as usize] += 1,
        |buffer, rows| {
            let nx = lattice.nx as usize;
            for (r, j) in rows.clone().enumerate() {
                for i in 0..nx {
                    let point = r * nx + i;
                    let top = buffer.top(point);
                    match top {
                        Some(Top { element, upper }) => {
                            let side = if upper { Side::Upper } else { Side::Lower };
                            visible[world.ends.face(element, side) as usize] += 1;
                        }
                        None => match soil_cell(world, &lattice, i, j) {
                            Some(cell) => visible[world.ends.soil(cell) as usize] += 1,
                            None => missed += 1,
                        },
                    }
                    // neighbours to the right and above, within the strip
                    let (at, variance) = ([i, j as usize], &mut direct.organ_variance_W2);
                    if i + 1 < nx {
                        outlines.beside(top, buffer.top(point + 1), at, variance);
                    }
                    if r + 1 < rows.len() {
                        outlines.above(top, buffer.top(point + nx), at, variance);
                    }
                }
            }
        },
    );
    outlines.finish(&mut direct.organ_variance_W2);

    direct.lines += lattice.lines() as u64;
    for (b, i) in intensity.iter().enumerate() {
        let all = lattice.lines() as u64 - if world.extent.periodic { 0 } else { missed };
        direct.incoming_W[b] += i * lattice.line_area_m2 * all as f64;
        if world.extent.periodic {
            direct.passed_W[b] += i * lattice.line_area_m2 * missed as f64;
        }
    }
    let beam = Beam {
        problem,
        world,
        areas,
        k,
        towards,
        line_area_m2: lattice.line_area_m2,
        intensity: &intensity,
    };
    if let Some(probe) = probe.filter(|_| thin.any()) {
        beam.probe(probe, &thin, scratch, direct);
    }
    beam.deal_out(&thin, scratch, direct);
    if let Some(soil) = &world.soil {
        for cell in 0..soil.cells() {
            let row = world.ends.soil(cell) as usize;
            let lit_m2 = f64::from(scratch.visible[row]) * lattice.line_area_m2;
            for (b, i) in intensity.iter().enumerate() {
                direct.irradiance_W_m2[row * bands + b] += i * lit_m2 / soil.cell_area_m2();
            }
        }
    }
}

/// Points that a large element is met by, on average.
const LARGE: f64 = 4.0;

/// A source, and what it is drawn with.
struct Beam<'a> {
    problem: &'a Problem,
    world: &'a World,
    areas: &'a Areas,
    /// Number of the source.
    k: usize,
    towards: DVec3,
    line_area_m2: f64,
    /// Perpendicular to the source, W m⁻², per band.
    intensity: &'a [f64],
}

impl Beam<'_> {
    fn organ_of(&self, t: u32) -> usize {
        self.problem.scene.organ[t as usize] as usize
    }

    fn projected_m2(&self, element: usize) -> f64 {
        self.areas.projected_m2(self.world, element, self.towards)
    }

    /// Lights the organs that are too small for the lattice by rays; what points show of them is
    /// forgotten.
    fn probe(&self, probe: &Probe, thin: &Thin, scratch: &mut Scratch, direct: &mut Direct) {
        let world = self.world;
        let mut organs = vec![Probed::default(); thin.organ.len()];
        let first = scratch.lit.len();
        let mut free_of_rays = Vec::new();
        let (mut shown_m2, mut projected_m2) = (0.0, 0.0);
        for (e, &t) in world.triangle_of_element.iter().enumerate() {
            let o = self.organ_of(t);
            if !thin.organ[o] {
                continue;
            }
            let projected = self.projected_m2(e);
            let points = scratch.visible[2 * e] + scratch.visible[2 * e + 1];
            shown_m2 += f64::from(points) * self.line_area_m2;
            projected_m2 += projected.abs();
            if projected == 0.0 {
                continue;
            }
            let organ = &mut organs[o];
            let to = organ.part + projected.abs() / thin.projected_m2[o];
            let rays = Probe::rays_between(organ.part, to);
            let free = probe.lit(world, e, (self.k, self.towards), rays);
            organ.part = to;
            organ.free += f64::from(free);
            organ.rays += f64::from(rays);
            free_of_rays.push([free, rays].map(f64::from));
            scratch.lit.push(Lit {
                element: e,
                upper: projected > 0.0,
                // as if all of it were lit; what is free of it is known only below
                area_m2: projected.abs(),
                variance_m4: 0.0,
            });
        }
        let mut lit_m2 = 0.0;
        for (lit, [free, rays]) in scratch.lit[first..].iter_mut().zip(free_of_rays) {
            let o = self.organ_of(world.triangle_of_element[lit.element]);
            let (probed, projected_m2) = (&organs[o], lit.area_m2);
            // an element without a ray of its own is as its organ
            lit.area_m2 *= if rays > 0.0 {
                free / rays
            } else {
                probed.free / probed.rays.max(1.0)
            };
            // a few rays that all say the same are no certainty (Jeffreys)
            let part = (probed.free + 0.5) / (probed.rays + 1.0);
            let of_a_ray = part * (1.0 - part);
            lit.variance_m4 = projected_m2 * projected_m2 * of_a_ray / rays.max(1.0);
            // elements that share a ray err together
            let together = projected_m2 * thin.projected_m2[o] * of_a_ray / probed.rays.max(1.0);
            self.add_organ_variance(lit, together, &mut direct.organ_variance_W2);
            lit_m2 += lit.area_m2;
            let organ = &mut scratch.organ[o];
            organ.seen_m2 += lit.area_m2;
            organ.dealt_m2 += lit.area_m2;
        }
        for (b, i) in self.intensity.iter().enumerate() {
            if world.extent.periodic {
                direct.closure_variance_W2[b] += i * i * projected_m2 * self.line_area_m2;
            } else {
                direct.incoming_W[b] += i * (lit_m2 - shown_m2);
            }
        }
    }

    fn add_organ_variance(&self, lit: &Lit, variance_m4: f64, variance_W2: &mut [f64]) {
        let t = self.world.triangle_of_element[lit.element];
        let (bands, material) = (&self.problem.bands, self.problem.scene.material[t as usize]);
        for (b, i) in self.intensity.iter().enumerate() {
            let absorbed = i * absorptance(&bands[b], material as usize, lit.upper);
            variance_W2[self.organ_of(t) * bands.len() + b] += absorbed * absorbed * variance_m4;
        }
    }

    /// Deals the light of each organ out to its elements.
    ///
    /// A large element is lit by its projected area times the part of its points that see the source, a
    /// small one by the area of the points that see it. Which of the two depends on its size alone, so
    /// both are unbiased. What all of an organ's elements get is then scaled to what the organ gets.
    fn deal_out(&self, thin: &Thin, scratch: &mut Scratch, direct: &mut Direct) {
        let (scene, bands) = (&self.problem.scene, self.problem.bands.len());
        let (world, line_area_m2) = (self.world, self.line_area_m2);
        for (e, &t) in world.triangle_of_element.iter().enumerate() {
            scratch.organ[self.organ_of(t)].met += scratch.met[e];
            let seen = f64::from(scratch.visible[2 * e] + scratch.visible[2 * e + 1]);
            // rounding to the lattice may give some area to a triangle without any
            if seen == 0.0 || thin.organ[self.organ_of(t)] || world.elements.area_m2[e] == 0.0 {
                continue;
            }
            let met = f64::from(scratch.met[e]);
            let projected_m2 = self.projected_m2(e);
            let (area_m2, variance_m4) = if projected_m2.abs() > LARGE * line_area_m2 {
                let part = seen / met;
                // binomial, for the points that meet it
                (
                    projected_m2.abs() * part,
                    projected_m2 * projected_m2 * part * (1.0 - part) / met,
                )
            } else {
                (seen * line_area_m2, seen * line_area_m2 * line_area_m2)
            };
            let organ = &mut scratch.organ[self.organ_of(t)];
            organ.seen_m2 += seen * line_area_m2;
            organ.dealt_m2 += area_m2;
            scratch.lit.push(Lit {
                element: e,
                upper: projected_m2 > 0.0,
                area_m2,
                variance_m4,
            });
        }
        for lit in scratch.lit.iter().filter(|lit| lit.area_m2 > 0.0) {
            let t = world.triangle_of_element[lit.element];
            let organ = &scratch.organ[self.organ_of(t)];
            let row = 2 * lit.element + usize::from(!lit.upper);
            let irradiated =
                lit.area_m2 * organ.seen_m2 / organ.dealt_m2 / world.elements.area_m2[lit.element];
            for (b, i) in self.intensity.iter().enumerate() {
                direct.irradiance_W_m2[row * bands + b] += i * irradiated;
            }
        }
        // what no point meets gets nothing, which may be wrong by all of it
        for (e, &t) in world.triangle_of_element.iter().enumerate() {
            let o = self.organ_of(t);
            if scratch.met[e] > 0 || thin.organ[o] {
                continue;
            }
            let projected_m2 = self.projected_m2(e);
            if projected_m2 == 0.0 {
                continue;
            }
            let visible = (scratch.organ[o].seen_m2 / thin.projected_m2[o]).min(1.0);
            let unmet = scratch.organ[o].met == 0;
            let lit = Lit {
                element: e,
                upper: projected_m2 > 0.0,
                area_m2: 0.0,
                variance_m4: projected_m2.abs() * line_area_m2 * if unmet { 1.0 } else { visible },
            };
            if unmet {
                self.add_organ_variance(&lit, lit.variance_m4, &mut direct.organ_variance_W2);
            }
            scratch.lit.push(lit);
        }
        for lit in &scratch.lit {
            let t = world.triangle_of_element[lit.element] as usize;
            for (b, i) in self.intensity.iter().enumerate() {
                let absorbed = i * absorptance(
                    &self.problem.bands[b],
                    scene.material[t] as usize,
                    lit.upper,
                );
                direct.element_variance_W2[lit.element * bands + b] +=
                    absorbed * absorbed * lit.variance_m4;
            }
        }
    }
}

pub(super) fn absorptance(band: &Band, material: usize, upper: bool) -> f64 {
    let optics = &band.materials[material];
    if upper {
        optics.upper.absorptance()
    } else {
        optics.lower.absorptance()
    }
}

fn soil_cell(world: &World, lattice: &Lattice, i: usize, j: u32) -> Option<u32> {
    let soil = world.soil.as_ref()?;
    let at = lattice.point_at(i as f64, f64::from(j), soil.z_m);
    soil.cell_at(at.truncate(), world.extent.periodic)
}
