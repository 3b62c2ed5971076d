//! Parameters driven to their ends.

use nestrad_common::optics::FaceOptics;

use super::*;

fn proper(field: &Field, soil: Option<f64>, tolerance: f64) {
    for level in 0..field.levels() {
        for bin in 0..field.bins_per_hemisphere() {
            let both = [
                field.radiance_up(level, bin),
                field.radiance_down(level, bin),
            ];
            assert!(both.iter().all(|l| l.is_finite() && *l >= 0.0), "{both:?}");
        }
    }
    for &absorbed in &field.absorbed_W_m2 {
        assert!(absorbed >= 0.0 && absorbed <= (1.0 + tolerance) * field.incoming_W_m2);
    }
    close(closure(field, soil), 0.0, tolerance);
}

#[test]
fn any_depth_with_and_without_absorption() {
    let sources = [
        source(0.0, 0.1),
        source(1e-9, 0.1),
        source(0.01, 1.0),
        source(1.0, 1.0),
    ];
    for area_index in [0.0, 1e-320, 1e-300, 1e-12, 1.0, 1e4, 1e8, 1e15, 1e100] {
        for (rho, tau) in [
            (0.0, 0.0),
            (0.5, 0.5),
            (0.0, 1.0),
            (1.0, 0.0),
            (0.3, 0.699999),
        ] {
            for (n, bins) in [(1, 1), (1, 6), (13, 6), (2, 32)] {
                for soil in [None, Some(0.0), Some(1.0)] {
                    let layers = spherical(n, area_index, 4);
                    let leaf = LeafOptics::symmetric(rho, tau);
                    let field = solve(&layers, leaf, &sources, soil, bins);
                    proper(&field, soil, 3e-14);
                }
            }
        }
    }
}

/// Over black soil the light that gets through a conservative canopy falls as 1 / depth, which is
/// what rounding would spoil first. The problem's own condition is the depth: a difference of one
/// part in 1e16 between what leaves send up and down is a drift that adds up.
#[test]
fn a_very_deep_conservative_canopy_still_passes_the_right_trace() {
    for rho in [0.5, 0.9] {
        for area_index in [1e4, 1e6, 1e9] {
            let leaf = LeafOptics::symmetric(rho, 1.0 - rho);
            for (n, bins) in [(1, 1), (1, 6), (10, 6)] {
                let layers = homogeneous(n, &[(1.0, false, area_index)]);
                let field = solve(&layers, leaf, &[source(0.5, 1.0)], Some(0.0), bins);
                let passed = 1.0 / (1.0 + rho * area_index);
                let tolerance = 1e-15 * area_index;
                close(field.transmitted_W_m2 / passed, 1.0, tolerance);
            }
        }
    }
}

#[test]
fn absorption_vanishes_with_the_leaves_to_relative_rounding() {
    for area_index in [1e-6, 1e-12, 1e-100] {
        let layers = spherical(5, area_index, 50);
        let leaf = LeafOptics::symmetric(0.4, 0.599);
        let field = solve(&layers, leaf, &[source(0.7, 1.0)], None, 6);
        let first_order = 0.001 * field_interception(area_index, 0.7);
        let absorbed: f64 = field.absorbed_W_m2.iter().sum();
        close(absorbed / first_order, 1.0, 1e-10 + 10.0 * area_index);
    }

    fn field_interception(area_index: f64, mu: f64) -> f64 {
        let layers = spherical(1, area_index, 50);
        solve(&layers, LeafOptics::default(), &[source(mu, 1.0)], None, 1).absorbed_W_m2[0]
    }
}

#[test]
fn ten_thousand_layers_and_sixty_four_bins() {
    let leaf = LeafOptics::symmetric(0.45, 0.5);
    let few = solve(
        &spherical(10, 5.0, 5),
        leaf,
        &[source(0.6, 1.0)],
        Some(0.2),
        6,
    );
    let many = solve(
        &spherical(10_000, 5.0, 5),
        leaf,
        &[source(0.6, 1.0)],
        Some(0.2),
        6,
    );
    close(closure(&many, Some(0.2)), 0.0, 1e-12);
    close(many.reflected_W_m2, few.reflected_W_m2, 1e-11);
    close(many.transmitted_W_m2, few.transmitted_W_m2, 1e-11);
    let fine = solve(
        &spherical(3, 5.0, 5),
        leaf,
        &[source(0.6, 1.0)],
        Some(0.2),
        64,
    );
    proper(&fine, Some(0.2), 1e-13);
    close(fine.reflected_W_m2, few.reflected_W_m2, 2e-3);
}

#[test]
fn no_light_no_leaves_and_no_bin_is_special() {
    let empty = homogeneous(3, &[]);
    let field = solve(
        &empty,
        LeafOptics::default(),
        &[source(0.5, 2.0)],
        Some(0.25),
        6,
    );
    close(field.reflected_W_m2, 0.5, 1e-15);
    for level in 0..4 {
        for bin in 0..6 {
            close(
                field.radiance_up(level, bin),
                0.5 / std::f64::consts::PI,
                1e-15,
            );
            close(field.radiance_down(level, bin), 0.0, 0.0);
        }
    }
    let dark = solve(
        &spherical(3, 2.0, 4),
        LeafOptics::symmetric(0.5, 0.5),
        &[],
        Some(1.0),
        6,
    );
    assert!(dark.reflected_W_m2 == 0.0 && dark.radiance_up(2, 3) == 0.0);
    // A vertical beam along vertical leaves meets nothing.
    let upright = homogeneous(2, &[(0.0, false, 4.0)]);
    let field = solve(
        &upright,
        LeafOptics::symmetric(0.5, 0.5),
        &[source(1.0, 1.0)],
        None,
        6,
    );
    close(field.transmitted_W_m2, 1.0, 0.0);
}

/// Leaves that transmit better one way than the other: light gathers between two such layers, by a
/// factor that grows exponentially with their depth.
#[test]
fn light_valves_balance_until_the_light_cannot_leave_at_all() {
    let face = |rho, tau| FaceOptics { rho, tau };
    let valve = LeafOptics {
        upper: face(0.25, 0.75),
        lower: face(0.0, 1.0),
    };
    for (area_index, closes) in [(20.0, true), (400.0, true), (6e4, false)] {
        let mut layers = homogeneous(2, &[(1.0, false, area_index)]);
        layers.foliage[1][0].lower_face_up = true;
        let field = solve(&layers, valve, &[source(1.0, 1.0)], Some(0.5), 4);
        for bin in 0..4 {
            assert!(field.radiance_up(1, bin).is_finite());
        }
        assert!(field.reflected_W_m2.is_finite() && field.transmitted_W_m2.is_finite());
        if closes {
            close(closure(&field, Some(0.5)), 0.0, 1e-11);
        }
    }
}
