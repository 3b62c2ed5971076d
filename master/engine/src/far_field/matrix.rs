//! Small dense matrices, row by row in memory: just what adding and doubling need.

/// A `rows x cols` matrix.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

impl Matrix {
    pub(super) fn zeros(rows: usize, cols: usize) -> Self {
        Self {
            rows,
            cols,
            data: vec![0.0; rows * cols],
        }
    }

    pub(super) fn identity(n: usize) -> Self {
        let mut matrix = Self::zeros(n, n);
        for i in 0..n {
            matrix.row_mut(i)[i] = 1.0;
        }
        matrix
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn cols(&self) -> usize {
        self.cols
    }

    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.cols..][..self.cols]
    }

    pub(super) fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.cols..][..self.cols]
    }

    /// The `rows x cols` block whose first entry is `(row, col)`.
    pub(super) fn block(&self, row: usize, col: usize, rows: usize, cols: usize) -> Self {
        let mut block = Self::zeros(rows, cols);
        for i in 0..rows {
            block
                .row_mut(i)
                .copy_from_slice(&self.row(row + i)[col..col + cols]);
        }
        block
    }

    /// `self += factor * other`.
    pub(super) fn add_scaled(&mut self, factor: f64, other: &Self) {
        axpy(factor, &other.data, &mut self.data);
    }

    /// `self + other`.
    pub(super) fn plus(mut self, other: &Self) -> Self {
        self.add_scaled(1.0, other);
        self
    }

    /// The matrix product `self * other`.
    pub(super) fn times(&self, other: &Self) -> Self {
        let mut product = Self::zeros(self.rows, other.cols);
        for i in 0..self.rows {
            let sum = product.row_mut(i);
            // Four rows at a time, so that the sum is loaded and stored a quarter as often.
            let (fours, rest) = self.row(i).as_chunks::<4>();
            let mut rows = other.rows_iter();
            for f in fours {
                let mut next = || rows.next().unwrap_or_default();
                let (a, b, c, d) = (next(), next(), next(), next());
                let entries = sum.iter_mut().zip(a).zip(b).zip(c).zip(d);
                for ((((sum, a), b), c), d) in entries {
                    *sum += f[0] * a + f[1] * b + f[2] * c + f[3] * d;
                }
            }
            for (&factor, row) in rest.iter().zip(rows) {
                axpy(factor, row, sum);
            }
        }
        product
    }

    /// Changes the sign of rows `from` and on.
    pub(super) fn negate_rows(mut self, from: usize) -> Self {
        self.data[from * self.cols..]
            .iter_mut()
            .for_each(|x| *x = -*x);
        self
    }

    /// Changes the sign of columns `from` and on.
    pub(super) fn negate_cols(mut self, from: usize) -> Self {
        for i in 0..self.rows {
            self.row_mut(i)[from..].iter_mut().for_each(|x| *x = -*x);
        }
        self
    }

    /// The sum of each column.
    pub(super) fn column_sums(&self) -> Vec<f64> {
        self.row_times(&vec![1.0; self.rows])
    }

    /// `self * column`.
    pub(super) fn times_column(&self, column: &[f64]) -> Vec<f64> {
        self.rows_iter().map(|row| dot(row, column)).collect()
    }

    /// `row * self`.
    pub(super) fn row_times(&self, row: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.cols];
        for (&factor, own) in row.iter().zip(self.rows_iter()) {
            axpy(factor, own, &mut sum);
        }
        sum
    }

    /// Multiplies column `j` by `factors[j]`.
    pub(super) fn scale_columns(&mut self, factors: &[f64]) {
        for i in 0..self.rows {
            for (x, factor) in self.row_mut(i).iter_mut().zip(factors) {
                *x *= factor;
            }
        }
    }

    /// `self += column * row`, the outer product.
    pub(super) fn add_outer(&mut self, column: &[f64], row: &[f64]) {
        for (i, &factor) in column.iter().enumerate() {
            axpy(factor, row, self.row_mut(i));
        }
    }

    fn rows_iter(&self) -> impl Iterator<Item = &[f64]> {
        (0..self.rows).map(|i| self.row(i))
    }
}

/// `y += factor * x`.
fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// `a + b`.
pub(super) fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// The scalar product.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The least share of light that a round between two slabs must lose. Less can only be between light
/// valves (conservative leaves that let light through one way better than the other, which nature
/// does not have), where radiance would grow beyond all bounds.
pub(super) const LEAST_LOSS: f64 = 1e-100;

/// LU factors of a column diagonally dominant matrix, found without exchanging pivots.
///
/// Elimination keeps such a matrix diagonally dominant and its entries grow at most twofold, so it
/// is backward stable (Higham 2002, section 9.5).
pub(super) struct Lu {
    /// Unit lower triangle and upper triangle in one; the diagonal holds the pivots' reciprocals.
    factors: Matrix,
}

impl Lu {
    /// Factors a square matrix that is strictly diagonally dominant by columns, its diagonal
    /// positive.
    pub(super) fn of_dominant(mut matrix: Matrix) -> Self {
        for k in 0..matrix.rows {
            let reciprocal = 1.0 / matrix.row(k)[k];
            eliminate(&mut matrix, k, reciprocal);
        }
        Self { factors: matrix }
    }

    /// Factors `identity - returning`, where column `j` of `returning`, not negative, says where
    /// light of channel `j` comes back after one round, and `lost[j]`, not negative, how much of it
    /// does not: each column and its loss add up to 1.
    ///
    /// The diagonal is not computed as a difference but from the other entries and the loss, so
    /// that no subtraction occurs and every entry is accurate to relative rounding, however little
    /// is lost (Grassmann, Taksar & Heyman 1985; O'Cinneide 1993).
    pub(super) fn of_rounds(returning: Matrix, mut lost: Vec<f64>) -> Self {
        let mut matrix = returning;
        matrix.data.iter_mut().for_each(|x| *x = -*x);
        for k in 0..matrix.rows {
            let elsewhere: f64 = (k + 1..matrix.rows).map(|i| -matrix.row(i)[k]).sum();
            let reciprocal = 1.0 / (lost[k] + elsewhere).max(LEAST_LOSS);
            let lost_share = lost[k] * reciprocal;
            for (lost, entry) in lost.iter_mut().zip(matrix.row(k)).skip(k + 1) {
                *lost -= lost_share * entry;
            }
            eliminate(&mut matrix, k, reciprocal);
        }
        Self { factors: matrix }
    }

    /// Solves for every column of `right`.
    pub(super) fn solve(&self, mut right: Matrix) -> Matrix {
        let n = self.factors.rows;
        let cols = right.cols;
        if cols == 0 {
            return right;
        }
        for i in 0..n {
            let (known, rest) = right.data.split_at_mut(i * cols);
            let row = &mut rest[..cols];
            for (j, known) in known.chunks_exact(cols).enumerate() {
                axpy(-self.factors.row(i)[j], known, row);
            }
        }
        for i in (0..n).rev() {
            let (rest, known) = right.data.split_at_mut((i + 1) * cols);
            let row = &mut rest[i * cols..];
            for (j, known) in known.chunks_exact(cols).enumerate() {
                axpy(-self.factors.row(i)[i + 1 + j], known, row);
            }
            let reciprocal = self.factors.row(i)[i];
            row.iter_mut().for_each(|x| *x *= reciprocal);
        }
        right
    }

    /// Solves for one right-hand side.
    pub(super) fn solve_column(&self, right: Vec<f64>) -> Vec<f64> {
        let right = Matrix {
            rows: right.len(),
            cols: 1,
            data: right,
        };
        self.solve(right).data
    }
}

/// Step `k` of the elimination, given the reciprocal of its pivot.
fn eliminate(matrix: &mut Matrix, k: usize, reciprocal: f64) {
    let n = matrix.cols;
    let (above, below) = matrix.data.split_at_mut((k + 1) * n);
    let pivot_row = &mut above[k * n..];
    for row in below.chunks_exact_mut(n) {
        row[k] *= reciprocal;
        let factor = row[k];
        axpy(-factor, &pivot_row[k + 1..], &mut row[k + 1..]);
    }
    pivot_row[k] = reciprocal;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lu_solves_a_dominant_system() {
        let n = 7;
        let mut matrix = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..n {
                let entry = ((i * 31 + j * 17) % 13) as f64 / 13.0;
                matrix.row_mut(i)[j] = if i == j { 8.0 } else { -entry };
            }
        }
        let wanted = Matrix {
            rows: n,
            cols: 2,
            data: (0..2 * n).map(|i| i as f64 - 3.0).collect(),
        };
        let got = Lu::of_dominant(matrix.clone()).solve(matrix.times(&wanted));
        for (a, b) in got.data.iter().zip(&wanted.data) {
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
    }

    #[test]
    fn rounds_without_loss_keep_relative_accuracy() {
        // Two channels that swap all but 1e-30 and 2e-30 of their light: the sum over rounds is
        // 1 / 3e-30 (1 + 1e-30, 1 - ...) and the like, which no subtraction from 1 could tell.
        let mut returning = Matrix::zeros(2, 2);
        returning.row_mut(0)[1] = 1.0;
        returning.row_mut(1)[0] = 1.0;
        let solved = Lu::of_rounds(returning, vec![1e-30, 2e-30]).solve_column(vec![1.0, 0.0]);
        for x in solved {
            assert!((x * 3e-30 - 1.0).abs() < 1e-15, "{x}");
        }
    }
}
