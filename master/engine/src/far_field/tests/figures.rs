//! The figures of `docs/far_field.md`. Run with
//! `cargo test --release -p nestrad-master far_field::tests::figures -- --ignored --nocapture`.

#![allow(clippy::print_stdout, reason = "these tests exist to print")]

use std::time::Instant;

use nestrad_common::optics::FaceOptics;

use super::*;

const NIR: LeafOptics = leaf(0.45, 0.44);
const PAR: LeafOptics = leaf(0.09, 0.05);

const fn leaf(rho: f64, tau: f64) -> LeafOptics {
    let face = FaceOptics { rho, tau };
    LeafOptics {
        upper: face,
        lower: face,
    }
}

fn sky() -> Vec<Source> {
    (0..47)
        .map(|i| (f64::from(i) + 0.5) / 47.0)
        .map(|mu| source(mu, mu))
        .collect()
}

#[test]
#[ignore = "prints figures"]
fn polar_bins() {
    let layers = spherical(1, 4.0, 200);
    let total = |leaf, mu, bins| {
        let field = solve(&layers, leaf, &[source(mu, 1.0)], Some(0.2), bins);
        [field.reflected_W_m2, field.transmitted_W_m2]
    };
    println!("error in % of incoming: bins, then per sun mu 0.3, 0.9: NIR R T, PAR R T");
    for bins in [1, 2, 3, 4, 6, 8, 12, 16, 32] {
        print!("| {bins} |");
        for mu in [0.3, 0.9] {
            for leaf in [NIR, PAR] {
                let (coarse, fine) = (total(leaf, mu, bins), total(leaf, mu, 128));
                for (a, b) in coarse.iter().zip(fine) {
                    print!(" {:+.4} |", 100.0 * (a - b));
                }
            }
        }
        println!();
    }
}

#[test]
#[ignore = "prints figures"]
fn closure_by_depth() {
    println!("closure (conservative leaves): depth, black soil, white soil; absorbing leaves");
    for area_index in [1e-12, 1e-3, 1.0, 1e2, 1e4, 1e8, 1e15] {
        let layers = spherical(8, area_index, 18);
        let run = |leaf, soil| {
            let field = solve(&layers, leaf, &sky(), Some(soil), 6);
            closure(&field, Some(soil))
        };
        let conservative = LeafOptics::symmetric(0.55, 0.45);
        println!(
            "| {area_index:e} | {:.1e} | {:.1e} | {:.1e} |",
            run(conservative, 0.0),
            run(conservative, 1.0),
            run(NIR, 0.2)
        );
    }
}

#[test]
#[ignore = "prints figures"]
fn cost() {
    println!("ms for one band and 47 sources of different height, leaf area index 5");
    for (n, bins) in [
        (1, 6),
        (32, 6),
        (64, 1),
        (64, 6),
        (64, 16),
        (64, 64),
        (10_000, 6),
    ] {
        let layers = spherical(n, 5.0, 18);
        let start = Instant::now();
        let field = solve(&layers, NIR, &sky(), Some(0.2), bins);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        println!("| {n} | {bins} | {ms:.1} | {:.6} |", field.reflected_W_m2);
    }
}

#[test]
#[ignore = "prints figures"]
fn number_of_layers() {
    println!(
        "relative difference from 10,000 layers: reflected, transmitted, radiance at mid-height"
    );
    let values = |n: usize| {
        let field = solve(&spherical(n, 4.0, 18), NIR, &sky(), Some(0.2), 6);
        let middle = field.radiance_up(n / 2, 0);
        [field.reflected_W_m2, field.transmitted_W_m2, middle]
    };
    let fine = values(10_000);
    for n in [2, 8, 64, 1000] {
        let [r, t, l] = std::array::from_fn(|i| values(n)[i] / fine[i] - 1.0);
        println!("| {n} | {r:.1e} | {t:.1e} | {l:.1e} |");
    }
}

#[test]
#[ignore = "prints figures"]
fn trace_through_depth() {
    println!("light that passes a conservative canopy of horizontal leaves: relative error");
    for rho in [0.5, 0.9] {
        for area_index in [1e4, 1e6, 1e9, 1e15] {
            print!("| {rho} | {area_index:e} |");
            for (n, bins) in [(1, 1), (1, 6), (10, 6)] {
                let layers = homogeneous(n, &[(1.0, false, area_index)]);
                let field = solve(&layers, leaf(rho, 1.0 - rho), &sky(), Some(0.0), bins);
                let passed = field.incoming_W_m2 / (1.0 + rho * area_index);
                print!(" {:.1e} |", field.transmitted_W_m2 / passed - 1.0);
            }
            println!();
        }
    }
}
