//! The sizes in a scene that sampling follows.

use nestrad_common::canopy::{Canopy, Kind, Triangle};
use nestrad_common::geometry;
use rayon::prelude::*;
use serde::Serialize;

use super::density;
use crate::frame::{bounds_of, extent_of};

/// Lengths and areas that stand for a scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scale {
    /// One-sided area of all triangles, m².
    pub area_m2: f64,
    /// Area that lines are spread over: of the pattern, or of an open scene's box and the soil around it
    /// (a scene that stands on edge has the mean cross-section of its box), m².
    pub ground_area_m2: f64,
    /// From the lowest to the highest point, soil included, m.
    pub height_m: f64,
    /// Area of the organ that a point of the canopy belongs to, on average, m².
    pub organ_area_m2: f64,
    /// Area of the triangle that a point of the canopy belongs to, on average, m².
    pub triangle_area_m2: f64,
    /// Longest edge of that triangle, on average, m.
    pub triangle_edge_m: f64,
    /// One-sided area of other organs around a point of the canopy, on average, per volume, 1/m.
    pub leaf_area_density_per_m: f64,
}

impl Scale {
    /// Measures a scene; soil triangles count only where there is nothing else.
    pub fn of(canopy: &Canopy) -> Self {
        let kinds = canopy.kinds();
        let is_soil = |t: &Triangle| kinds[t.material as usize] == Kind::Soil;
        let only_soil = canopy.triangles().all(|t| is_soil(&t));
        let counts = |t: &Triangle| only_soil || !is_soil(t);
        // summed by size, so that the order of the input leaves no trace in the rounding
        let mut areas: Vec<(f64, f64, u32)> = canopy
            .triangles()
            .filter(counts)
            .map(|t| {
                let edge_m = geometry::longest_edge(&t.corners_m);
                (geometry::area(&t.corners_m), edge_m, t.organ)
            })
            .collect();
        areas.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let (mut area, mut triangle_squares, mut edges) = (0.0, 0.0, 0.0);
        let mut organs = vec![0.0; canopy.organs.len()];
        for (a, edge_m, organ) in areas {
            area += a;
            triangle_squares += a * a;
            edges += a * edge_m;
            organs[organ as usize] += a;
        }
        organs.sort_unstable_by(f64::total_cmp);
        let extent = extent_of(canopy);
        let [x, y, z] = (extent.max_m - extent.min_m).to_array();
        let (lowest, highest) = bounds_of(canopy);
        let mean = |squares: f64| if area > 0.0 { squares / area } else { 0.0 };
        let organ_area_m2: f64 = mean(organs.iter().map(|a| a * a).sum());
        Self {
            area_m2: area,
            ground_area_m2: match canopy.pattern {
                Some(pattern) => pattern.area_m2(),
                // a quarter of the surface (Cauchy 1832)
                None => (x * y).max(0.5 * (x * y + x * z + y * z)),
            },
            height_m: highest.z - lowest.z,
            organ_area_m2,
            triangle_area_m2: mean(triangle_squares),
            triangle_edge_m: mean(edges),
            leaf_area_density_per_m: density::around(canopy, counts, organ_area_m2.sqrt()),
        }
    }
    /// Side of an organ of average size, m; infinite where there is none.
    pub(super) fn organ_m(&self) -> f64 {
        match self.organ_area_m2 {
            0.0 => f64::INFINITY,
            area => area.sqrt(),
        }
    }
}
