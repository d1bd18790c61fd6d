//! Cholesky factorisation of the Hessian of a step.
//!
//! Its shape is an arrow: one block of each finger, and a border of the object that couples to both. The blocks are
//! equally large, so that both are worked on at once, in the two lanes of a vector register. While the fingers touch, a
//! third block couples them, and the matrix is dense.

/// One number of each finger.
pub(super) type Lanes = wide::f64x2;

/// Lower triangle of a symmetric matrix: `block` rows of each finger, then the border.
#[derive(Clone, Debug)]
pub(super) struct Hessian {
    block: usize,
    size: usize,
    /// Rows of the blocks; entries right of the diagonal are not used.
    rows: Vec<Lanes>,
    /// The border's rows over the blocks, column by column.
    border: Vec<Lanes>,
    /// Row-major, `size` columns: the border's own block, and while the fingers are coupled everything.
    values: Vec<f64>,
    /// True while the fingers are coupled.
    dense: bool,
    /// Columns of the factor of the blocks, each with zeros up to its diagonal.
    columns: Vec<Lanes>,
    /// One over the diagonal of the factor.
    inverses: Vec<Lanes>,
    /// The fingers' part of a solution.
    solution: Vec<Lanes>,
}

/// Pivots that rounding made non-positive are raised to this, so that the direction computed stays finite and downhill.
const LEAST_PIVOT: f64 = 1e-300;

/// Number of joints of the default finger and of unknowns of a free object, alone or with fingers that leave their
/// planes, for which loops are unrolled.
const USUAL_JOINTS: usize = 10;
const FREE_OBJECT: usize = 6;
const FREE_OBJECT_AND_SWAYS: usize = 10;

impl Hessian {
    /// Zeros for two fingers of `block` joints and `border` unknowns of the object.
    pub(super) fn new(block: usize, border: usize) -> Self {
        let size = 2 * block + border;
        Self {
            block,
            size,
            rows: vec![Lanes::ZERO; block * block],
            border: vec![Lanes::ZERO; block * border],
            values: vec![0.0; size * size],
            dense: false,
            columns: vec![Lanes::ZERO; block * block],
            inverses: vec![Lanes::ZERO; block],
            solution: vec![Lanes::ZERO; block],
        }
    }

    /// Couples the fingers, or takes them apart. All entries have to be filled anew.
    pub(super) fn couple(&mut self, fingers: bool) {
        self.dense = fingers;
    }

    /// Row `i` of both fingers' blocks up to the diagonal.
    #[inline]
    pub(super) fn row_mut(&mut self, i: usize) -> &mut [Lanes] {
        &mut self.rows[i * self.block..][..=i]
    }

    /// The border's entries over column `i` of both blocks.
    #[inline]
    pub(super) fn border_mut(&mut self, i: usize) -> &mut [Lanes] {
        let border = self.size - 2 * self.block;
        &mut self.border[i * border..][..border]
    }

    /// An entry of the border's own block or, while the fingers are coupled, of the block between them.
    #[inline]
    pub(super) fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        debug_assert!(j <= i && (j >= 2 * self.block || self.dense && i >= self.block && j < self.block), "({i}, {j})");
        &mut self.values[i * self.size + j]
    }

    /// Replaces the matrix by its factor L.
    pub(super) fn factorise(&mut self) {
        if self.dense {
            self.scatter();
            factorise_dense(&mut self.values, self.size, 0);
            return;
        }
        match (self.block, self.size - 2 * self.block) {
            (USUAL_JOINTS, FREE_OBJECT) => self.factorise_arrow::<USUAL_JOINTS, FREE_OBJECT>(),
            (USUAL_JOINTS, 0) => self.factorise_arrow::<USUAL_JOINTS, 0>(),
            (USUAL_JOINTS, FREE_OBJECT_AND_SWAYS) => self.factorise_arrow::<USUAL_JOINTS, FREE_OBJECT_AND_SWAYS>(),
            _ => self.factorise_arrow::<0, 0>(),
        }
    }

    /// `N` is the number of joints and `B` of unknowns in the border, or zero where only the program that runs knows.
    fn factorise_arrow<const N: usize, const B: usize>(&mut self) {
        let (n, b) = if N > 0 { (N, B) } else { (self.block, self.size - 2 * self.block) };
        let (rows, columns) = (&mut self.rows[..n * n], &mut self.columns[..n * n]);
        let inverses = &mut self.inverses[..n];
        for i in 0..n {
            let row = &mut rows[i * n..][..n];
            for k in 0..i {
                let column = &mut columns[k * n..][..n];
                let value = row[k] * inverses[k];
                column[i] = value;
                for j in k + 1..=i {
                    row[j] -= value * column[j];
                }
            }
            inverses[i] = Lanes::ONE / row[i].max(Lanes::splat(LEAST_PIVOT)).sqrt();
        }
        if b == 0 {
            return;
        }
        let border = &mut self.border[..n * b];
        for k in 0..n {
            let (upper, rest) = border.split_at_mut((k + 1) * b);
            let values = &mut upper[k * b..][..b];
            for value in values.iter_mut() {
                *value *= inverses[k];
            }
            let column = &columns[k * n..][..n];
            for (entries, l) in rest.chunks_exact_mut(b).zip(&column[k + 1..]) {
                for i in 0..b {
                    entries[i] -= values[i] * *l;
                }
            }
        }
        let size = 2 * n + b;
        for i in 0..b {
            for j in 0..=i {
                let column = border.chunks_exact(b);
                let sum = column.fold(Lanes::ZERO, |sum, values| sum + values[i] * values[j]);
                self.values[(2 * n + i) * size + 2 * n + j] -= sum.reduce_add();
            }
        }
        factorise_dense(&mut self.values, size, 2 * n);
    }

    /// Copies the blocks to the dense matrix.
    fn scatter(&mut self) {
        let (n, size) = (self.block, self.size);
        let mut put = |i: usize, j: usize, lanes: Lanes| {
            let [left, right] = lanes.to_array();
            let values = &mut self.values;
            let i = if i < n { [i, n + i] } else { [n + i, n + i] };
            (values[i[0] * size + j], values[i[1] * size + n + j]) = (left, right);
        };
        for (i, row) in self.rows.chunks_exact(n).enumerate() {
            row[..=i].iter().enumerate().for_each(|(j, lanes)| put(i, j, *lanes));
        }
        for (j, column) in self.border.chunks_exact((size - 2 * n).max(1)).enumerate() {
            column.iter().enumerate().for_each(|(i, lanes)| put(n + i, j, *lanes));
        }
    }

    /// Solves L L' x = b in place.
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        if self.dense {
            solve_lower(&self.values, self.size, 0, x);
            solve_upper(&self.values, self.size, 0, x);
            return;
        }
        match (self.block, self.size - 2 * self.block) {
            (USUAL_JOINTS, FREE_OBJECT) => self.solve_arrow::<USUAL_JOINTS, FREE_OBJECT>(x),
            (USUAL_JOINTS, 0) => self.solve_arrow::<USUAL_JOINTS, 0>(x),
            (USUAL_JOINTS, FREE_OBJECT_AND_SWAYS) => self.solve_arrow::<USUAL_JOINTS, FREE_OBJECT_AND_SWAYS>(x),
            _ => self.solve_arrow::<0, 0>(x),
        }
    }

    fn solve_arrow<const N: usize, const B: usize>(&mut self, x: &mut [f64]) {
        let (n, b) = if N > 0 { (N, B) } else { (self.block, self.size - 2 * self.block) };
        let size = 2 * n + b;
        let (fingers, object) = x.split_at_mut(2 * n);
        let y = &mut self.solution[..n];
        for (i, y) in y.iter_mut().enumerate() {
            *y = Lanes::new([fingers[i], fingers[n + i]]);
        }
        for k in 0..n {
            let value = y[k] * self.inverses[k];
            for (y, l) in y.iter_mut().zip(&self.columns[k * n..][..n]) {
                *y -= value * *l;
            }
            y[k] = value;
        }
        if b > 0 {
            let border = &self.border[..n * b];
            for (column, y) in border.chunks_exact(b).zip(y.iter()) {
                for (x, l) in object.iter_mut().zip(column) {
                    *x -= (*l * *y).reduce_add();
                }
            }
            solve_lower(&self.values, size, 2 * n, object);
            solve_upper(&self.values, size, 2 * n, object);
            for (column, y) in border.chunks_exact(b).zip(y.iter_mut()) {
                for (x, l) in object.iter().zip(column) {
                    *y -= *l * Lanes::splat(*x);
                }
            }
        }
        for k in (0..n).rev() {
            let column = &self.columns[k * n..][..n];
            let beyond = column.iter().zip(y.iter()).fold(Lanes::ZERO, |sum, (l, y)| sum + *l * *y);
            // The column's own entry is zero.
            y[k] = (y[k] - beyond) * self.inverses[k];
        }
        for (i, y) in y.iter().enumerate() {
            [fingers[i], fingers[n + i]] = y.to_array();
        }
    }
}

/// Product of the N x N matrices of both fingers with the rates of their joints: `put` takes each entry of it. Leaves the
/// rates in `factors`.
#[inline]
pub(super) fn multiply(matrices: &[Lanes], rates: &[f64], factors: &mut [Lanes], mut put: impl FnMut(usize, f64)) {
    let n = factors.len();
    for (i, factor) in factors.iter_mut().enumerate() {
        *factor = Lanes::new([rates[i], rates[n + i]]);
    }
    for (i, row) in matrices.chunks_exact(n).enumerate() {
        let sum = row.iter().zip(factors.iter()).fold(Lanes::ZERO, |sum, (a, x)| sum + *a * *x);
        let [left, right] = sum.to_array();
        put(i, left);
        put(n + i, right);
    }
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
                    match (i, j) {
                        (4, 4) => *matrix.at_mut(4, 4) = *value,
                        (4, 0 | 1) => matrix.border_mut(j)[0] = Lanes::new([*value, dense[4][j + 2]]),
                        (0 | 1, _) => matrix.row_mut(i)[j] = Lanes::new([*value, dense[i + 2][j + 2]]),
                        (2 | 3, 0 | 1) if coupled => *matrix.at_mut(i, j) = *value,
                        _ => (),
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
