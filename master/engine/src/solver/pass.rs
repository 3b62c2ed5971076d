//! A pass over all rows: from one half of the lines to the other and back.

use super::gather::{Gather, Half};
use super::system::System;

/// Both halves, and what they are worked off with.
pub(super) struct Pass<'a, const N: usize> {
    pub(super) gather: &'a Gather<'a, N>,
    pub(super) system: System<'a>,
    /// Numbers of the bands.
    pub(super) bands: &'a [usize],
    direct: Vec<[f64; N]>,
    /// Radiosities of the ends that are not rows, with and without light.
    fixed: Vec<[f64; N]>,
    dark: Vec<[f64; N]>,
    pub(super) x: Half<[f64; N]>,
    pub(super) y: Half<[f64; N]>,
    /// Passes done.
    pub(super) done: u32,
}

impl<'a, const N: usize> Pass<'a, N> {
    /// For the bands with these numbers.
    pub(super) fn new(system: &System<'a>, gather: &'a Gather<'a, N>, bands: &'a [usize]) -> Self {
        let lanes = |values: &[f64]| -> Vec<[f64; N]> {
            values
                .chunks_exact(system.optics.len())
                .map(|v| std::array::from_fn(|k| bands.get(k).map_or(0.0, |&b| v[b])))
                .collect()
        };
        // an element that is partly buried has its light on the rest of it
        let mut direct = lanes(system.direct_W_m2);
        for (lane, &exposed) in direct.iter_mut().zip(&system.outlook.exposed) {
            *lane = lane.map(|e| if exposed > 0.0 { e / exposed } else { 0.0 });
        }
        let fixed = lanes(system.fixed_W_m2);
        let mut start = Half {
            irradiance: direct.clone(),
            radiosity: Vec::new(),
        };
        gather.start(&mut start, &fixed);
        Self {
            gather,
            system: *system,
            bands,
            dark: vec![[0.0; N]; fixed.len()],
            x: start.clone(),
            y: start,
            direct,
            fixed,
            done: 0,
        }
    }

    /// Irradiances to begin with: E0, or where there is a far field, what follows from the layer model's.
    pub(super) fn first(&mut self) -> Vec<[f64; N]> {
        if self.system.far.is_some() {
            self.work_off(true);
        }
        self.y.irradiance.clone()
    }

    /// From y to x and back to y, with all light.
    pub(super) fn with_light(&mut self, y: &[[f64; N]]) {
        self.set(y, true);
        self.work_off(true);
    }

    /// The same without sources: what scattering alone makes of `y`.
    pub(super) fn scattering(&mut self, y: &[[f64; N]]) -> Vec<[f64; N]> {
        self.set(y, false);
        self.work_off(false);
        self.y.irradiance.clone()
    }

    /// The radiosities of both halves; all else is freed.
    pub(super) fn into_radiosities(self) -> [Vec<[f64; N]>; 2] {
        [self.x.radiosity, self.y.radiosity]
    }

    fn set(&mut self, y: &[[f64; N]], lit: bool) {
        let rows = self.direct.len();
        let others = if lit { &self.fixed } else { &self.dark };
        for half in [&mut self.x, &mut self.y] {
            half.radiosity[rows..].copy_from_slice(others);
        }
        self.y.irradiance.copy_from_slice(y);
        self.gather.scatter(&mut self.y);
        self.gather.close_far_field(1, &mut self.y.radiosity);
    }

    fn work_off(&mut self, lit: bool) {
        let direct = lit.then_some(&self.direct[..]);
        let [a, b] = &self.system.exchange.halves;
        self.gather.half_pass(0, a, &self.y, direct, &mut self.x);
        self.gather.half_pass(1, b, &self.x, direct, &mut self.y);
        self.done += 1;
    }
}
