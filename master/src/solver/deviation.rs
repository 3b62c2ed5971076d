//! How far a solution would move if its model were another: if elements were larger, or the sphere of near
//! exchange had no end.
//!
//! What a row gathers then changes by `d = (F' - F) B` or `d = F (B' - B)`, with the radiosities B as they were
//! solved for. The change is light of its own: `dx = d_x + F_A S dy`, `dy = d_y + F_B S dx`, of which two passes
//! are followed. Both halves tell of it by lines of their own, so the product of what they say of an organ is
//! free of the noise of either: squares are taken so.

use super::Group;
use super::gather::{Gather, Half};
use super::groups::Groups;
use super::pass::Pass;
use crate::exchange::{Exchange, Outlook};

/// A change of the power that organs absorb in one band.
#[derive(Clone, Debug, Default)]
pub struct Deviation {
    /// By the lines of each half, W, per organ.
    pub halves_W: [Vec<f64>; 2],
}

/// The exchange by the same few lines within the sphere and without end.
#[derive(Clone, Debug)]
pub struct FarSample {
    /// As the solve has it.
    pub within: (Exchange, Outlook),
    /// On the true geometry.
    pub without_end: (Exchange, Outlook),
}

/// Passes that a change is followed for.
const FOLLOWED: usize = 2;

impl<const N: usize> Pass<'_, N> {
    /// What the size of elements does: the change from elements as wide as groups to those that there are, by
    /// the change from these to groups, made smaller by how much wider groups are.
    ///
    /// Errors fall in proportion to the width (measured: `master/docs/accuracy.md`), so elements are to none at
    /// all as groups are to elements, but for that factor.
    pub(super) fn of_element_size(&self, group: &Group, groups: &Groups) -> Vec<Deviation> {
        if groups.wider <= 1.0 {
            return vec![Deviation::default(); group.bands.len()];
        }
        let [a, b] = &group.system.exchange.halves;
        let dark = vec![[0.0; N]; self.x.irradiance.len()];
        let [x, y] = [&self.x, &self.y].map(|half| Half {
            irradiance: dark.clone(),
            radiosity: self.grouped(groups, half, 1.0 / (groups.wider - 1.0)),
        });
        let mut first = [x.clone(), x.clone()];
        self.gather.sweep(0, a, &y, None, &mut first[0]);
        self.gather.sweep(1, b, &x, None, &mut first[1]);
        self.followed(group, first.map(|half| half.irradiance))
    }

    /// What a field of means beyond the sphere does.
    pub(super) fn of_far_field(&self, group: &Group, sample: &FarSample) -> Vec<Deviation> {
        let mut seen = [&sample.within, &sample.without_end].map(|(exchange, outlook)| {
            let mut system = group.system;
            (system.exchange, system.outlook) = (exchange, outlook);
            let gather = Gather::<N>::new(&system, group.bands);
            let unseen = |half: &Half<[f64; N]>| Half {
                irradiance: vec![[0.0; N]; half.irradiance.len()],
                radiosity: half.radiosity.clone(),
            };
            let [x, y] = [unseen(&self.x), unseen(&self.y)];
            let mut into = [x.clone(), y.clone()];
            gather.sweep(0, &exchange.halves[0], &y, None, &mut into[0]);
            gather.sweep(1, &exchange.halves[1], &x, None, &mut into[1]);
            into.map(|half| half.irradiance)
        });
        let [within, without_end] = &mut seen;
        for (within, without_end) in within.iter_mut().zip(without_end) {
            for (within, without_end) in within.iter_mut().zip(without_end) {
                *within = std::array::from_fn(|k| without_end[k] - within[k]);
            }
        }
        let [change, _] = seen;
        self.followed(group, change)
    }

    /// How the radiosities of rows change when those of a group are one, times `factor`; other ends stay.
    fn grouped(&self, groups: &Groups, half: &Half<[f64; N]>, factor: f64) -> Vec<[f64; N]> {
        let world = self.gather.world;
        let area_m2 = |row: usize| world.row_area_m2(row as u32) * self.gather.outlook.exposed[row];
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
    fn followed(&self, group: &Group, first: [Vec<[f64; N]>; 2]) -> Vec<Deviation> {
        let world = self.gather.world;
        let halves = &group.system.exchange.halves;
        let dark = vec![[0.0; N]; world.ends.len() - world.rows()];
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
                .sweep(0, &halves[0], &y, Some(&first[0]), &mut x);
            self.gather
                .sweep(1, &halves[1], &x, Some(&first[1]), &mut y);
        }
        let bands = group.bands.iter().enumerate();
        bands
            .map(|(k, &band)| Deviation {
                halves_W: [&x, &y].map(|half| by_organ(group, band, |row| half.irradiance[row][k])),
            })
            .collect()
    }
}

/// Power that irradiances make organs absorb, W.
fn by_organ(group: &Group, band: usize, irradiance: impl Fn(usize) -> f64) -> Vec<f64> {
    let (problem, world) = (group.system.problem, group.system.world);
    let mut absorbed_W = vec![0.0; problem.scene.organs.len()];
    for (e, &t) in world.triangle_of_element.iter().enumerate() {
        let material = problem.scene.material[t as usize] as usize;
        let optics = problem.bands[band].materials[material];
        let faces = [optics.upper, optics.lower];
        for (side, face) in faces.iter().enumerate() {
            let row = 2 * e + side;
            let area_m2 = world.elements.area_m2[e] * group.system.outlook.exposed[row];
            absorbed_W[problem.scene.organ[t as usize] as usize] +=
                face.absorptance() * area_m2 * irradiance(row);
        }
    }
    absorbed_W
}
