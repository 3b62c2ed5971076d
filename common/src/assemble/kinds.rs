//! What the materials of a canopy are declared to count as.

use std::collections::{BTreeMap, BTreeSet};

use crate::canopy::{Canopy, Kind, Material};
use crate::inputs::Inputs;

/// The kinds that inputs declare, of the materials that a canopy has.
pub(super) fn declared(inputs: &Inputs, canopy: &Canopy) -> BTreeMap<Material, Kind> {
    let kinds = &inputs.kinds;
    let of = |material: &Material| match material {
        Material::Named(name) => kinds.materials.get(name).copied(),
        _ => kinds.species.get(&material.species()?).copied(),
    };
    let materials = canopy.materials.iter();
    materials
        .filter_map(|material| Some((material.clone(), of(material)?)))
        .collect()
}

/// The named materials that are declared to be stems and let no light through in any band.
pub(super) fn opaque_stems(inputs: &Inputs, canopy: &Canopy) -> BTreeSet<Material> {
    let is_clear = |name: &String| {
        let optics = inputs.bands.iter().map(|band| band.materials.get(name));
        optics
            .flatten()
            .any(|optics| optics.upper.tau + optics.lower.tau > 0.0)
    };
    let declared = canopy.declared.iter();
    declared
        .filter(|&(material, &kind)| {
            matches!(material, Material::Named(name) if kind == Kind::Stem && !is_clear(name))
        })
        .map(|(material, _)| material.clone())
        .collect()
}

/// Warnings of kinds that are declared for what a canopy does not have.
pub(super) fn unknown(inputs: &Inputs, canopy: &Canopy) -> Vec<String> {
    let kinds = &inputs.kinds;
    let has = |of: &dyn Fn(&Material) -> bool| canopy.materials.iter().any(of);
    let materials = kinds.materials.keys();
    let materials = materials
        .filter(|&name| !has(&|material| matches!(material, Material::Named(own) if own == name)))
        .map(|name| format!("material '{name}'"));
    let species = kinds.species.keys();
    let species = species
        .filter(|&&number| !has(&|material| material.species() == Some(number)))
        .map(|number| format!("species {number}"));
    materials
        .chain(species)
        .map(|what| format!("a kind is given for {what}, which the scene does not have"))
        .collect()
}
