//! A triangle soup, laid out so that what slips between the lines is sorted out quickly.

use glam::DVec3;

use super::{Lattice, reach};

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
        let mut columns: [[Vec<f64>; 3]; 3] =
            std::array::from_fn(|_| std::array::from_fn(|_| Vec::with_capacity(triangles.len())));
        // in one reading: the triangles of a large scene do not stay in the cache
        for triangle in &triangles {
            for (columns, vertex) in columns.iter_mut().zip(triangle) {
                for (column, x) in columns.iter_mut().zip(vertex.to_array()) {
                    column.push(x);
                }
            }
        }
        Self { triangles, columns }
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        &self.triangles
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
        for start in (0..self.triangles.len()).step_by(BLOCK) {
            let end = (start + BLOCK).min(self.triangles.len());
            let columns =
                [0, 1, 2].map(|v| [0, 1, 2].map(|axis| &self.columns[v][axis][start..end]));
            for (number, lattice) in lattices.iter().enumerate() {
                reach::test(lattice, columns, &mut hit[..end - start]);
                for k in (0..end - start).filter(|&k| hit[k]) {
                    let vertex = |v: [&[f64]; 3]| DVec3::new(v[0][k], v[1][k], v[2][k]);
                    reached(number, (start + k) as u32, &columns.map(vertex));
                }
            }
        }
    }
}
