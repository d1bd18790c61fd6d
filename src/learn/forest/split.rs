//! Search for the best cut of one column for the rows of a node.
//!
//! A cut into sides L and R is scored by
//!
//!   S(L) / W(L) + S(R) / W(R),   S = sum over channels of (sum of amounts)²,   W = sum of weights,
//!
//! which is, up to a term that all cuts share, the negative weighted squared error around the means of both sides. A regression
//! target y has one channel and amounts w y. A class is the vector that is 1 in its own channel: amounts are w, the
//! squared error is the Gini impurity, and one search serves both.
//!
//! Rows are sorted by bin, by counting if they are many. Both sides are summed from their own end: nothing is
//! subtracted, so the small weights of boosting lose no digits to large ones.

use super::bins::Column;

/// Target of one row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    /// Weight times target.
    pub(super) amount: f64,
    /// Weight, positive.
    pub(super) weight: f64,
    /// Class; 0 in regression.
    pub(super) channel: usize,
}

/// Targets of all rows.
pub(super) struct Target {
    /// Number of classes; 1 in regression.
    pub(super) channels: usize,
    /// One for each row.
    pub(super) items: Vec<Item>,
}

impl Target {
    /// Classification targets with the weight of each row.
    pub(super) fn classes(labels: &[usize], classes: usize, weight: impl Fn(usize) -> f64) -> Self {
        let item = |(row, &channel): (usize, &usize)| Item { amount: weight(row), weight: weight(row), channel };
        Self { channels: classes, items: labels.iter().enumerate().map(item).collect() }
    }

    /// Appends the share that each class has of the rows' weight.
    pub(super) fn push_shares(&self, rows: &[u32], shares: &mut Vec<f32>) {
        let mut sums = Sums::new(self.channels);
        for &row in rows {
            sums.add(&self.items[row as usize]);
        }
        shares.extend(sums.totals.iter().map(|total| (total / sums.weight) as f32));
    }

    /// True if all these rows have the same target.
    pub(super) fn is_pure(&self, rows: &[u32]) -> bool {
        let first = self.items[rows[0] as usize];
        rows.iter()
            .map(|&row| self.items[row as usize])
            .all(|item| item.channel == first.channel && item.amount * first.weight == first.amount * item.weight)
    }
}

/// Rows with a code up to `code` go left, values up to `threshold` likewise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    pub(super) code: u8,
    pub(super) threshold: f32,
    /// Larger is better; comparable within a node only.
    pub(super) score: f64,
}

struct Sums {
    totals: Vec<f64>,
    squares: f64,
    weight: f64,
}

impl Sums {
    fn new(channels: usize) -> Self {
        Self { totals: vec![0.0; channels], squares: 0.0, weight: 0.0 }
    }

    fn clear(&mut self) {
        self.totals.fill(0.0);
        (self.squares, self.weight) = (0.0, 0.0);
    }

    /// (T + a)² - T² = a (2 T + a).
    #[inline]
    fn add(&mut self, item: &Item) {
        let total = &mut self.totals[item.channel];
        self.squares += item.amount * (2.0 * *total + item.amount);
        *total += item.amount;
        self.weight += item.weight;
    }

    fn score(&self) -> f64 {
        self.squares / self.weight
    }
}

/// Search with its scratch memory.
pub(super) struct Search {
    sums: Sums,
    /// Code and row, sorted by code.
    ordered: Vec<(u8, u32)>,
    /// Score of the rows from here to the end, at the start of each bin.
    right: Vec<f64>,
}

/// Fewer rows than this are sorted, others counted; forests grow equally fast with 8 to 32, 10 % slower with 128.
const FEW_ROWS: usize = 32;

impl Search {
    pub(super) fn new(channels: usize) -> Self {
        Self { sums: Sums::new(channels), ordered: Vec::new(), right: Vec::new() }
    }

    /// Finds the best cut with `min_leaf` rows on both sides; of equally good ones, that with the smallest threshold.
    pub(super) fn best_cut(&mut self, column: &Column, target: &Target, rows: &[u32], min_leaf: usize) -> Option<Cut> {
        if column.bins() < 2 || rows.len() < 2 {
            return None;
        }
        self.order(column, rows);
        let count = rows.len();
        if self.ordered[0].0 == self.ordered[count - 1].0 {
            return None;
        }
        self.score_right_sides(target);
        self.sums.clear();
        let mut best: Option<(usize, f64)> = None;
        for k in 1..=count - min_leaf.clamp(1, count) {
            let (code, row) = self.ordered[k - 1];
            self.sums.add(&target.items[row as usize]);
            if k >= min_leaf && code != self.ordered[k].0 {
                let score = self.sums.score() + self.right[k];
                if best.is_none_or(|(_, least)| score > least) {
                    best = Some((k, score));
                }
            }
        }
        let (k, score) = best?;
        let (left, right) = (self.ordered[k - 1].0, self.ordered[k].0);
        Some(Cut { code: left, threshold: column.threshold(left, right), score })
    }

    fn score_right_sides(&mut self, target: &Target) {
        self.sums.clear();
        self.right.resize(self.ordered.len(), 0.0);
        for k in (1..self.ordered.len()).rev() {
            let (code, row) = self.ordered[k];
            self.sums.add(&target.items[row as usize]);
            if self.ordered[k - 1].0 != code {
                self.right[k] = self.sums.score();
            }
        }
    }

    /// Sorts rows by code; stable.
    fn order(&mut self, column: &Column, rows: &[u32]) {
        let coded = rows.iter().map(|&row| (column.codes[row as usize], row));
        if rows.len() < FEW_ROWS {
            self.ordered.clear();
            self.ordered.extend(coded);
            self.ordered.sort_by_key(|(code, _)| *code);
            return;
        }
        let mut next = [0_u32; 256];
        for (code, _) in coded.clone() {
            next[usize::from(code)] += 1;
        }
        let mut below = 0;
        for count in &mut next[..column.bins()] {
            below += std::mem::replace(count, below);
        }
        self.ordered.resize(rows.len(), (0, 0));
        for (code, row) in coded {
            let place = &mut next[usize::from(code)];
            self.ordered[*place as usize] = (code, row);
            *place += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Table;
    use super::super::bins::Bins;
    use super::*;

    fn cut_of(values: &[f32], target: &Target, min_leaf: usize) -> Option<Cut> {
        let bins = Bins::new(&Table { values, columns: 1 });
        let rows: Vec<u32> = (0..values.len() as u32).collect();
        Search::new(target.channels).best_cut(&bins.columns[0], target, &rows, min_leaf)
    }

    #[test]
    fn classes_are_cut_where_gini_is_least() {
        // Two of class 0, then three of class 1 and one of class 2: 2²/2 + (3² + 1²)/4.
        let target = Target::classes(&[0, 0, 1, 1, 1, 2], 3, |_| 1.0);
        let values = [1.0, 2.0, 5.0, 6.0, 7.0, 8.0];
        let cut = cut_of(&values, &target, 1).expect("a cut");
        assert_eq!((cut.code, cut.threshold, cut.score), (1, 3.5, 4.5));
        let cut = cut_of(&values, &target, 3).expect("a cut");
        assert_eq!((cut.code, cut.threshold), (2, 5.5));
        assert_eq!(cut_of(&values, &target, 4), None);
        assert_eq!(cut_of(&[1.0; 6], &target, 1), None);
    }

    #[test]
    fn a_heavy_row_moves_the_cut() {
        // Unweighted, a cut beside either end is as good, and the first is taken.
        let light = Target::classes(&[0, 1, 0], 2, |_| 1.0);
        assert_eq!(cut_of(&[0.0, 1.0, 2.0], &light, 1).map(|cut| cut.threshold), Some(0.5));
        let heavy = Target::classes(&[0, 1, 0], 2, |row| if row == 2 { 3.0 } else { 1.0 });
        assert_eq!(cut_of(&[0.0, 1.0, 2.0], &heavy, 1).map(|cut| cut.threshold), Some(1.5));
    }

    #[test]
    fn a_step_is_cut_at_its_edge() {
        // Enough rows to be counted rather than sorted: y = -1 below 40, 2 from there on.
        let values: Vec<f32> = (0..100u32).map(|k| ((k * 37) % 100) as f32).collect();
        let item = |v: &f32| Item { amount: if *v < 40.0 { -1.0 } else { 2.0 }, weight: 1.0, channel: 0 };
        let target = Target { channels: 1, items: values.iter().map(item).collect() };
        let cut = cut_of(&values, &target, 1).expect("a cut");
        assert_eq!((cut.threshold, cut.score), (39.5, 40.0 + 240.0));
    }

    #[test]
    fn small_weights_count_beside_large_ones() {
        // Rows 3 and 4 have tiny weights, yet are separated.
        let weights = [1.0, 1.0, 1.0, 1e-18, 1e-18];
        let target = Target::classes(&[0, 0, 0, 1, 2], 3, |row| weights[row]);
        let cut = cut_of(&[0.0, 1.0, 2.0, 3.0, 4.0], &target, 1).expect("a cut");
        assert!((cut.score - 3.0).abs() < 1e-12);
    }
}
