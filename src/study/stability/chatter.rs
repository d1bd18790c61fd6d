//! Holds that chatter: grasps of the built-in objects in random poses of each preset, at draft and standard.
//!
//! A hold chatters if the object is held, the force on a finger changes at least five times by more than 50 mN from one
//! sample to the next while nothing is commanded, and it does not do so at the reference accuracy in the same pose: there
//! the object really rolls or slips.

use palpate_lab::grasping::{Recompute, grasp, grasp_soundly};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{Phase, Side};
use palpate_sim::objects::{ObjectError, ObjectModel, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Accuracy, PRESETS, PosePreset, Scene};
use palpate_tactile::trial::SimulatedTrial;
use serde::{Deserialize, Serialize};

/// Accuracies of the table.
pub const CHATTER_ACCURACIES: [Accuracy; 2] = [Accuracy::Draft, Accuracy::Standard];
/// Change of a finger's force from one sample to the next that counts (N).
const CHANGE: f64 = 0.05;
/// Changes from which on a hold chatters.
const MOST_CHANGES: usize = 5;
/// Force on each finger that holds an object (N).
const HELD: f64 = 1e-3;

/// Grasps of one object in poses of one preset: a piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChatterUnit {
    preset: usize,
    /// Place of the object in the catalogue.
    object: usize,
    grasps: usize,
}

/// Counts over grasps of a preset at an accuracy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChatterRow {
    /// Name of the preset.
    pub preset: String,
    /// Accuracy that was asked for.
    pub accuracy: String,
    pub grasps: usize,
    /// Grasps computed again because forces change in their hold.
    pub recomputed: usize,
    /// Of these, restless at the reference accuracy too: left out of data sets.
    pub remaining: usize,
    /// Grasps whose forces change like those of a hold that chatters, without being computed again.
    pub changing: usize,
    /// Of these, grasps that do not do so at the reference accuracy: they chatter.
    pub chattering: usize,
    /// The same among the trials as they are stored.
    pub chattering_stored: usize,
    /// Seeds of the latter, with the object.
    pub examples: Vec<(String, u64)>,
    /// CPU time, that of the reference included (s).
    pub cpu_s: f64,
}

impl ChatterRow {
    /// Counts of several rows of one preset and accuracy together.
    fn add(&mut self, other: Self) {
        let Self { preset: _, accuracy: _, grasps, recomputed, remaining, changing, chattering, .. } = other;
        self.grasps += grasps;
        self.recomputed += recomputed;
        self.remaining += remaining;
        self.changing += changing;
        self.chattering += chattering;
        self.chattering_stored += other.chattering_stored;
        self.examples.extend(other.examples);
        self.cpu_s += other.cpu_s;
    }
}

impl ChatterUnit {
    /// Units of a table with `grasps` grasps of each preset at each accuracy.
    pub fn all(grasps: usize) -> Vec<Self> {
        let objects = catalogue().len();
        let of = |preset: usize, object: usize| {
            let grasps = grasps / objects + usize::from(object < grasps % objects);
            Self { preset, object, grasps }
        };
        let units = (0..PRESETS.len()).flat_map(|preset| (0..objects).map(move |object| of(preset, object)));
        units.filter(|unit| unit.grasps > 0).collect()
    }

    /// Its name in files of results.
    pub(super) fn name(&self) -> String {
        format!("chatter {} {}", PRESETS[self.preset].name, catalogue()[self.object].name)
    }

    /// Computes its grasps, at each accuracy in the same poses.
    pub fn run(&self) -> Result<Vec<ChatterRow>, ObjectError> {
        let preset: &PosePreset = &PRESETS[self.preset];
        let mut scene = Scene { pose: preset.poses(), ..Scene::default() };
        scene.object.source.clone_from(&catalogue()[self.object].name);
        let object = scene.load_object()?;
        let sampler = PoseSampler::new(&scene, object.as_ref());
        let row = |accuracy: &Accuracy| {
            let start = cpu_time::ThreadTime::now();
            let mut row = ChatterRow {
                preset: preset.name.to_owned(),
                accuracy: accuracy.to_string(),
                grasps: self.grasps,
                recomputed: 0,
                remaining: 0,
                changing: 0,
                chattering: 0,
                chattering_stored: 0,
                examples: Vec::new(),
                cpu_s: 0.0,
            };
            for seed in 1..=self.grasps as u64 {
                let mut posed = sampler.draw(object.as_ref(), seed).0;
                posed.solver.accuracy = *accuracy;
                row.count(&posed, object.as_ref(), seed);
            }
            row.cpu_s = start.elapsed().as_secs_f64();
            row
        };
        Ok(CHATTER_ACCURACIES.iter().map(row).collect())
    }
}

impl ChatterRow {
    fn count(&mut self, scene: &Scene, object: Option<&ObjectModel>, seed: u64) {
        let stored = grasp_soundly(scene, object, seed, Recompute::Unsettled);
        let quality = &stored.data.quality;
        // A trial that was not computed again is the one that was asked for.
        let asked = quality.recomputed.is_some().then(|| grasp(scene, object, seed));
        let changing = changes_in_hold(asked.as_ref().unwrap_or(&stored));
        let stored_changing = changes_in_hold(&stored);
        self.recomputed += usize::from(asked.is_some());
        self.remaining += usize::from(quality.is_restless());
        self.changing += usize::from(changing);
        if changing || stored_changing {
            let mut reference = scene.clone();
            reference.solver.accuracy = Accuracy::Reference;
            let really = changes_in_hold(&grasp(&reference, object, seed));
            self.chattering += usize::from(changing && !really);
            if stored_changing && !really {
                self.chattering_stored += 1;
                self.examples.push((scene.object.source.clone(), seed));
            }
        }
    }
}

/// True if the object is held and forces change as in a hold that chatters.
fn changes_in_hold(trial: &SimulatedTrial) -> bool {
    let count = trial.header.scene.gripper.taxels().count();
    let held: Vec<&Frame> = trial.frames().iter().filter(|frame| frame.phase == Phase::Hold).collect();
    let Some(last) = held.last() else { return false };
    let in_hand = trial.frames().first().is_some_and(|first| !last.has_lost_object(first));
    let squeezed = Side::BOTH.iter().all(|side| last.normal_force(*side, count) > HELD);
    let changes = |side: &Side| {
        let forces: Vec<f64> = held.iter().map(|frame| frame.normal_force(*side, count)).collect();
        forces.windows(2).filter(|pair| (pair[1] - pair[0]).abs() > CHANGE).count()
    };
    in_hand && squeezed && Side::BOTH.iter().any(|side| changes(side) >= MOST_CHANGES)
}

/// The table of all units: one row per preset and accuracy.
pub fn chatter_table(rows: impl IntoIterator<Item = ChatterRow>) -> Vec<ChatterRow> {
    let mut table: Vec<ChatterRow> = Vec::new();
    for row in rows {
        match table.iter_mut().find(|known| known.preset == row.preset && known.accuracy == row.accuracy) {
            Some(known) => known.add(row),
            None => table.push(row),
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_share_the_grasps_of_a_preset() {
        for grasps in [1, 16, 1000] {
            let units = ChatterUnit::all(grasps);
            assert_eq!(units.iter().map(|unit| unit.grasps).sum::<usize>(), grasps * PRESETS.len());
        }
    }

    #[test]
    fn rows_of_a_preset_add_up_and_a_lying_brick_is_at_rest_in_what_is_stored() {
        let brick = catalogue().iter().position(|built_in| built_in.name == "jenga").expect("in the catalogue");
        let rows = ChatterUnit { preset: 2, object: brick, grasps: 3 }.run().expect("loads");
        assert_eq!(rows.iter().map(|row| row.accuracy.as_str()).collect::<Vec<_>>(), ["draft", "standard"]);
        let table = chatter_table(rows.iter().chain(&rows).cloned());
        assert_eq!((table.len(), table[0].grasps, table[1].grasps), (2, 6, 6));
        assert!(rows.iter().all(|row| row.chattering_stored == 0), "{rows:#?}");
    }

    #[test]
    fn a_force_that_jumps_in_the_hold_counts_only_while_the_object_is_held() {
        let mut scene = Scene::default();
        "ball".clone_into(&mut scene.object.source);
        let object = scene.load_object().expect("built in");
        let mut trial = grasp(&scene, object.as_ref(), 0);
        assert!(!changes_in_hold(&trial));
        let hold: Vec<usize> = (0..trial.frames().len()).filter(|k| trial.frames()[*k].phase == Phase::Hold).collect();
        for k in hold.iter().skip(20).step_by(2).take(3) {
            for load in &mut trial.data.frames[*k].taxels {
                load.normal += 0.2;
            }
        }
        assert!(changes_in_hold(&trial), "three peaks are six changes");
        for k in hold {
            trial.data.frames[k].world_from_object.as_mut().expect("a ball").position.z -= 0.1;
        }
        assert!(!changes_in_hold(&trial), "fallen");
    }
}
