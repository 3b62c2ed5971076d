//! Where each triangle of a canopy was read.

use super::error::Place;
use crate::canopy::Canopy;

/// Where each triangle of a canopy was read.
#[derive(Clone, Debug, Default)]
pub struct Origins {
    /// Name of a file and the number of its first triangle, in the order of the triangles.
    files: Vec<(String, usize)>,
    lines: Vec<u32>,
}

impl Origins {
    /// Goes on with the triangles of another file, from these lines.
    pub(crate) fn extend(&mut self, file: String, triangles_before: usize, lines: Vec<u32>) {
        self.files.push((file, triangles_before));
        if self.lines.is_empty() {
            self.lines = lines;
        } else {
            self.lines.extend(lines);
        }
    }

    /// The file and line of a triangle; its number where it did not come from a file.
    pub fn place(&self, triangle: usize) -> Place {
        if self.files.is_empty() {
            return Place::file(&format!("triangle {triangle}"));
        }
        let next = self.files.partition_point(|&(_, first)| first <= triangle);
        let file = next.checked_sub(1).map(|index| self.files[index].0.clone());
        Place {
            file: file.unwrap_or_default(),
            line: self.lines.get(triangle).map(|&line| line as usize),
        }
    }

    /// Where a material is used first.
    pub fn first_use(&self, canopy: &Canopy, material: u32) -> Place {
        let first = canopy.triangles().position(|t| t.material == material);
        self.place(first.unwrap_or_default())
    }
}
