//! The plan of a labelling session: how many trials of each object are wanted (the paper took 40 to 55), which is to be
//! taken next, and how the object is to be held.
//!
//! The order matters: sensors warm up and creep, and where one object is taken after the other, a recogniser learns the
//! hour instead of the object. So the object that is farthest behind comes next, by its share and not by its name, and
//! none comes twice in a row while another is left.

use super::class_name::{ClassNameError, class_name};
use super::labelled_trial::LabelledTrial;
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_sim::scene::PoseSpread;
use palpate_tactile::model::Stream;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most trials of one object.
pub const MOST_WANTED: u32 = 1000;

/// Trials of each object unless it is said: within the 40 to 55 of the paper (section IV-B).
const USUALLY_WANTED: u32 = 50;

/// What may be asked of a hand: whole steps of so many degrees.
const TURN_STEP_DEG: f64 = 5.0;

/// An object and how many trials of it are wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedObject {
    /// Its name, which becomes the label.
    pub name: String,
    /// How many trials, 1 to [`MOST_WANTED`].
    pub wanted: u32,
}

/// How many trials of each object are wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LabelPlan {
    /// The objects, in the order in which they are shown.
    pub objects: Vec<PlannedObject>,
}

impl Default for LabelPlan {
    /// The built-in objects.
    fn default() -> Self {
        let planned = |name: &str| PlannedObject { name: name.to_owned(), wanted: USUALLY_WANTED };
        Self { objects: catalogue().iter().map(|built_in| planned(&built_in.name)).collect() }
    }
}

/// A plan that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// A name that cannot be a label.
    #[error(transparent)]
    Name(#[from] ClassNameError),
    /// Too many, or none.
    #[error("{wanted} trials of \"{name}\" are not possible: choose 1 to {MOST_WANTED}, or remove it from the plan")]
    Count {
        /// The object.
        name: String,
        /// What was asked for.
        wanted: u32,
    },
    /// An object that is in the plan twice.
    #[error("\"{name}\" is in the plan twice")]
    Twice {
        /// The object.
        name: String,
    },
    /// An object that is not in the plan.
    #[error("\"{name}\" is not in the plan; `palpate plan` shows what is")]
    NotPlanned {
        /// The object.
        name: String,
    },
}

impl LabelPlan {
    /// The same plan with names as labels are stored; refused where a name cannot be a label, a count is out of range, or an
    /// object comes twice.
    pub fn checked(&self) -> Result<Self, PlanError> {
        let mut sound = Self { objects: Vec::new() };
        for PlannedObject { name, wanted } in &self.objects {
            let name = class_name(name)?;
            if sound.objects.iter().any(|object| object.name == name) {
                return Err(PlanError::Twice { name });
            }
            sound.set(&name, *wanted)?;
        }
        Ok(sound)
    }

    /// Sets how many trials of an object are wanted; a new one is added at the end.
    pub fn set(&mut self, name: &str, wanted: u32) -> Result<(), PlanError> {
        let name = class_name(name)?;
        if !(1..=MOST_WANTED).contains(&wanted) {
            return Err(PlanError::Count { name, wanted });
        }
        match self.objects.iter_mut().find(|object| object.name == name) {
            Some(object) => object.wanted = wanted,
            None => self.objects.push(PlannedObject { name, wanted }),
        }
        Ok(())
    }

    /// Takes an object out of the plan; its trials stay.
    pub fn remove(&mut self, name: &str) -> Result<(), PlanError> {
        let at = self.objects.iter().position(|object| object.name == name.trim());
        self.objects.remove(at.ok_or_else(|| PlanError::NotPlanned { name: name.trim().to_owned() })?);
        Ok(())
    }

    /// How far the plan is done. Objects that were recorded but are not planned follow by name, with nothing wanted.
    pub fn progress(&self, rows: &[LabelledTrial]) -> Progress {
        let mut met: BTreeMap<&str, (u32, u32)> = BTreeMap::new();
        for row in rows.iter().filter(|row| row.counts()) {
            let (done, flagged) = met.entry(row.object.as_deref().unwrap_or_default()).or_default();
            *done += 1;
            *flagged += u32::from(!row.flags.is_empty());
        }
        let mut told = |name: &str, wanted: u32| {
            let (done, flagged) = met.remove(name).unwrap_or_default();
            ObjectProgress { name: name.to_owned(), wanted, done, flagged }
        };
        let mut objects: Vec<ObjectProgress> =
            self.objects.iter().map(|object| told(&object.name, object.wanted)).collect();
        let stranger = |(name, (done, flagged)): (&str, (u32, u32))| {
            let name = name.to_owned();
            ObjectProgress { name, wanted: 0, done, flagged }
        };
        objects.extend(met.into_iter().map(stranger));
        Progress { objects }
    }
}

/// How far one object is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ObjectProgress {
    /// Its name.
    pub name: String,
    /// How many trials are wanted.
    pub wanted: u32,
    /// How many there are.
    pub done: u32,
    /// How many of those are flagged.
    pub flagged: u32,
}

/// How far a plan is.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Progress {
    /// The objects of the plan, then others that were recorded.
    pub objects: Vec<ObjectProgress>,
}

/// How an object is to be held, against lying in the middle between the fingers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PoseCue {
    /// Turned about the gripper's axis, counter-clockwise seen from the palm (degrees).
    pub turn_deg: f64,
    /// Shifted along the fingers' opening, towards the right finger, and across it (mm).
    pub shift_mm: [f64; 2],
}

/// What to take next.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextTrial {
    /// The object.
    pub object: String,
    /// Which of its trials this will be, from 1.
    pub number: u32,
    /// How it is to be held.
    pub cue: PoseCue,
}

impl Progress {
    /// Trials that there are of what is wanted, no object counting for more than its share.
    pub fn done(&self) -> u32 {
        self.objects.iter().map(|object| object.done.min(object.wanted)).sum()
    }

    /// Trials that are wanted.
    pub fn wanted(&self) -> u32 {
        self.objects.iter().map(|object| object.wanted).sum()
    }

    /// What to take after `last`: of the objects that are farthest behind one that is drawn, but never the same twice in a
    /// row while another is left. It depends on nothing but what there is, so it stays while it is shown. None when all is
    /// done.
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
        let object = behind.get(draw as usize).or(behind.last())?;
        Some(NextTrial {
            object: object.name.clone(),
            number: object.done + 1,
            cue: PoseCue::drawn(&object.name, object.done + 1),
        })
    }
}

impl PoseCue {
    /// How an object is to be held in one of its trials: within preset M of the simulated grasps, in steps that a hand can
    /// follow. The same object and trial give the same cue.
    pub fn drawn(object: &str, number: u32) -> Self {
        if object == EMPTY {
            return Self::default();
        }
        let spread = PoseSpread::default();
        let mut stream = Stream::new(u64::from(number), object, "pose cue");
        let mut within = |most: f64, step: f64| (stream.within(-most, most) / step).round() * step;
        let turn_deg = within(spread.yaw_deg, TURN_STEP_DEG);
        // Adding zero keeps a minus from standing before it.
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
        let told = |name: &str, wanted, done| ObjectProgress { name: name.to_owned(), wanted, done, flagged: 0 };
        assert_eq!(plan.progress(&rows).objects, [told("a", 5, 1), told("mug", 0, 1)]);
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
        assert!(matches!(plan.set("mug", 0), Err(PlanError::Count { .. })));
        assert!(matches!(plan.set("mug", 1001), Err(PlanError::Count { .. })));
        assert!(matches!(plan.set("\n", 5), Err(PlanError::Name(ClassNameError::Empty))));
        plan.set(" mug ", 5).expect("sound");
        plan.set("mug", 7).expect("sound");
        assert_eq!(plan.objects, [PlannedObject { name: "mug".to_owned(), wanted: 7 }]);
        assert_eq!(plan.checked().as_ref(), Ok(&plan));
        let twice = LabelPlan { objects: [plan.objects.clone(), plan.objects.clone()].concat() };
        assert!(matches!(twice.checked(), Err(PlanError::Twice { .. })));
        assert!(matches!(plan.remove("cup"), Err(PlanError::NotPlanned { .. })));
        assert_eq!(plan.remove("mug"), Ok(()));
        assert!(LabelPlan::default().checked().is_ok() && LabelPlan::default().objects.len() == 16);
    }
}
