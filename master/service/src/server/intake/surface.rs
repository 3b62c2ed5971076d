//! What triangles are made of, as clients say it.

use nestrad_common::canopy::{Canopy, Kind, Material};
use nestrad_proto::v1;

/// A material, and what it counts as.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::server) struct Surface {
    pub(super) material: Material,
    pub(super) kind: Kind,
}

impl Surface {
    /// Of material number `index`.
    pub(super) fn new(index: usize, name: &str, kind: Kind, is_solid: bool) -> Self {
        let material = if is_solid {
            // a stem's number only tells it from other stems
            let species = index as u32 + 1;
            Material::Stem { species }
        } else {
            Material::Named(name.to_owned())
        };
        Self { material, kind }
    }

    /// Of all materials of a canopy.
    pub(in crate::server) fn of(canopy: &Canopy) -> Vec<Self> {
        let materials = canopy.materials.iter().cloned().zip(canopy.kinds());
        materials
            .map(|(material, kind)| Self { material, kind })
            .collect()
    }

    /// It lets no light through.
    pub(super) fn is_opaque(&self) -> bool {
        self.kind == Kind::Soil || matches!(self.material, Material::Stem { .. })
    }
}

/// A kind as it travels.
pub(in crate::server) fn sent(kind: Kind) -> v1::scene_material::Kind {
    use v1::scene_material::Kind as Sent;
    match kind {
        Kind::Leaf => Sent::Leaf,
        Kind::Stem => Sent::Stem,
        Kind::Soil => Sent::Soil,
        Kind::Structure => Sent::Structure,
    }
}
