//! Grasps that a model learned from, so that no one judges it on them.

use crate::data::{Dataset, Example};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeSet;

/// Set of grasps, by 32 bits of their content: one grasp in a million is taken for one of 4000 others. On a card it is a
/// text of eight hexadecimal digits for each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LearnedGrasps(BTreeSet<u32>);

impl LearnedGrasps {
    /// All grasps of a data set.
    pub fn of(data: &Dataset) -> Self {
        Self(data.examples.iter().map(|example| short(example.content)).collect())
    }

    /// Adds all grasps of a data set.
    pub(crate) fn extend(&mut self, data: &Dataset) {
        self.0.extend(data.examples.iter().map(|example| short(example.content)));
    }

    /// True for a grasp of the set.
    pub fn contains(&self, example: &Example) -> bool {
        self.0.contains(&short(example.content))
    }

    /// True without grasps, as on cards of early versions.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

fn short(content: u64) -> u32 {
    (content ^ (content >> 32)) as u32
}

impl Serialize for LearnedGrasps {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let text: String = self.0.iter().map(|grasp| format!("{grasp:08x}")).collect();
        serializer.serialize_str(&text)
    }
}

impl<'de> Deserialize<'de> for LearnedGrasps {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let digits = text.as_bytes().chunks(8).map(|digits| {
            let digits = std::str::from_utf8(digits).ok().filter(|digits| digits.len() == 8)?;
            u32::from_str_radix(digits, 16).ok()
        });
        let grasps: Option<BTreeSet<u32>> = digits.collect();
        grasps.map(Self).ok_or_else(|| serde::de::Error::custom("the learned grasps are not hexadecimal numbers"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_card_tells_learned_grasps_from_others() {
        let example = |content: u64| Example { content, ..Example::default() };
        let data = Dataset { examples: (1..=3).map(|k| example(k * 0x1234_5678_9abc)).collect(), ..Dataset::default() };
        let learned = LearnedGrasps::of(&data);
        let text = serde_json::to_string(&learned).unwrap();
        assert_eq!(text.len(), 2 + 3 * 8);
        let read: LearnedGrasps = serde_json::from_str(&text).unwrap();
        assert!(data.examples.iter().all(|grasp| read.contains(grasp)) && !read.contains(&example(7)));
        assert!(serde_json::from_str::<LearnedGrasps>("\"12\"").is_err());
    }
}
