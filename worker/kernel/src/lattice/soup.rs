//! A triangle soup, laid out so that what slips between the lines is sorted out quickly.

use glam::DVec3;

use super::{Lattice, reach};

/// Triangles in blocks, each block column by column: the layout that the test of which lines meet what reads
/// at vector width, and the only copy of the vertices that a solve computes with.
#[derive(Clone, Debug, Default)]
pub struct Soup {
    blocks: Vec<Columns>,
    len: usize,
}

/// x, y and z of the first, second and third vertices of [`BLOCK`] triangles; what is past the last is zero.
type Columns = [[[f64; BLOCK]; 3]; 3];

/// Triangles that are tested at a time.
const BLOCK: usize = 128;

impl FromIterator<[DVec3; 3]> for Soup {
    fn from_iter<I: IntoIterator<Item = [DVec3; 3]>>(triangles: I) -> Self {
        let triangles = triangles.into_iter();
        let mut soup = Self {
            blocks: Vec::with_capacity(triangles.size_hint().0.div_ceil(BLOCK)),
            len: 0,
        };
        for triangle in triangles {
            let place = soup.len % BLOCK;
            if place == 0 {
                soup.blocks.push([[[0.0; BLOCK]; 3]; 3]);
            }
            if let Some(block) = soup.blocks.last_mut() {
                for (columns, vertex) in block.iter_mut().zip(triangle) {
                    for (column, x) in columns.iter_mut().zip(vertex.to_array()) {
                        column[place] = x;
                    }
                }
            }
            soup.len += 1;
        }
        soup
    }
}

impl Soup {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.len
    }

    /// No triangles at all.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The vertices of a triangle.
    #[inline]
    pub fn triangle(&self, t: usize) -> [DVec3; 3] {
        let k = t % BLOCK;
        let vertex = |[x, y, z]: &[[f64; BLOCK]; 3]| DVec3::new(x[k], y[k], z[k]);
        self.blocks[t / BLOCK].each_ref().map(vertex)
    }

    /// All triangles, in order.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [DVec3; 3]> + Clone {
        (0..self.len).map(|t| self.triangle(t))
    }

    /// Calls `reached` for each triangle that a line may meet, by rising number. Those left out meet none.
    #[inline]
    pub(super) fn for_each_reached(
        &self,
        lattice: &Lattice,
        mut reached: impl FnMut(u32, &[DVec3; 3]),
    ) {
        self.for_each_reached_of(std::slice::from_ref(lattice), |_, t, triangle| {
            reached(t, triangle);
        });
    }

    /// The same for several lattices in one reading of the triangles: calls `reached` with the number of the
    /// lattice, for each lattice by rising number of the triangle.
    ///
    /// Vertices are handed on from the columns that the test has just read: most triangles are left out,
    /// so reading the others from elsewhere would cost a cache miss each.
    #[inline]
    pub fn for_each_reached_of(
        &self,
        lattices: &[Lattice],
        mut reached: impl FnMut(usize, u32, &[DVec3; 3]),
    ) {
        let mut hit = [false; BLOCK];
        for (block, start) in self.blocks.iter().zip((0..self.len).step_by(BLOCK)) {
            let n = BLOCK.min(self.len - start);
            let columns = block
                .each_ref()
                .map(|v| v.each_ref().map(|axis| &axis[..n]));
            for (number, lattice) in lattices.iter().enumerate() {
                reach::test(lattice, columns, &mut hit[..n]);
                for k in (0..n).filter(|&k| hit[k]) {
                    let vertex = |v: [&[f64]; 3]| DVec3::new(v[0][k], v[1][k], v[2][k]);
                    reached(number, (start + k) as u32, &columns.map(vertex));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_come_back_in_order_from_full_blocks_and_the_last_one() {
        let triangle = |t: usize| [0, 1, 2].map(|v| DVec3::new(t as f64, f64::from(v), -0.5));
        for n in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 7] {
            let soup: Soup = (0..n).map(triangle).collect();
            assert_eq!(soup.len(), n);
            let all: Vec<_> = soup.triangles().collect();
            assert_eq!(all, (0..n).map(triangle).collect::<Vec<_>>());
        }
    }
}
