//! A triangle soup, laid out so that what slips between the lines is sorted out quickly.

use glam::DVec3;

use super::Lattice;

/// Triangles, also column by column.
#[derive(Clone, Debug, Default)]
pub struct Soup {
    triangles: Vec<[DVec3; 3]>,
    /// x, y and z of the first, second and third vertices.
    columns: [[Vec<f64>; 3]; 3],
}

/// Triangles that are tested at a time.
const BLOCK: usize = 128;

impl Soup {
    /// Takes the triangles as they are.
    pub fn new(triangles: Vec<[DVec3; 3]>) -> Self {
        let column =
            |vertex: usize, axis: usize| triangles.iter().map(|t| t[vertex][axis]).collect();
        let columns = [0, 1, 2].map(|v| [0, 1, 2].map(|axis| column(v, axis)));
        Self { triangles, columns }
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        &self.triangles
    }

    /// The triangles that a line may meet, by rising number. Those left out meet none.
    pub(super) fn reached(&self, lattice: &Lattice) -> Vec<u32> {
        let mut reached = Vec::with_capacity(self.triangles.len() / 2);
        let mut hit = [false; BLOCK];
        for start in (0..self.triangles.len()).step_by(BLOCK) {
            let end = (start + BLOCK).min(self.triangles.len());
            let vertex = |v: usize| [0, 1, 2].map(|axis| &self.columns[v][axis][start..end]);
            test(
                lattice,
                [vertex(0), vertex(1), vertex(2)],
                &mut hit[..end - start],
            );
            for (k, &hit) in hit[..end - start].iter().enumerate() {
                if hit {
                    reached.push((start + k) as u32);
                }
            }
        }
        reached
    }
}

/// Whether a lattice row and a lattice column pass through the box around each triangle. Plain
/// arithmetic without branches, which compilers turn into vector instructions.
fn test(lattice: &Lattice, vertices: [[&[f64]; 3]; 3], hit: &mut [bool]) {
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
        hit[k] = holds_whole_number(v) & holds_whole_number(u);
    }
}

/// Whether there is a whole number in `least..greatest`.
#[inline]
fn holds_whole_number([a, b, c]: [f64; 3]) -> bool {
    let least = |a: f64, b: f64| if a < b { a } else { b };
    let greatest = |a: f64, b: f64| if a > b { a } else { b };
    let (lo, hi) = (least(least(a, b), c), greatest(greatest(a, b), c));
    // adding 1.5 * 2^52 rounds to a whole number
    const ROUNDER: f64 = 1.5 * (1u64 << 52) as f64;
    let near = (lo + ROUNDER) - ROUNDER;
    let above = if near < lo { near + 1.0 } else { near };
    above < hi
}
