//! Matrix products on slices, bounds-checked here and computed by `matrixmultiply`, which selects SIMD at run time.

/// Row-major matrix, or its transpose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Matrix<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
    transposed: bool,
}

impl<'a> Matrix<'a> {
    /// Creates a matrix from its rows.
    pub(crate) fn new(values: &'a [f32], rows: usize, columns: usize) -> Self {
        assert_eq!(values.len(), rows * columns, "a matrix of {rows} by {columns}");
        Self { values, rows, columns, transposed: false }
    }

    /// Transposes, without copying.
    pub(crate) fn t(self) -> Self {
        Self { transposed: !self.transposed, ..self }
    }

    fn shape(&self) -> (usize, usize) {
        if self.transposed { (self.columns, self.rows) } else { (self.rows, self.columns) }
    }

    fn strides(&self) -> (isize, isize) {
        let row = self.columns as isize;
        if self.transposed { (1, row) } else { (row, 1) }
    }
}

/// Computes out = keep * out + a b, with `out` row-major.
pub(crate) fn multiply(a: Matrix<'_>, b: Matrix<'_>, keep: f32, out: &mut [f32]) {
    let ((m, k), (inner, n)) = (a.shape(), b.shape());
    assert_eq!(k, inner, "inner sizes agree");
    assert_eq!(out.len(), m * n, "the product is {m} by {n}");
    let ((a_row, a_column), (b_row, b_column)) = (a.strides(), b.strides());
    #[expect(unsafe_code, reason = "matrixmultiply takes pointers")]
    // SAFETY: the sizes of all three slices match the shapes and strides, as asserted above.
    unsafe {
        matrixmultiply::sgemm(
            m,
            k,
            n,
            1.0,
            a.values.as_ptr(),
            a_row,
            a_column,
            b.values.as_ptr(),
            b_row,
            b_column,
            keep,
            out.as_mut_ptr(),
            n as isize,
            1,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_transposes() {
        let a = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let mut out = [1.0; 4];
        multiply(Matrix::new(&a, 2, 3), Matrix::new(&a, 2, 3).t(), 0.0, &mut out);
        assert_eq!(out, [14.0, 32.0, 32.0, 77.0]);
        multiply(Matrix::new(&a, 3, 2).t(), Matrix::new(&a, 3, 2), 1.0, &mut out);
        assert_eq!(out, [14.0 + 35.0, 32.0 + 44.0, 32.0 + 44.0, 77.0 + 56.0]);
    }
}
