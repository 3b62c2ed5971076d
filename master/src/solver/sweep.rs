//! One half of a pass: every row gathers what it sees, then scatters it.

use nestrad_common::problem::Problem;
use rayon::prelude::*;

use super::Lane;
use crate::exchange::{HalfRows, Outlook};
use crate::far_field::closure::FarRows;
use crate::world::World;

/// Elements that are worked off as one task; a fixed number, so that sums have a fixed order.
const TASK: usize = 512;

/// Least part of an irradiance that counts when changes are judged.
const LEAST_COUNTED: f64 = 0.1;

/// What a material does, per band of the group.
#[derive(Clone, Copy, Debug)]
struct Scatter<const N: usize> {
    rho_upper: Lane<N>,
    tau_upper: Lane<N>,
    rho_lower: Lane<N>,
    tau_lower: Lane<N>,
    absorbed_upper: Lane<N>,
    absorbed_lower: Lane<N>,
}

/// Gathers and scatters for a group of `N` bands.
pub(super) struct Gather<'a, const N: usize> {
    pub(super) world: &'a World,
    materials: Vec<Scatter<N>>,
    material_of_element: Vec<u32>,
    soil_albedo: Lane<N>,
    pub(super) outlook: &'a Outlook,
    far: Option<&'a FarRows>,
}

/// Irradiance of all rows and radiosity of all ends, in one half.
#[derive(Clone, Debug)]
pub(super) struct Half<const N: usize> {
    /// Irradiance, W m⁻², per row.
    pub(super) irradiance: Vec<Lane<N>>,
    /// Radiosity, W m⁻², per end.
    pub(super) radiosity: Vec<Lane<N>>,
}

impl<'a, const N: usize> Gather<'a, N> {
    /// Prepares the bands with these numbers (at most `N`; the rest are black).
    pub(super) fn new(
        problem: &Problem,
        world: &'a World,
        outlook: &'a Outlook,
        far: Option<&'a FarRows>,
        bands: &[usize],
    ) -> Self {
        let lane = |value: &dyn Fn(usize) -> f64| {
            std::array::from_fn(|k| bands.get(k).map_or(0.0, |&b| value(b)))
        };
        let materials = (0..problem.scene.materials.len())
            .map(|m| {
                let of = |b: usize| problem.bands[b].materials[m];
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
        let material_of_element = world
            .triangle_of_element
            .iter()
            .map(|&t| problem.scene.material[t as usize])
            .collect();
        Self {
            world,
            materials,
            material_of_element,
            soil_albedo: lane(&|b| problem.bands[b].soil_albedo),
            outlook,
            far,
        }
    }

    /// A half with the given irradiances, and what they make the rows send out.
    ///
    /// `fixed`: radiosities of the ends that are not rows, from the sky on.
    pub(super) fn start(&self, irradiance: Vec<Lane<N>>, fixed: &[Lane<N>]) -> Half<N> {
        let mut radiosity = vec![[0.0; N]; self.world.ends.len()];
        radiosity[self.world.rows()..].copy_from_slice(fixed);
        for (e, pair) in irradiance[..self.world.ends.faces() as usize]
            .chunks_exact(2)
            .enumerate()
        {
            let [upper, lower] = self.scattered(e, &pair[0], &pair[1]);
            (radiosity[2 * e], radiosity[2 * e + 1]) = (upper, lower);
        }
        for row in self.world.ends.faces() as usize..self.world.rows() {
            radiosity[row] = std::array::from_fn(|k| self.soil_albedo[k] * irradiance[row][k]);
        }
        Half {
            irradiance,
            radiosity,
        }
    }

    /// `into.irradiance += omega * (E0 + F radiosity of the other half - into.irradiance)`, and the
    /// radiosities that follow. A row without lines in this half takes the irradiance of the other.
    ///
    /// Returns how much the absorbed power changed, per band, summed without regard to sign, W (see
    /// [`Self::counted_area_m2`]).
    pub(super) fn sweep(
        &self,
        half: usize,
        rows_of_half: &HalfRows,
        other: &Half<N>,
        direct: &[Lane<N>],
        omega: &Lane<N>,
        into: &mut Half<N>,
    ) -> Lane<N> {
        let (rows, faces) = (self.world.rows(), self.world.ends.faces() as usize);
        let (face_irradiance, soil_irradiance) = into.irradiance.split_at_mut(faces);
        let (face_radiosity, rest) = into.radiosity.split_at_mut(faces);
        let soil_radiosity = &mut rest[..rows - faces];

        let relaxed = |row: usize, old: &Lane<N>| -> (Lane<N>, Lane<N>) {
            let weight = self.outlook.weight[half][row];
            let gathered = if weight > 0.0 {
                let sum = gather(rows_of_half.row(row), &other.radiosity);
                std::array::from_fn(|k| direct[row][k] + sum[k] * weight)
            } else {
                other.irradiance[row]
            };
            let step: Lane<N> = std::array::from_fn(|k| omega[k] * (gathered[k] - old[k]));
            (std::array::from_fn(|k| old[k] + step[k]), step)
        };
        let of_faces: Vec<Lane<N>> = face_irradiance
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
                    let (upper, up_step) = relaxed(2 * element, &pair[0]);
                    let (lower, low_step) = relaxed(2 * element + 1, &pair[1]);
                    (pair[0], pair[1]) = (upper, lower);
                    let [up_area, low_area] =
                        [0, 1].map(|side| self.counted_area_m2(element, side));
                    for b in 0..N {
                        change[b] +=
                            up_area[b] * up_step[b].abs() + low_area[b] * low_step[b].abs();
                    }
                    let [upper, lower] = self.scattered(element, &pair[0], &pair[1]);
                    (out[0], out[1]) = (upper, lower);
                }
                change
            })
            .collect();
        let of_soil: Vec<Lane<N>> = soil_irradiance
            .par_chunks_mut(TASK)
            .zip(soil_radiosity.par_chunks_mut(TASK))
            .enumerate()
            .map(|(task, (irradiance, radiosity))| {
                let area = self.world.soil.map_or(0.0, |s| s.cell_area_m2());
                let mut change = [0.0; N];
                for (k, (e, out)) in irradiance.iter_mut().zip(radiosity).enumerate() {
                    let (new, step) = relaxed(faces + task * TASK + k, e);
                    *e = new;
                    for b in 0..N {
                        change[b] +=
                            area * (1.0 - self.soil_albedo[b]).max(LEAST_COUNTED) * step[b].abs();
                        out[b] = self.soil_albedo[b] * new[b];
                    }
                }
                change
            })
            .collect();
        self.close_far_field(half, &mut into.radiosity);
        of_faces
            .iter()
            .chain(&of_soil)
            .fold([0.0; N], |sum, c| std::array::from_fn(|b| sum[b] + c[b]))
    }

    /// The radiosities of the far ends as they follow from those of the faces.
    fn close_far_field(&self, half: usize, radiosity: &mut [Lane<N>]) {
        let Some(far) = self.far else { return };
        let (near, far_ends) = radiosity.split_at_mut(self.world.ends.far_start() as usize);
        let rows = &far.halves[half];
        far_ends.par_iter_mut().enumerate().for_each(|(row, out)| {
            let ends = rows.row(row);
            // a level that no line passes keeps what it has
            if !ends.is_empty() {
                let sum = gather(ends, near);
                *out = sum.map(|s| s / ends.len() as f64);
            }
        });
    }

    /// What a change of irradiance of a face is multiplied with to be judged, m²: its area that is not
    /// buried, times its absorptance. A face that absorbs next to nothing counts for a tenth of its area,
    /// since what it scatters ends somewhere.
    pub(super) fn counted_area_m2(&self, element: usize, side: usize) -> Lane<N> {
        let m = &self.materials[self.material_of_element[element] as usize];
        let absorbed = if side == 0 {
            &m.absorbed_upper
        } else {
            &m.absorbed_lower
        };
        let area = self.world.elements.area_m2[element] * self.outlook.exposed[2 * element + side];
        absorbed.map(|a| a.max(LEAST_COUNTED) * area)
    }

    /// What the upper and the lower face of an element send out (DESIGN: section 2).
    #[inline]
    fn scattered(&self, element: usize, upper: &Lane<N>, lower: &Lane<N>) -> [Lane<N>; 2] {
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
fn gather<const N: usize>(row: &[u32], seen: &[Lane<N>]) -> Lane<N> {
    let mut sum = [0.0; N];
    for &end in row {
        let b = &seen[end as usize];
        for k in 0..N {
            sum[k] += b[k];
        }
    }
    sum
}
