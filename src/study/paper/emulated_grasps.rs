//! Grasps of emulated grippers, each read as after `palpate adapt`: parts that no training saw, through board, line and decoder.

use crate::emulated::EmulatedHand;
use crate::frame::StudyError;
use palpate_learn::{Class, DataCard, Dataset, Example, Labels};
use palpate_sim::scene::Scene;
use std::sync::Arc;

/// Emulated grippers and what they grasp.
pub(super) struct EmulatedGrippers<'a> {
    /// Gripper, programme and poses, those of a preset.
    pub(super) scene: &'a Scene,
    pub(super) preset: &'a str,
    /// Seeds of their parts.
    pub(super) seeds: std::ops::Range<u64>,
    /// Objects that each grasps.
    pub(super) objects: &'a [String],
    /// Grasps of each object by each gripper.
    pub(super) each: u64,
}

impl EmulatedGrippers<'_> {
    /// Their grasps in these channels, from the closing to the end of the hold.
    pub(super) fn grasps(&self, channels: &[String]) -> Result<Dataset, StudyError> {
        let class = |name: &String| Class { name: name.clone(), size: None, shape: None };
        let labels = Labels { classes: self.objects.iter().map(class).collect(), ..Labels::default() };
        let about = DataCard {
            preset: Some(self.preset.to_owned()),
            object: "free, emulated gripper".to_owned(),
            ..DataCard::default()
        };
        let mut data = Dataset { channels: channels.to_vec(), labels, examples: Vec::new(), about };
        for seed in self.seeds.clone() {
            let hand = EmulatedHand::new(self.scene, self.scene, seed)?;
            for (class, object) in self.objects.iter().enumerate() {
                for number in 0..self.each {
                    let pose = seed * 1000 + number;
                    let logs = hand.grasps(object, pose, &[Vec::new()])?;
                    let log = logs.first().ok_or_else(|| StudyError::missing("readings of the emulated gripper"))?;
                    let grasp = hand.sequence(log, channels)?;
                    let id = data.examples.len() as i64;
                    data.examples.push(Example {
                        id,
                        class,
                        content: grasp.content(),
                        grasp: Arc::new(grasp),
                        ..Example::default()
                    });
                }
            }
        }
        data.about.grasps = data.examples.len();
        Ok(data)
    }
}
