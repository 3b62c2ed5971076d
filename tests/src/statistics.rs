//! What a handful of numbers says.

/// Mean and standard deviation (of a sample).
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0)).sqrt())
}

/// The middle value.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Fails unless `found` is within `sigmas` standard errors of `expected`, and unless the standard
/// error itself is at most `cap`: a test with a large error would prove nothing.
#[track_caller]
pub fn assert_close(what: &str, found: f64, expected: f64, se: f64, sigmas: f64, cap: f64) {
    assert!(
        se <= cap,
        "{what}: standard error {se:.2e}, expected at most {cap:.1e}"
    );
    let off = (found - expected).abs();
    assert!(
        off <= sigmas * se + 1e-9,
        "{what}: {found:.6}, expected {expected:.6}: off by {:.1} of {se:.2e}",
        off / se
    );
}

/// Fails unless `found` is within `bound` of `expected`.
#[track_caller]
pub fn assert_within(what: &str, found: f64, expected: f64, bound: f64) {
    assert!(
        (found - expected).abs() <= bound,
        "{what}: {found:.6}, expected {expected:.6} within {bound:.1e}"
    );
}
