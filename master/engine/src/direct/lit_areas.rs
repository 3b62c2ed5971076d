//! What a direction lights: areas of faces and points of soil cells, and how well they are known. There is no
//! light in it, so it serves every source that shines from there.

use glam::DVec3;
use nestrad_kernel::ends::Side;
use nestrad_kernel::lattice::Lattice;
use nestrad_kernel::zbuffer::{Top, ZBuffer};

use super::areas::Areas;
use super::outlines::{Outline, Outlines};
use super::probe::{Probe, Thin};
use crate::frame::Frame;

/// What a direction lights.
#[derive(Clone, Debug, Default)]
pub(super) struct LitAreas {
    /// Towards the source, a unit vector.
    pub(super) towards: DVec3,
    /// Cross-section of a line, m².
    pub(super) line_area_m2: f64,
    /// Lattice points.
    pub(super) lines: u64,
    /// Those that meet nothing.
    pub(super) missed: u64,
    /// Faces; a face may stand here without any lit area, for what is uncertain of it.
    pub(super) faces: Vec<LitFace>,
    /// Soil cells, and the points that show them.
    pub(super) soil: Vec<(u32, u32)>,
    /// Along the outlines of organs.
    pub(super) outlines: Vec<Outline>,
    /// Faces whose organs are not known by points.
    pub(super) unsure: Vec<Unsure>,
    /// Of all organs that are probed, perpendicular to the source: area, what is lit of it, and what the lattice
    /// shows of it, m².
    pub(super) probed_m2: Option<[f64; 3]>,
}

/// A face that is lit.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitFace {
    pub(super) element: u32,
    pub(super) upper: bool,
    /// Lit area perpendicular to the source, over the area of the face.
    pub(super) part: f64,
    /// Variance of the lit area, m⁴.
    pub(super) variance_m4: f64,
}

/// What is uncertain of an organ's lit area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unsure {
    pub(super) organ: u32,
    pub(super) material: u32,
    pub(super) upper: bool,
    pub(super) variance_m4: f64,
}

/// Counters, kept from direction to direction.
pub(super) struct Scratch {
    buffer: ZBuffer,
    /// Points that show each face and each soil cell.
    visible: Vec<u32>,
    /// Points that meet each element.
    met: Vec<u32>,
    organ: Vec<OfOrgan>,
    lit: Vec<Lit>,
}

/// What an organ shows to the source.
#[derive(Clone, Copy, Default)]
struct OfOrgan {
    /// By its points.
    seen_m2: f64,
    /// By what its elements got.
    dealt_m2: f64,
    /// Points that meet it, seen or not.
    met: u32,
}

/// What rays say of an organ.
#[derive(Clone, Copy, Default)]
struct Probed {
    /// The part of its area whose rays are cast.
    part: f64,
    rays: f64,
    /// Rays that meet nothing.
    free: f64,
}

/// An element that is lit.
struct Lit {
    element: usize,
    upper: bool,
    /// Perpendicular to the source.
    area_m2: f64,
    variance_m4: f64,
}

impl Scratch {
    pub(super) fn new(frame: &Frame) -> Self {
        Self {
            buffer: ZBuffer::default(),
            visible: vec![0; frame.rows()],
            met: vec![0; frame.area_m2.len()],
            organ: vec![OfOrgan::default(); frame.organs],
            lit: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.lit.clear();
        self.visible.fill(0);
        self.met.fill(0);
        self.organ.fill(OfOrgan::default());
    }
}

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

impl LitAreas {
    /// Projects the canopy along a direction.
    pub(super) fn of(
        frame: &Frame,
        areas: &Areas,
        projection: &Projection,
        probe: Option<&Probe>,
        scratch: &mut Scratch,
    ) -> Self {
        let &Projection {
            towards,
            line_area_m2,
            random,
            ..
        } = projection;
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
        let mut lit = Self {
            towards,
            line_area_m2: lattice.line_area_m2,
            lines: lattice.lines() as u64,
            missed,
            outlines: outlines.finish(),
            ..Self::default()
        };
        let beam = Beam {
            frame,
            areas,
            k: projection.k,
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

/// Points that a large element is met by, on average.
const LARGE: f64 = 4.0;

/// A direction, and what it is drawn with.
struct Beam<'a> {
    frame: &'a Frame,
    areas: &'a Areas,
    /// Number of the source.
    k: usize,
    towards: DVec3,
    line_area_m2: f64,
}

impl Beam<'_> {
    fn organ_of(&self, t: u32) -> usize {
        self.frame.organ[t as usize] as usize
    }

    fn projected_m2(&self, element: usize) -> f64 {
        self.areas.projected_m2(self.frame, element, self.towards)
    }

    /// Lights the organs that are too small for the lattice by rays; what points show of them is
    /// forgotten.
    fn probe(&self, probe: &Probe, thin: &Thin, scratch: &mut Scratch, areas: &mut LitAreas) {
        let frame = self.frame;
        let mut organs = vec![Probed::default(); thin.organ.len()];
        let first = scratch.lit.len();
        let mut free_of_rays = Vec::new();
        let (mut shown_m2, mut projected_m2) = (0.0, 0.0);
        for (e, &t) in frame.triangle_of_element.iter().enumerate() {
            let o = self.organ_of(t);
            if !thin.organ[o] {
                continue;
            }
            let projected = self.projected_m2(e);
            let points = scratch.visible[2 * e] + scratch.visible[2 * e + 1];
            shown_m2 += f64::from(points) * self.line_area_m2;
            projected_m2 += projected.abs();
            if projected == 0.0 {
                continue;
            }
            let organ = &mut organs[o];
            let to = organ.part + projected.abs() / thin.projected_m2[o];
            let rays = Probe::rays_between(organ.part, to);
            let free = probe.lit(frame, e, (self.k, self.towards), rays);
            organ.part = to;
            organ.free += f64::from(free);
            organ.rays += f64::from(rays);
            free_of_rays.push([free, rays].map(f64::from));
            scratch.lit.push(Lit {
                element: e,
                upper: projected > 0.0,
                // as if all of it were lit; what is free of it is known only below
                area_m2: projected.abs(),
                variance_m4: 0.0,
            });
        }
        let mut lit_m2 = 0.0;
        for (lit, [free, rays]) in scratch.lit[first..].iter_mut().zip(free_of_rays) {
            let o = self.organ_of(frame.triangle_of_element[lit.element]);
            let (probed, projected_m2) = (&organs[o], lit.area_m2);
            // an element without a ray of its own is as its organ
            lit.area_m2 *= if rays > 0.0 {
                free / rays
            } else {
                probed.free / probed.rays.max(1.0)
            };
            // a few rays that all say the same are no certainty (Jeffreys)
            let part = (probed.free + 0.5) / (probed.rays + 1.0);
            let of_a_ray = part * (1.0 - part);
            lit.variance_m4 = projected_m2 * projected_m2 * of_a_ray / rays.max(1.0);
            // elements that share a ray err together
            let together = projected_m2 * thin.projected_m2[o] * of_a_ray / probed.rays.max(1.0);
            areas.unsure.push(self.unsure(lit, together));
            lit_m2 += lit.area_m2;
            let organ = &mut scratch.organ[o];
            organ.seen_m2 += lit.area_m2;
            organ.dealt_m2 += lit.area_m2;
        }
        areas.probed_m2 = Some([projected_m2, lit_m2, shown_m2]);
    }

    fn unsure(&self, lit: &Lit, variance_m4: f64) -> Unsure {
        let t = self.frame.triangle_of_element[lit.element] as usize;
        Unsure {
            organ: self.frame.organ[t],
            material: self.frame.material[t],
            upper: lit.upper,
            variance_m4,
        }
    }

    /// Deals the light of each organ out to its elements.
    ///
    /// A large element is lit by its projected area times the part of its points that see the source, a
    /// small one by the area of the points that see it. Which of the two depends on its size alone, so
    /// both are unbiased. What all of an organ's elements get is then scaled to what the organ gets.
    fn deal_out(&self, thin: &Thin, scratch: &mut Scratch, areas: &mut LitAreas) {
        let (frame, line_area_m2) = (self.frame, self.line_area_m2);
        for (e, &t) in frame.triangle_of_element.iter().enumerate() {
            scratch.organ[self.organ_of(t)].met += scratch.met[e];
            let seen = f64::from(scratch.visible[2 * e] + scratch.visible[2 * e + 1]);
            // rounding to the lattice may give some area to a triangle without any
            if seen == 0.0 || thin.organ[self.organ_of(t)] || frame.area_m2[e] == 0.0 {
                continue;
            }
            let met = f64::from(scratch.met[e]);
            let projected_m2 = self.projected_m2(e);
            let (area_m2, variance_m4) = if projected_m2.abs() > LARGE * line_area_m2 {
                let part = seen / met;
                // binomial, for the points that meet it
                (
                    projected_m2.abs() * part,
                    projected_m2 * projected_m2 * part * (1.0 - part) / met,
                )
            } else {
                (seen * line_area_m2, seen * line_area_m2 * line_area_m2)
            };
            let organ = &mut scratch.organ[self.organ_of(t)];
            organ.seen_m2 += seen * line_area_m2;
            organ.dealt_m2 += area_m2;
            scratch.lit.push(Lit {
                element: e,
                upper: projected_m2 > 0.0,
                area_m2,
                variance_m4,
            });
        }
        areas.faces.reserve(scratch.lit.len());
        for lit in &scratch.lit {
            let organ = &scratch.organ[self.organ_of(frame.triangle_of_element[lit.element])];
            let part = if lit.area_m2 > 0.0 {
                lit.area_m2 * organ.seen_m2 / organ.dealt_m2 / frame.area_m2[lit.element]
            } else {
                0.0
            };
            areas.faces.push(LitFace {
                element: lit.element as u32,
                upper: lit.upper,
                part,
                variance_m4: lit.variance_m4,
            });
        }
        self.add_unmet(thin, scratch, areas);
    }

    /// What no point meets gets nothing, which may be wrong by all of it.
    fn add_unmet(&self, thin: &Thin, scratch: &Scratch, areas: &mut LitAreas) {
        for (e, &t) in self.frame.triangle_of_element.iter().enumerate() {
            let o = self.organ_of(t);
            if scratch.met[e] > 0 || thin.organ[o] {
                continue;
            }
            let projected_m2 = self.projected_m2(e);
            if projected_m2 == 0.0 {
                continue;
            }
            let visible = (scratch.organ[o].seen_m2 / thin.projected_m2[o]).min(1.0);
            let unmet = scratch.organ[o].met == 0;
            let of_it = if unmet { 1.0 } else { visible };
            let lit = Lit {
                element: e,
                upper: projected_m2 > 0.0,
                area_m2: 0.0,
                variance_m4: projected_m2.abs() * self.line_area_m2 * of_it,
            };
            if unmet {
                areas.unsure.push(self.unsure(&lit, lit.variance_m4));
            }
            areas.faces.push(LitFace {
                element: e as u32,
                upper: lit.upper,
                part: 0.0,
                variance_m4: lit.variance_m4,
            });
        }
    }
}

fn soil_cell(frame: &Frame, lattice: &Lattice, i: usize, j: u32) -> Option<u32> {
    let soil = frame.world.soil.as_ref()?;
    let at = lattice.point_at(i as f64, f64::from(j), soil.z_m);
    soil.cell_at(at.truncate(), frame.world.extent.periodic)
}
