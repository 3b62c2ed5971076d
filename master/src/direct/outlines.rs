//! How well a lattice counts the area of an organ: from its outline.

use nestrad_common::optics::Band;
use nestrad_common::problem::Problem;

use super::buffer::Top;
use super::source::absorptance;
use crate::world::World;

/// Variance of an area that is measured by counting points of a square lattice of spacing h:
/// `0.0724 h³ P`, P the length of its outline (Gundersen & Jensen 1987, after Matérn); and a lattice
/// counts `4/pi P/h` neighbours across an outline of any direction.
const VARIANCE_PER_CROSSING: f64 = 0.0724 * std::f64::consts::FRAC_PI_4;

/// That is so on average over directions. An outline that runs along the rows of the lattice is counted
/// one row too far or too short as a whole: between two such ends, of any distance, a row of n points is
/// missed with variance n²/6 on average.
const VARIANCE_OF_ROW: f64 = 1.0 / 6.0;

/// An outline runs along the rows where one of its rows has this part of all neighbours across it. Of a
/// disc it is a tenth, of a square that stands at an angle still less.
const ALONG_ROWS: f64 = 0.3;

/// An organ's side at a point: organ, material, and whether it is the upper face.
type Side = (usize, usize, bool);

/// What differs between neighbours.
type Pair = (Option<Side>, Option<Side>);

/// Counts neighbours across the outlines of organs.
pub(super) struct Outlines<'a> {
    problem: &'a Problem,
    world: &'a World,
    /// Organs whose light is not counted by points.
    thin: &'a [bool],
    /// Variance of one point of unit absorptance, W², per band.
    point_W2: Vec<f64>,
    /// The last pair across a row, by column, and the row; and the same across columns.
    last_in_row: Option<Run>,
    last_in_column: Vec<Option<Run>>,
    /// Neighbours across the outline of each organ, across rows and across columns.
    organ: Vec<[Across; 2]>,
}

/// Neighbours one after the other that differ in the same way.
#[derive(Clone, Copy)]
struct Run {
    pair: Pair,
    /// Of the latest.
    at: [usize; 2],
    length: u32,
}

/// What is known of an organ's outline in one direction.
#[derive(Clone, Copy, Default)]
struct Across {
    all: u32,
    longest: Option<Run>,
}

impl<'a> Outlines<'a> {
    /// `point_W`: power of a point, per band.
    pub(super) fn new(
        problem: &'a Problem,
        world: &'a World,
        thin: &'a [bool],
        columns: u32,
        point_W: &[f64],
    ) -> Self {
        Self {
            problem,
            world,
            thin,
            point_W2: point_W.iter().map(|w| w * w).collect(),
            last_in_row: None,
            last_in_column: vec![None; columns as usize],
            organ: vec![Default::default(); problem.scene.organs.len()],
        }
    }

    /// Neighbours above each other, the lower one at this column and row.
    pub(super) fn above(
        &mut self,
        a: Option<Top>,
        b: Option<Top>,
        at: [usize; 2],
        variance_W2: &mut [f64],
    ) {
        if let Some(pair) = self.differ(a, b) {
            let run = follow(self.last_in_row, pair, at, [at[0].wrapping_sub(1), at[1]]);
            self.last_in_row = Some(run);
            self.count(run, 0, variance_W2);
        }
    }

    /// Neighbours beside each other, the left one at this column and row.
    pub(super) fn beside(
        &mut self,
        a: Option<Top>,
        b: Option<Top>,
        at: [usize; 2],
        variance_W2: &mut [f64],
    ) {
        if let Some(pair) = self.differ(a, b) {
            let last = &mut self.last_in_column[at[0]];
            let run = follow(*last, pair, at, [at[0], at[1].wrapping_sub(1)]);
            *last = Some(run);
            self.count(run, 1, variance_W2);
        }
    }

    fn differ(&self, a: Option<Top>, b: Option<Top>) -> Option<Pair> {
        if a == b {
            return None;
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
        let pair = (a.map(at), b.map(at));
        (pair.0 != pair.1).then_some(pair)
    }

    /// Adds a crossing to the variances, and its run to what is known of its organs.
    fn count(&mut self, run: Run, across: usize, variance_W2: &mut [f64]) {
        self.add(run.pair, VARIANCE_PER_CROSSING, None, variance_W2);
        for organ in organs(run.pair).into_iter().flatten() {
            let of = &mut self.organ[organ][across];
            of.all += 1;
            if of.longest.is_none_or(|longest| run.length > longest.length) {
                of.longest = Some(run);
            }
        }
    }

    /// Adds what outlines along the rows leave uncertain.
    pub(super) fn finish(&self, variance_W2: &mut [f64]) {
        for (organ, across) in self.organ.iter().enumerate() {
            for of in across {
                let Some(run) = of.longest else { continue };
                let length = f64::from(run.length);
                if length > ALONG_ROWS * f64::from(of.all) {
                    let times = VARIANCE_OF_ROW * length * length;
                    self.add(run.pair, times, Some(organ), variance_W2);
                }
            }
        }
    }

    /// Adds so many times the variance of a point to the organs of a pair, or to one of them.
    fn add(&self, pair: Pair, times: f64, only: Option<usize>, variance_W2: &mut [f64]) {
        let bands = self.point_W2.len();
        let mut to = |organ: usize, weight: &dyn Fn(&Band) -> f64| {
            if self.thin[organ] || only.is_some_and(|only| only != organ) {
                return;
            }
            for (k, band) in self.problem.bands.iter().enumerate() {
                variance_W2[organ * bands + k] += times * self.point_W2[k] * weight(band).powi(2);
            }
        };
        let value = |side: Side, band: &Band| absorptance(band, side.1, side.2);
        match pair {
            (Some(a), Some(b)) if a.0 == b.0 => to(a.0, &|band| value(a, band) - value(b, band)),
            (a, b) => {
                for side in [a, b].into_iter().flatten() {
                    to(side.0, &|band| value(side, band));
                }
            }
        }
    }
}

/// The organs of a pair, each once.
fn organs((a, b): Pair) -> [Option<usize>; 2] {
    let [a, b] = [a, b].map(|side| side.map(|(organ, ..)| organ));
    [a, if a == b { None } else { b }]
}

/// The run that a pair goes on with, if the last one differed in the same way just before, or begins.
fn follow(last: Option<Run>, pair: Pair, at: [usize; 2], before: [usize; 2]) -> Run {
    let length = match last {
        Some(run) if run.pair == pair && run.at == before => run.length + 1,
        _ => 1,
    };
    Run { pair, at, length }
}
