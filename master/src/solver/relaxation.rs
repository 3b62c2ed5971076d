//! How far to step: over-relaxation whose factor is learnt from the passes themselves.

/// Over-relaxation for one band.
///
/// For a 2-cyclic matrix whose Jacobi iteration contracts by `lambda` per half pass, Gauss-Seidel
/// contracts by `lambda²` per pass and successive over-relaxation with
/// `omega = 2 / (1 + sqrt(1 - lambda²))` by `omega - 1` (Young 1971). `lambda` is learnt from the
/// ratio `mu` of successive changes by Young's relation `(mu + omega - 1)² = mu omega² lambda²`
/// (Hageman & Young 1981, section 9.3).
///
/// The theory asks for real eigenvalues. Leaves whose faces differ strongly have complex ones, for which
/// a large factor diverges; so when changes grow the factor is given up, for good: plain Gauss-Seidel
/// converges wherever light is lost at all.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relaxation {
    pub(super) omega: f64,
    lambda_squared: f64,
    last_change: Option<f64>,
    /// Passes since the factor was last changed.
    age: u32,
    /// Ratio of the last two changes.
    ratio: f64,
    /// Over-relaxation has failed.
    plain: bool,
}

/// Passes with one factor before it is judged: the ratio of changes needs to settle.
const SETTLE: u32 = 3;

impl Relaxation {
    pub(super) fn new() -> Self {
        Self {
            omega: 1.0,
            lambda_squared: 0.0,
            last_change: None,
            age: 0,
            ratio: 1.0,
            plain: false,
        }
    }

    /// Takes note of a pass's change; returns how much may be left to change after it.
    pub(super) fn after(&mut self, change: f64) -> f64 {
        self.age += 1;
        let Some(last) = self.last_change.replace(change) else {
            return f64::INFINITY;
        };
        if change == 0.0 || last == 0.0 {
            return change;
        }
        self.ratio = change / last;
        if self.ratio > 1.0 && self.omega > 1.0 && self.age > 1 {
            (self.omega, self.plain, self.age) = (1.0, true, 0);
            return f64::INFINITY;
        }
        // the asymptotic rate is never better than omega - 1
        let rate = self.ratio.max(self.omega - 1.0).min(0.9999);
        let left = change * rate / (1.0 - rate);
        if !self.plain && self.age >= SETTLE && self.ratio < 1.0 && self.ratio > self.omega - 1.0 {
            let lambda_squared =
                (self.ratio + self.omega - 1.0).powi(2) / (self.ratio * self.omega * self.omega);
            if lambda_squared > self.lambda_squared && lambda_squared < 1.0 {
                self.lambda_squared = lambda_squared;
                self.omega = 2.0 / (1.0 + (1.0 - lambda_squared).sqrt());
                self.age = 0;
            }
        }
        left
    }
}
