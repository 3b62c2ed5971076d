//! The leaf area density around a point of the canopy.
//!
//! Light in a canopy falls off over the inverse of the leaf area density (Ross 1981), so that is how far apart
//! places have to be to be lit differently. What counts is the density where the leaves are: the mean over the
//! ground would call a row of crops on bare soil thin.

use glam::DVec3;
use nestrad_common::canopy::{Canopy, Triangle};
use nestrad_common::geometry;
use rayon::prelude::*;

/// Sides of the cells that densities are those of, in sides of an organ of average size.
const CELL: f64 = 2.0;

/// A triangle, where its middle is.
struct Piece {
    cell: [i64; 3],
    organ: u32,
    area_m2: f64,
}

/// One-sided area of other organs around a point of the canopy, on average over the canopy, per volume, 1/m; of
/// the triangles of a scene that are marked, with organs of `organ_m` on a side. Zero where organs are apart.
///
/// Measured in cubes of twice that side: for cells of area `a` and organs `o` of area `a_o` in them,
/// `sum of a (a - a_o) / (volume of a cell x area of all)`. It does not depend on the order of the input.
pub(super) fn around(
    canopy: &Canopy,
    marked: impl Fn(&Triangle) -> bool + Sync,
    organ_m: f64,
) -> f64 {
    let cell_m = CELL * organ_m;
    if !(cell_m > 0.0 && cell_m.is_finite()) {
        return 0.0;
    }
    let mut pieces: Vec<Piece> = (0..canopy.len())
        .into_par_iter()
        .map(|t| canopy.triangle(t))
        .filter(|triangle| marked(triangle))
        .map(|triangle| {
            let corners = &triangle.corners_m;
            let mut at_m = corners.iter().copied().sum::<DVec3>() / 3.0;
            if let Some(pattern) = canopy.pattern {
                let within = (at_m.truncate() - pattern.min_m).rem_euclid(pattern.size_m);
                at_m = within.extend(at_m.z);
            }
            Piece {
                cell: (at_m / cell_m).floor().to_array().map(|c| c as i64),
                organ: triangle.organ,
                area_m2: geometry::area(corners),
            }
        })
        .collect();
    pieces.par_sort_unstable_by(|a, b| {
        (a.cell, a.organ)
            .cmp(&(b.cell, b.organ))
            .then(a.area_m2.total_cmp(&b.area_m2))
    });
    let (mut all_m2, mut squares) = (0.0, 0.0);
    for cell in pieces.chunk_by(|a, b| a.cell == b.cell) {
        let mut organs: Vec<f64> = cell
            .chunk_by(|a, b| a.organ == b.organ)
            .map(|organ| organ.iter().map(|p| p.area_m2).sum())
            .collect();
        // organs are numbered as they come
        organs.sort_unstable_by(f64::total_cmp);
        let area: f64 = organs.iter().sum();
        all_m2 += area;
        squares += organs.iter().map(|a| a * (area - a)).sum::<f64>();
    }
    if all_m2 > 0.0 {
        squares / (cell_m.powi(3) * all_m2)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use nestrad_common::canopy::{Mesh, Organ, Pattern};
    use proptest::prelude::*;

    use super::*;

    /// Level squares of two triangles, an organ each, 1 cm on a side.
    fn leaves(at_m: &[DVec3], pattern_m: f64) -> Canopy {
        let corner = |x, y| DVec3::new(x, y, 0.0) * 0.01;
        let [a, b, c, d] =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| corner(x, y));
        let halves = |at: &DVec3| [[a, b, c], [a, c, d]].map(|t| t.map(|p| p + *at));
        let organ = Organ {
            id: "leaf".to_owned(),
            plant: "plant".to_owned(),
            ..Organ::default()
        };
        let leaf = |(organ, at)| {
            halves(at).map(|corners_m| Triangle {
                corners_m,
                organ,
                material: 0,
            })
        };
        let mesh: Mesh = (0..).zip(at_m).flat_map(leaf).collect();
        let mut canopy = Canopy::of_meshes(vec![mesh]);
        canopy.organs = vec![organ; at_m.len()];
        canopy.pattern = Some(Pattern {
            min_m: DVec2::ZERO,
            size_m: DVec2::splat(pattern_m),
        });
        canopy
    }

    fn density(at_m: &[DVec3]) -> f64 {
        around(&leaves(at_m, 0.4), |_| true, 0.01)
    }

    /// So many layers of cells of 2 cm, with so many leaves of 1 cm² along each of their sides.
    fn layers(count: usize, per_side: usize) -> Vec<DVec3> {
        let step = 0.02 / per_side as f64;
        let mut at_m = Vec::new();
        for z in 0..count * per_side {
            for y in 0..20 * per_side {
                for x in 0..20 * per_side {
                    at_m.push(DVec3::new(x as f64, y as f64, z as f64) * step + 1e-4);
                }
            }
        }
        at_m
    }

    #[test]
    fn organs_do_not_count_for_themselves() {
        assert_eq!(density(&layers(2, 1)), 0.0);
        assert_eq!(density(&[]), 0.0);
        assert_eq!(around(&Canopy::default(), |_| true, f64::INFINITY), 0.0);
    }

    #[test]
    fn a_uniform_layer_has_the_density_that_it_has() {
        let others = 7.0 * 1e-4 / 8e-6;
        let found = density(&layers(2, 2));
        assert!((found / others - 1.0).abs() < 1e-9, "{found} {others}");
    }

    #[test]
    fn bare_ground_beside_it_makes_a_canopy_no_thinner() {
        let at_m = layers(1, 2);
        let wide = around(&leaves(&at_m, 4.0), |_| true, 0.01);
        assert!((wide / density(&at_m) - 1.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn the_order_of_the_input_leaves_no_trace(
            at in prop::collection::vec((0.0..0.1, 0.0..0.1, 0.0..0.05), 2..40),
            turn in 1usize..39,
        ) {
            let mut at_m: Vec<DVec3> = at.into_iter().map(DVec3::from).collect();
            let before = density(&at_m);
            let by = turn % at_m.len();
            at_m.rotate_left(by);
            prop_assert_eq!(before.to_bits(), density(&at_m).to_bits());
        }
    }
}
