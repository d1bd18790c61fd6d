//! The built-in objects in random order: everyone gets a turn before anyone gets a second.

use palpate_sim::objects::catalogue;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Deals built-in objects. The same seed deals the same sequence.
#[derive(Clone, Debug)]
pub struct ShuffledObjects {
    random: ChaCha8Rng,
    /// Indices into the catalogue that have not been dealt yet, the next one last.
    left: Vec<usize>,
}

impl ShuffledObjects {
    /// A shuffled deck.
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
        // Only the one in the hand is left: the deck is shuffled anew without it.
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
    fn everyone_gets_a_turn_and_nobody_two_in_a_row() {
        let deal = |seed: u64| {
            let mut deck = ShuffledObjects::new(seed);
            let mut dealt = vec!["lemon"];
            for _ in 0..100 {
                dealt.push(deck.next(dealt[dealt.len() - 1]));
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
