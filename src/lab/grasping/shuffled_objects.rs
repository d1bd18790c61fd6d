//! The built-in objects in random order: each occurs once before any occurs again.

use palpate_sim::objects::catalogue;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Sequence of built-in objects; the same seed gives the same sequence.
#[derive(Clone, Debug)]
pub struct ShuffledObjects {
    random: ChaCha8Rng,
    /// Indices into the catalogue still to come, the next one last.
    left: Vec<usize>,
}

impl ShuffledObjects {
    /// Starts a sequence.
    pub fn new(seed: u64) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), left: Vec::new() }
    }

    /// The next object's name, never that of the one in the hand.
    pub fn next(&mut self, in_hand: &str) -> &'static str {
        let all = catalogue();
        if self.left.is_empty() {
            self.left.extend(0..all.len());
            self.left.shuffle(&mut self.random);
        }
        let other = self.left.iter().rposition(|k| all[*k].name != in_hand);
        // Only the one in the hand is left: the next round is drawn.
        let Some(at) = other else {
            self.left.clear();
            return self.next(in_hand);
        };
        &all[self.left.remove(at)].name
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn each_object_occurs_once_per_round_and_never_twice_in_a_row() {
        let deal = |seed: u64| {
            let mut shuffled = ShuffledObjects::new(seed);
            let mut dealt = vec!["lemon"];
            for _ in 0..100 {
                dealt.push(shuffled.next(dealt[dealt.len() - 1]));
            }
            dealt
        };
        let dealt = deal(1);
        assert!(dealt.windows(2).all(|pair| pair[0] != pair[1]));
        assert_eq!(dealt[1..=16].iter().collect::<BTreeSet<_>>().len(), 16, "one turn each");
        assert_eq!(dealt, deal(1));
        assert_ne!(dealt, deal(2));
    }
}
