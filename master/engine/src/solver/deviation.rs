//! How far a solution would move if its model were another: if elements were larger, or the sphere of near
//! exchange had no end.
//!
//! What a row gathers then changes by `d = (F' - F) B` or `d = F (B' - B)`, with the radiosities B as they were
//! solved for. The change is light of its own: `dx = d_x + F_A S dy`, `dy = d_y + F_B S dx`, of which two passes
//! are followed. Both halves tell of it by lines of their own, so the product of what they say of an organ is
//! free of the noise of either: squares are taken so.

use super::gather::{Gather, Half};
use super::pass::Pass;
use super::soil_groups::Member;
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
        let (frame, outlook) = (self.gather.frame, self.gather.outlook);
        let faces = (0..).zip(&groups.of_face).map(|(end, &group)| Member {
            end,
            group,
            area_m2: frame.row_area_m2(end as usize) * outlook.exposed[end as usize],
        });
        self.followed(self.put_together(faces, groups.len, 1.0 / (groups.wider - 1.0)))
    }

    /// What the size of soil cells does, and of the zones around them: by cells that are put together by four, in
    /// either way (see [`SoilGroups`](super::soil_groups::SoilGroups)). It is not followed any farther: what soil
    /// cells have too much and too little lies side by side.
    pub(super) fn of_soil_cells(&self) -> [Vec<Deviation>; 2] {
        let soil = &self.system.groups.soil;
        let is_dark = |&band: &usize| self.system.optics.bands[band].soil_albedo == 0.0;
        if soil.len == 0 || self.bands.iter().all(is_dark) {
            return [(); 2].map(|()| vec![Deviation::default(); self.bands.len()]);
        }
        soil.ways.each_ref().map(|way| {
            let [x, y] = self.put_together(way.iter().copied(), soil.len, 1.0);
            self.summed_up([&x, &y])
        })
    }

    /// How the irradiances of rows change when the radiosities of the members of each group are one, times `factor`.
    fn put_together(
        &self,
        members: impl Iterator<Item = Member> + Clone,
        groups: usize,
        factor: f64,
    ) -> [Vec<[f64; N]>; 2] {
        let [a, b] = &self.system.exchange.halves;
        let dark = vec![[0.0; N]; self.x.irradiance.len()];
        let [x, y] = [&self.x, &self.y].map(|half| Half {
            irradiance: dark.clone(),
            radiosity: grouped(members.clone(), groups, half, factor),
        });
        let mut first = [x.clone(), x.clone()];
        self.gather.half_pass(0, a, &y, None, &mut first[0]);
        self.gather.half_pass(1, b, &x, None, &mut first[1]);
        first.map(|half| half.irradiance)
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
        self.summed_up([&x.irradiance, &y.irradiance])
    }

    /// A change of irradiances of rows, summed up by organs.
    fn summed_up(&self, halves: [&[[f64; N]]; 2]) -> Vec<Deviation> {
        let bands = self.bands.iter().enumerate();
        bands
            .map(|(k, &band)| Deviation {
                halves_W: halves.map(|half| by_organ(&self.system, band, |row| half[row][k])),
            })
            .collect()
    }
}

/// How the radiosities of members change when those of a group are one, times `factor`; other ends stay.
fn grouped<const N: usize>(
    members: impl Iterator<Item = Member> + Clone,
    groups: usize,
    half: &Half<[f64; N]>,
    factor: f64,
) -> Vec<[f64; N]> {
    let mut sums = vec![([0.0; N], 0.0); groups];
    for member in members.clone() {
        let (sum, area) = &mut sums[member.group as usize];
        for (sum, b) in sum.iter_mut().zip(half.radiosity[member.end as usize]) {
            *sum += member.area_m2 * b;
        }
        *area += member.area_m2;
    }
    let mut change = vec![[0.0; N]; half.radiosity.len()];
    for member in members {
        let (sum, area) = &sums[member.group as usize];
        if *area > 0.0 && member.area_m2 > 0.0 {
            let own = &half.radiosity[member.end as usize];
            change[member.end as usize] =
                std::array::from_fn(|k| factor * (sum[k] / area - own[k]));
        }
    }
    change
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
