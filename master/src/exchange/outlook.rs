//! What the rows see that is not a radiosity to solve for: sky, void, soil beyond the map, burial.

use rayon::prelude::*;

use super::Exchange;
use crate::world::World;

/// What the rows see that is not a radiosity to solve for.
#[derive(Clone, Debug, Default)]
pub struct Outlook {
    /// One over the number of lines of a row that count, in each half; 0 for a row without.
    pub weight: [Vec<f64>; 2],
    /// The part of each row that is not buried in something solid.
    pub exposed: Vec<f64>,
    /// The part of what each row sends out that leaves to the sky, by the lines of each half.
    pub to_sky: [Vec<f64>; 2],
    /// The part that leaves downwards, or to the soil beyond the map.
    pub to_void: [Vec<f64>; 2],
    /// The part of what each row sees that is soil beyond the map of an open scene.
    pub outer_soil: Vec<f64>,
}

impl Exchange {
    /// Counts what is seen by each row; `lit` tells which rows a source shines on.
    ///
    /// What is lit is not buried, though all lines of a row that peeps out of the soil by a hair may say so: it
    /// counts as if one line more had seen the sky.
    pub fn outlook(&self, world: &World, lit: impl Fn(usize) -> bool + Sync) -> Outlook {
        let seen: Vec<[Seen; 2]> = (0..world.rows())
            .into_par_iter()
            .map(|row| {
                let mut seen = [0, 1].map(|h: usize| Seen::of(world, self.halves[h].row(row)));
                if seen.iter().all(|s| s.counted == 0) && lit(row) {
                    (seen[0].counted, seen[0].sky) = (1, 1);
                }
                seen
            })
            .collect();
        let per = |part: usize, of: usize| {
            if of == 0 {
                0.0
            } else {
                part as f64 / of as f64
            }
        };
        let exposed = |[a, b]: &[Seen; 2]| match (a.counted + b.counted, a.buried + b.buried) {
            (_, 0) => 1.0,
            (counted, buried) => per(counted, counted + buried),
        };
        // a row without lines in a half is judged by those of the other
        let part = |of: fn(&Seen) -> usize| {
            [0, 1].map(|h: usize| {
                let judge = |s: &[Seen; 2]| if s[h].counted > 0 { s[h] } else { s[1 - h] };
                seen.iter()
                    .map(|s| per(of(&judge(s)), judge(s).counted))
                    .collect::<Vec<f64>>()
            })
        };
        Outlook {
            weight: [0, 1].map(|h: usize| seen.iter().map(|s| per(1, s[h].counted)).collect()),
            exposed: seen
                .par_iter()
                .enumerate()
                .map(|(row, seen)| world.share_above_soil(row as u32) * exposed(seen))
                .collect(),
            to_sky: part(|s| s.sky),
            to_void: part(|s| s.void),
            outer_soil: seen
                .iter()
                .map(|[a, b]| per(a.outer + b.outer, a.counted + b.counted))
                .collect(),
        }
    }
}

/// Lines of a row in one half, by what they see.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// All that are not buried.
    counted: usize,
    buried: usize,
    sky: usize,
    void: usize,
    outer: usize,
}

impl Seen {
    fn of(world: &World, row: &[u32]) -> Self {
        let (ends, mut seen) = (&world.ends, Self::default());
        for &end in row {
            let buried = end == ends.buried();
            seen.buried += usize::from(buried);
            seen.counted += usize::from(!buried);
            seen.sky += usize::from(end == ends.sky());
            let outer = end == ends.outer_soil();
            seen.outer += usize::from(outer);
            seen.void += usize::from(outer || end == ends.void());
        }
        seen
    }
}
