//! Advice on the next grasp by any model, in simulation and to people.

use super::guide::Guide;
use super::known::KnownTouches;
use super::library::TouchLibrary;
use super::stance::GripperMove;
use crate::grasping::RecognisedGrasp;
use palpate_learn::{Model, Shipped};
use palpate_sim::objects::ObjectModel;
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Between, Scene};
use std::fmt;
use std::sync::Arc;

/// Moves that a person is advised to make: turns (degrees), shifts along the pads and lifts (m).
const TURNS_DEG: [f64; 7] = [0.0, 30.0, -30.0, 60.0, -60.0, 90.0, 45.0];
const SHIFTS: [f64; 3] = [0.0, 0.008, -0.008];
const LIFTS: [f64; 3] = [0.0, 0.005, -0.005];
/// Entropy that a turn, a shift or a lift has to save (nat): few moves are easier than many.
const WORTH: f64 = 0.02;

/// Advice on the next grasp of an object. Answers of a model to the grasps in known poses are computed when it is first asked
/// for, in one or two seconds.
#[derive(Clone, Debug, Default)]
pub struct Advisor {
    /// The model in use; none within where the known grasps lack its channels.
    library: Option<(Arc<Model>, Option<Arc<TouchLibrary>>)>,
    /// The object so far, and the last move.
    guide: Option<Guide>,
    by: GripperMove,
}

impl Advisor {
    /// One that knows the answers of a model ahead; none where the model's channels are unknown here.
    pub fn of(model: &Arc<Model>) -> Option<Self> {
        let mut advisor = Self::default();
        advisor.library(model)?;
        Some(advisor)
    }

    fn library(&mut self, model: &Arc<Model>) -> Option<Arc<TouchLibrary>> {
        if !self.library.as_ref().is_some_and(|(own, _)| Arc::ptr_eq(own, model)) {
            self.guide = None;
            let touches = KnownTouches::shipped(Shipped::of(&model.card.data)).ok();
            let library = touches.and_then(|touches| touches.library(model)).map(Arc::new);
            self.library = Some((Arc::clone(model), library));
        }
        self.library.as_ref().and_then(|(_, library)| library.clone())
    }

    /// The scene of the next grasp of an object that stays, and the move of the gripper that leads to it, within the poses of
    /// the nominal scene. `scene` is that of the last grasp, `drawn` one of [`PoseSampler::draw_after`], which has a free
    /// object where it lies now. None where the object was put down anew, where the model's channels are unknown here, and
    /// where no pose has room.
    pub fn next(
        &mut self,
        last: &RecognisedGrasp,
        [scene, drawn]: [&Scene; 2],
        sampler: &PoseSampler,
        object: Option<&ObjectModel>,
    ) -> Option<(GripperMove, Scene)> {
        let nominal = sampler.scene();
        let stays = nominal.holds_object() || sampler.is_left(drawn);
        if nominal.pose.between != Between::Guided || !stays {
            return None;
        }
        let lying = if nominal.holds_object() { &scene.object } else { &drawn.object };
        let from = Scene { object: lying.clone(), ..scene.clone() };
        let library = self.library(&last.model)?;
        // A free object has moved in the hand: its readings tell more of its pose than the moves so far.
        if last.belief.grasps() <= 1 || !nominal.holds_object() {
            self.guide = None;
        }
        let guide = self.guide.get_or_insert_with(|| Guide::new(library));
        guide.felt(&last.grasp, &self.by);
        let (by, scene) = guide.best(last.belief.now()?, &from, nominal, object)?;
        self.by = by;
        Some((by, scene))
    }

    /// How a person should move the object before the next grasp. How it was held is read from the readings of the last grasp
    /// alone.
    pub fn advice(&mut self, last: &RecognisedGrasp) -> Option<GripperMove> {
        let mut guide = Guide::new(self.library(&last.model)?);
        guide.felt(&last.grasp, &GripperMove::default());
        let moves = TURNS_DEG.iter().flat_map(|turn_deg| {
            let shifts = SHIFTS.iter().flat_map(|along| LIFTS.map(|lift| ([0.0, *along], lift)));
            shifts.map(|(shift, lift)| GripperMove { turn_deg: *turn_deg, shift, lift })
        });
        // The same once more would be felt the same.
        let moves: Vec<GripperMove> = moves.filter(|by| *by != GripperMove::default()).collect();
        let expected = guide.expected_entropy(last.belief.now()?, &moves);
        let cost = |k: &usize| expected[*k] + WORTH * moves[*k].parts() as f64;
        (0..moves.len()).min_by(|a, b| cost(a).total_cmp(&cost(b))).map(|best| moves[best])
    }
}

impl GripperMove {
    /// Number of turns, shifts and lifts.
    fn parts(&self) -> usize {
        [self.turn_deg, self.shift[0], self.shift[1], self.lift].iter().filter(|part| **part != 0.0).count()
    }

    /// The move as one of the object under a gripper that stays, for people: `turn the object by 30° clockwise, seen from above`.
    pub fn of_object(&self) -> ObjectMove {
        ObjectMove(*self)
    }
}

/// A move of the object that has the same effect as one of the gripper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectMove(GripperMove);

impl ObjectMove {
    /// The move of the gripper.
    pub fn of_gripper(self) -> GripperMove {
        self.0
    }
}

/// Millimetres, without sign.
fn whole_mm(metres: f64) -> f64 {
    (1e3 * metres.abs()).round()
}

impl fmt::Display for GripperMove {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shift = self.shift[0].hypot(self.shift[1]);
        let mut parts = Vec::new();
        if self.turn_deg != 0.0 {
            parts.push(format!("turned by {:+.0}°", self.turn_deg));
        }
        if whole_mm(shift) > 0.0 {
            parts.push(format!("shifted by {} mm", whole_mm(shift)));
        }
        if whole_mm(self.lift) > 0.0 {
            parts.push(format!("{} mm {}", whole_mm(self.lift), if self.lift > 0.0 { "higher" } else { "lower" }));
        }
        if parts.is_empty() { write!(f, "in the same pose") } else { write!(f, "{}", parts.join(", ")) }
    }
}

impl fmt::Display for ObjectMove {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let GripperMove { turn_deg, shift: [_, along], lift } = self.0;
        let mut parts = Vec::new();
        match turn_deg {
            0.0 => {}
            90.0 | -90.0 => parts.push("turn the object by a quarter turn".to_owned()),
            _ => {
                // What the gripper turns to one side, the object turns to the other.
                let way = if turn_deg > 0.0 { "clockwise" } else { "counter-clockwise" };
                parts.push(format!("turn the object by {:.0}° {way}, seen from above", turn_deg.abs()));
            }
        }
        if along != 0.0 {
            let way = if along > 0.0 { "towards you" } else { "away from you" };
            parts.push(format!("shift the object by {} mm {way}, finger L on your left", whole_mm(along)));
        }
        if lift != 0.0 {
            let way = if lift > 0.0 { "higher" } else { "lower" };
            parts.push(format!("grip the object {} mm {way}", whole_mm(lift)));
        }
        write!(f, "{}", parts.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasets::{SensorView, sequence_of};
    use crate::grasping::{Recompute, grasp_soundly};

    #[test]
    fn advice_moves_the_object_as_the_gripper_would_move() {
        let by = |turn_deg, along, lift| GripperMove { turn_deg, shift: [0.0, along], lift };
        let cases = [
            (by(30.0, 0.0, 0.0), "turn the object by 30° clockwise, seen from above", "turned by +30°"),
            (
                by(-90.0, 0.0, 0.005),
                "turn the object by a quarter turn; grip the object 5 mm higher",
                "turned by -90°, 5 mm higher",
            ),
            (
                by(0.0, 0.008, -0.005),
                "shift the object by 8 mm towards you, finger L on your left; grip the object 5 mm lower",
                "shifted by 8 mm, 5 mm lower",
            ),
            (by(0.0, 0.0, 0.0), "", "in the same pose"),
        ];
        for (by, object, gripper) in cases {
            assert_eq!((by.of_object().to_string().as_str(), by.to_string().as_str()), (object, gripper));
        }
    }

    #[test]
    fn the_next_grasp_is_another_one_within_the_poses_of_the_scene() {
        let model = Arc::new(Shipped::PerfectSensors.model().expect("valid"));
        let mut nominal = Scene::default();
        nominal.object.source = "lemon".to_owned();
        let object = nominal.load_object().expect("built in");
        let trial = grasp_soundly(&nominal, object.as_ref(), 1, Recompute::Unsettled);
        let grasp = sequence_of(&SensorView::of_model(&model.card).signals(&trial).expect("a layout"));
        let last = RecognisedGrasp::alone(model, grasp, None);
        let mut advisor = Advisor::default();
        nominal.pose.between = Between::Guided;
        nominal.set_object_fixed(true);
        let sampler = PoseSampler::new(&nominal, object.as_ref());
        let (by, scene) = advisor.next(&last, [&nominal; 2], &sampler, object.as_ref()).expect("has room");
        assert_ne!(by, GripperMove::default());
        let mount = &scene.gripper.mount;
        assert!(mount.offset.iter().zip(nominal.pose.shift).all(|(x, most)| x.abs() <= most + 1e-9));
        assert_eq!(scene.object, nominal.object);
        let advice = advisor.advice(&last).expect("known channels");
        assert_ne!(advice, GripperMove::default());
    }
}
