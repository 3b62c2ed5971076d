//! Form factors between organs, counted from the rows that the kernel gives.

use nestrad_common::canopy::Canopy;
use nestrad_engine::exchange::{Exchange, Sampling, ThisProcess};
use nestrad_engine::frame::{Cut, Frame};
use nestrad_engine::solution::Estimate;
use nestrad_kernel::ends::Side;

use crate::solving::trace;

/// A canopy that has been traced. Organs have the canopy's numbers here, rows the frame's.
pub struct Traced {
    /// As it was cut and numbered.
    pub frame: Frame,
    /// What everything sees.
    pub exchange: Exchange,
    organ_of_element: Vec<usize>,
}

impl Traced {
    /// Traces a canopy whose elements have edges of at most `max_edge_m`.
    pub fn new(canopy: &Canopy, max_edge_m: f64, sampling: &Sampling) -> Self {
        let cut = Cut {
            max_edge_m,
            soil_cell_m: 0.1,
            radius_m: f64::INFINITY,
            far: None,
        };
        let frame = Frame::new(canopy, &cut).unwrap();
        let exchange = trace(&frame, sampling, &ThisProcess::default());
        let organ = |&t: &u32| organ_of(&frame, t as usize);
        Self {
            organ_of_element: frame.triangle_of_element.iter().map(organ).collect(),
            frame,
            exchange,
        }
    }

    /// Rows of one side of an organ.
    pub fn rows(&self, organ: usize, side: Side) -> Vec<usize> {
        let elements = 0..self.organ_of_element.len();
        elements
            .filter(|&e| self.organ_of_element[e] == organ)
            .map(|e| self.frame.ends.face(e as u32, side) as usize)
            .collect()
    }

    /// Whether an end is that side of an organ.
    pub fn is(&self, end: u32, organ: usize, side: Side) -> bool {
        end < self.frame.ends.faces()
            && end % 2 == side as u32
            && self.organ_of_element[end as usize / 2] == organ
    }

    /// Whether an organ is something solid.
    pub fn is_solid(&self, organ: usize) -> bool {
        let mut triangles = 0..self.frame.organ.len();
        let first = triangles.find(|&t| organ_of(&self.frame, t) == organ);
        self.frame.is_solid(first.unwrap())
    }

    /// Part of the light that leaves `rows` (evenly over their area) for ends of which `hits` holds,
    /// over the batches of some halves. Its standard error is from the batches: each is an independent
    /// estimate (linearised ratio estimator; Cochran 1977, section 2.11).
    pub fn part_seen(
        &self,
        rows: &[usize],
        halves: &[usize],
        hits: impl Fn(u32) -> bool,
    ) -> Estimate {
        let mut pulls: Vec<f64> = Vec::new();
        let (mut sum, mut area) = (0.0, 0.0);
        for &row in rows {
            let counts: Vec<(f64, f64)> = halves
                .iter()
                .map(|&half| &self.exchange.halves[half])
                .flat_map(|half| half.by_batch(row).map(|batch| &half.ends()[batch]))
                .map(|ends| {
                    let seen = ends.iter().filter(|&&end| hits(end)).count();
                    (seen as f64, ends.len() as f64)
                })
                .collect();
            let seen: f64 = counts.iter().map(|c| c.0).sum();
            let all: f64 = counts.iter().map(|c| c.1).sum();
            assert!(all > 0.0, "row {row} sees nothing at all");
            let row_area = self.frame.row_area_m2(row);
            sum += row_area * seen / all;
            area += row_area;
            pulls.resize(counts.len(), 0.0);
            for (pull, (s, n)) in pulls.iter_mut().zip(counts) {
                *pull += row_area * (s - seen / all * n) / all;
            }
        }
        let n = pulls.len() as f64;
        let variance = n / (n - 1.0) * pulls.iter().map(|p| p * p).sum::<f64>();
        Estimate {
            value: sum / area,
            se: variance.sqrt() / area,
        }
    }

    /// Form factor from a side of an organ to a side of another one, over all batches.
    pub fn form_factor(&self, from: (usize, Side), to: (usize, Side)) -> Estimate {
        self.part_seen(&self.rows(from.0, from.1), &[0, 1], |end| {
            self.is(end, to.0, to.1)
        })
    }
}

/// The canopy's number of the organ of a triangle of the frame.
fn organ_of(frame: &Frame, triangle: usize) -> usize {
    frame.order.organ[frame.organ[triangle] as usize] as usize
}
