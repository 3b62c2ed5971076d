//! Projects the canopy along a direction: what is on top at each point of the lattice.

use glam::DVec3;
use nestrad_kernel::ends::Side;
use nestrad_kernel::lattice::Lattice;
use nestrad_kernel::zbuffer::Top;

use super::areas::Areas;
use super::dealing::Beam;
use super::lit_areas::{LitAreas, Scratch};
use super::outlines::Outlines;
use super::probe::{Probe, Thin};
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
                            }
                            None => match soil_cell(frame, &lattice, i, j) {
                                Some(cell) => visible[frame.ends.soil(cell) as usize] += 1,
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
        lit
    }
}

fn soil_cell(frame: &Frame, lattice: &Lattice, i: usize, j: u32) -> Option<u32> {
    let soil = frame.world.soil.as_ref()?;
    let at = lattice.point_at(i as f64, f64::from(j), soil.z_m);
    soil.cell_at(at.truncate(), frame.world.extent.periodic)
}
