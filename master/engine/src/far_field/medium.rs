//! What a layer does to light per unit of depth: the right-hand side of the transport equation.

use nestrad_common::light::Source;
use nestrad_common::optics::Band;

use super::layers::{Foliage, Layers};
use super::leaf::{self, Bins, LeafAngle};
use super::matrix::{Matrix, sum};

/// The parallel sources of a band, those of equal height in one.
pub(super) struct Beams {
    /// Cosine of the zenith angle, 0 to 1, of each.
    mu: Vec<f64>,
    /// Irradiance of a horizontal plane above the canopy, W m⁻².
    pub(super) irradiance: Vec<f64>,
}

impl Beams {
    /// The layer model knows no azimuth, so nothing is lost by joining sources of one height.
    pub(super) fn new(sources: &[Source], band_index: usize) -> Self {
        let mut all: Vec<(f64, f64)> = sources
            .iter()
            .map(|s| {
                (
                    (-s.direction.z).clamp(0.0, 1.0),
                    s.irradiance_W_m2[band_index],
                )
            })
            .filter(|&(_, irradiance)| irradiance > 0.0)
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut beams = Self {
            mu: Vec::new(),
            irradiance: Vec::new(),
        };
        for (mu, irradiance) in all {
            match beams.irradiance.last_mut() {
                Some(last) if beams.mu.last() == Some(&mu) => *last += irradiance,
                _ => {
                    beams.mu.push(mu);
                    beams.irradiance.push(irradiance);
                }
            }
        }
        beams
    }
}

/// What does not differ from layer to layer.
pub(super) struct Medium<'a> {
    bins: Bins,
    band: &'a Band,
    beams: &'a Beams,
    angles: Vec<LeafAngle>,
    /// Per class and beam: mean of `max(0, cos)` between beam and skyward face.
    beam_onto_sky_face: Vec<Vec<f64>>,
    /// Likewise for the groundward face.
    beam_onto_ground_face: Vec<Vec<f64>>,
}

/// One layer, all of it: depths and rates are for its whole thickness.
pub(super) struct LayerOptics {
    /// Change of the flux in each channel along its way, per flux in each channel.
    pub(super) interaction: Matrix,
    /// Optical depth that each beam meets.
    pub(super) beam_depth: Vec<f64>,
    /// Flux scattered into each channel (row) per flux intercepted from each beam (column).
    pub(super) beam_scatter: Matrix,
    /// Absorbed flux per flux in each channel: what the column of `interaction` sums to, but for
    /// the sign, computed without cancellation.
    pub(super) absorption: Vec<f64>,
    /// Flux absorbed at once per flux intercepted from each beam.
    pub(super) beam_absorption: Vec<f64>,
}

/// Area times optical properties of all leaves of a class.
#[derive(Clone, Copy, Default)]
struct ClassOptics {
    area: f64,
    rho_sky: f64,
    tau_sky: f64,
    absorbed_sky: f64,
    rho_ground: f64,
    tau_ground: f64,
    absorbed_ground: f64,
}

impl<'a> Medium<'a> {
    pub(super) fn new(layers: &Layers, bins: Bins, band: &'a Band, beams: &'a Beams) -> Self {
        let cosines = &layers.class_cosine;
        let facing = |sign: f64| {
            let of_class = |&c: &f64| {
                let onto = |&mu: &f64| (0.5 * (leaf::projection(mu, c) + sign * mu * c)).max(0.0);
                beams.mu.iter().map(onto).collect()
            };
            cosines.iter().map(of_class).collect()
        };
        Self {
            bins,
            band,
            beams,
            angles: cosines.iter().map(|&c| LeafAngle::new(bins, c)).collect(),
            // A beam travels down, so tilt turns it towards the skyward face.
            beam_onto_sky_face: facing(1.0),
            beam_onto_ground_face: facing(-1.0),
        }
    }

    /// The optics of a layer that holds something; `None` when there is nothing in it.
    pub(super) fn layer(&self, foliage: &[Foliage]) -> Option<LayerOptics> {
        let channels = 2 * self.bins.0;
        let beams = self.beams.mu.len();
        let mut interaction = Matrix::zeros(channels, channels);
        let mut absorption = vec![0.0; channels];
        let mut beam_scatter = Matrix::zeros(channels, beams);
        let mut beam_absorption = vec![0.0; beams];
        let mut intercepted = vec![0.0; beams];
        let mut any = false;
        for (class, leaves) in self.by_class(foliage).iter().enumerate() {
            if leaves.area <= 0.0 {
                continue;
            }
            any = true;
            let angle = &self.angles[class];
            let onto = Onto(&angle.onto_sky_face, &angle.onto_ground_face);
            leaves.scatter(angle, onto, &mut interaction);
            add(&mut absorption, &leaves.absorbed(onto));
            let onto = Onto(
                &self.beam_onto_sky_face[class],
                &self.beam_onto_ground_face[class],
            );
            leaves.scatter(angle, onto, &mut beam_scatter);
            add(&mut beam_absorption, &leaves.absorbed(onto));
            add(&mut intercepted, &leaves.met(onto));
        }
        // A channel loses what goes to the others and what is absorbed. Extinction less what comes
        // back into the same channel is the same, but loses energy to rounding where it cancels.
        for ch in 0..channels {
            interaction.row_mut(ch)[ch] = 0.0;
        }
        let lost = sum(&interaction.column_sums(), &absorption);
        for (ch, lost) in lost.into_iter().enumerate() {
            interaction.row_mut(ch)[ch] = -lost;
        }
        // Vertical leaves under a vertical beam meet nothing of it.
        let inverse = |&met: &f64| {
            if met >= f64::MIN_POSITIVE {
                1.0 / met
            } else {
                0.0
            }
        };
        let per_met: Vec<f64> = intercepted.iter().map(inverse).collect();
        beam_scatter.scale_columns(&per_met);
        let depth = |met, mu| {
            if met >= f64::MIN_POSITIVE {
                met / mu
            } else {
                0.0
            }
        };
        any.then(|| LayerOptics {
            interaction,
            absorption,
            beam_depth: zip_map(&intercepted, &self.beams.mu, depth),
            beam_scatter,
            beam_absorption: zip_map(&beam_absorption, &per_met, |a, per_met| a * per_met),
        })
    }

    /// A leaf whose lower face looks up is one whose faces have changed places.
    fn by_class(&self, foliage: &[Foliage]) -> Vec<ClassOptics> {
        let mut sums = vec![ClassOptics::default(); self.angles.len()];
        for f in foliage {
            let leaf = &self.band.materials[f.material as usize];
            let (sky, ground) = if f.lower_face_up {
                (leaf.lower, leaf.upper)
            } else {
                (leaf.upper, leaf.lower)
            };
            let sum = &mut sums[f.class as usize];
            sum.area += f.area_index;
            sum.rho_sky += f.area_index * sky.rho;
            sum.tau_sky += f.area_index * sky.tau;
            sum.absorbed_sky += f.area_index * sky.absorptance();
            sum.rho_ground += f.area_index * ground.rho;
            sum.tau_ground += f.area_index * ground.tau;
            sum.absorbed_ground += f.area_index * ground.absorptance();
        }
        sums
    }
}

/// Light that arrives on the skyward and on the groundward face, by origin.
#[derive(Clone, Copy)]
struct Onto<'a>(&'a [f64], &'a [f64]);

impl Onto<'_> {
    fn weighted(self, sky: f64, ground: f64) -> Vec<f64> {
        zip_map(self.0, self.1, |s, g| sky * s + ground * g)
    }
}

impl ClassOptics {
    fn met(&self, onto: Onto) -> Vec<f64> {
        onto.weighted(self.area, self.area)
    }

    fn absorbed(&self, onto: Onto) -> Vec<f64> {
        onto.weighted(self.absorbed_sky, self.absorbed_ground)
    }

    /// Adds what the leaves send out (row: channel, column: origin) to `sum`.
    fn scatter(&self, angle: &LeafAngle, onto: Onto, sum: &mut Matrix) {
        let by_sky_face = onto.weighted(self.rho_sky, self.tau_ground);
        let by_ground_face = onto.weighted(self.tau_sky, self.rho_ground);
        sum.add_outer(&angle.from_sky_face, &by_sky_face);
        sum.add_outer(&angle.from_ground_face, &by_ground_face);
    }
}

fn zip_map(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().zip(b).map(|(&a, &b)| f(a, b)).collect()
}

fn add(sum: &mut [f64], more: &[f64]) {
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum += more;
    }
}
