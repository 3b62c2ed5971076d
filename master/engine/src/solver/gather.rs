//! One half of a pass: every row gathers what it sees, then scatters it.

use nestrad_kernel::far_grid::Exit;
use rayon::prelude::*;

use super::lane::Lane;
use super::prefetch::prefetch;
use super::sums::{TASK, sum_of};
use super::system::System;
use crate::exchange::{FarRows, HalfRows, Outlook};
use crate::frame::Frame;

/// Least part of an irradiance that counts when changes are judged.
const LEAST_COUNTED: f64 = 0.1;

/// What a material does, per band of the group.
#[derive(Clone, Copy, Debug)]
struct Scatter<const N: usize> {
    rho_upper: [f64; N],
    tau_upper: [f64; N],
    rho_lower: [f64; N],
    tau_lower: [f64; N],
    absorbed_upper: [f64; N],
    absorbed_lower: [f64; N],
}

/// Gathers and scatters for a group of `N` bands.
pub(super) struct Gather<'a, const N: usize> {
    pub(super) frame: &'a Frame,
    materials: Vec<Scatter<N>>,
    material_of_element: Vec<u32>,
    soil_albedo: [f64; N],
    pub(super) outlook: &'a Outlook,
    far: Option<&'a FarRows>,
}

/// Irradiance of all rows and radiosity of all ends, in one half.
#[derive(Clone, Debug)]
pub(super) struct Half<L> {
    /// Irradiance, W m⁻², per row.
    pub(super) irradiance: Vec<L>,
    /// Radiosity, W m⁻², per end.
    pub(super) radiosity: Vec<L>,
}

impl<L> Default for Half<L> {
    fn default() -> Self {
        Self {
            irradiance: Vec::new(),
            radiosity: Vec::new(),
        }
    }
}

impl<'a, const N: usize> Gather<'a, N> {
    /// Prepares the bands with these numbers (at most `N`; the rest are black).
    pub(super) fn new(system: &System<'a>, bands: &[usize]) -> Self {
        let System {
            frame,
            optics,
            outlook,
            far,
            ..
        } = *system;
        let lane = |value: &dyn Fn(usize) -> f64| {
            std::array::from_fn(|k| bands.get(k).map_or(0.0, |&b| value(b)))
        };
        let materials = (0..frame.kinds.len())
            .map(|m| {
                let of = |b: usize| optics.bands[b].materials[m];
                Scatter {
                    rho_upper: lane(&|b| of(b).upper.rho),
                    tau_upper: lane(&|b| of(b).upper.tau),
                    rho_lower: lane(&|b| of(b).lower.rho),
                    tau_lower: lane(&|b| of(b).lower.tau),
                    absorbed_upper: lane(&|b| of(b).upper.absorptance()),
                    absorbed_lower: lane(&|b| of(b).lower.absorptance()),
                }
            })
            .collect();
        let material_of_element = frame
            .triangle_of_element
            .iter()
            .map(|&t| frame.material[t as usize])
            .collect();
        Self {
            frame,
            materials,
            material_of_element,
            soil_albedo: lane(&|b| optics.bands[b].soil_albedo),
            outlook,
            far,
        }
    }

    /// Begins with the irradiances of a half: sets what they make the rows send out, and the ends that are not
    /// rows, from the sky on, to `fixed`.
    pub(super) fn start<L: Lane<N>>(&self, half: &mut Half<L>, fixed: &[L]) {
        half.radiosity.clear();
        // memory that is aligned to cache lines cannot grow in place: there would be two of it for a while
        half.radiosity
            .reserve_exact(self.frame.rows() + fixed.len());
        half.radiosity.resize(self.frame.rows(), L::of([0.0; N]));
        half.radiosity.extend_from_slice(fixed);
        self.scatter(half);
    }

    /// Sets what the rows send out, as follows from their irradiances.
    pub(super) fn scatter<L: Lane<N>>(&self, half: &mut Half<L>) {
        let faces = self.frame.ends.faces() as usize;
        let (of_faces, rest) = half.radiosity.split_at_mut(faces);
        of_faces
            .par_chunks_mut(2 * TASK)
            .zip(half.irradiance[..faces].par_chunks(2 * TASK))
            .enumerate()
            .for_each(|(task, (out, irradiance))| {
                for (k, (out, pair)) in out
                    .chunks_exact_mut(2)
                    .zip(irradiance.chunks_exact(2))
                    .enumerate()
                {
                    let [upper, lower] =
                        self.scattered(task * TASK + k, &pair[0].get(), &pair[1].get());
                    (out[0], out[1]) = (L::of(upper), L::of(lower));
                }
            });
        for (out, on) in rest.iter_mut().zip(&half.irradiance[faces..]) {
            *out = self.scattered_by_soil(&on.get());
        }
    }

    fn scattered_by_soil<L: Lane<N>>(&self, on: &[f64; N]) -> L {
        L::of(std::array::from_fn(|k| self.soil_albedo[k] * on[k]))
    }

    /// One half of a pass: `into = E0 + F radiosity of the other half`, and what that makes the rows send
    /// out. A row without lines in this half takes the irradiance of the other. Without `direct`, E0 is
    /// dark.
    ///
    /// Returns how much the absorbed power changed, summed without regard to sign, W (see
    /// [`Self::counted_area_m2`]).
    pub(super) fn half_pass<L: Lane<N>>(
        &self,
        half: usize,
        rows_of_half: &HalfRows,
        other: &Half<L>,
        direct: Option<&[L]>,
        into: &mut Half<L>,
    ) -> [f64; N] {
        let (rows, faces) = (self.frame.rows(), self.frame.ends.faces() as usize);
        let (face_irradiance, soil_irradiance) = into.irradiance.split_at_mut(faces);
        let (face_radiosity, rest) = into.radiosity.split_at_mut(faces);
        let soil_radiosity = &mut rest[..rows - faces];

        let gathered = |row: usize| -> [f64; N] {
            let weight = self.outlook.weight[half][row];
            if weight > 0.0 {
                let sum = gather(rows_of_half, row, &other.radiosity);
                let first = direct.map_or([0.0; N], |d| d[row].get());
                std::array::from_fn(|k| first[k] + sum[k] * weight)
            } else {
                other.irradiance[row].get()
            }
        };
        let of_faces: Vec<[f64; N]> = face_irradiance
            .par_chunks_mut(2 * TASK)
            .zip(face_radiosity.par_chunks_mut(2 * TASK))
            .enumerate()
            .map(|(task, (irradiance, radiosity))| {
                let mut change = [0.0; N];
                for (k, (pair, out)) in irradiance
                    .chunks_exact_mut(2)
                    .zip(radiosity.chunks_exact_mut(2))
                    .enumerate()
                {
                    let element = task * TASK + k;
                    let (upper, lower) = (gathered(2 * element), gathered(2 * element + 1));
                    let [up_area, low_area] =
                        [0, 1].map(|side| self.counted_area_m2(element, side));
                    let (old_upper, old_lower) = (pair[0].get(), pair[1].get());
                    for b in 0..N {
                        change[b] += up_area[b] * (upper[b] - old_upper[b]).abs()
                            + low_area[b] * (lower[b] - old_lower[b]).abs();
                    }
                    (pair[0], pair[1]) = (L::of(upper), L::of(lower));
                    let [upper, lower] = self.scattered(element, &upper, &lower);
                    (out[0], out[1]) = (L::of(upper), L::of(lower));
                }
                change
            })
            .collect();
        let soil_area = self.counted_soil_m2();
        let of_soil: Vec<[f64; N]> = soil_irradiance
            .par_chunks_mut(TASK)
            .zip(soil_radiosity.par_chunks_mut(TASK))
            .enumerate()
            .map(|(task, (irradiance, radiosity))| {
                let mut change = [0.0; N];
                for (k, (on, out)) in irradiance.iter_mut().zip(radiosity).enumerate() {
                    let (new, old) = (gathered(faces + task * TASK + k), on.get());
                    for b in 0..N {
                        change[b] += soil_area[b] * (new[b] - old[b]).abs();
                    }
                    *on = L::of(new);
                    *out = self.scattered_by_soil(&new);
                }
                change
            })
            .collect();
        self.close_far_field(half, &mut into.radiosity);
        let (faces, soil) = (sum_of(&of_faces), sum_of(&of_soil));
        std::array::from_fn(|k| faces[k] + soil[k])
    }

    /// The radiosities of the far ends as they follow from those of the faces.
    pub(super) fn close_far_field<L: Lane<N>>(&self, half: usize, radiosity: &mut [L]) {
        let Some(far) = self.far else { return };
        let (near, far_ends) = radiosity.split_at_mut(self.frame.ends.far(0) as usize);
        let rows = &far.halves[half];
        far_ends.par_iter_mut().enumerate().for_each(|(row, out)| {
            let lines = rows.row(row).len();
            // a level that no line passes keeps what it has
            if lines > 0 {
                let sum = gather(rows, row, near);
                *out = L::of(sum.map(|s| s / lines as f64));
            }
        });
    }

    /// What leaves upwards and downwards through a far field, W per m² of ground: the mean over lines through
    /// the whole scene, of which there are as many along a direction as it has flux.
    pub(super) fn leaving<L: Lane<N>>(&self, half: usize, radiosity: &[L]) -> [[f64; N]; 2] {
        let Some(far) = self.far else {
            return [[0.0; N]; 2];
        };
        Exit::BOTH.map(|exit| {
            if exit == Exit::Down && self.frame.world.soil.is_some() {
                return [0.0; N];
            }
            let (rows, row) = (&far.halves[half], far.leaving(exit));
            let lines = rows.row(row).len().max(1) as f64;
            gather(rows, row, radiosity).map(|s| s / lines)
        })
    }

    /// Power that irradiances make all rows absorb, summed without regard to sign, W (see
    /// [`Self::counted_area_m2`]).
    pub(super) fn absorbed<L: Lane<N>>(&self, irradiance: &[L]) -> [f64; N] {
        let faces = self.frame.ends.faces() as usize;
        let soil = self.counted_soil_m2();
        let parts: Vec<[f64; N]> = irradiance
            .par_chunks(2 * TASK)
            .enumerate()
            .map(|(task, chunk)| {
                let mut sum = [0.0; N];
                for (k, on) in chunk.iter().enumerate() {
                    let row = 2 * TASK * task + k;
                    let counted = if row < faces {
                        self.counted_area_m2(row / 2, row % 2)
                    } else {
                        soil
                    };
                    let on = on.get();
                    for b in 0..N {
                        sum[b] += counted[b] * on[b].abs();
                    }
                }
                sum
            })
            .collect();
        sum_of(&parts)
    }

    /// What a change of irradiance of a face is multiplied with to be judged, m²: its area that is not
    /// buried, times its absorptance. A face that absorbs next to nothing counts for a tenth of its area,
    /// since what it scatters ends somewhere.
    fn counted_area_m2(&self, element: usize, side: usize) -> [f64; N] {
        let m = &self.materials[self.material_of_element[element] as usize];
        let absorbed = if side == 0 {
            &m.absorbed_upper
        } else {
            &m.absorbed_lower
        };
        let area = self.frame.area_m2[element] * self.outlook.exposed[2 * element + side];
        absorbed.map(|a| a.max(LEAST_COUNTED) * area)
    }

    /// The same of a soil cell.
    fn counted_soil_m2(&self) -> [f64; N] {
        let area = self.frame.world.soil.map_or(0.0, |s| s.cell_area_m2());
        self.soil_albedo
            .map(|a| area * (1.0 - a).max(LEAST_COUNTED))
    }

    /// What the upper and the lower face of an element send out (DESIGN: section 2).
    #[inline]
    fn scattered(&self, element: usize, upper: &[f64; N], lower: &[f64; N]) -> [[f64; N]; 2] {
        let m = &self.materials[self.material_of_element[element] as usize];
        [
            std::array::from_fn(|b| m.rho_upper[b] * upper[b] + m.tau_lower[b] * lower[b]),
            std::array::from_fn(|b| m.rho_lower[b] * lower[b] + m.tau_upper[b] * upper[b]),
        ]
    }
}

/// Sum of the radiosities of what a row sees: all lines weigh the same. What is buried is dark, and is
/// not in the weight.
#[inline]
fn gather<L: Lane<N>, const N: usize>(rows: &HalfRows, row: usize, seen: &[L]) -> [f64; N] {
    let ends = rows.ends();
    let mut sum = [0.0; N];
    for i in rows.range(row) {
        prefetch(seen, ends, i);
        let b = seen[ends[i] as usize].get();
        for k in 0..N {
            sum[k] += b[k];
        }
    }
    sum
}
