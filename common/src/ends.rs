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
    /// Levels of the far field; 0 without one.
    pub far_levels: u32,
    /// Bins of the far field per hemisphere.
    pub far_bins: u32,
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

    /// The soil beyond the map of an open scene.
    pub fn outer_soil(&self) -> u32 {
        self.rows() + 2
    }

    /// What a face sees where it is buried in something solid.
    pub fn buried(&self) -> u32 {
        self.rows() + 3
    }

    /// First end of the far field.
    pub fn far_start(&self) -> u32 {
        self.rows() + 4
    }

    /// The bin of a direction with this cosine to the vertical, 0 to 1.
    pub fn far_bin(&self, cosine: f64) -> u32 {
        ((cosine * f64::from(self.far_bins)) as u32).min(self.far_bins.saturating_sub(1))
    }

    /// Scattered light at a level, in bin `bin` of the light that comes down (from above).
    pub fn far_from_above(&self, bin: u32, level: u32) -> u32 {
        self.far_start() + bin * self.far_levels + level
    }

    /// Scattered light at a level, in bin `bin` of the light that comes up (from below).
    pub fn far_from_below(&self, bin: u32, level: u32) -> u32 {
        self.far_from_above(self.far_bins + bin, level)
    }

    /// Ends of the far field.
    pub fn far_len(&self) -> u32 {
        2 * self.far_bins * self.far_levels
    }

    /// All ends.
    pub fn len(&self) -> usize {
        self.far_start() as usize + self.far_len() as usize
    }

    /// There is always the sky.
    pub fn is_empty(&self) -> bool {
        false
    }
}
