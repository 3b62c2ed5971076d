//! Form factors between organs, counted from the rows that the kernel gives.

use nestrad_common::ends::Side;
use nestrad_common::problem::Problem;
use nestrad_master::exchange::{BlockOf, Exchange, Sampling, trace_here};
use nestrad_master::solution::Estimate;
use nestrad_master::world::World;

/// A scene that has been traced.
pub struct Traced {
    /// As it was cut and numbered.
    pub world: World,
    /// What everything sees.
    pub exchange: Exchange,
    organ_of_element: Vec<usize>,
}

impl Traced {
    /// Traces a scene whose elements have edges of at most `max_edge_m`.
    pub fn new(problem: &Problem, max_edge_m: f64, sampling: &Sampling) -> Self {
        let world = World::new(&problem.scene, max_edge_m, 0.1, f64::INFINITY, (0, 0));
        let whole = [BlockOf::whole(&world)];
        let exchange = trace_here(&problem.scene, &world, &whole, sampling, || Ok(())).unwrap();
        let organ = |&t: &u32| problem.scene.organ[t as usize] as usize;
        Self {
            organ_of_element: world.triangle_of_element.iter().map(organ).collect(),
            world,
            exchange,
        }
    }

    /// Rows of one side of an organ.
    pub fn rows(&self, organ: usize, side: Side) -> Vec<usize> {
        let elements = 0..self.organ_of_element.len();
        elements
            .filter(|&e| self.organ_of_element[e] == organ)
            .map(|e| self.world.ends.face(e as u32, side) as usize)
            .collect()
    }

    /// Whether an end is that side of an organ.
    pub fn is(&self, end: u32, organ: usize, side: Side) -> bool {
        end < self.world.ends.faces()
            && end % 2 == side as u32
            && self.organ_of_element[end as usize / 2] == organ
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
            let row_area = self.world.row_area_m2(row as u32);
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
