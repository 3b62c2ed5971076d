//! E0, the uncollided light: for every source the canopy is projected along its direction, and what
//! is on top keeps the light (DESIGN: sections 2 and 4).
//!
//! An organ gets the light of the lattice points that it shows, which sums to the incoming light
//! exactly; where only a few organs are too small for the lattice, these are probed with rays instead.
//! Within an organ, light is dealt out by how much of each element is seen (visible points over all of
//! its points), so a fully lit leaf is evenly lit however few points its elements have.

mod areas;
mod buffer;
mod outlines;
mod probe;
mod sky;
mod source;

use nestrad_common::directions::{Purpose, stream};
use nestrad_common::lattice::Extent;
use nestrad_common::light::Source;
use nestrad_common::problem::Problem;
use nestrad_worker::BlockFault;
use rand::RngExt;
use rayon::prelude::*;
use thiserror::Error;

use crate::output::progress::Cancelled;
use crate::world::World;
use areas::Areas;
use probe::Probe;

/// Uncollided light on everything that has a row.
#[derive(Clone, Debug, Default)]
pub struct Direct {
    /// W m⁻² of one-sided area, indexed `row * bands + band`.
    pub irradiance_W_m2: Vec<f64>,
    /// Variance of what each organ absorbs of it, W², indexed `organ * bands + band`.
    pub organ_variance_W2: Vec<f64>,
    /// Variance of what each element absorbs of it, W², indexed `element * bands + band`.
    pub element_variance_W2: Vec<f64>,
    /// Light that comes in, W per band: on the pattern, or on all that an open scene intercepts.
    pub incoming_W: Vec<f64>,
    /// Variance of how much of the light that comes in is not accounted for, W² per band.
    pub closure_variance_W2: Vec<f64>,
    /// Light that passes an open pattern without soil, W per band.
    pub passed_W: Vec<f64>,
    /// Lattice points that were drawn.
    pub lines: u64,
    /// What every other direction of a sky, and the others, would make organs absorb if they stood for all of
    /// it, W, indexed `organ * bands + band`; empty without such a sky.
    pub sky_halves_W: [Vec<f64>; 2],
}

impl Direct {
    /// Whether a row is lit in any band: a face or the face behind it, which light passes to, or a cell of soil.
    pub fn reaches(&self, row: usize) -> bool {
        let bands = self.incoming_W.len();
        let faces = 2 * self.element_variance_W2.len() / bands.max(1);
        let (first, rows) = if row < faces { (row & !1, 2) } else { (row, 1) };
        let on = &self.irradiance_W_m2[first * bands..(first + rows) * bands];
        on.iter().any(|&e| e > 0.0)
    }
}

/// Sources are worked off in this many groups, an even number, each in order, which are then added in order: so the
/// result does not depend on the number of threads.
const GROUPS: usize = 8;

/// Why there is no direct light.
#[derive(Debug, Error)]
pub enum DirectError {
    /// The kernel refused the scene.
    #[error("rays for what is too small for the lattice refused")]
    Block(#[from] BlockFault),
    /// It is not wanted any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Projects every source. `line_area_m2` holds, per source, the cross-section of a line (m²); `step` is asked
/// before each of them.
pub fn direct_light(
    problem: &Problem,
    world: &World,
    line_area_m2: &[f64],
    seed: u64,
    step: impl Fn() -> Result<(), Cancelled> + Sync,
) -> Result<Direct, DirectError> {
    let areas = Areas::of(problem);
    let probe = Probe::new(problem, world, &areas, line_area_m2, seed)?;
    let parts: Result<Vec<Direct>, Cancelled> = groups(problem)
        .into_par_iter()
        .map(|group| {
            let mut part = empty(problem, world);
            let mut scratch = source::Scratch::new(world, problem.scene.organs.len());
            for k in group {
                step()?;
                let mut rng = stream(seed, Purpose::Direct, k as u64);
                let random = [rng.random(), rng.random(), 0.5];
                let drawn = source::Drawn {
                    k,
                    line_area_m2: line_area_m2[k],
                    random,
                };
                source::add(
                    problem,
                    world,
                    &areas,
                    &drawn,
                    probe.as_ref(),
                    &mut scratch,
                    &mut part,
                );
            }
            Ok(part)
        })
        .collect();
    let parts = parts?;
    let mut sum = empty(problem, world);
    for part in &parts {
        let add =
            |to: &mut Vec<f64>, from: &Vec<f64>| to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
        add(&mut sum.irradiance_W_m2, &part.irradiance_W_m2);
        add(&mut sum.organ_variance_W2, &part.organ_variance_W2);
        add(&mut sum.element_variance_W2, &part.element_variance_W2);
        add(&mut sum.incoming_W, &part.incoming_W);
        add(&mut sum.closure_variance_W2, &part.closure_variance_W2);
        add(&mut sum.passed_W, &part.passed_W);
        sum.lines += part.lines;
    }
    sum.sky_halves_W = sky::halves_W(problem, world, &parts);
    Ok(sum)
}

/// The numbers of the sources of each group: those of a sky's directions apart from the others.
fn groups(problem: &Problem) -> Vec<Vec<usize>> {
    let (sky, all) = (problem.sky_directions, problem.sources.len());
    let dealt = |from: usize, to: usize| {
        (0..GROUPS.min(to - from)).map(move |g| (from + g..to).step_by(GROUPS).collect())
    };
    dealt(0, sky).chain(dealt(sky, all)).collect()
}

fn empty(problem: &Problem, world: &World) -> Direct {
    let bands = problem.bands.len();
    Direct {
        irradiance_W_m2: vec![0.0; world.rows() * bands],
        organ_variance_W2: vec![0.0; problem.scene.organs.len() * bands],
        element_variance_W2: vec![0.0; world.elements.len() * bands],
        incoming_W: vec![0.0; bands],
        closure_variance_W2: vec![0.0; bands],
        passed_W: vec![0.0; bands],
        lines: 0,
        sky_halves_W: Default::default(),
    }
}

/// Cross-section of the lines of each source, m², so that all of them together cost what the
/// strongest alone would cost at `finest_m2` several times over, and err least.
///
/// The variance of an organ's light goes with `I² a^(3/2)` (I: irradiance perpendicular to the
/// source, a: cross-section; the variance of an area measured by a lattice of points, Gundersen &
/// Jensen 1987), the cost with `1/a`; the least variance for a given cost has `a ~ I^(-4/5)`.
pub fn spread_effort(
    problem: &Problem,
    extent: &Extent,
    finest_m2: f64,
    ground_area_m2: f64,
) -> Vec<f64> {
    let intensity: Vec<f64> = problem
        .sources
        .iter()
        .map(|s| s.irradiance_W_m2.iter().sum::<f64>() / -s.direction.z)
        .collect();
    let strongest = intensity.iter().copied().fold(0.0, f64::max);
    let finest_m2 = finest_m2 * coarser_by_number(&intensity[..problem.sky_directions]);
    let wanted: Vec<f64> = problem
        .sources
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
    let all: f64 = problem.sources.iter().zip(&wanted).map(points).sum();
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
