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
    /// Per organ: points that show it, points that meet it.
    organ: Vec<[u64; 2]>,
    /// Per organ: light by the elements' visible parts, W for unit irradiance.
    dealt: Vec<f64>,
}

impl Scratch {
    pub(super) fn new(world: &World, organs: usize) -> Self {
        Self {
            buffer: Buffer::default(),
            visible: vec![0; world.rows()],
            met: vec![0; world.elements.len()],
            organ: vec![[0; 2]; organs],
            dealt: vec![0.0; organs],
        }
    }

    fn clear(&mut self) {
        self.visible.fill(0);
        self.met.fill(0);
        self.organ.fill([0; 2]);
        self.dealt.fill(0.0);
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
    let (scene, bands) = (&problem.scene, problem.bands.len());
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
        &scene.triangles,
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

    deal_out(problem, world, towards, scratch);
    direct.lines += lattice.lines() as u64;
    for (b, i) in intensity.iter().enumerate() {
        let all = lattice.lines() as u64 - if world.extent.periodic { 0 } else { missed };
        direct.incoming_W[b] += i * lattice.line_area_m2 * all as f64;
        if world.extent.periodic {
            direct.passed_W[b] += i * lattice.line_area_m2 * missed as f64;
        }
    }
    for e in 0..world.elements.len() {
        let t = world.triangle_of_element[e] as usize;
        let area = world.elements.area_m2[e];
        let o = scene.organ[t] as usize;
        if scratch.dealt[o] <= 0.0 || area <= 0.0 {
            continue;
        }
        let projected = projected_area(&scene.triangles[t], world.elements.divisions[t], towards);
        let scale = scratch.organ[o][0] as f64 * lattice.line_area_m2 / scratch.dealt[o];
        let (met, lit) = seen_part(scratch, e, o);
        let face = if projected > 0.0 { 2 * e } else { 2 * e + 1 };
        let optics = scene.material[t] as usize;
        for (b, i) in intensity.iter().enumerate() {
            direct.irradiance_W_m2[face * bands + b] += i * scale * projected.abs() * lit / area;
            let absorbed =
                i * projected.abs() * absorptance(&problem.bands[b], optics, face % 2 == 0);
            // binomial, for the points that meet it
            direct.element_variance_W2[e * bands + b] +=
                absorbed * absorbed * lit * (1.0 - lit) / met.max(1.0);
        }
    }
    if let Some(soil) = &world.soil {
        for cell in 0..soil.cells() {
            let row = world.ends.soil(cell) as usize;
            let points = f64::from(scratch.visible[row]);
            for (b, i) in intensity.iter().enumerate() {
                direct.irradiance_W_m2[row * bands + b] +=
                    i * points * lattice.line_area_m2 / soil.cell_area_m2();
            }
        }
    }
}

/// Projected area of an element, m²; negative when the lower face looks towards the source.
fn projected_area(triangle: &[DVec3; 3], divisions: u32, towards: DVec3) -> f64 {
    0.5 * geometry::doubled_area_vector(triangle).dot(towards) / f64::from(divisions * divisions)
}

fn absorptance(band: &Band, material: usize, upper: bool) -> f64 {
    let optics = &band.materials[material];
    if upper {
        optics.upper.absorptance()
    } else {
        optics.lower.absorptance()
    }
}

/// How many points meet an element, and the part of them that see it. An element that no point meets
/// is taken to be seen as its organ is.
fn seen_part(scratch: &Scratch, element: usize, organ: usize) -> (f64, f64) {
    let met = scratch.met[element];
    let seen = scratch.visible[2 * element] + scratch.visible[2 * element + 1];
    let [organ_seen, organ_met] = scratch.organ[organ];
    if met > 0 {
        (f64::from(met), f64::from(seen) / f64::from(met))
    } else if organ_met > 0 {
        (0.0, organ_seen as f64 / organ_met as f64)
    } else {
        (0.0, 0.0)
    }
}

/// Sums per organ what its elements show.
fn deal_out(problem: &Problem, world: &World, towards: DVec3, scratch: &mut Scratch) {
    let scene = &problem.scene;
    for e in 0..world.elements.len() {
        let o = scene.organ[world.triangle_of_element[e] as usize] as usize;
        scratch.organ[o][0] += u64::from(scratch.visible[2 * e] + scratch.visible[2 * e + 1]);
        scratch.organ[o][1] += u64::from(scratch.met[e]);
    }
    for e in 0..world.elements.len() {
        let t = world.triangle_of_element[e] as usize;
        let o = scene.organ[t] as usize;
        let (_, lit) = seen_part(scratch, e, o);
        scratch.dealt[o] +=
            lit * projected_area(&scene.triangles[t], world.elements.divisions[t], towards).abs();
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
