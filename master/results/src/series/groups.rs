//! Organs together: plants and species.

use std::collections::HashMap;
use std::hash::Hash;

use nestrad_common::canopy::{Canopy, Organ};

/// Organs of one name.
pub(super) struct Group<'a> {
    /// The first of them.
    pub(super) first: &'a Organ,
    /// Their numbers.
    pub(super) organs: Vec<usize>,
}

/// Plants, in the order of their first organs.
pub(super) fn plants(canopy: &Canopy) -> Vec<Group<'_>> {
    by(canopy, |organ| (&organ.species, &organ.plant))
}

/// Species, likewise.
pub(super) fn species(canopy: &Canopy) -> Vec<Group<'_>> {
    by(canopy, |organ| &organ.species)
}

fn by<'a, K: Eq + Hash>(canopy: &'a Canopy, key: impl Fn(&'a Organ) -> K) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    let mut known = HashMap::new();
    for (number, organ) in canopy.organs.iter().enumerate() {
        let group = *known.entry(key(organ)).or_insert_with(|| {
            groups.push(Group {
                first: organ,
                organs: Vec::new(),
            });
            groups.len() - 1
        });
        groups[group].organs.push(number);
    }
    groups
}
