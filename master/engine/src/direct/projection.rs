//! Projects the canopy along a direction: what is on top at each point of the lattice.

use glam::DVec3;
use nestrad_kernel::ends::Side;
use nestrad_kernel::ground::{Along, Ground};
use nestrad_kernel::lattice::Lattice;
use nestrad_kernel::zbuffer::Top;

use super::areas::Areas;
use super::classes::Classes;
use super::dealing::{Beam, LARGE};
use super::lit_areas::{LitAreas, LitCell, Scratch};
use super::outlines::Looking;
use super::probe::{Probe, Thin};
use super::shadow::Shadow;
use crate::frame::Frame;

/// How a direction is projected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    /// Number of its source.
    pub(super) k: usize,
    /// Towards the source, a unit vector.
    pub(super) towards: DVec3,
    /// Cross-section of a line, m², about.
    pub(super) line_area_m2: f64,
    /// See [`Lattice::stretched`].
    pub(super) random: [f64; 4],
}

impl Projection {
    /// Projects the canopy along the direction.
    pub(super) fn lit_areas(
        &self,
        frame: &Frame,
        (areas, classes): (&Areas, &Classes),
        probe: &Probe,
        scratch: &mut Scratch,
    ) -> LitAreas {
        let &Self {
            towards,
            line_area_m2,
            random,
            ..
        } = self;
        let lattice = Lattice::stretched(towards, &frame.world.extent, line_area_m2, random);
        let mut missed = 0u64;
        scratch.clear();
        let mut thin = Thin::of(frame, areas, towards, line_area_m2);
        if !probe.serves(self.k) {
            thin.forget();
        }
        let looking = Looking {
            frame,
            classes,
            thin: &thin.organ,
            lattice: &lattice,
        };
        let Scratch {
            buffer,
            visible,
            met,
            outlines,
            ..
        } = scratch;
        outlines.begin(&lattice, &areas.organ_boxes_m);
        let under = Under::of(frame, &lattice);
        let outer = frame.world.outer_soil().zip(frame.world.soil);
        let mut shadow = outer.map(|_| Shadow::new(&lattice));
        buffer.draw(
            &lattice,
            frame.soup(),
            frame.elements(),
            frame.world.soil.map(|s| s.z_m),
            |element| met[element as usize] += 1,
            |buffer, rows| {
                let nx = lattice.nx as usize;
                for (r, j) in rows.enumerate() {
                    outlines.row(&looking, j as usize, |i| buffer.top(r * nx + i));
                    for i in 0..nx {
                        let point = r * nx + i;
                        let top = buffer.top(point);
                        match top {
                            Some(Top { element, upper }) => {
                                let side = if upper { Side::Upper } else { Side::Lower };
                                visible[frame.ends.face(element, side) as usize] += 1;
                                if let Some(shadow) = &mut shadow {
                                    shadow.meets(i, j as usize);
                                }
                            }
                            None => match under.row(i, j) {
                                Some(row) => visible[row] += 1,
                                None => missed += 1,
                            },
                        }
                    }
                }
            },
        );
        let [of_organs, of_scene] = outlines.finish(&looking);
        let mut lit = LitAreas {
            towards,
            line_area_m2: lattice.line_area_m2,
            lines: lattice.lines() as u64,
            missed,
            outlines: of_organs,
            scene: of_scene,
            ..LitAreas::default()
        };
        let beam = Beam {
            frame,
            areas,
            k: self.k,
            towards,
            line_area_m2: lattice.line_area_m2,
        };
        if thin.any() {
            beam.probe(probe, &thin, scratch, &mut lit);
        }
        beam.deal_out(&thin, scratch, &mut lit);
        lit.soil = under.lit_cells(&lattice, &scratch.visible);
        if let Some((shadow, (outer, soil))) = shadow.zip(outer) {
            lit.shades = shadow.on(&outer, &lattice, soil.z_m);
        }
        lit
    }
}

/// The ground under the points of a lattice.
struct Under<'a> {
    frame: &'a Frame,
    ground: Option<Ground>,
    column: Vec<Along>,
    row: Vec<Along>,
}

impl<'a> Under<'a> {
    fn of(frame: &'a Frame, lattice: &Lattice) -> Self {
        let ground = Ground::of(&frame.world);
        let (mut column, mut row) = (Vec::new(), Vec::new());
        if let Some((ground, soil)) = ground.zip(frame.world.soil) {
            let at = |i: u32, j: u32| lattice.point_at(f64::from(i), f64::from(j), soil.z_m);
            column.extend((0..lattice.nx).map(|i| ground.along(0, at(i, 0).x)));
            row.extend((0..lattice.ny).map(|j| ground.along(1, at(0, j).y)));
        }
        Self {
            frame,
            ground,
            column,
            row,
        }
    }

    /// The row of the soil cell; none beyond the map, and where there is no soil.
    fn row(&self, i: usize, j: u32) -> Option<usize> {
        let ground = self.ground.as_ref()?;
        let end = ground.end(self.column[i], self.row[j as usize]) as usize;
        (end < self.frame.rows()).then_some(end)
    }

    /// The cells that are lit. Cells that span some steps of the lattice on both sides are lit by the part of their
    /// points that see the source, so a cell in full light has just that; smaller ones by the area of the points that
    /// show them.
    fn lit_cells(&self, lattice: &Lattice, visible: &[u32]) -> Vec<LitCell> {
        let Some(soil) = &self.frame.world.soil else {
            return Vec::new();
        };
        let points_along = |axis: usize, along: &[Along]| {
            let mut points = vec![0u32; soil.cells[axis] as usize];
            for cell in along.iter().filter_map(|along| along.cell) {
                points[cell as usize] += 1;
            }
            points
        };
        let (across, along) = (points_along(0, &self.column), points_along(1, &self.row));
        let corner = soil.min_m.extend(soil.z_m);
        let steps = lattice.place(corner + soil.cell_m.extend(0.0)) - lattice.place(corner);
        let is_large = steps.min_element() >= LARGE.sqrt();
        let of_point = lattice.line_area_m2 / (lattice.direction.z * soil.cell_area_m2());
        let seen = |cell: u32| f64::from(visible[self.frame.ends.soil(cell) as usize]);
        let cells = 0..self.frame.ends.soil_cells;
        let lit = cells.map(|cell| {
            let [column, row] = [cell % soil.cells[0], cell / soil.cells[0]];
            let met = f64::from(across[column as usize] * along[row as usize]);
            let seen = seen(cell);
            let (part, variance) = if is_large && met > 0.0 {
                let part = seen / met;
                // binomial, for the points that meet it
                (part, part * (1.0 - part) / met)
            } else {
                (seen * of_point, seen.max(1.0) * of_point * of_point)
            };
            LitCell {
                cell,
                part,
                variance,
            }
        });
        let mut lit: Vec<LitCell> = lit.collect();
        // together they get the light of all points that show them
        let points: f64 = (0..self.frame.ends.soil_cells).map(seen).sum();
        let dealt: f64 = lit.iter().map(|lit| lit.part).sum();
        let scale = if dealt > 0.0 {
            points * of_point / dealt
        } else {
            1.0
        };
        for lit in &mut lit {
            lit.variance += (lit.part * (scale - 1.0)).powi(2);
            lit.part *= scale;
        }
        lit.retain(|lit| lit.part > 0.0 || lit.variance > 0.0);
        lit
    }
}
