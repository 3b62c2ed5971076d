//! Whether any line may meet a triangle: most triangles of a canopy slip between the lines, so this is
//! the test that a direction spends its time on.

use super::Lattice;

/// Vertices of some triangles, column by column: x, y, z of the first, the second and the third ones.
pub(super) type Columns<'a> = [[&'a [f64]; 3]; 3];

/// Sets `hit` for each triangle that a line may meet. Those left out meet none.
pub(super) fn test(lattice: &Lattice, vertices: Columns, hit: &mut [bool]) {
    #[cfg(target_arch = "x86_64")]
    if wide::test(lattice, vertices, hit) {
        return;
    }
    test_each(lattice, vertices, hit);
}

/// Plain arithmetic without branches, which compilers turn into vector instructions.
#[inline(always)]
fn test_each(lattice: &Lattice, vertices: Columns, hit: &mut [bool]) {
    let n = hit.len();
    let [[x0, y0, z0], [x1, y1, z1], [x2, y2, z2]] = vertices.map(|v| v.map(|c| &c[..n]));
    for k in 0..n {
        let v = [
            lattice.v(y0[k], z0[k]),
            lattice.v(y1[k], z1[k]),
            lattice.v(y2[k], z2[k]),
        ];
        let u = [
            lattice.u(x0[k], z0[k]),
            lattice.u(x1[k], z1[k]),
            lattice.u(x2[k], z2[k]),
        ];
        let (row, rows_end) = whole_numbers(v);
        let (column, columns_end) = whole_numbers(u);
        // a box around several points is for the scan to sort out
        let several = (row + 1.0 < rows_end) | (column + 1.0 < columns_end);
        hit[k] = (row < rows_end)
            & (column < columns_end)
            & (several | !is_outside(u, v, [column, row]));
    }
}

/// The least whole number in `least..greatest`, and `greatest`: none if the former is not below the latter.
#[inline(always)]
fn whole_numbers([a, b, c]: [f64; 3]) -> (f64, f64) {
    let (lo, hi) = (least(least(a, b), c), greatest(greatest(a, b), c));
    // adding 1.5 * 2^52 rounds to a whole number
    const ROUNDER: f64 = 1.5 * (1u64 << 52) as f64;
    let near = (lo + ROUNDER) - ROUNDER;
    (if near < lo { near + 1.0 } else { near }, hi)
}

/// Whether a point is outside of a triangle beyond doubt.
#[inline(always)]
fn is_outside(u: [f64; 3], v: [f64; 3], [column, row]: [f64; 2]) -> bool {
    let (x, y) = (u.map(|u| u - column), v.map(|v| v - row));
    let side = |a: usize, b: usize| x[a] * y[b] - x[b] * y[a];
    let (p, q, r) = (side(0, 1), side(1, 2), side(2, 0));
    let (lo, hi) = (least(least(p, q), r), greatest(greatest(p, q), r));
    (lo < -DOUBT) & (hi > DOUBT)
}

/// Doubled area, in steps of the lattice, below which the scan decides. Where an edge crosses a row is off
/// by at most some 4 * 2^-53 * 2^24 steps, and the triangle is at most two steps high: below 1e-7.
const DOUBT: f64 = 1e-6;

#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greatest(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The same arithmetic, compiled for processors with wider vectors: four times the speed. No operation is
/// fused or reordered, so the result is the same.
#[cfg(target_arch = "x86_64")]
#[allow(
    unsafe_code,
    reason = "a function compiled for AVX2 is called once the processor is known to have it"
)]
mod wide {
    use super::{Columns, Lattice, test_each};

    #[target_feature(enable = "avx2")]
    fn test_avx2(lattice: &Lattice, vertices: Columns, hit: &mut [bool]) {
        test_each(lattice, vertices, hit);
    }

    /// Whether the processor can, and it is done.
    pub(super) fn test(lattice: &Lattice, vertices: Columns, hit: &mut [bool]) -> bool {
        let can = std::arch::is_x86_feature_detected!("avx2");
        if can {
            // SAFETY: the processor has AVX2.
            unsafe { test_avx2(lattice, vertices, hit) };
        }
        can
    }
}
