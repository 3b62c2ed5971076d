//! Why a block is refused.

use nestrad_proto::mesh::MeshFault;
use thiserror::Error;

/// Why a block was refused.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum BlockFault {
    /// A message that must be there is not.
    #[error("block without {0}")]
    Missing(&'static str),
    /// Its triangles cannot be unpacked.
    #[error(transparent)]
    Mesh(#[from] MeshFault),
    /// Parts that describe the same triangles differ in length.
    #[error("block lists {found} {what}, expected {expected}")]
    Length {
        /// What is listed.
        what: &'static str,
        /// How many there are.
        found: u64,
        /// How many there should be.
        expected: u64,
    },
    /// A number is out of its range.
    #[error("block with {what} out of range")]
    Range {
        /// What is out of range.
        what: &'static str,
    },
}

pub(super) fn require(holds: bool, what: &'static str) -> Result<(), BlockFault> {
    if holds {
        Ok(())
    } else {
        Err(BlockFault::Range { what })
    }
}

pub(super) fn same_length(what: &'static str, found: u64, expected: u64) -> Result<(), BlockFault> {
    if found == expected {
        Ok(())
    } else {
        Err(BlockFault::Length {
            what,
            found,
            expected,
        })
    }
}
