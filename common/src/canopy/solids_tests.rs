//! Pots, boards, stems in pieces and solids turned inside out.

use glam::DVec3;

use super::solids::Solids;
use super::{Canopy, Material, Mesh, Organ, Triangle};

/// Quadrilaterals around a prism of 12 sides, from one height and radius to the next, with its outside upwards.
fn tube(rings: &[(f64, f64)], bottom: bool, top: bool) -> Vec<[DVec3; 3]> {
    const SIDES: usize = 12;
    let at = |k: usize, (z, r): (f64, f64)| {
        let angle = std::f64::consts::TAU * (k % SIDES) as f64 / SIDES as f64;
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    };
    let mut triangles = Vec::new();
    for pair in rings.windows(2) {
        for k in 0..SIDES {
            let (a, b) = (at(k, pair[0]), at(k + 1, pair[0]));
            let (c, d) = (at(k + 1, pair[1]), at(k, pair[1]));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let (first, last) = (rings[0], rings[rings.len() - 1]);
    for k in 1..SIDES - 1 {
        if bottom {
            triangles.push([at(0, first), at(k + 1, first), at(k, first)]);
        }
        if top {
            triangles.push([at(0, last), at(k, last), at(k + 1, last)]);
        }
    }
    triangles
}

fn solids(triangles: &[[DVec3; 3]]) -> Solids {
    let mesh: Mesh = triangles
        .iter()
        .map(|&corners_m| Triangle {
            corners_m,
            organ: 0,
            material: 0,
        })
        .collect();
    let mut canopy = Canopy::of_meshes(vec![mesh]);
    canopy.organs = vec![Organ {
        species: "1".to_owned(),
        plant: "1".to_owned(),
        id: "1000".to_owned(),
    }];
    canopy.materials = vec![Material::Stem { species: 1 }];
    canopy.solids()
}

#[track_caller]
fn assert_solid(triangles: &[[DVec3; 3]], solid: bool) {
    let found = solids(triangles);
    assert!(found.solid.iter().all(|&s| s == solid), "{:?}", found.solid);
    assert_eq!(found.inside_out, []);
}

#[test]
fn fault_a_pot_a_gutter_and_a_board_were_solid() {
    // a pot, a pot without a bottom, a polytunnel, a board
    assert_solid(&tube(&[(0.0, 0.1), (0.2, 0.12)], true, false), false);
    assert_solid(&tube(&[(0.0, 0.1), (0.2, 0.12)], false, false), false);
    assert_solid(&tube(&[(0.0, 1.0), (5.0, 1.0)], false, false), false);
    assert_solid(
        &[
            [DVec3::ZERO, DVec3::X, DVec3::Y],
            [DVec3::X, DVec3::ONE, DVec3::Y],
        ],
        false,
    );
    // half a pipe, as long as may be
    let pipe = tube(&[(0.0, 0.05), (4.0, 0.05)], true, true);
    let half: Vec<_> = pipe
        .into_iter()
        .filter(|t| t.iter().all(|p| p.y < 1e-9))
        .collect();
    assert_solid(&half, false);
}

#[test]
fn stems_are_solid_with_open_ends_and_in_pieces() {
    let closed = tube(&[(0.0, 0.01), (0.02, 0.01)], true, true);
    assert_solid(&closed, true);
    assert_solid(&tube(&[(0.0, 0.01), (0.2, 0.008)], false, false), true);
    // short pieces, one on the other, of rounded coordinates
    let mut pieces = Vec::new();
    for k in 0..10 {
        let z = 0.02 * f64::from(k) + 1e-6;
        let r = 0.01 - 2e-4 * f64::from(k);
        pieces.extend(tube(&[(z, r), (z + 0.02 - 2e-6, r - 1e-5)], false, false));
    }
    assert_solid(&pieces, true);
    // one of them alone is a ring
    assert_solid(&pieces[..24], false);
}

#[test]
fn a_solid_that_stands_twice_is_solid_once_and_again() {
    let closed = tube(&[(0.0, 0.01), (0.02, 0.01)], true, true);
    let again: Vec<_> = closed.iter().map(|&[a, b, c]| [b, c, a]).collect();
    assert_solid(&[closed.clone(), again].concat(), true);
    let open = tube(&[(0.0, 0.1), (0.2, 0.1)], true, false);
    assert_solid(&[open.clone(), open].concat(), false);
}

#[test]
fn faces_that_are_turned_inside_out_are_said() {
    let mut box_ = tube(&[(0.0, 0.01), (0.02, 0.01)], true, true);
    box_[3].swap(0, 1);
    let found = solids(&box_);
    assert_eq!(found.inside_out, [3]);
    assert_eq!(found.solid.iter().filter(|&&s| s).count(), box_.len() - 1);
    for triangle in &mut box_ {
        triangle.swap(0, 1);
    }
    let found = solids(&box_);
    assert_eq!(found.inside_out.len(), box_.len() - 1);
    assert_eq!(found.solid.iter().filter(|&&s| s).count(), 1);
}
