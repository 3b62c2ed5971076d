//! From canopies to layers.

use glam::DVec2;
use nestrad_common::canopy::{Canopy, Mesh, Pattern, Triangle};
use nestrad_common::geometry::area;

use super::super::layers::LayersFault;
use super::*;

fn canopy(triangles: Vec<[DVec3; 3]>) -> Canopy {
    let triangle = |corners_m| Triangle {
        corners_m,
        organ: 0,
        material: 0,
    };
    let mesh: Mesh = triangles.into_iter().map(triangle).collect();
    let mut canopy = Canopy::of_meshes(vec![mesh]);
    canopy.pattern = Some(Pattern {
        min_m: DVec2::ZERO,
        size_m: DVec2::new(2.0, 1.0),
    });
    canopy
}

/// Triangles of all sizes and directions, from a fixed sequence.
fn many(n: usize) -> Vec<[DVec3; 3]> {
    let mut state = 1_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..n)
        .map(|_| {
            let size = 10_f64.powf(-4.0 * next());
            let at = DVec3::new(next(), next(), next());
            [(); 3].map(|()| at + size * DVec3::new(next(), next(), next()))
        })
        .collect()
}

fn layers(canopy: &Canopy, n: usize, classes: usize) -> Layers {
    Layers::of_canopy(canopy, nonzero(n), nonzero(classes)).expect("ground is given")
}

#[test]
fn no_area_is_lost() {
    let triangles = many(2000);
    let whole: f64 = triangles.iter().map(area).sum();
    for n in [1, 7, 64, 10_000] {
        let layers = layers(&canopy(triangles.clone()), n, 18);
        assert_eq!(layers.foliage.len(), n);
        close(layers.area_index() * 2.0 / whole, 1.0, 1e-13);
    }
}

#[test]
fn triangles_are_cut_where_they_cross_a_level() {
    // Upright, its point down: a quarter of the area lies in the lower half.
    let upright = [
        DVec3::ZERO,
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::new(0.0, 0.0, 1.0),
    ];
    let cut = layers(&canopy(vec![upright]), 2, 9);
    close(cut.foliage[0][0].area_index, 0.125 / 2.0, 1e-16);
    close(cut.foliage[1][0].area_index, 0.375 / 2.0, 1e-16);
    close(
        cut.class_cosine[cut.foliage[0][0].class as usize],
        0.0,
        1e-16,
    );
}

#[test]
fn classes_keep_inclination_and_facing() {
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let turned = [DVec3::ZERO, DVec3::Y, DVec3::X];
    let raised = |t: [DVec3; 3]| t.map(|v| v + DVec3::Z);
    let layers = layers(&canopy(vec![flat, raised(turned)]), 3, 18);
    assert!(layers.foliage[1].is_empty());
    let (low, high) = (layers.foliage[0][0], layers.foliage[2][0]);
    assert!(!low.lower_face_up && high.lower_face_up);
    assert_eq!(layers.class_cosine[low.class as usize], 1.0);
    assert_eq!(low.area_index, 0.25);
}

#[test]
fn what_lies_under_the_soil_plane_is_left_out() {
    let upright = [
        DVec3::ZERO,
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::new(0.0, 0.0, 1.0),
    ];
    let mut canopy = canopy(vec![upright]);
    canopy.soil_z_m = Some(0.5);
    let above = layers(&canopy, 5, 3);
    close(above.area_index(), 0.375 / 2.0, 1e-16);
    assert_eq!((above.bottom_z_m, above.top_z_m), (0.5, 1.0));
    canopy.soil_z_m = Some(2.0);
    assert_eq!(layers(&canopy, 5, 3).area_index(), 0.0);
}

#[test]
fn scenes_without_height_or_ground() {
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let mut flat = canopy(vec![flat]);
    assert_eq!(layers(&flat, 4, 3).foliage[0].len(), 1);
    flat.pattern = None;
    assert_eq!(layers(&flat, 4, 3).area_index(), 0.5);
    assert_eq!(layers(&canopy(vec![]), 4, 3).area_index(), 0.0);

    let mut upright = canopy(vec![[DVec3::ZERO, DVec3::X, DVec3::Z]]);
    upright.pattern = None;
    let fault = Layers::of_canopy(&upright, nonzero(1), nonzero(1));
    assert_eq!(fault, Err(LayersFault::NoGround));
}

#[test]
fn classes_stand_for_what_is_in_them() {
    let mut canopy = canopy(many(3000));
    canopy.pattern = Some(Pattern {
        min_m: DVec2::ZERO,
        size_m: DVec2::new(10.0, 10.0),
    });
    let leaf = LeafOptics::symmetric(0.45, 0.4);
    let reflected = |classes: usize| {
        let layers = layers(&canopy, 8, classes);
        solve(&layers, leaf, &[source(0.5, 1.0)], Some(0.2), 6).reflected_W_m2
    };
    close(reflected(18), reflected(900), 2e-5);
}
