//! How well a lattice counts the area of an organ: from its outline.

use nestrad_common::optics::Band;
use nestrad_kernel::zbuffer::Top;

use crate::frame::Frame;

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
type Side = (u32, u32, bool);

/// What differs between neighbours.
type Pair = (Option<Side>, Option<Side>);

/// What differs across an outline of an organ: one face of it from what is not it, or two faces of it from each
/// other. A face is a material, and whether it is the upper one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Difference {
    Edge((u32, bool)),
    Fold((u32, bool), (u32, bool)),
}

/// Crossings of an organ's outline that differ in the same way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    pub(super) organ: u32,
    difference: Difference,
    /// How many.
    pub(super) crossings: u32,
    /// Variance that each of them leaves, in parts of that of a point of unit absorptance.
    pub(super) variance: f64,
}

impl Outline {
    /// By how much the absorptances across it differ in a band.
    pub(super) fn contrast(&self, band: &Band) -> f64 {
        let of =
            |(material, upper): (u32, bool)| band.materials[material as usize].absorptance(upper);
        match self.difference {
            Difference::Edge(face) => of(face),
            Difference::Fold(a, b) => of(a) - of(b),
        }
    }
}

/// Counts neighbours across the outlines of organs.
pub(super) struct Outlines<'a> {
    frame: &'a Frame,
    /// Organs whose light is not counted by points.
    thin: &'a [bool],
    /// The last pair across a row, by column, and the row; and the same across columns.
    last_in_row: Option<Run>,
    last_in_column: Vec<Option<Run>>,
    /// Neighbours across the outline of each organ, across rows and across columns.
    organ: Vec<[Across; 2]>,
    /// The outline of each organ that is being counted.
    counting: Vec<Option<Outline>>,
    /// Outlines that are counted: those of an organ in the order in which they were met.
    counted: Vec<Outline>,
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
    pub(super) fn new(frame: &'a Frame, thin: &'a [bool], columns: u32) -> Self {
        Self {
            frame,
            thin,
            last_in_row: None,
            last_in_column: vec![None; columns as usize],
            organ: vec![Default::default(); frame.organs],
            counting: vec![None; frame.organs],
            counted: Vec::new(),
        }
    }

    /// Neighbours above each other, the lower one at this column and row.
    pub(super) fn above(&mut self, a: Option<Top>, b: Option<Top>, at: [usize; 2]) {
        if let Some(pair) = self.differ(a, b) {
            let run = follow(self.last_in_row, pair, at, [at[0].wrapping_sub(1), at[1]]);
            self.last_in_row = Some(run);
            self.count(run, 0);
        }
    }

    /// Neighbours beside each other, the left one at this column and row.
    pub(super) fn beside(&mut self, a: Option<Top>, b: Option<Top>, at: [usize; 2]) {
        if let Some(pair) = self.differ(a, b) {
            let last = &mut self.last_in_column[at[0]];
            let run = follow(*last, pair, at, [at[0], at[1].wrapping_sub(1)]);
            *last = Some(run);
            self.count(run, 1);
        }
    }

    fn differ(&self, a: Option<Top>, b: Option<Top>) -> Option<Pair> {
        if a == b {
            return None;
        }
        let frame = self.frame;
        let at = |top: Top| {
            let t = frame.triangle_of_element[top.element as usize] as usize;
            (frame.organ[t], frame.material[t], top.upper)
        };
        let pair = (a.map(at), b.map(at));
        (pair.0 != pair.1).then_some(pair)
    }

    /// Counts a crossing, and adds its run to what is known of its organs.
    fn count(&mut self, run: Run, across: usize) {
        for (organ, difference) in differences(run.pair).into_iter().flatten() {
            self.add(organ, difference, VARIANCE_PER_CROSSING);
        }
        for organ in organs(run.pair).into_iter().flatten() {
            let of = &mut self.organ[organ as usize][across];
            of.all += 1;
            if of.longest.is_none_or(|longest| run.length > longest.length) {
                of.longest = Some(run);
            }
        }
    }

    /// All outlines, with what those along the rows leave uncertain.
    pub(super) fn finish(mut self) -> Vec<Outline> {
        for (organ, across) in std::mem::take(&mut self.organ).into_iter().enumerate() {
            for of in across {
                let Some(run) = of.longest else { continue };
                let length = f64::from(run.length);
                if length > ALONG_ROWS * f64::from(of.all) {
                    let variance = VARIANCE_OF_ROW * length * length;
                    let of_pair = differences(run.pair).into_iter().flatten();
                    for (_, difference) in of_pair.filter(|&(of, _)| of as usize == organ) {
                        self.add(organ as u32, difference, variance);
                    }
                }
            }
        }
        self.counted.extend(self.counting.into_iter().flatten());
        self.counted
    }

    /// Adds a crossing that leaves so many times the variance of a point.
    fn add(&mut self, organ: u32, difference: Difference, variance: f64) {
        if self.thin[organ as usize] {
            return;
        }
        match &mut self.counting[organ as usize] {
            Some(last) if last.difference == difference && last.variance == variance => {
                last.crossings += 1;
            }
            counting => {
                self.counted.extend(*counting);
                *counting = Some(Outline {
                    organ,
                    difference,
                    crossings: 1,
                    variance,
                });
            }
        }
    }
}

/// What differs for each organ of a pair.
fn differences((a, b): Pair) -> [Option<(u32, Difference)>; 2] {
    match (a, b) {
        (Some((organ, m, upper)), Some((other, n, other_upper))) if organ == other => {
            let fold = Difference::Fold((m, upper), (n, other_upper));
            [Some((organ, fold)), None]
        }
        (a, b) => [a, b].map(|side| {
            side.map(|(organ, material, upper)| (organ, Difference::Edge((material, upper))))
        }),
    }
}

/// The organs of a pair, each once.
fn organs((a, b): Pair) -> [Option<u32>; 2] {
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
