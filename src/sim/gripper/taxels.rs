//! The grid of taxels on a pad, fixed by arc length: row by row from the palm to the tip, and in each row from
//! negative to positive y of the finger.

use super::{Finger, Pad};

/// Taxel grid of one pad: positions and stiffness. Both fingers have the same grid.
#[derive(Clone, Debug, PartialEq)]
pub struct TaxelGrid {
    /// Rows along the finger.
    pub rows: usize,
    /// Columns across it.
    pub columns: usize,
    length: f64,
    width: f64,
    pad: Pad,
}

impl TaxelGrid {
    /// The grid of a finger's pad.
    pub fn new(finger: &Finger, pad: &Pad) -> Self {
        Self { rows: pad.rows, columns: pad.columns, length: finger.length, width: finger.width, pad: pad.clone() }
    }

    /// Taxels on one pad.
    pub fn count(&self) -> usize {
        self.rows * self.columns
    }

    /// Distance between rows (m).
    pub fn row_pitch(&self) -> f64 {
        self.length / self.rows as f64
    }

    /// Distance between columns (m).
    pub fn column_pitch(&self) -> f64 {
        self.width / self.columns as f64
    }

    /// Area of each taxel, a (m²).
    pub fn area(&self) -> f64 {
        self.row_pitch() * self.column_pitch()
    }

    /// Arc length of a taxel's middle from the palm (m).
    pub fn arc(&self, taxel: usize) -> f64 {
        ((taxel / self.columns) as f64 + 0.5) * self.row_pitch()
    }

    /// Position of a taxel's middle across the finger (m).
    pub fn across(&self, taxel: usize) -> f64 {
        ((taxel % self.columns) as f64 + 0.5) * self.column_pitch() - 0.5 * self.width
    }

    /// Height of the undeformed skin above the neutral axis, H (m): the pad's thickness less its crown.
    pub fn height(&self, taxel: usize) -> f64 {
        self.pad.height(self.across(taxel))
    }

    /// Small-strain stiffness of a taxel, k = E a / H (N/m).
    pub fn stiffness(&self, taxel: usize) -> f64 {
        self.pad.modulus * self.area() / self.height(taxel)
    }

    /// Compression of a taxel under a steady normal force (N), in m.
    pub fn compression(&self, taxel: usize, force: f64) -> f64 {
        self.pad.law.compression(self.stiffness(taxel), self.height(taxel), force)
    }

    /// The rigid segment that carries a taxel on a finger of N joints, and how far along it the taxel lies (m).
    pub fn place(&self, taxel: usize, finger: &Finger) -> (usize, f64) {
        let segment = self.segment(taxel, finger.joints);
        let start = if segment == 0 { 0.0 } else { (segment as f64 - 0.5) * finger.segment_length() };
        (segment, self.arc(taxel) - start)
    }

    /// The rigid segment that carries a taxel when the finger has `joints` joints.
    ///
    /// Segment j spans arc lengths (j - 1/2) L / N to (j + 1/2) L / N; computed in whole numbers, so that a taxel
    /// exactly over a joint always falls to the same side.
    pub fn segment(&self, taxel: usize, joints: usize) -> usize {
        let row = taxel / self.columns;
        (((2 * row + 1) * joints + self.rows) / (2 * self.rows)).min(joints)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taxels_tile_the_pad() {
        let (finger, pad) = (Finger::default(), Pad::default());
        let grid = TaxelGrid::new(&finger, &pad);
        assert_eq!(grid.count(), 160);
        let total = grid.area() * grid.count() as f64;
        assert!((total - finger.length * finger.width).abs() < 1e-15);
        let (first, last) = (0, grid.count() - 1);
        assert!((grid.arc(first) + grid.arc(last) - finger.length).abs() < 1e-15);
        assert!((grid.across(first) + grid.across(last)).abs() < 1e-15);
        assert!(grid.height(first) < pad.thickness);
    }

    #[test]
    fn a_taxel_lies_on_the_segment_that_carries_it() {
        // With 40 joints under 40 rows every taxel lies exactly over a joint.
        for joints in [2, 7, 10, 40, 80] {
            let finger = Finger { joints, ..Finger::default() };
            let grid = TaxelGrid::new(&finger, &Pad::default());
            let lengths: Vec<f64> = finger.segment_lengths().collect();
            for taxel in 0..grid.count() {
                let (segment, along) = grid.place(taxel, &finger);
                assert_eq!(segment, grid.segment(taxel, joints));
                assert!((-1e-12..lengths[segment] + 1e-12).contains(&along), "N = {joints}, taxel {taxel}: {along}");
                let arc = lengths[..segment].iter().sum::<f64>() + along;
                assert!((arc - grid.arc(taxel)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn segments_carry_the_taxels_above_them() {
        let grid = TaxelGrid::new(&Finger::default(), &Pad::default());
        for joints in 2..=80 {
            let l = 0.1 / joints as f64;
            for taxel in 0..grid.count() {
                let j = grid.segment(taxel, joints) as f64;
                let arc = grid.arc(taxel);
                let from = ((j - 0.5) * l).max(0.0);
                assert!(arc >= from - 1e-12 && arc <= (j + 0.5) * l + 1e-12, "N = {joints}, taxel {taxel}");
            }
        }
        // Two rows on the rigid base half of the default finger.
        assert_eq!((0..160).filter(|t| grid.segment(*t, 10) == 0).count(), 8);
    }
}
