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

/// Rows whose sums are added in order: they depend on this, not on the number of threads.
const AT_ONCE: usize = 1 << 14;

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
        let mut outlook = Self {
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
            outer_soil_m2: Vec::new(),
            blind: (0..).zip(&seen).filter_map(blind).collect(),
        };
        if any(|s| s.outer) {
            outlook.outer_soil_m2 = outlook.onto_outer_soil_W(frame, exchange, |_| 1.0);
        }
        outlook
    }

    /// What rows of these radiosities (W m⁻²) send onto the soil beyond the map of an open scene, W: onto each zone of it,
    /// and onto what lies beyond all zones.
    pub fn onto_outer_soil_W(
        &self,
        frame: &Frame,
        exchange: &Exchange,
        radiosity_W_m2: impl Fn(usize) -> f64 + Sync,
    ) -> Vec<f64> {
        let (ends, rows) = (&frame.ends, frame.rows());
        let zones = ends.outer_zones as usize + 1;
        let of_rows = |first: usize| {
            let mut sums = vec![0.0; zones];
            for row in first..rows.min(first + AT_ONCE) {
                if self.to_void(0, row) + self.to_void(1, row) == 0.0 {
                    continue;
                }
                let lines: f64 = self.weight.iter().map(|w| per_f64(1.0, w[row])).sum();
                let power_W = radiosity_W_m2(row) * frame.row_area_m2(row) * self.exposed[row];
                let of_a_line_W = per_f64(power_W, lines);
                for half in &exchange.halves {
                    for &end in half.row(row).iter().filter(|&&e| ends.is_outer_soil(e)) {
                        let zone = end.checked_sub(ends.zone(0)).unwrap_or(ends.outer_zones);
                        sums[zone as usize] += of_a_line_W;
                    }
                }
            }
            sums
        };
        let parts: Vec<Vec<f64>> = (0..rows)
            .into_par_iter()
            .step_by(AT_ONCE)
            .map(of_rows)
            .collect();
        let mut sums = vec![0.0; zones];
        for part in &parts {
            sums.iter_mut()
                .zip(part)
                .for_each(|(sum, part)| *sum += part);
        }
        sums
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

fn per_f64(part: f64, of: f64) -> f64 {
    if of == 0.0 { 0.0 } else { part / of }
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
