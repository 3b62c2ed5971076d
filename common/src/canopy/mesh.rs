//! An indexed mesh: every vertex once.

use glam::DVec3;

use super::Welder;

/// Triangles over shared vertices, in metres once they are part of a [`Canopy`](super::Canopy).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub vertices: Vec<DVec3>,
    /// The vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Organ of each triangle.
    pub organ: Vec<u32>,
    /// Material of each triangle.
    pub material: Vec<u32>,
}

/// A triangle of a canopy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its vertices, metres.
    pub corners_m: [DVec3; 3],
    /// Index into [`Canopy::organs`](super::Canopy::organs).
    pub organ: u32,
    /// Index into [`Canopy::materials`](super::Canopy::materials).
    pub material: u32,
}

impl Mesh {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// No triangles at all.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// A triangle.
    #[inline]
    pub fn triangle(&self, number: usize) -> Triangle {
        let corner = |v: u32| self.vertices[v as usize];
        Triangle {
            corners_m: self.triangles[number].map(corner),
            organ: self.organ[number],
            material: self.material[number],
        }
    }

    /// Adds a triangle, whose vertices may be there already.
    pub fn push(&mut self, welder: &mut Welder, triangle: &Triangle) {
        let vertex = |corner| welder.number(corner, &mut self.vertices);
        self.triangles.push(triangle.corners_m.map(vertex));
        self.organ.push(triangle.organ);
        self.material.push(triangle.material);
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let vertex = size_of::<DVec3>();
        (self.vertices.capacity() * vertex + self.triangles.capacity() * 12) as u64
            + 4 * (self.organ.capacity() + self.material.capacity()) as u64
    }
}

impl FromIterator<Triangle> for Mesh {
    fn from_iter<I: IntoIterator<Item = Triangle>>(triangles: I) -> Self {
        let (mut mesh, mut welder) = (Self::default(), Welder::default());
        for triangle in triangles {
            mesh.push(&mut welder, &triangle);
        }
        mesh
    }
}
