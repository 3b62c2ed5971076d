//! What speed costs in accuracy, measured on the user's own scene: the study behind `nestrad trade`.

mod axis;
mod bars;
pub mod choice;
mod error;
mod folder;
mod keys;
pub mod ledger;
pub mod measure;
mod pace;
mod page;
mod plot;
pub mod request;
pub mod setting;
pub mod study;
pub mod table;
mod terminal;

pub use error::TradeError;
pub use folder::{check_place, write};
pub use page::About;
