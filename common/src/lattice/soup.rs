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
            reach::test(
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
