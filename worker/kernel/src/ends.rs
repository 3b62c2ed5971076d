//! The numbers of what a face can see ("ends"): other faces, soil cells, the sky, the far field.
//!
//! The order is part of the protocol; see `World` in `near_field.proto`.

/// How the ends of a scene are numbered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ends {
    /// Elements of the scene, each with two faces.
    pub elements: u32,
    /// Cells of the soil plane; 0 without soil.
    pub soil_cells: u32,
    /// Ends of the far field; 0 without one.
    pub far_ends: u32,
    /// Zones of the soil around the map of an open scene; 0 without.
    pub outer_zones: u32,
}

/// The side of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Where the right-hand normal points to.
    Upper = 0,
    /// The other one.
    Lower = 1,
}

impl Ends {
    /// Faces of elements: `2 * elements`.
    pub fn faces(&self) -> u32 {
        2 * self.elements
    }

    /// Faces and soil cells: those that have a row, and a radiosity of their own.
    pub fn rows(&self) -> u32 {
        self.faces() + self.soil_cells
    }

    /// A face of an element.
    pub fn face(&self, element: u32, side: Side) -> u32 {
        2 * element + side as u32
    }

    /// A soil cell.
    pub fn soil(&self, cell: u32) -> u32 {
        self.faces() + cell
    }

    /// The sky: nothing scattered comes from it.
    pub fn sky(&self) -> u32 {
        self.rows()
    }

    /// The black void below a scene without soil.
    pub fn void(&self) -> u32 {
        self.rows() + 1
    }

    /// The soil beyond the map of an open scene, and beyond all zones around it.
    pub fn outer_soil(&self) -> u32 {
        self.rows() + 2
    }

    /// What a face sees where it is buried in something solid.
    pub fn buried(&self) -> u32 {
        self.rows() + 3
    }

    /// An end of the far field, which numbers them from 0.
    pub fn far(&self, end: u32) -> u32 {
        self.rows() + 4 + end
    }

    /// A zone of the soil around the map of an open scene.
    pub fn zone(&self, zone: u32) -> u32 {
        self.far(self.far_ends) + zone
    }

    /// Whether an end is soil beyond the map of an open scene, in a zone or beyond all of them.
    pub fn is_outer_soil(&self, end: u32) -> bool {
        end == self.outer_soil() || end >= self.zone(0)
    }

    /// All ends.
    pub fn len(&self) -> usize {
        self.zone(self.outer_zones) as usize
    }

    /// There is always the sky.
    pub fn is_empty(&self) -> bool {
        false
    }
}
