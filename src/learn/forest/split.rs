//! Search for the best cut of one column for the rows of a node, or one at random.
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
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

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

    /// Weight of some rows.
    pub(super) fn weight_of(&self, rows: &[u32]) -> f64 {
        rows.iter().map(|row| self.items[*row as usize].weight).sum()
    }

    /// True if all these rows have the same target.
    pub(super) fn is_pure(&self, rows: &[u32]) -> bool {
        let first = self.items[rows[0] as usize];
        rows.iter()
            .map(|&row| self.items[row as usize])
            .all(|item| item.channel == first.channel && item.amount * first.weight == first.amount * item.weight)
    }
}

/// Rows with values up to `threshold` go left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
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
    /// Sums of the other side of a random cut.
    others: Sums,
    /// Code and row, sorted by code.
    ordered: Vec<(u8, u32)>,
    /// Score of the rows from here to the end, at the start of each bin.
    right: Vec<f64>,
}

/// Fewer rows than this are sorted, others counted; forests grow equally fast with 8 to 32, 10 % slower with 128.
const FEW_ROWS: usize = 32;

impl Search {
    pub(super) fn new(channels: usize) -> Self {
        let sums = || Sums::new(channels);
        Self { sums: sums(), others: sums(), ordered: Vec::new(), right: Vec::new() }
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
        Some(Cut { threshold: column.threshold(left, right), score })
    }

    /// Draws a threshold between the smallest and the largest value of the rows (extremely randomised trees, Geurts et al.
    /// 2006). `None` if all values are equal, or a side would have fewer than `min_leaf` rows.
    pub(super) fn random_cut(
        &mut self,
        column: &Column,
        target: &Target,
        rows: &[u32],
        min_leaf: usize,
        random: &mut ChaCha8Rng,
    ) -> Option<Cut> {
        let value = |row: &u32| column.values[*row as usize];
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for x in rows.iter().map(value) {
            (low, high) = (low.min(x), high.max(x));
        }
        if low >= high {
            return None;
        }
        let drawn = (f64::from(low) + random.random::<f64>() * (f64::from(high) - f64::from(low))) as f32;
        // Rounding may reach the largest value, which would leave the right side empty.
        let threshold = if (low..high).contains(&drawn) { drawn } else { low };
        self.sums.clear();
        self.others.clear();
        let mut left = 0;
        for row in rows {
            let item = &target.items[*row as usize];
            if value(row) <= threshold {
                self.sums.add(item);
                left += 1;
            } else {
                self.others.add(item);
            }
        }
        let enough = left.min(rows.len() - left) >= min_leaf;
        enough.then(|| Cut { threshold, score: self.sums.score() + self.others.score() })
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
    use super::super::bins::Bins;
    use super::super::{Table, random_of};
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
        assert_eq!((cut.threshold, cut.score), (3.5, 4.5));
        let cut = cut_of(&values, &target, 3).expect("a cut");
        assert_eq!(cut.threshold, 5.5);
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

    fn random_cut_of(values: &[f32], target: &Target, min_leaf: usize, seed: u64) -> Option<Cut> {
        let bins = Bins::new(&Table { values, columns: 1 });
        let rows: Vec<u32> = (0..values.len() as u32).collect();
        let mut search = Search::new(target.channels);
        search.random_cut(&bins.columns[0], target, &rows, min_leaf, &mut random_of(seed, 0))
    }

    #[test]
    fn a_random_cut_is_scored_like_the_best_one() {
        let target = Target::classes(&[0, 0, 1, 1, 1, 2], 3, |_| 1.0);
        let values = [1.0, 2.0, 5.0, 6.0, 7.0, 8.0];
        // Sum of squared class counts over rows, of both sides, for one to five rows on the left.
        let scores = [1.0 + 11.0 / 5.0, 4.5, 5.0 / 3.0 + 5.0 / 3.0, 2.0 + 1.0, 13.0 / 5.0 + 1.0];
        let mut met = [0; 5];
        for seed in 0..2000 {
            let cut = random_cut_of(&values, &target, 1, seed).expect("values differ");
            let left = values.iter().filter(|x| **x <= cut.threshold).count();
            assert!((cut.score - scores[left - 1]).abs() < 1e-12, "{cut:?}");
            met[left - 1] += 1;
        }
        // Thresholds are uniform between 1 and 8: three sevenths between 2 and 5, one seventh in each other gap.
        for (share, sevenths) in met.map(|n| f64::from(n) / 2000.0).into_iter().zip([1.0, 3.0, 1.0, 1.0, 1.0]) {
            assert!((share - sevenths / 7.0).abs() < 0.05, "{met:?}");
        }
        assert_eq!(random_cut_of(&[3.0; 6], &target, 1, 0), None);
        let halves = (0..200).filter_map(|seed| random_cut_of(&values, &target, 3, seed));
        assert!(halves.map(|cut| cut.threshold).all(|threshold| (5.0..6.0).contains(&threshold)));
        let next = [1.0_f32, 1.0_f32.next_up()];
        let target = Target::classes(&[0, 1], 2, |_| 1.0);
        assert!((0..50).all(|seed| random_cut_of(&next, &target, 1, seed).is_some_and(|cut| cut.threshold == 1.0)));
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
