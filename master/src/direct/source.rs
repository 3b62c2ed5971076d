//! The light of one source.

use glam::DVec3;
use nestrad_common::ends::Side;
use nestrad_common::geometry;
use nestrad_common::lattice::Lattice;
use nestrad_common::optics::Band;
use nestrad_common::problem::Problem;

use super::Direct;
use super::buffer::{Buffer, Top};
use crate::world::World;

/// Variance of an area that is measured by counting points of a square lattice of spacing h:
/// `0.0724 h³ P`, P the length of its outline (Gundersen & Jensen 1987, after Matérn); and a lattice
/// counts `4/pi P/h` neighbours across an outline of any direction.
const VARIANCE_PER_CROSSING: f64 = 0.0724 * std::f64::consts::FRAC_PI_4;

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
        self.visible.fill(0);
        self.met.fill(0);
        self.organ.fill(OfOrgan::default());
    }
}

/// Adds the light of source `k` to `direct`.
pub(super) fn add(
    problem: &Problem,
    world: &World,
    k: usize,
    line_area_m2: f64,
    random: [f64; 3],
    scratch: &mut Scratch,
    direct: &mut Direct,
) {
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
    let crossings = Crossings {
        problem,
        world,
        scale: intensity
            .iter()
            .map(|i| VARIANCE_PER_CROSSING * (i * lattice.line_area_m2).powi(2))
            .collect(),
    };
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
                    if i + 1 < nx {
                        crossings.count(top, buffer.top(point + 1), &mut direct.organ_variance_W2);
                    }
                    if r + 1 < rows.len() {
                        crossings.count(top, buffer.top(point + nx), &mut direct.organ_variance_W2);
                    }
                }
            }
        },
    );

    direct.lines += lattice.lines() as u64;
    for (b, i) in intensity.iter().enumerate() {
        let all = lattice.lines() as u64 - if world.extent.periodic { 0 } else { missed };
        direct.incoming_W[b] += i * lattice.line_area_m2 * all as f64;
        if world.extent.periodic {
            direct.passed_W[b] += i * lattice.line_area_m2 * missed as f64;
        }
    }
    deal_out(
        problem,
        world,
        towards,
        lattice.line_area_m2,
        &intensity,
        scratch,
        direct,
    );
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

/// Deals the light of each organ out to its elements.
///
/// A large element is lit by its projected area times the part of its points that see the source, a
/// small one by the area of the points that see it. Which of the two depends on its size alone, so both
/// are unbiased. What all of an organ's elements get is then scaled to what the organ gets.
fn deal_out(
    problem: &Problem,
    world: &World,
    towards: DVec3,
    line_area_m2: f64,
    intensity: &[f64],
    scratch: &mut Scratch,
    direct: &mut Direct,
) {
    let (scene, bands) = (&problem.scene, problem.bands.len());
    let organ_of = |t: u32| scene.organ[t as usize] as usize;
    scratch.lit.clear();
    for (e, &t) in world.triangle_of_element.iter().enumerate() {
        let seen = f64::from(scratch.visible[2 * e] + scratch.visible[2 * e + 1]);
        if seen == 0.0 {
            continue;
        }
        let met = f64::from(scratch.met[e]);
        let projected_m2 = projected_area_m2(world, &scene.triangles, e, towards);
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
        let organ = &mut scratch.organ[organ_of(t)];
        organ.seen_m2 += seen * line_area_m2;
        organ.dealt_m2 += area_m2;
        scratch.lit.push(Lit {
            element: e,
            upper: projected_m2 > 0.0,
            area_m2,
            variance_m4,
        });
    }
    for lit in &scratch.lit {
        let t = world.triangle_of_element[lit.element];
        let organ = &scratch.organ[organ_of(t)];
        let row = 2 * lit.element + usize::from(!lit.upper);
        let irradiated =
            lit.area_m2 * organ.seen_m2 / organ.dealt_m2 / world.elements.area_m2[lit.element];
        for (b, i) in intensity.iter().enumerate() {
            direct.irradiance_W_m2[row * bands + b] += i * irradiated;
            let absorbed = i * absorptance(
                &problem.bands[b],
                scene.material[t as usize] as usize,
                lit.upper,
            );
            direct.element_variance_W2[lit.element * bands + b] +=
                absorbed * absorbed * lit.variance_m4;
        }
    }
}

/// Projected area of an element; negative when the lower face looks towards the source.
fn projected_area_m2(
    world: &World,
    triangles: &[[DVec3; 3]],
    element: usize,
    towards: DVec3,
) -> f64 {
    let t = world.triangle_of_element[element] as usize;
    let n = world.elements.divisions[t];
    0.5 * geometry::doubled_area_vector(&triangles[t]).dot(towards) / f64::from(n * n)
}

fn absorptance(band: &Band, material: usize, upper: bool) -> f64 {
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

/// Counts neighbours across the outlines of organs.
struct Crossings<'a> {
    problem: &'a Problem,
    world: &'a World,
    /// Variance of one crossing of unit absorptance, W², per band.
    scale: Vec<f64>,
}

impl Crossings<'_> {
    fn count(&self, a: Option<Top>, b: Option<Top>, variance_W2: &mut [f64]) {
        if a == b {
            return;
        }
        let scene = &self.problem.scene;
        let at = |top: Top| {
            let t = self.world.triangle_of_element[top.element as usize] as usize;
            (
                scene.organ[t] as usize,
                scene.material[t] as usize,
                top.upper,
            )
        };
        let (a, b) = (a.map(at), b.map(at));
        if a == b {
            return;
        }
        let bands = self.scale.len();
        let same_organ = matches!((a, b), (Some(a), Some(b)) if a.0 == b.0);
        for (band, scale) in self
            .problem
            .bands
            .iter()
            .enumerate()
            .map(|(k, b)| (b, (k, self.scale[k])))
        {
            let (k, scale) = scale;
            let value = |side: Option<(usize, usize, bool)>| {
                side.map_or(0.0, |(_, m, upper)| absorptance(band, m, upper))
            };
            if same_organ {
                if let Some((o, ..)) = a {
                    variance_W2[o * bands + k] += scale * (value(a) - value(b)).powi(2);
                }
            } else {
                for side in [a, b] {
                    if let Some((o, ..)) = side {
                        variance_W2[o * bands + k] += scale * value(side).powi(2);
                    }
                }
            }
        }
    }
}
