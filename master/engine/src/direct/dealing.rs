//! Deals the light of a direction out to the elements of each organ: by the points that show them, or by rays where
//! an organ is too small for the points.

use glam::DVec3;

use super::areas::Areas;
use super::lit_areas::{Lit, LitAreas, LitFace, Scratch, Unsure};
use super::probe::{Probe, Thin};
use crate::frame::Frame;

/// What rays say of an organ.
#[derive(Clone, Copy, Default)]
struct Probed {
    /// The part of its area whose rays are cast.
    part: f64,
    rays: f64,
    /// Rays that meet nothing.
    free: f64,
}

/// Points that a large element is met by, on average.
pub(super) const LARGE: f64 = 4.0;

/// A direction, and what it is drawn with.
pub(super) struct Beam<'a> {
    pub(super) frame: &'a Frame,
    pub(super) areas: &'a Areas,
    /// Number of the source.
    pub(super) k: usize,
    pub(super) towards: DVec3,
    pub(super) line_area_m2: f64,
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
    pub(super) fn probe(
        &self,
        probe: &Probe,
        thin: &Thin,
        scratch: &mut Scratch,
        areas: &mut LitAreas,
    ) {
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

    fn face(&self, lit: &Lit, part: f64) -> LitFace {
        LitFace {
            row: (2 * lit.element + usize::from(!lit.upper)) as u32,
            variance: (lit.variance_m4 / (self.line_area_m2 * self.line_area_m2)) as f32,
            part,
        }
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
    pub(super) fn deal_out(&self, thin: &Thin, scratch: &mut Scratch, areas: &mut LitAreas) {
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
            areas.faces.push(self.face(lit, part));
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
            let pieces = f64::from(self.frame.elements().divisions[t as usize].pow(2));
            let of_triangle_m2 = projected_m2.abs() * pieces;
            // a strip between two rows of points is missed as a whole
            let is_strip = of_triangle_m2 > LARGE * self.line_area_m2
                && self
                    .frame
                    .elements()
                    .of(t as usize)
                    .all(|e| scratch.met[e as usize] == 0);
            let missed_m2 = if is_strip {
                of_triangle_m2 * of_it
            } else {
                self.line_area_m2
            };
            let lit = Lit {
                element: e,
                upper: projected_m2 > 0.0,
                area_m2: 0.0,
                variance_m4: projected_m2.abs() * missed_m2 * of_it,
            };
            if is_strip {
                // with the other triangle that it is made of
                areas.unsure.push(self.unsure(&lit, 2.0 * lit.variance_m4));
            } else if unmet {
                areas.unsure.push(self.unsure(&lit, lit.variance_m4));
            }
            areas.faces.push(self.face(&lit, 0.0));
        }
    }
}
