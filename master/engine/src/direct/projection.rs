//! Projects the canopy along a direction: what is on top at each point of the lattice.

use glam::DVec3;
use nestrad_kernel::ends::Side;
use nestrad_kernel::ground::{Along, Ground};
use nestrad_kernel::lattice::Lattice;
use nestrad_kernel::zbuffer::Top;

use super::areas::Areas;
use super::dealing::Beam;
use super::lit_areas::{LitAreas, Scratch};
use super::outlines::Outlines;
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
    /// See [`Lattice::new`].
    pub(super) random: [f64; 3],
}

impl Projection {
    /// Projects the canopy along the direction.
    pub(super) fn lit_areas(
        &self,
        frame: &Frame,
        areas: &Areas,
        probe: Option<&Probe>,
        scratch: &mut Scratch,
    ) -> LitAreas {
        let &Self {
            towards,
            line_area_m2,
            random,
            ..
        } = self;
        let lattice = Lattice::new(towards, &frame.world.extent, line_area_m2, random);
        let mut missed = 0u64;
        scratch.clear();
        let mut thin = Thin::of(frame, areas, towards, line_area_m2);
        if probe.is_none() {
            thin.forget();
        }
        let mut outlines = Outlines::new(frame, &thin.organ, lattice.nx);
        let Scratch {
            buffer,
            visible,
            met,
            ..
        } = scratch;
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
                for (r, j) in rows.clone().enumerate() {
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
                        // neighbours to the right and above, within the strip
                        let at = [i, j as usize];
                        if i + 1 < nx {
                            outlines.beside(top, buffer.top(point + 1), at);
                        }
                        if r + 1 < rows.len() {
                            outlines.above(top, buffer.top(point + nx), at);
                        }
                    }
                }
            },
        );
        let mut lit = LitAreas {
            towards,
            line_area_m2: lattice.line_area_m2,
            lines: lattice.lines() as u64,
            missed,
            outlines: outlines.finish(),
            ..LitAreas::default()
        };
        let beam = Beam {
            frame,
            areas,
            k: self.k,
            towards,
            line_area_m2: lattice.line_area_m2,
        };
        if let Some(probe) = probe.filter(|_| thin.any()) {
            beam.probe(probe, &thin, scratch, &mut lit);
        }
        beam.deal_out(&thin, scratch, &mut lit);
        let cells = (0..frame.ends.soil_cells).map(|cell| {
            let row = frame.ends.soil(cell) as usize;
            (cell, scratch.visible[row])
        });
        lit.soil = cells.filter(|&(_, points)| points > 0).collect();
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
}
