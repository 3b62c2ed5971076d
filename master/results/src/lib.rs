//! Results as files to keep and pages to look at: tables, a surface for ParaView, a summary; the report of a result;
//! the study of what speed costs in accuracy. What a solve says on the terminal is here too.
//!
//! The result of a solve is a folder: `organs`, `triangles` and (where there is a soil plane) `soil` as `.csv` or
//! `.parquet`, `canopy.vtp` if asked for, and `summary.json`, which is written last. All files are written beside
//! their places and then renamed: see [`atomic`] for what that means to a reader of the folder.
//!
//! This crate may import `nestrad-common`, the engine and the kernel, and libraries for files and numbers: no
//! network, no command line.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

pub mod atomic;
mod csv;
mod error;
mod finite;
mod folder;
mod html;
mod json;
mod number;
mod parquet;
pub mod report;
mod sensors;
pub mod series;
pub mod summary;
mod table;
mod tables;
pub mod terminal;
pub mod trade;
mod vtk_xml;
mod vtp;

pub use nestrad_common::options::TableFormat;

pub use error::{Fault, OutputError};
pub use folder::{Formats, StagedResult, check_place, stage, write_all};
