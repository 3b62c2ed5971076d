//! What speed costs in accuracy, measured on the user's own scene: parts of the study behind `nestrad trade`.

pub mod choice;
mod error;
pub mod ledger;
pub mod measure;
pub mod setting;
pub mod study;

pub use error::TradeError;
