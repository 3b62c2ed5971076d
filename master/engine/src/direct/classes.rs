//! What a lattice tells apart: the upper and lower faces of each material of each organ.

use nestrad_kernel::zbuffer::Top;

use super::tally::{Class, Groups};
use crate::frame::Frame;

/// The faces of one material and side of an organ are a class.
pub(super) struct Classes {
    /// Of the upper faces of each triangle, within its organ; that of the lower ones is the next.
    of_triangle: Vec<u32>,
    /// Materials of each organ, sorted.
    materials: Vec<Vec<u32>>,
    /// Materials of the scene.
    all: u32,
}

/// What a class is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Face {
    Leaf {
        material: u32,
        upper: bool,
    },
    /// Of the soil plane.
    Soil,
}

impl Classes {
    pub(super) fn of(frame: &Frame) -> Self {
        let mut materials: Vec<Vec<u32>> = vec![Vec::new(); frame.organs];
        for (&organ, &material) in frame.organ.iter().zip(&frame.material) {
            let of_organ = &mut materials[organ as usize];
            if let Err(place) = of_organ.binary_search(&material) {
                of_organ.insert(place, material);
            }
        }
        let of_triangle = frame.organ.iter().zip(&frame.material);
        let of_triangle = of_triangle
            .map(|(&organ, material)| {
                let place = materials[organ as usize].binary_search(material);
                2 * place.unwrap_or_default() as u32
            })
            .collect();
        Self {
            of_triangle,
            materials,
            all: frame.materials.len() as u32,
        }
    }

    /// Organs, with two classes for each material.
    pub(super) fn organs(&self) -> Groups {
        Groups::new(self.materials.iter().map(|of| 2 * of.len() as u32))
    }

    /// The scene as one group: two classes for each material, and the soil.
    pub(super) fn scene(&self) -> Groups {
        Groups::new(std::iter::once(2 * self.all + 1))
    }

    /// The class of what is on top.
    pub(super) fn of_organ(&self, frame: &Frame, top: Top) -> Class {
        let t = frame.triangle_of_element[top.element as usize] as usize;
        (frame.organ[t], self.of_triangle[t] + u32::from(!top.upper))
    }

    /// The class of what is on top, or of the soil where nothing is, in the scene as a whole.
    pub(super) fn of_scene(&self, frame: &Frame, top: Option<Top>) -> Option<Class> {
        let Some(Top { element, upper }) = top else {
            return frame.world.soil.map(|_| (0, 2 * self.all));
        };
        let t = frame.triangle_of_element[element as usize] as usize;
        Some((0, 2 * frame.material[t] + u32::from(!upper)))
    }

    /// The face of a class of an organ.
    pub(super) fn face_of_organ(&self, organ: usize, class: u32) -> Face {
        Face::Leaf {
            material: self.materials[organ][class as usize / 2],
            upper: class.is_multiple_of(2),
        }
    }

    /// The face of a class of the scene.
    pub(super) fn face_of_scene(&self, class: u32) -> Face {
        if class == 2 * self.all {
            return Face::Soil;
        }
        Face::Leaf {
            material: class / 2,
            upper: class.is_multiple_of(2),
        }
    }
}
