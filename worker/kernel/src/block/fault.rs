//! Why a block is refused.

use thiserror::Error;

/// Why a block was refused.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum BlockFault {
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
