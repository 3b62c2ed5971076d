//! How far a solution would move if its model were another: if elements were larger, or the sphere of near
//! exchange had no end.
//!
//! What a row gathers then changes by `d = (F' - F) B` or `d = F (B' - B)`, with the radiosities B as they were
//! solved for. The change is light of its own: `dx = d_x + F_A S dy`, `dy = d_y + F_B S dx`, of which two passes
//! are followed. Both halves tell of it by lines of their own, so the product of what they say of an organ is
//! free of the noise of either: squares are taken so.

use super::gather::{Gather, Half};
use super::groups::Groups;
use super::pass::Pass;
use super::system::{Deviation, FarSample, Sampled, System};

/// Passes that a change is followed for.
const FOLLOWED: usize = 2;

impl<const N: usize> Pass<'_, N> {
    /// What the size of elements does: the change from elements as wide as groups to those that there are, by
    /// the change from these to groups, made smaller by how much wider groups are.
    ///
    /// Errors fall in proportion to the width (measured: `master/docs/accuracy.md`), so elements are to none at
    /// all as groups are to elements, but for that factor.
    pub(super) fn of_element_size(&self) -> Vec<Deviation> {
        let groups = self.system.groups;
        if groups.wider <= 1.0 {
            return vec![Deviation::default(); self.bands.len()];
        }
        let [a, b] = &self.system.exchange.halves;
        let dark = vec![[0.0; N]; self.x.irradiance.len()];
        let [x, y] = [&self.x, &self.y].map(|half| Half {
            irradiance: dark.clone(),
            radiosity: self.grouped(groups, half, 1.0 / (groups.wider - 1.0)),
        });
        let mut first = [x.clone(), x.clone()];
        self.gather.half_pass(0, a, &y, None, &mut first[0]);
        self.gather.half_pass(1, b, &x, None, &mut first[1]);
        self.followed(first.map(|half| half.irradiance))
    }

    /// What a field of means beyond the sphere does.
    pub(super) fn of_far_field(&self, sample: &FarSample) -> Vec<Deviation> {
        let samples = [&sample.within, &sample.without_end];
        let mut seen = samples.map(|Sampled { exchange, outlook }| {
            let mut system = self.system;
            (system.exchange, system.outlook) = (exchange, outlook);
            let gather = Gather::<N>::new(&system, self.bands);
            let unseen = |half: &Half<[f64; N]>| Half {
                irradiance: vec![[0.0; N]; half.irradiance.len()],
                radiosity: half.radiosity.clone(),
            };
            let [x, y] = [unseen(&self.x), unseen(&self.y)];
            let mut into = [x.clone(), y.clone()];
            gather.half_pass(0, &exchange.halves[0], &y, None, &mut into[0]);
            gather.half_pass(1, &exchange.halves[1], &x, None, &mut into[1]);
            into.map(|half| half.irradiance)
        });
        let [within, without_end] = &mut seen;
        for (within, without_end) in within.iter_mut().zip(without_end) {
            for (within, without_end) in within.iter_mut().zip(without_end) {
                *within = std::array::from_fn(|k| without_end[k] - within[k]);
            }
        }
        let [change, _] = seen;
        self.followed(change)
    }

    /// How the radiosities of rows change when those of a group are one, times `factor`; other ends stay.
    fn grouped(&self, groups: &Groups, half: &Half<[f64; N]>, factor: f64) -> Vec<[f64; N]> {
        let frame = self.gather.frame;
        let area_m2 = |row: usize| frame.row_area_m2(row) * self.gather.outlook.exposed[row];
        let mut sums = vec![([0.0; N], 0.0); groups.len];
        for (row, &group) in groups.of_row.iter().enumerate() {
            let ((sum, area), own) = (&mut sums[group as usize], area_m2(row));
            for (sum, b) in sum.iter_mut().zip(half.radiosity[row]) {
                *sum += own * b;
            }
            *area += own;
        }
        let mut change = vec![[0.0; N]; half.radiosity.len()];
        for (row, &group) in groups.of_row.iter().enumerate() {
            let (sum, area) = &sums[group as usize];
            if *area > 0.0 && area_m2(row) > 0.0 {
                let own = &half.radiosity[row];
                change[row] = std::array::from_fn(|k| factor * (sum[k] / area - own[k]));
            }
        }
        change
    }

    /// Follows a change of what rows gather, and sums it up by organs.
    fn followed(&self, first: [Vec<[f64; N]>; 2]) -> Vec<Deviation> {
        let frame = self.gather.frame;
        let halves = &self.system.exchange.halves;
        let dark = vec![[0.0; N]; frame.ends.len() - frame.rows()];
        let [mut x, mut y] = [0, 1].map(|half: usize| {
            let mut changed = Half {
                irradiance: first[half].clone(),
                radiosity: Vec::new(),
            };
            self.gather.start(&mut changed, &dark);
            self.gather.close_far_field(half, &mut changed.radiosity);
            changed
        });
        for _ in 0..FOLLOWED {
            self.gather
                .half_pass(0, &halves[0], &y, Some(&first[0]), &mut x);
            self.gather
                .half_pass(1, &halves[1], &x, Some(&first[1]), &mut y);
        }
        let bands = self.bands.iter().enumerate();
        bands
            .map(|(k, &band)| Deviation {
                halves_W: [&x, &y]
                    .map(|half| by_organ(&self.system, band, |row| half.irradiance[row][k])),
            })
            .collect()
    }
}

/// Power that irradiances make organs absorb, W.
fn by_organ(system: &System, band: usize, irradiance: impl Fn(usize) -> f64) -> Vec<f64> {
    let System {
        frame,
        optics,
        outlook,
        ..
    } = system;
    frame.sum_by_organ(&optics.bands[band], |e, optics| {
        [true, false].map(|upper| {
            let row = 2 * e + usize::from(!upper);
            let area_m2 = frame.area_m2[e] * outlook.exposed[row];
            optics.absorptance(upper) * area_m2 * irradiance(row)
        })
    })
}
