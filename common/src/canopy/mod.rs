//! The canopy: meshes with their organs and materials, the pattern, the soil. There is no light in it.

mod kind;
mod mesh;
mod solids;
#[cfg(test)]
mod solids_tests;
mod weld;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use glam::{DAffine3, DVec2, DVec3};

use crate::geometry;
pub use kind::Kind;
pub use mesh::{Mesh, Triangle};
pub use solids::Solids;
pub use weld::Welder;

/// Longest name of an organ, plant, species, material or band, bytes.
pub const MAX_NAME_BYTES: usize = 4096;

/// A canopy ready to be computed: checked, in metres, moved to a local origin.
///
/// Conventions: z up; the *upper* face of a triangle is the one that the right-hand normal
/// `(v1 - v0) x (v2 - v0)` points to. Triangles are numbered from 0 through all instances, in their order;
/// triangle, organ and material order is the user's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Canopy {
    meshes: Vec<Mesh>,
    instances: Vec<Instance>,
    /// Number of the first triangle of each instance, and of all triangles at the end.
    first: Vec<usize>,
    /// In order of first appearance.
    pub organs: Vec<Organ>,
    /// In order of first appearance; optics are looked up by this name.
    pub materials: Vec<Material>,
    /// What materials count as that the user declared; the others count as what they are ([`Material::kind`]).
    pub declared: BTreeMap<Material, Kind>,
    /// What is solid where it encloses something, besides CAN's stems: named materials that are declared to be stems and
    /// let no light through.
    pub opaque_stems: BTreeSet<Material>,
    /// What was subtracted from the user's coordinates (already in metres).
    pub origin_m: DVec3,
    /// The rectangle on which the canopy repeats for ever; `None` for an isolated scene.
    pub pattern: Option<Pattern>,
    /// Height of the soil plane, relative to `origin_m`; `None` for a black void below.
    pub soil_z_m: Option<f64>,
}

/// A mesh in its place. The kernel computes with every instance's own triangles as yet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instance {
    /// Index of the mesh.
    pub mesh: u32,
    /// Added to the mesh's organ numbers.
    pub first_organ: u32,
    /// Where it stands; `None` where the mesh is.
    pub place: Option<DAffine3>,
}

impl Canopy {
    /// Of meshes in metres, each instance of which is an index below their number.
    pub fn new(meshes: Vec<Mesh>, instances: Vec<Instance>) -> Self {
        let mut first = vec![0];
        let mut total = 0;
        for instance in &instances {
            total += meshes[instance.mesh as usize].len();
            first.push(total);
        }
        Self {
            meshes,
            instances,
            first,
            ..Self::default()
        }
    }

    /// Of meshes that stand where they are.
    pub fn of_meshes(meshes: Vec<Mesh>) -> Self {
        let instance = |mesh| Instance {
            mesh,
            ..Instance::default()
        };
        let instances = (0..meshes.len() as u32).map(instance).collect();
        Self::new(meshes, instances)
    }

    /// Number of triangles, those of all instances together.
    pub fn len(&self) -> usize {
        self.first.last().copied().unwrap_or(0)
    }

    /// No triangles at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A triangle.
    #[inline]
    pub fn triangle(&self, number: usize) -> Triangle {
        let at = match self.first[..] {
            [_, _] => 0,
            _ => self.first.partition_point(|&first| first <= number) - 1,
        };
        let instance = &self.instances[at];
        let mut triangle = self.meshes[instance.mesh as usize].triangle(number - self.first[at]);
        triangle.organ += instance.first_organ;
        if let Some(place) = &instance.place {
            triangle.corners_m = triangle
                .corners_m
                .map(|corner| place.transform_point3(corner));
        }
        triangle
    }

    /// All triangles, in order.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = Triangle> + Clone {
        (0..self.len()).map(|t| self.triangle(t))
    }

    /// The vertices of all triangles, in order, metres.
    pub fn corners_m(&self) -> impl ExactSizeIterator<Item = [DVec3; 3]> + Clone {
        self.triangles().map(|triangle| triangle.corners_m)
    }

    /// What each material counts as.
    pub fn kinds(&self) -> Vec<Kind> {
        let kind = |material: &Material| match self.declared.get(material) {
            Some(&declared) => declared,
            None => material.kind(),
        };
        self.materials.iter().map(kind).collect()
    }

    /// Whether the lower faces of each material may be the inside of something solid: of CAN's stems, unless they are
    /// declared to be a structure, which has two faces, and of named materials that are opaque stems.
    pub fn may_be_solid(&self) -> Vec<bool> {
        let kinds = self.kinds().into_iter().zip(&self.materials);
        let solid = |(kind, material): (Kind, &Material)| {
            let stem = matches!(material, Material::Stem { .. });
            (stem && kind != Kind::Structure) || self.opaque_stems.contains(material)
        };
        kinds.map(solid).collect()
    }

    /// What is solid.
    pub fn solids(&self) -> Solids {
        Solids::of(self, &self.may_be_solid())
    }

    /// Whether each organ is of a plant: some of it is leaf or stem.
    pub fn plants(&self) -> Vec<bool> {
        let kinds = self.kinds();
        let mut plant = vec![false; self.organs.len()];
        for triangle in self.triangles() {
            plant[triangle.organ as usize] |= kinds[triangle.material as usize].is_plant();
        }
        plant
    }

    /// What each organ counts as; none where its triangles are of several kinds.
    pub fn organ_kinds(&self) -> Vec<Option<Kind>> {
        let kinds = self.kinds();
        let mut found: Vec<Option<Option<Kind>>> = vec![None; self.organs.len()];
        for triangle in self.triangles() {
            let kind = Some(kinds[triangle.material as usize]);
            let organ = &mut found[triangle.organ as usize];
            *organ = Some(match organ {
                None => kind,
                Some(known) if *known == kind => kind,
                Some(_) => None,
            });
        }
        found.into_iter().map(Option::flatten).collect()
    }

    /// The corners of its box, without the soil plane; both zero where there is nothing.
    pub fn bounds_m(&self) -> (DVec3, DVec3) {
        geometry::bounds_of(self.corners_m()).unwrap_or_default()
    }

    /// Bytes that its triangles take.
    pub fn bytes(&self) -> u64 {
        self.meshes.iter().map(Mesh::bytes).sum()
    }
}

/// A group of triangles that is reported as one. No two organs of a canopy have the same species, plant and id.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Organ {
    /// For CAN, the species number; for OBJ, the name of the file, which as a rule is one kind of plant.
    pub species: String,
    /// The plant it belongs to: for CAN, the plant number; for OBJ, the object's name.
    pub plant: String,
    /// As in the output: for CAN, plant * 1000 + leaf; for OBJ, the group's name.
    pub id: String,
}

impl Organ {
    /// CAN's soil: nobody's organ, which may be in several files.
    pub fn soil() -> Self {
        let [species, plant, id] = [(); 3].map(|()| "0".to_owned());
        Self { species, plant, id }
    }
}

impl fmt::Display for Organ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { species, plant, id } = self;
        write!(f, "organ {id} of plant {plant} of species {species}")
    }
}

/// What a triangle is made of; a band gives it optical properties.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Material {
    /// Opaque part of a CAN species (leaf number 0).
    Stem {
        /// Species number of the CAN label, 1 or more.
        species: u32,
    },
    /// Leaf of a CAN species.
    Leaf {
        /// Species number of the CAN label, 1 or more.
        species: u32,
    },
    /// Soil triangle (CAN species 0): opaque, with the soil's albedo.
    Soil,
    /// A material known by name (OBJ).
    Named(String),
}

impl Material {
    /// What it counts as where nothing is declared.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Leaf { .. } | Self::Named(_) => Kind::Leaf,
            Self::Stem { .. } => Kind::Stem,
            Self::Soil => Kind::Soil,
        }
    }

    /// The species that it is of, for CAN.
    pub fn species(&self) -> Option<u32> {
        match self {
            Self::Leaf { species } | Self::Stem { species } => Some(*species),
            Self::Soil | Self::Named(_) => None,
        }
    }
}

impl fmt::Display for Material {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stem { species } => write!(f, "stem of species {species}"),
            Self::Leaf { species } => write!(f, "leaf of species {species}"),
            Self::Soil => f.write_str("soil"),
            Self::Named(name) => f.write_str(name),
        }
    }
}

/// The rectangle in x, y on which a periodic canopy repeats, relative to the local origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// Lower corner, metres.
    pub min_m: DVec2,
    /// Extent in x and y, metres, both positive.
    pub size_m: DVec2,
}

impl Pattern {
    /// Area of the rectangle, m².
    pub fn area_m2(&self) -> f64 {
        self.size_m.x * self.size_m.y
    }
}
