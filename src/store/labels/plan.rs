//! The plan of a labelling session: how many trials of each object are wanted (the paper took 40 to 55), which object
//! is next, and its pose in the hand.
//!
//! The order matters: sensors warm up and creep, and with objects in blocks a recogniser learns the time instead of the
//! object. So the object with the smallest share done comes next, and none comes twice in a row while another is left.

use super::class_name::{Classes, LabelError, class_name, compared};
use super::labelled_trial::LabelledTrial;
use palpate_geometry::units::fixed;
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_sim::scene::PoseSpread;
use palpate_tactile::model::Stream;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most trials of one object.
pub const MOST_WANTED: u32 = 1000;

/// Default number of trials per object: within the 40 to 55 of the paper (section IV-B).
const USUALLY_WANTED: u32 = 50;

/// Step of the turn that a person is asked for (degrees).
const TURN_STEP_DEG: f64 = 5.0;

/// An object and how many trials of it are wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedObject {
    /// Name, which becomes the label.
    pub name: String,
    /// Number of trials, 1 to [`MOST_WANTED`].
    pub wanted: u32,
}

/// How many trials of each object are wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LabelPlan {
    /// Objects in the order of the list.
    pub objects: Vec<PlannedObject>,
}

impl Default for LabelPlan {
    /// The built-in objects.
    fn default() -> Self {
        let planned = |name: &str| PlannedObject { name: name.to_owned(), wanted: USUALLY_WANTED };
        Self { objects: catalogue().iter().map(|built_in| planned(&built_in.name)).collect() }
    }
}

impl LabelPlan {
    /// The same plan with trimmed names; refused where a name cannot be a label, a count is out of range, or an object
    /// comes twice.
    pub fn checked(&self) -> Result<Self, LabelError> {
        let mut sound = Self { objects: Vec::new() };
        for PlannedObject { name, wanted } in &self.objects {
            let name = class_name(name)?;
            if sound.objects.iter().any(|object| compared(&object.name) == compared(&name)) {
                return Err(LabelError(format!("\"{name}\" is in the plan twice")));
            }
            sound.set(&name, *wanted)?;
        }
        Ok(sound)
    }

    /// Sets how many trials of an object are wanted; a new one is added at the end.
    pub fn set(&mut self, name: &str, wanted: u32) -> Result<(), LabelError> {
        let name = class_name(name)?;
        if !(1..=MOST_WANTED).contains(&wanted) {
            return Err(LabelError(format!(
                "{wanted} trials of \"{name}\" are not possible: choose 1 to {MOST_WANTED}, or remove it from the plan"
            )));
        }
        match self.objects.iter_mut().find(|object| compared(&object.name) == compared(&name)) {
            Some(object) => object.wanted = wanted,
            None => self.objects.push(PlannedObject { name, wanted }),
        }
        Ok(())
    }

    /// Removes an object from the plan; its trials stay.
    pub fn remove(&mut self, name: &str) -> Result<(), LabelError> {
        let at = self.objects.iter().position(|object| compared(&object.name) == compared(name));
        let missing = || LabelError(format!("\"{}\" is not in the plan; `palpate plan` shows it", name.trim()));
        self.objects.remove(at.ok_or_else(missing)?);
        Ok(())
    }

    /// Progress of the plan. Recorded objects that are not planned follow by name, with no trials wanted.
    pub fn progress(&self, rows: &[LabelledTrial]) -> Progress {
        let (mut met, mut classes) = (BTreeMap::<String, (u32, u32)>::new(), Classes::default());
        for row in rows.iter().filter(|row| row.counts()) {
            let class = classes.named(row.object.as_deref().unwrap_or_default());
            let (done, flagged) = met.entry(class.to_owned()).or_default();
            *done += 1;
            *flagged += u32::from(!row.flags.is_empty());
        }
        let mut row = |name: &str, wanted: u32| {
            let (done, flagged) = met.remove(classes.named(name)).unwrap_or_default();
            ObjectProgress { name: name.to_owned(), wanted, done, flagged }
        };
        let mut objects: Vec<ObjectProgress> =
            self.objects.iter().map(|object| row(&object.name, object.wanted)).collect();
        let unplanned =
            |(name, (done, flagged)): (String, (u32, u32))| ObjectProgress { name, wanted: 0, done, flagged };
        objects.extend(met.into_iter().map(unplanned));
        Progress { objects }
    }
}

/// Progress of one object.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ObjectProgress {
    pub name: String,
    /// Trials wanted.
    pub wanted: u32,
    /// Trials done.
    pub done: u32,
    /// Flagged trials among those done.
    pub flagged: u32,
}

/// Progress of a plan.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Progress {
    /// Objects of the plan, then other recorded ones.
    pub objects: Vec<ObjectProgress>,
}

/// Pose of an object in the hand, relative to the middle between the fingers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PoseCue {
    /// Turn about the gripper's axis, counter-clockwise seen from the palm (degrees).
    pub turn_deg: f64,
    /// Shift along the fingers' opening, towards the right finger, and across it (mm).
    pub shift_mm: [f64; 2],
}

/// Next trial of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextTrial {
    /// Name of the object.
    pub object: String,
    /// Number of the trial among those of the object, from 1.
    pub number: u32,
    /// Pose to hold it in.
    pub cue: PoseCue,
}

impl ObjectProgress {
    /// Its next trial.
    pub fn next(&self) -> NextTrial {
        let number = self.done + 1;
        NextTrial { object: self.name.clone(), number, cue: PoseCue::drawn(&self.name, number) }
    }
}

impl Progress {
    /// Trials done, each object counting up to its number wanted.
    pub fn done(&self) -> u32 {
        self.objects.iter().map(|object| object.done.min(object.wanted)).sum()
    }

    /// Trials wanted.
    pub fn wanted(&self) -> u32 {
        self.objects.iter().map(|object| object.wanted).sum()
    }

    /// The trial after `last`: drawn from the objects with the smallest share done, but not the same twice in a row
    /// while another is left. The same progress gives the same trial. None when all are done.
    pub fn next(&self, last: Option<&str>) -> Option<NextTrial> {
        let left: Vec<&ObjectProgress> = self.objects.iter().filter(|object| object.done < object.wanted).collect();
        let others: Vec<&ObjectProgress> =
            left.iter().copied().filter(|object| Some(object.name.as_str()) != last).collect();
        let among = if others.is_empty() { left } else { others };
        // done / wanted without division, so that equal shares are equal.
        let share_below = |a: &ObjectProgress, b: &ObjectProgress| {
            u64::from(a.done) * u64::from(b.wanted) < u64::from(b.done) * u64::from(a.wanted)
        };
        let behind: Vec<&ObjectProgress> =
            among.iter().copied().filter(|object| !among.iter().any(|other| share_below(other, object))).collect();
        let draw = Stream::new(u64::from(self.done()), "label plan", "next").within(0.0, behind.len() as f64);
        behind.get(draw as usize).or(behind.last()).map(|object| object.next())
    }
}

impl PoseCue {
    /// What to do with the object: `turn 10°, 3 mm towards the right finger, 2 mm back`.
    pub fn words(&self) -> String {
        let [along, across] = self.shift_mm;
        let part = |by: f64, positive: &str, negative: &str| match by.round() {
            by if by > 0.0 => format!(", {by:.0} mm {positive}"),
            by if by < 0.0 => format!(", {:.0} mm {negative}", -by),
            _ => String::new(),
        };
        let shifts =
            part(along, "towards the right finger", "towards the left finger") + &part(across, "back", "forward");
        format!("turn {}°{shifts}", fixed(self.turn_deg, 0))
    }

    /// Pose for one trial of an object: within preset M of the simulated grasps, in steps that a person can follow. The
    /// same object and trial give the same pose.
    pub fn drawn(object: &str, number: u32) -> Self {
        if object == EMPTY {
            return Self::default();
        }
        let spread = PoseSpread::default();
        let mut stream = Stream::new(u64::from(number), object, "pose cue");
        let mut within = |most: f64, step: f64| (stream.within(-most, most) / step).round() * step;
        let turn_deg = within(spread.yaw_deg, TURN_STEP_DEG);
        // Adding zero turns -0 into 0.
        let shift_mm = [0, 1].map(|axis| within(spread.shift[axis] * 1e3, 1.0) + 0.0);
        Self { turn_deg: turn_deg + 0.0, shift_mm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn row(object: &str) -> LabelledTrial {
        LabelledTrial { object: Some(object.to_owned()), complete: true, ..LabelledTrial::default() }
    }

    #[test]
    fn eight_hundred_trials_stay_balanced_and_no_object_comes_twice_in_a_row() {
        let plan = LabelPlan::default();
        let mut progress = plan.progress(&[]);
        let (mut last, mut order) = (None::<String>, Vec::new());
        while let Some(next) = progress.next(last.as_deref()) {
            assert_ne!(Some(&next.object), last.as_ref());
            assert_eq!(progress.next(last.as_deref()).as_ref(), Some(&next), "stable while it is shown");
            let object = progress.objects.iter_mut().find(|object| object.name == next.object).expect("planned");
            assert_eq!(next.number, object.done + 1);
            object.done += 1;
            let done = || progress.objects.iter().map(|object| object.done);
            assert!(done().max() <= done().min().map(|least| least + 1), "{progress:?}");
            order.push(next.object.clone());
            last = Some(next.object);
        }
        assert_eq!((order.len(), progress.done(), progress.wanted()), (800, 800, 800));
        let rounds: BTreeSet<&[String]> = order.chunks(16).collect();
        assert!(rounds.len() > 45, "rounds come in ever another order, not by name: {}", rounds.len());
    }

    #[test]
    fn unequal_wishes_are_met_by_share() {
        let mut plan = LabelPlan { objects: Vec::new() };
        for (name, wanted) in [("a", 40), ("b", 30), ("c", 20), ("d", 10)] {
            plan.set(name, wanted).expect("sound");
        }
        let mut rows = Vec::new();
        for _ in 0..50 {
            let last = rows.last().and_then(|row: &LabelledTrial| row.object.clone());
            rows.push(row(&plan.progress(&rows).next(last.as_deref()).expect("half is left").object));
        }
        let done: Vec<u32> = plan.progress(&rows).objects.iter().map(|object| object.done).collect();
        assert_eq!(done.iter().sum::<u32>(), 50);
        for (done, half) in done.iter().zip([20, 15, 10, 5]) {
            assert!(done.abs_diff(half) <= 2, "{done} of {half}");
        }
        // Of the last one, as many as are wanted, one after the other.
        let one = LabelPlan { objects: vec![PlannedObject { name: "a".to_owned(), wanted: 2 }] };
        assert_eq!(one.progress(&[row("a")]).next(Some("a")).map(|next| next.number), Some(2));
        assert_eq!(one.progress(&[row("a"), row("a"), row("a")]).next(None), None);
    }

    #[test]
    fn only_what_counts_is_counted_and_strangers_are_shown() {
        let plan = LabelPlan { objects: vec![PlannedObject { name: "a".to_owned(), wanted: 5 }] };
        let rows = [
            row("a"),
            row("mug"),
            LabelledTrial { discarded: true, ..row("a") },
            LabelledTrial { complete: false, ..row("a") },
            LabelledTrial { object: None, ..row("a") },
        ];
        let row = |name: &str, wanted, done| ObjectProgress { name: name.to_owned(), wanted, done, flagged: 0 };
        assert_eq!(plan.progress(&rows).objects, [row("a", 5, 1), row("mug", 0, 1)]);
    }

    #[test]
    fn cues_are_such_as_a_hand_can_follow_and_differ() {
        let cues: Vec<PoseCue> = (1..=50).map(|number| PoseCue::drawn("lemon", number)).collect();
        for cue in &cues {
            assert!(cue.turn_deg.abs() <= 25.0 && cue.turn_deg % 5.0 == 0.0, "{cue:?}");
            assert!(cue.shift_mm.iter().all(|mm| mm.abs() <= 5.0 && mm.fract() == 0.0), "{cue:?}");
        }
        let turns: BTreeSet<i32> = cues.iter().map(|cue| cue.turn_deg as i32).collect();
        assert!(turns.len() >= 9, "{turns:?}");
        assert_ne!(PoseCue::drawn("cube", 1), cues[0]);
        assert_eq!(PoseCue::drawn(EMPTY, 3), PoseCue::default());
    }

    #[test]
    fn a_plan_that_cannot_be_is_refused() {
        let mut plan = LabelPlan { objects: Vec::new() };
        let refused =
            |result: Result<(), LabelError>, why: &str| result.is_err_and(|error| error.to_string().contains(why));
        assert!(refused(plan.set("mug", 0), "0 trials of \"mug\" are not possible"));
        assert!(refused(plan.set("mug", 1001), "are not possible"));
        assert!(refused(plan.set("\n", 5), "cannot be empty"));
        plan.set(" mug ", 5).expect("sound");
        plan.set("mug", 7).expect("sound");
        assert_eq!(plan.objects, [PlannedObject { name: "mug".to_owned(), wanted: 7 }]);
        assert_eq!(plan.checked().as_ref(), Ok(&plan));
        let twice = LabelPlan { objects: [plan.objects.clone(), plan.objects.clone()].concat() };
        assert!(refused(twice.checked().map(drop), "in the plan twice"));
        assert!(refused(plan.remove("cup"), "is not in the plan"));
        assert_eq!(plan.remove("mug"), Ok(()));
        assert!(LabelPlan::default().checked().is_ok() && LabelPlan::default().objects.len() == 16);
    }
}
