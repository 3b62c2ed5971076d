//! What a direction lights: areas of faces and points of soil cells, and how well they are known. There is no
//! light in it, so it serves every source that shines from there.

use glam::DVec3;
use nestrad_kernel::zbuffer::ZBuffer;

use super::classes::Classes;
use super::outlines::{Outline, Outlines};
use super::shadow::Shade;
use crate::frame::Frame;

/// What a direction lights.
#[derive(Clone, Debug, Default)]
pub(super) struct LitAreas {
    /// Towards the source, a unit vector.
    pub(super) towards: DVec3,
    /// Cross-section of a line, m².
    pub(super) line_area_m2: f64,
    /// Lattice points.
    pub(super) lines: u64,
    /// Those that meet nothing.
    pub(super) missed: u64,
    /// Faces; a face may stand here without any lit area, for what is uncertain of it.
    pub(super) faces: Vec<LitFace>,
    /// Soil cells that are lit.
    pub(super) soil: Vec<LitCell>,
    /// On the soil around the map of an open scene.
    pub(super) shades: Vec<Shade>,
    /// Of organs, in order.
    pub(super) outlines: Vec<Outline>,
    /// Of the scene as a whole.
    pub(super) scene: Vec<Outline>,
    /// Faces whose organs are not known by points.
    pub(super) unsure: Vec<Unsure>,
    /// Of all organs that are probed, perpendicular to the source: area, what is lit of it, and what the lattice
    /// shows of it, m².
    pub(super) probed_m2: Option<[f64; 3]>,
    /// Of each organ, if this is the sun.
    pub(super) sunlit: Vec<SunlitArea>,
}

/// One-sided area of an organ that a direction reaches, on whichever side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SunlitArea {
    /// All of it.
    pub area_m2: f64,
    /// Its variance.
    pub variance_m4: f64,
}

/// A face that is lit. There are as many as a canopy has, for each direction that is kept: they are small.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitFace {
    /// Number of the row.
    pub(super) row: u32,
    /// Variance of the lit area, in squares of the cross-section of a line.
    pub(super) variance: f32,
    /// Lit area perpendicular to the source, over the area of the face.
    pub(super) part: f64,
}

/// A soil cell that is lit.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitCell {
    pub(super) cell: u32,
    /// Lit area of the ground, over the area of the cell.
    pub(super) part: f64,
    /// Variance of that.
    pub(super) variance: f64,
}

/// What is uncertain of an organ's lit area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unsure {
    pub(super) organ: u32,
    pub(super) material: u32,
    pub(super) upper: bool,
    pub(super) variance_m4: f64,
}

/// Counters, kept from direction to direction.
pub(super) struct Scratch {
    pub(super) buffer: ZBuffer,
    /// Points that show each face and each soil cell.
    pub(super) visible: Vec<u32>,
    /// Points that meet each element.
    pub(super) met: Vec<u32>,
    pub(super) outlines: Outlines,
    pub(super) organ: Vec<OfOrgan>,
    pub(super) lit: Vec<Lit>,
}

/// What an organ shows to the source.
#[derive(Clone, Copy, Default)]
pub(super) struct OfOrgan {
    /// By its points.
    pub(super) seen_m2: f64,
    /// By what its elements got.
    pub(super) dealt_m2: f64,
    /// Points that meet it, seen or not.
    pub(super) met: u32,
}

/// An element that is lit.
pub(super) struct Lit {
    pub(super) element: usize,
    pub(super) upper: bool,
    /// Perpendicular to the source.
    pub(super) area_m2: f64,
    pub(super) variance_m4: f64,
}

impl LitAreas {
    /// Bytes that it takes.
    pub(super) fn bytes(&self) -> u64 {
        let of = |list: usize, item: usize| (list * item) as u64;
        size_of::<Self>() as u64
            + of(self.faces.capacity(), size_of::<LitFace>())
            + of(self.soil.capacity(), size_of::<LitCell>())
            + of(self.shades.capacity(), size_of::<Shade>())
            + of(self.outlines.capacity(), size_of::<Outline>())
            + of(self.scene.capacity(), size_of::<Outline>())
            + of(self.unsure.capacity(), size_of::<Unsure>())
            + of(self.sunlit.capacity(), size_of::<SunlitArea>())
    }

    /// Without room that is not used.
    pub(super) fn shrink(&mut self) {
        self.faces.shrink_to_fit();
        self.soil.shrink_to_fit();
        self.shades.shrink_to_fit();
        self.outlines.shrink_to_fit();
        self.scene.shrink_to_fit();
        self.unsure.shrink_to_fit();
        self.sunlit.shrink_to_fit();
    }
}

impl Scratch {
    pub(super) fn new(frame: &Frame, classes: &Classes) -> Self {
        Self {
            buffer: ZBuffer::default(),
            visible: vec![0; frame.rows()],
            met: vec![0; frame.area_m2.len()],
            outlines: Outlines::new(classes),
            organ: vec![OfOrgan::default(); frame.organs],
            lit: Vec::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.lit.clear();
        self.visible.fill(0);
        self.met.fill(0);
        self.organ.fill(OfOrgan::default());
    }
}
