//! Cases that have an answer on paper.

use super::*;

/// Horizontal leaves, small-leaf limit: reflected, arriving at the soil, absorbed.
/// Two-stream closed form, of which `docs/far_field.md` gives the derivation.
fn horizontal(rho: f64, tau: f64, soil: f64, area_index: f64) -> (f64, f64, f64) {
    let k = ((1.0 - tau).powi(2) - rho * rho).sqrt();
    let r = (1.0 - tau - k) / rho;
    let eta = (soil - r) / (1.0 - soil * r);
    let e = (-k * area_index).exp();
    let denominator = 1.0 + eta * r * e * e;
    let up = (r + eta * e * e) / denominator;
    let down = (e + eta * r * e) / denominator;
    (up, down, 1.0 - up - (1.0 - soil) * down)
}

#[test]
fn horizontal_leaves_over_soil() {
    let (up, down, absorbed) = horizontal(0.3912, 0.4146, 0.2142, 3.0);
    close(up, 0.371617, 5e-7);
    close(down, 0.252977, 5e-7);
    close(absorbed, 0.429594, 5e-7);
    for n in [1, 3, 64] {
        for bins in [1, 2, 6, 17] {
            for mu in [1e-12, 0.01, 0.3, 1.0] {
                let layers = homogeneous(n, &[(1.0, false, 3.0)]);
                let leaf = LeafOptics::symmetric(0.3912, 0.4146);
                let field = solve(&layers, leaf, &[source(mu, 2.0)], Some(0.2142), bins);
                close(field.reflected_W_m2, 2.0 * up, 1e-11);
                close(field.transmitted_W_m2, 2.0 * down, 1e-11);
                close(field.absorbed_W_m2.iter().sum(), 2.0 * absorbed, 1e-11);
                close(closure(&field, Some(0.2142)), 0.0, 1e-14);
            }
        }
    }
}

#[test]
fn horizontal_leaves_that_absorb_nothing() {
    for (rho, soil, area_index) in [(0.5, 0.0, 3.0), (0.2, 0.7, 8.0), (1.0, 0.3, 50.0)] {
        let x = (1.0 - soil) * rho * area_index;
        let up = (soil + x) / (1.0 + x);
        for (n, bins) in [(1, 1), (7, 6), (100, 3)] {
            let layers = homogeneous(n, &[(1.0, false, area_index)]);
            let leaf = LeafOptics::symmetric(rho, 1.0 - rho);
            let field = solve(&layers, leaf, &[source(0.4, 1.0)], Some(soil), bins);
            close(field.reflected_W_m2, up, 1e-11);
            close(field.transmitted_W_m2, (1.0 - up) / (1.0 - soil), 1e-11);
            close(field.absorbed_W_m2.iter().sum(), 0.0, 1e-15);
        }
    }
}

#[test]
fn black_leaves_leave_the_direct_gaps() {
    let black = LeafOptics::default();
    for area_index in [1.0, 3.0] {
        for mu in [0.1, 0.5, 1.0] {
            let layers = spherical(9, area_index, 2000);
            let field = solve(&layers, black, &[source(mu, 1.0)], None, 6);
            close(field.transmitted_W_m2, (-0.5 * area_index / mu).exp(), 1e-6);
            assert!(field.radiance_down(0, 0) == 0.0 && field.radiance_up(9, 5) == 0.0);
        }
    }
}

#[test]
fn a_uniform_sky_is_intercepted_as_by_e3() {
    let n = 4000;
    let sky: Vec<_> = (0..n)
        .map(|i| (f64::from(i) + 0.5) / f64::from(n))
        .map(|mu| source(mu, 2.0 * mu / f64::from(n)))
        .collect();
    for (area_index, intercepted) in [(1.0, 0.556791), (2.0, 0.780616), (3.0, 0.886521)] {
        let layers = spherical(1, area_index, 400);
        let field = solve(&layers, LeafOptics::default(), &sky, Some(0.0), 1);
        close(field.absorbed_W_m2[0], intercepted, 1e-6);
    }
}

#[test]
fn nothing_is_lost_where_nothing_absorbs() {
    for (rho, tau) in [(0.5, 0.5), (1.0, 0.0), (0.0, 1.0), (0.1, 0.9)] {
        for area_index in [1e-6, 0.5, 50.0] {
            let layers = spherical(20, area_index, 6);
            let leaf = LeafOptics::symmetric(rho, tau);
            let sources = [source(0.02, 1.0), source(0.9, 2.0)];
            let field = solve(&layers, leaf, &sources, Some(1.0), 6);
            close(field.reflected_W_m2, 3.0, 1e-13);
        }
    }
}
