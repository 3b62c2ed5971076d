//! Sums in a fixed order, whoever computes the parts.

/// Elements that are worked off as one task; a fixed number, so that sums have a fixed order.
pub(super) const TASK: usize = 512;

/// Partial sums added in order.
pub(super) fn sum_of<const N: usize>(parts: &[[f64; N]]) -> [f64; N] {
    parts
        .iter()
        .fold([0.0; N], |sum, p| std::array::from_fn(|k| sum[k] + p[k]))
}
