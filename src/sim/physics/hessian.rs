//! Cholesky factorisation of the Hessian of a step.
//!
//! Its shape is an arrow: one block of each finger, and a border of the object that couples to both. The blocks are
//! equally large, so that both are worked on at once, in the two lanes of a vector register. While the fingers touch, a
//! third block couples them, and the matrix is dense.

/// One number of each finger.
type Lanes = [f64; 2];

/// Lower triangle of a symmetric matrix: `block` rows of each finger, then the border.
#[derive(Clone, Debug)]
pub(super) struct Hessian {
    block: usize,
    size: usize,
    /// Row-major, `size` columns; entries right of the diagonal are not used.
    values: Vec<f64>,
    /// True while the fingers are coupled.
    dense: bool,
    /// Factor of the blocks, row by row, and the border's rows over them; diagonals inverted.
    factor: Vec<Lanes>,
    /// A column of the factor, contiguous.
    column: Vec<Lanes>,
}

/// Pivots that rounding made non-positive are raised to this, so that the direction computed stays finite and downhill.
const LEAST_PIVOT: f64 = 1e-300;

impl Hessian {
    /// Zeros for two fingers of `block` joints and `border` unknowns of the object.
    pub(super) fn new(block: usize, border: usize) -> Self {
        let size = 2 * block + border;
        Self {
            block,
            size,
            values: vec![0.0; size * size],
            dense: block == 0,
            factor: vec![[0.0; 2]; (block + border) * block],
            column: vec![[0.0; 2]; block + border],
        }
    }

    /// Couples the fingers, or takes them apart. All entries have to be filled anew.
    pub(super) fn couple(&mut self, fingers: bool) {
        self.dense = fingers;
    }

    /// Row `i` of the lower triangle from column `from` on.
    #[inline]
    pub(super) fn row_mut(&mut self, i: usize, from: usize) -> &mut [f64] {
        &mut self.values[i * self.size + from..=i * self.size + i]
    }

    #[inline]
    pub(super) fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        debug_assert!(j <= i && (self.dense || i >= 2 * self.block || i / self.block == j / self.block), "({i}, {j})");
        &mut self.values[i * self.size + j]
    }

    /// Replaces the matrix by its factor L.
    pub(super) fn factorise(&mut self) {
        if self.dense {
            factorise_dense(&mut self.values, self.size, 0);
            return;
        }
        let (n, size) = (self.block, self.size);
        let border = size - 2 * n;
        for i in 0..n {
            let (left, right) = (&self.values[i * size..][..=i], &self.values[(n + i) * size + n..][..=i]);
            for ((lanes, l), r) in self.factor[i * n..].iter_mut().zip(left).zip(right) {
                *lanes = [*l, *r];
            }
        }
        for b in 0..border {
            let row = &self.values[(2 * n + b) * size..][..2 * n];
            let (left, right) = row.split_at(n);
            for ((lanes, l), r) in self.factor[(n + b) * n..].iter_mut().zip(left).zip(right) {
                *lanes = [*l, *r];
            }
        }
        for k in 0..n {
            let pivot = self.factor[k * n + k];
            let inverse = pivot.map(|pivot| 1.0 / pivot.max(LEAST_PIVOT).sqrt());
            self.factor[k * n + k] = inverse;
            for (row, column) in self.factor.chunks_exact_mut(n).zip(&mut self.column).skip(k + 1) {
                row[k] = times(row[k], inverse);
                *column = row[k];
            }
            let column = &self.column[k + 1..n];
            for (i, row) in self.factor.chunks_exact_mut(n).enumerate().skip(k + 1) {
                let l = row[k];
                for (x, c) in row[k + 1..n.min(i + 1)].iter_mut().zip(column) {
                    *x = [x[0] - l[0] * c[0], x[1] - l[1] * c[1]];
                }
            }
        }
        for a in 0..border {
            let row_a = &self.factor[(n + a) * n..][..n];
            for b in 0..=a {
                let row_b = &self.factor[(n + b) * n..][..n];
                let sum = row_a.iter().zip(row_b).fold([0.0; 2], |s, (x, y)| [s[0] + x[0] * y[0], s[1] + x[1] * y[1]]);
                self.values[(2 * n + a) * size + 2 * n + b] -= sum[0] + sum[1];
            }
        }
        factorise_dense(&mut self.values, size, 2 * n);
    }

    /// Solves L L' x = b in place.
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        if self.dense {
            solve_lower(&self.values, self.size, 0, x);
            solve_upper(&self.values, self.size, 0, x);
            return;
        }
        let (n, size) = (self.block, self.size);
        let (fingers, object) = x.split_at_mut(2 * n);
        let y = &mut self.column;
        for (i, y) in y[..n].iter_mut().enumerate() {
            *y = [fingers[i], fingers[n + i]];
        }
        for k in 0..n {
            y[k] = times(y[k], self.factor[k * n + k]);
            let value = y[k];
            for (y, row) in y[..n].iter_mut().zip(self.factor.chunks_exact(n)).skip(k + 1) {
                let l = row[k];
                *y = [y[0] - l[0] * value[0], y[1] - l[1] * value[1]];
            }
        }
        for (row, x) in self.factor[n * n..].chunks_exact(n).zip(object.iter_mut()) {
            let sum = row.iter().zip(&y[..n]).fold([0.0; 2], |s, (l, y)| [s[0] + l[0] * y[0], s[1] + l[1] * y[1]]);
            *x -= sum[0] + sum[1];
        }
        solve_lower(&self.values, size, 2 * n, object);
        solve_upper(&self.values, size, 2 * n, object);
        for (row, x) in self.factor[n * n..].chunks_exact(n).zip(object.iter()) {
            for (y, l) in y[..n].iter_mut().zip(row) {
                *y = [y[0] - l[0] * x, y[1] - l[1] * x];
            }
        }
        for i in (0..n).rev() {
            let row = &self.factor[i * n..][..=i];
            y[i] = times(y[i], row[i]);
            let value = y[i];
            for (y, l) in y[..i].iter_mut().zip(row) {
                *y = [y[0] - l[0] * value[0], y[1] - l[1] * value[1]];
            }
        }
        for (i, y) in y[..n].iter().enumerate() {
            (fingers[i], fingers[n + i]) = (y[0], y[1]);
        }
    }
}

#[inline]
fn times(a: Lanes, b: Lanes) -> Lanes {
    [a[0] * b[0], a[1] * b[1]]
}

/// Factorises the part of a matrix from row and column `from` on.
fn factorise_dense(values: &mut [f64], size: usize, from: usize) {
    for i in from..size {
        let (above, row) = values.split_at_mut(i * size);
        for j in from..i {
            let row_j = &above[j * size + from..=j * size + j];
            let dot: f64 = row[from..j].iter().zip(row_j).map(|(a, b)| a * b).sum();
            row[j] = (row[j] - dot) / row_j[j - from];
        }
        let squares: f64 = row[from..i].iter().map(|a| a * a).sum();
        row[i] = (row[i] - squares).max(LEAST_PIVOT).sqrt();
    }
}

fn solve_lower(values: &[f64], size: usize, from: usize, x: &mut [f64]) {
    for i in 0..x.len() {
        let row = &values[(from + i) * size + from..][..=i];
        let dot: f64 = row.iter().zip(&x[..i]).map(|(a, b)| a * b).sum();
        x[i] = (x[i] - dot) / row[i];
    }
}

fn solve_upper(values: &[f64], size: usize, from: usize, x: &mut [f64]) {
    for i in (0..x.len()).rev() {
        let row = &values[(from + i) * size + from..][..=i];
        let value = x[i] / row[i];
        x[i] = value;
        for (x, a) in x[..i].iter_mut().zip(row) {
            *x -= a * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_blocks_and_a_border_coupled_or_not() {
        // Rows 0-1 and 2-3 are the fingers, row 4 couples to both.
        for coupled in [false, true] {
            let c = if coupled { 0.3 } else { 0.0 };
            let dense = [
                [4.0, 1.0, c, 0.0, 0.5],
                [1.0, 3.0, 0.0, c, -0.2],
                [c, 0.0, 5.0, -1.0, 0.3],
                [0.0, c, -1.0, 2.0, 0.1],
                [0.5, -0.2, 0.3, 0.1, 1.5],
            ];
            let mut matrix = Hessian::new(2, 1);
            matrix.couple(coupled);
            for (i, row) in dense.iter().enumerate() {
                for (j, value) in row.iter().enumerate().take(i + 1) {
                    if coupled || i == 4 || i / 2 == j / 2 {
                        *matrix.at_mut(i, j) = *value;
                    }
                }
            }
            let want = [1.0, -2.0, 0.5, 3.0, -1.0];
            let mut x: Vec<f64> = (0..5).map(|i| (0..5).map(|j| dense[i][j] * want[j]).sum()).collect();
            matrix.factorise();
            matrix.solve(&mut x);
            for (got, want) in x.iter().zip(want) {
                assert!((got - want).abs() < 1e-14);
            }
        }
    }
}
