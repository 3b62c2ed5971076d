//! Gauss-Seidel over two independent halves of the exchange.
//!
//! With F_A and F_B estimated from two independent halves of the lines, and S the scattering of a face
//! (rho to the same side, tau to the other), the unknowns are the irradiances x and y in
//!
//! ```text
//! x = E0 + F_A S y        y = E0 + F_B S x        E = (x + y) / 2
//! ```
//!
//! Light that goes from i to j and back goes there by one half and back by the other, so a chance
//! excess of lines between i and j is not squared: that removes the bias that one set of lines, used
//! both ways, has in multiple scattering, and every line still serves both its ends. All x depend on y
//! alone and all y on x alone, so a pass is a parallel Gauss-Seidel sweep (a red-black one) with one
//! result for any number of threads. Passes are accelerated by a minimal-residual method (`krylov`), so
//! that a canopy that absorbs next to nothing converges, too.

mod deviation;
mod gather;
mod groups;
mod krylov;
mod lane;
mod larger;
mod pass;
mod prefetch;
mod soil_groups;
mod solve;
mod spread;
mod sums;
mod system;

pub use groups::Groups;
pub use solve::{SolverError, Tolerance, solve};
pub use system::{Deviation, FarSample, Irradiance, Sampled, System, Variances};
