//! What a generated canopy must be, whatever its kind.

use std::collections::{BTreeMap, HashSet};

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;

fn normal_area(triangle: &[DVec3; 3]) -> DVec3 {
    0.5 * (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0])
}

fn leaf_triangles(canopy: &Generated) -> impl Iterator<Item = &[DVec3; 3]> {
    let labelled = canopy.triangles.iter().zip(&canopy.labels);
    labelled.filter(|(_, l)| l.leaf > 0).map(|(t, _)| t)
}

/// Holds for every canopy.
fn check_sound(canopy: &Generated) {
    assert_eq!(canopy.triangles.len(), canopy.labels.len());
    assert!(!canopy.triangles.is_empty());
    for triangle in &canopy.triangles {
        assert!(triangle.iter().all(|v| v.is_finite()));
        assert!(normal_area(triangle).length() > 1e-12, "{triangle:?}");
        assert!(triangle.iter().all(|v| v.z > canopy.soil_z_m));
    }
    for label in &canopy.labels {
        assert_eq!(label.to_string().len(), 12);
    }
}

fn stand(plants: u32, row_spacing_m: f64, plant_spacing_m: f64) -> Stand {
    Stand {
        rows: 2,
        plants_per_row: plants,
        row_spacing_m,
        plant_spacing_m,
    }
}

/// Mean area of leaf triangles, m².
fn mean_triangle(canopy: &Generated) -> f64 {
    canopy.leaf_area_index() * canopy.pattern.area_m2() / leaf_triangles(canopy).count() as f64
}

fn highest(canopy: &Generated) -> f64 {
    let heights = canopy.triangles.iter().flatten().map(|v| v.z);
    heights.fold(0.0, f64::max)
}

/// No plant reaches farther sideways than `reach_m` from where it stands, and all stand in the
/// middle of their cells.
fn check_reach(canopy: &Generated, stand: &Stand, reach_m: f64) {
    let feet: BTreeMap<u32, DVec2> = stand.plants().collect();
    for (triangle, label) in canopy.triangles.iter().zip(&canopy.labels) {
        let foot = feet[&label.plant];
        assert!(
            triangle
                .iter()
                .all(|v| v.truncate().distance(foot) < reach_m)
        );
    }
}

#[test]
fn maize_is_like_maize() {
    let maize = Maize {
        stand: stand(20, 0.75, 0.2),
        ..Maize::default()
    };
    let canopy = maize.generate().unwrap();
    check_sound(&canopy);
    check_reach(&canopy, &maize.stand, 1.0);
    assert!((3.6..4.4).contains(&canopy.leaf_area_index()));
    assert!((2.1..2.4).contains(&highest(&canopy)));
    let per_plant = canopy.triangles.len() / 40;
    assert!((7000..9000).contains(&per_plant), "{per_plant}");
    assert!((0.7e-4..0.9e-4).contains(&mean_triangle(&canopy)));
    for plant in 1..=40 {
        let of_plant = canopy.labels.iter().filter(|l| l.plant == plant);
        let leaves: HashSet<u32> = of_plant.map(|l| l.leaf).collect();
        assert!((13..=18).contains(&leaves.len()));
    }
}

#[test]
fn bean_is_like_bean() {
    let bean = Bean {
        stand: stand(20, 0.5, 0.1),
        ..Bean::default()
    };
    let canopy = bean.generate().unwrap();
    check_sound(&canopy);
    check_reach(&canopy, &bean.stand, 0.5);
    assert!((3.5..4.5).contains(&canopy.leaf_area_index()));
    assert!((0.5..0.75).contains(&highest(&canopy)));
    assert!((0.4e-4..0.6e-4).contains(&mean_triangle(&canopy)));
    // three leaflets a leaf, and 9 leaves on the main stem with 2 or 3 branches of 4 or 5
    for plant in 1..=40 {
        let of_plant = canopy.labels.iter().filter(|l| l.plant == plant);
        let leaflets: HashSet<(u32, u32)> = of_plant
            .filter(|l| l.leaf > 0)
            .map(|l| (l.leaf, l.element))
            .collect();
        assert!((3 * 17..=3 * 24).contains(&leaflets.len()));
    }
}

/// Upper faces are adaxial: most of a leaf looks up.
#[test]
fn leaves_lie_on_their_backs() {
    for canopy in [
        Maize::default().generate().unwrap(),
        Bean::default().generate().unwrap(),
        RandomCanopy::default().generate().unwrap(),
    ] {
        let up: f64 = leaf_triangles(&canopy).map(|t| normal_area(t).z).sum();
        let over: f64 = leaf_triangles(&canopy)
            .map(|t| normal_area(t).z.abs())
            .sum();
        assert!(up > 0.9 * over, "{up} of {over}");
    }
}

#[test]
fn finer_triangles_make_the_same_plants() {
    let maize = |leaf_triangle_m2| {
        let maize = Maize {
            leaf_triangle_m2,
            ..Maize::default()
        };
        maize.generate().unwrap()
    };
    let (coarse, fine) = (maize(1e-4), maize(0.25e-4));
    let leaves = |canopy: &Generated| leaf_triangles(canopy).count() as f64;
    assert!((leaves(&fine) / leaves(&coarse) - 4.0).abs() < 0.2);
    assert!((fine.leaf_area_index() / coarse.leaf_area_index() - 1.0).abs() < 0.01);
}

/// A plant does not depend on how many others there are.
#[test]
fn plants_are_their_own() {
    let one_row = |plants_per_row| {
        let maize = Maize {
            stand: Stand {
                rows: 1,
                plants_per_row,
                row_spacing_m: 0.75,
                plant_spacing_m: 0.2,
            },
            ..Maize::default()
        };
        maize.generate().unwrap()
    };
    let (alone, beside) = (one_row(1), one_row(3));
    for (a, b) in alone.triangles.iter().zip(&beside.triangles) {
        for (a, b) in a.iter().zip(b) {
            assert!((*a - *b).distance(DVec3::X * 0.2) < 2e-6);
        }
    }
}

#[test]
fn random_leaves_have_the_angles_asked_for() {
    for (angles, mean_deg) in [
        (LeafAngles::Spherical, 57.2958),
        (LeafAngles::Uniform, 45.0),
        (LeafAngles::Planophile, 26.7624),
        (LeafAngles::Erectophile, 63.2376),
        (LeafAngles::Plagiophile, 45.0),
        (LeafAngles::Extremophile, 45.0),
        (LeafAngles::Horizontal, 0.0),
        (LeafAngles::Ellipsoidal { chi: 1.0 }, 57.2958),
    ] {
        let random = RandomCanopy {
            angles,
            ..RandomCanopy::default()
        };
        let canopy = random.generate().unwrap();
        check_sound(&canopy);
        let inclinations = canopy.triangles.iter().map(|t| {
            let normal = normal_area(t).normalize();
            normal.truncate().length().atan2(normal.z).to_degrees()
        });
        let mean = inclinations.sum::<f64>() / canopy.triangles.len() as f64;
        assert!((mean - mean_deg).abs() < 0.05, "{angles:?}: {mean}");
    }
}

/// Spherical leaves cast half their area on any plane.
#[test]
fn spherical_leaves_look_the_same_from_everywhere() {
    let canopy = RandomCanopy::default().generate().unwrap();
    for view in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, 0.0, 0.8)] {
        let cast: f64 = canopy
            .triangles
            .iter()
            .map(|t| normal_area(t).dot(view).abs())
            .sum();
        assert!((cast / 1.5 - 1.0).abs() < 0.02, "{view}: {cast}");
    }
}

#[test]
fn many_random_leaves_go_on_with_the_next_plant() {
    let random = RandomCanopy {
        leaf_m2: 1e-3,
        ..RandomCanopy::default()
    };
    let canopy = random.generate().unwrap();
    let leaves: HashSet<(u32, u32)> = canopy.labels.iter().map(|l| (l.plant, l.leaf)).collect();
    assert_eq!(leaves.len(), 3000);
    assert!(leaves.iter().all(|&(_, leaf)| (1..=999).contains(&leaf)));
    assert_eq!(canopy.labels.last().unwrap().plant, 4);
}

#[test]
fn absurd_parameters_are_refused() {
    let random = RandomCanopy::default();
    for bad in [
        RandomCanopy {
            leaf_area_index: 0.0,
            ..random.clone()
        },
        RandomCanopy {
            leaf_area_index: f64::NAN,
            ..random.clone()
        },
        RandomCanopy {
            leaf_area_index: 1e9,
            ..random.clone()
        },
        RandomCanopy {
            leaf_m2: 0.0,
            ..random.clone()
        },
        RandomCanopy {
            height_m: 0.01,
            ..random.clone()
        },
        RandomCanopy {
            height_m: f64::INFINITY,
            ..random.clone()
        },
        RandomCanopy {
            size_m: DVec2::new(1.0, -1.0),
            ..random.clone()
        },
        RandomCanopy {
            angles: LeafAngles::Ellipsoidal { chi: 0.0 },
            ..random
        },
    ] {
        let error = bad.generate().unwrap_err().to_string();
        assert!(error.contains("expected"), "{error}");
    }
    for bad in [
        stand(0, 0.75, 0.2),
        stand(u32::MAX, 0.75, 0.2),
        stand(4, 0.0, 0.2),
        stand(4, 0.75, f64::NAN),
    ] {
        let maize = Maize {
            stand: bad,
            ..Maize::default()
        };
        assert!(maize.generate().is_err());
        let bean = Bean {
            stand: bad,
            ..Bean::default()
        };
        assert!(bean.generate().is_err());
    }
    let maize = Maize {
        leaf_triangle_m2: 1.0,
        ..Maize::default()
    };
    assert!(maize.generate().is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn random_leaves_have_the_area_asked_for(
        leaf_area_index in 0.2..8.0,
        leaf_m2 in 1e-4..1e-2,
        disc: bool,
        (width, depth) in (0.3..2.0, 0.3..2.0),
        seed: u64,
    ) {
        let random = RandomCanopy {
            leaf_area_index,
            shape: if disc { LeafShape::Disc } else { LeafShape::Square },
            leaf_m2,
            size_m: DVec2::new(width, depth),
            seed,
            ..RandomCanopy::default()
        };
        let canopy = random.generate().unwrap();
        check_sound(&canopy);
        prop_assert!((canopy.leaf_area_index() / leaf_area_index - 1.0).abs() < 1e-3);
        prop_assert!(highest(&canopy) <= 1.0 + 1e-6);
    }

    #[test]
    fn plants_are_sound_whatever_the_seed(seed: u64) {
        let small = |row_m, plant_m| Stand { rows: 1, ..stand(2, row_m, plant_m) };
        let maize = Maize { stand: small(0.75, 0.2), seed, ..Maize::default() };
        check_sound(&maize.generate().unwrap());
        let bean = Bean { stand: small(0.5, 0.1), seed, ..Bean::default() };
        check_sound(&bean.generate().unwrap());
    }
}
