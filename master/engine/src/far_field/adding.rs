//! Adding: from the layers to the light at every level, in one sweep down and one up.
//!
//! Grant & Hunt 1969 (invariant embedding for layers that differ), with the first sweep from the top
//! because beams come from there. Levels and layers count from the ground.

use super::layer_slab::LayerSlab;
use super::leaf::Bins;
use super::matrix::{LEAST_LOSS, Lu, Matrix, dot, sum};

/// Everything above a level, as seen from below.
struct Above {
    /// Where upward light comes back.
    reflect: Matrix,
    /// The share of upward light, per bin, that does not come back; with the columns of `reflect` it
    /// adds up to 1.
    lost: Vec<f64>,
    /// Scattered light that comes down if none goes up.
    emit: Vec<f64>,
}

impl Above {
    /// Nothing but sky, which sends no scattered light.
    fn sky(bins: Bins) -> Self {
        Self {
            reflect: Matrix::zeros(bins.0, bins.0),
            lost: vec![1.0; bins.0],
            emit: vec![0.0; bins.0],
        }
    }

    /// Downward light, given the upward one.
    fn down(&self, up: &[f64]) -> Vec<f64> {
        sum(&self.reflect.times_column(up), &self.emit)
    }
}

/// A layer on the way down the stack: what the way up needs to know of it.
struct Step {
    /// What is above the layer.
    above: Above,
    /// Upward light at the upper level is `passed * (upward light at the lower level) + own`.
    passed: Matrix,
    own: Vec<f64>,
    absorb_top: Vec<f64>,
    absorb_bottom: Vec<f64>,
    /// Absorbed from the beams.
    absorbed_beams: f64,
}

impl Step {
    /// The layer under `above`, and what is above its lower level.
    fn new(layer: LayerSlab, above: Above, beams: &[f64]) -> (Self, Above) {
        let LayerSlab {
            slab,
            beams: of_beams,
        } = layer;
        let emit_up = of_beams.emit_up.times_column(beams);
        let emit_down = of_beams.emit_down.times_column(beams);
        let lost_below = slab.lost_from_above();
        let top = slab.reflect_top;

        // Light on its way up at the upper level, that comes back from above and again from below.
        let rounds = Lu::of_rounds(
            top.times(&above.reflect),
            sum(&above.lost, &above.reflect.row_times(&lost_below)),
        );
        let passed = rounds.solve(slab.transmit_up);
        let own = rounds.solve_column(sum(&top.times_column(&above.emit), &emit_up));
        let coming_down = above.reflect.times(&passed);

        let down = slab.transmit_down;
        let lost_beyond = sum(
            &passed.row_times(&above.lost),
            &coming_down.row_times(&slab.absorb_top),
        );
        let below = Above {
            reflect: down.times(&coming_down).plus(&slab.reflect_bottom),
            lost: sum(&slab.absorb_bottom, &lost_beyond),
            emit: sum(&down.times_column(&above.down(&own)), &emit_down),
        };
        let step = Self {
            above,
            passed,
            own,
            absorb_top: slab.absorb_top,
            absorb_bottom: slab.absorb_bottom,
            absorbed_beams: dot(&of_beams.absorbed, beams),
        };
        (step, below)
    }
}

/// Fluxes at the levels, per bin from the horizon, W m⁻² of ground.
pub(super) struct Fluxes {
    pub(super) up: Vec<Vec<f64>>,
    pub(super) down: Vec<Vec<f64>>,
    /// Absorbed per layer, scattered light and beams, W m⁻² of ground.
    pub(super) absorbed: Vec<f64>,
    /// What the beams bring to the lowest level unscattered.
    pub(super) beams_at_ground: f64,
}

/// Solves for a stack of layers, listed from the top and made as they are asked for (`None`: an
/// empty one), over ground with Lambertian `albedo`, under beams of the given horizontal
/// `irradiance` and a sky that sends nothing else.
pub(super) fn add_layers(
    bins: Bins,
    layers_from_top: impl Iterator<Item = Option<LayerSlab>>,
    irradiance: &[f64],
    albedo: f64,
) -> Fluxes {
    let mut above = Above::sky(bins);
    let mut depth = vec![0.0; irradiance.len()];
    let mut beams = irradiance.to_vec();
    let mut steps = Vec::new();
    for slab in layers_from_top {
        let Some(slab) = slab else {
            steps.push(None);
            continue;
        };
        depth = sum(&depth, &slab.beams.depth);
        let (step, below) = Step::new(slab, above, &beams);
        steps.push(Some(step));
        above = below;
        for ((beam, at_top), depth) in beams.iter_mut().zip(irradiance).zip(&depth) {
            *beam = at_top * (-depth).exp();
        }
    }

    // At the ground, upward light is Lambertian: a single number, namely the albedo's share of what
    // arrives, over what does not come back of it.
    let beams_at_ground = beams.iter().sum();
    let shape: Vec<f64> = (0..bins.0).map(|b| bins.lambertian(b)).collect();
    let lost = 1.0 - albedo + albedo * dot(&shape, &above.lost);
    let arriving = beams_at_ground + above.emit.iter().sum::<f64>();
    let power = albedo * arriving / lost.max(LEAST_LOSS);
    let up: Vec<f64> = shape.iter().map(|share| power * share).collect();
    let mut fluxes = Fluxes {
        down: vec![above.down(&up)],
        up: vec![up],
        absorbed: Vec::with_capacity(steps.len()),
        beams_at_ground,
    };
    for step in steps.iter().rev() {
        fluxes.climb(step.as_ref());
    }
    fluxes
}

impl Fluxes {
    /// Adds the next layer and the level above it.
    fn climb(&mut self, step: Option<&Step>) {
        let level = self.absorbed.len();
        let below = &self.up[level];
        let (up, down, absorbed) = match step {
            None => (below.clone(), self.down[level].clone(), 0.0),
            Some(step) => {
                let up = sum(&step.passed.times_column(below), &step.own);
                let down = step.above.down(&up);
                let absorbed = dot(&step.absorb_top, &down) + dot(&step.absorb_bottom, below);
                (up, down, absorbed + step.absorbed_beams)
            }
        };
        self.up.push(up);
        self.down.push(down);
        self.absorbed.push(absorbed);
    }
}
