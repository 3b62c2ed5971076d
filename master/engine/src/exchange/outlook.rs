//! What the rows see that is not a radiosity to solve for: sky, void, soil beyond the map, burial.

use std::borrow::Cow;

use rayon::prelude::*;

use super::Exchange;
use crate::frame::Frame;

/// What the rows see that is not a radiosity to solve for.
#[derive(Clone, Debug, Default)]
pub struct Outlook {
    /// One over the number of lines of a row that count, in each half; 0 for a row without.
    pub weight: [Vec<f64>; 2],
    /// The part of each row that is not buried in something solid.
    pub exposed: Vec<f64>,
    /// The part of what each row sends out that leaves to the sky, by the lines of each half.
    pub to_sky: [Vec<f64>; 2],
    /// The part that leaves downwards, or to the soil beyond the map; empty where there is neither.
    to_void: [Vec<f64>; 2],
    /// What all rows together see of the soil beyond the map of an open scene, m²: of each zone of it, and of what
    /// lies beyond all zones; empty where there is none.
    pub outer_soil_m2: Vec<f64>,
    /// Rows none of whose lines count, and how many of their lines are buried.
    blind: Vec<(u32, usize)>,
}

impl Outlook {
    /// Counts what is seen by each row.
    pub fn of(frame: &Frame, exchange: &Exchange) -> Self {
        let seen: Vec<[Seen; 2]> = (0..frame.rows())
            .into_par_iter()
            .map(|row| [0, 1].map(|h: usize| Seen::of(frame, exchange.halves[h].row(row))))
            .collect();
        // a row without lines in a half is judged by those of the other
        let part = |of: fn(&Seen) -> usize| {
            [0, 1].map(|h: usize| {
                let judge = |s: &[Seen; 2]| if s[h].counted > 0 { s[h] } else { s[1 - h] };
                seen.iter()
                    .map(|s| per(of(&judge(s)), judge(s).counted))
                    .collect::<Vec<f64>>()
            })
        };
        let any = |of: fn(&Seen) -> usize| seen.iter().flatten().any(|s| of(s) > 0);
        let blind = |(row, [a, b]): (u32, &[Seen; 2])| {
            (a.counted + b.counted == 0).then_some((row, a.buried + b.buried))
        };
        Self {
            weight: [0, 1].map(|h: usize| seen.iter().map(|s| per(1, s[h].counted)).collect()),
            exposed: seen
                .par_iter()
                .enumerate()
                .map(|(row, [a, b])| {
                    let lines = (a.counted + b.counted, a.buried + b.buried);
                    frame.share_above_soil(row) * exposed(lines)
                })
                .collect(),
            to_sky: part(|s| s.sky),
            to_void: if any(|s| s.void) {
                part(|s| s.void)
            } else {
                Default::default()
            },
            outer_soil_m2: if any(|s| s.outer) {
                outer_soil_m2(frame, exchange, &seen)
            } else {
                Vec::new()
            },
            blind: (0..).zip(&seen).filter_map(blind).collect(),
        }
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let pairs = [&self.weight, &self.to_sky, &self.to_void];
        let lists = pairs.into_iter().flatten();
        let all = lists.chain([&self.exposed, &self.outer_soil_m2]);
        all.map(|list| size_of_val(&list[..]) as u64).sum()
    }

    /// The part of what a row sends out that leaves downwards or to the soil beyond the map, by the lines of a half.
    pub fn to_void(&self, half: usize, row: usize) -> f64 {
        self.to_void[half].get(row).copied().unwrap_or(0.0)
    }

    /// The same where a source shines on the rows of which `lit` holds.
    ///
    /// What is lit is not buried, though all lines of a row that peeps out of the soil by a hair may say so: it
    /// counts as if one line more had seen the sky.
    pub fn lit(&self, frame: &Frame, lit: impl Fn(usize) -> bool) -> Cow<'_, Self> {
        let mut outlook = Cow::Borrowed(self);
        for &(row, buried) in &self.blind {
            let row = row as usize;
            if lit(row) {
                let outlook = outlook.to_mut();
                outlook.weight[0][row] = 1.0;
                outlook.exposed[row] = frame.share_above_soil(row) * exposed((1, buried));
                for to_sky in &mut outlook.to_sky {
                    to_sky[row] = 1.0;
                }
            }
        }
        outlook
    }
}

/// What all rows see of the soil beyond the map: see [`Outlook::outer_soil_m2`].
fn outer_soil_m2(frame: &Frame, exchange: &Exchange, seen: &[[Seen; 2]]) -> Vec<f64> {
    let ends = &frame.ends;
    let mut sums = vec![0.0; ends.outer_zones as usize + 1];
    for (row, [a, b]) in seen.iter().enumerate() {
        if a.outer + b.outer == 0 {
            continue;
        }
        let lines = (a.counted + b.counted, a.buried + b.buried);
        let area_m2 = frame.row_area_m2(row) * frame.share_above_soil(row) * exposed(lines);
        let of_a_line = area_m2 * per(1, lines.0);
        for half in &exchange.halves {
            for &end in half.row(row).iter().filter(|&&e| ends.is_outer_soil(e)) {
                let zone = end.checked_sub(ends.zone(0)).unwrap_or(ends.outer_zones);
                sums[zone as usize] += of_a_line;
            }
        }
    }
    sums
}

fn per(part: usize, of: usize) -> f64 {
    if of == 0 {
        0.0
    } else {
        part as f64 / of as f64
    }
}

/// The part of a row that is not buried, by the lines that count and those that do not.
fn exposed((counted, buried): (usize, usize)) -> f64 {
    match buried {
        0 => 1.0,
        _ => per(counted, counted + buried),
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
    fn of(frame: &Frame, row: &[u32]) -> Self {
        let (ends, mut seen) = (&frame.ends, Self::default());
        for &end in row {
            let buried = end == ends.buried();
            seen.buried += usize::from(buried);
            seen.counted += usize::from(!buried);
            seen.sky += usize::from(end == ends.sky());
            let outer = ends.is_outer_soil(end);
            seen.outer += usize::from(outer);
            seen.void += usize::from(outer || end == ends.void());
        }
        seen
    }
}
