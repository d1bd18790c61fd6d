//! The built-in objects in random order: each occurs once before any occurs again.

use palpate_sim::objects::catalogue;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Sequence of built-in objects; the same seed gives the same sequence.
#[derive(Clone, Debug)]
pub struct ShuffledObjects {
    random: ChaCha8Rng,
    /// Indices into the catalogue still to come, the next one last; none before the first is dealt.
    left: Option<Vec<usize>>,
}

impl ShuffledObjects {
    /// Starts a sequence.
    pub fn new(seed: u64) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), left: None }
    }

    /// The next object's name, never that of the one in the hand. The one in the hand at the beginning has had its turn.
    pub fn next(&mut self, in_hand: &str) -> &'static str {
        let all = catalogue();
        let mut left = self.left.take().unwrap_or_else(|| self.shuffled(|k| all[k].name != in_hand));
        // Where only the one in the hand is left, the next round is drawn.
        if left.iter().all(|k| all[*k].name == in_hand) {
            left = self.shuffled(|_| true);
        }
        let at = left.iter().rposition(|k| all[*k].name != in_hand).unwrap_or_default();
        let next = &all[left.remove(at)].name;
        self.left = Some(left);
        next
    }

    fn shuffled(&mut self, wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let mut left: Vec<usize> = (0..catalogue().len()).filter(|k| wanted(*k)).collect();
        left.shuffle(&mut self.random);
        left
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
        assert_eq!(dealt[..16].iter().collect::<BTreeSet<_>>().len(), 16, "one turn each, the first one too");
        assert_eq!(dealt, deal(1));
        assert_ne!(dealt, deal(2));
    }
}
