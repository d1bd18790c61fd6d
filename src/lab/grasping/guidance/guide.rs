//! The guide.

use super::library::{KnownTouch, TouchLibrary};
use super::stance::{GripperMove, Stance};
use palpate_learn::{Pmf, Sequence};
use palpate_sim::objects::ObjectModel;
use palpate_sim::poses::has_room;
use palpate_sim::scene::Scene;
use std::sync::Arc;

/// Distance of readings from a hypothesis at which its weight falls to 0.6, in deviations of a channel over the library.
const LIKE: f64 = 0.15;
/// The same for later grasps, whose pose the library holds only nearly.
const NEARLY_LIKE: f64 = 0.3;
/// Least weights that readings give, first and later: no hypothesis is ruled out by one grasp.
const LEAST_FIRST: f64 = 1e-6;
const LEAST_LATER: f64 = 1e-3;
/// Hypotheses that are kept of each object.
const KEPT: usize = 40;
/// Objects and hypotheses below these shares are not considered.
const LEAST_BELIEF: f64 = 0.01;
const LEAST_SHARE: f64 = 1e-3;

/// How alike two readings are, 0 to 1.
fn likeness(a: &[f32], b: &[f32], width: f64) -> f64 {
    let squares: f32 = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum();
    (-0.5 * f64::from(squares) / (a.len().max(1) as f64 * width * width)).exp()
}

/// The object and the pose in which it is gripped.
#[derive(Clone, Copy, Debug)]
struct Hypothesis {
    class: usize,
    stance: Stance,
    /// Share among those of its class.
    share: f64,
}

/// Advice on the next grasp of one object that stays where it is.
#[derive(Clone, Debug)]
pub struct Guide {
    library: Arc<TouchLibrary>,
    hypotheses: Vec<Hypothesis>,
}

impl Guide {
    /// Before the first grasp.
    pub fn new(library: Arc<TouchLibrary>) -> Self {
        Self { library, hypotheses: Vec::new() }
    }

    /// Takes in the readings of a grasp, `by` the move of the gripper since the one before.
    pub fn felt(&mut self, grasp: &Sequence, by: &GripperMove) {
        let felt = self.library.felt(grasp);
        if self.hypotheses.is_empty() {
            for (class, touches) in self.library.touches.iter().enumerate() {
                let of = |touch: &KnownTouch| Hypothesis {
                    class,
                    stance: touch.stance,
                    share: likeness(&felt, &touch.felt, LIKE) + LEAST_FIRST,
                };
                self.hypotheses.extend(touches.iter().map(of));
            }
        } else {
            for own in &mut self.hypotheses {
                own.stance = own.stance.moved(by);
                let nearest = self.library.nearest(own.class, &own.stance);
                let nearest = nearest.first().map(|touch| &self.library.touches[own.class][*touch]);
                let like = nearest.map_or(0.0, |touch| likeness(&felt, &touch.felt, NEARLY_LIKE));
                own.share *= like + LEAST_LATER;
            }
        }
        self.hypotheses.sort_by(|a, b| a.class.cmp(&b.class).then(b.share.total_cmp(&a.share)));
        let by_class = self.hypotheses.chunk_by(|a, b| a.class == b.class);
        let shared = |of: &[Hypothesis]| {
            let kept = &of[..of.len().min(KEPT)];
            let sum: f64 = kept.iter().map(|own| own.share).sum();
            kept.iter().map(|own| Hypothesis { share: own.share / sum, ..*own }).collect::<Vec<_>>()
        };
        self.hypotheses = by_class.flat_map(shared).collect();
    }

    /// The best move from a scene that keeps to the poses of the nominal one and has room for the fingers, with the scene
    /// after it; none where no pose has room.
    pub fn best(
        &self,
        belief: &Pmf,
        from: &Scene,
        nominal: &Scene,
        object: Option<&ObjectModel>,
    ) -> Option<(GripperMove, Scene)> {
        let mut all = GripperMove::all(from, nominal);
        let moves: Vec<GripperMove> = all.iter().map(|(by, _)| *by).collect();
        let expected = self.expected_entropy(belief, &moves);
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|a, b| expected[*a].total_cmp(&expected[*b]));
        let chosen = order.into_iter().find(|k| has_room(&all[*k].1, object))?;
        Some(all.swap_remove(chosen))
    }

    /// Expected entropy of the belief after one more grasp (nat), after each of these moves.
    pub fn expected_entropy(&self, belief: &Pmf, moves: &[GripperMove]) -> Vec<f64> {
        let p = belief.probabilities();
        let considered: Vec<&Hypothesis> =
            self.hypotheses.iter().filter(|own| p[own.class] >= LEAST_BELIEF && own.share >= LEAST_SHARE).collect();
        let entropies = |(class, touches): (usize, &Vec<KnownTouch>)| -> Vec<f64> {
            let touches = if p[class] >= LEAST_BELIEF { touches.as_slice() } else { &[] };
            touches.iter().map(|touch| belief.times(&touch.answer).entropy()).collect()
        };
        let entropies: Vec<Vec<f64>> = self.library.touches.iter().enumerate().map(entropies).collect();
        let after = |by: &GripperMove| -> f64 {
            let of = |own: &&Hypothesis| {
                let nearest = self.library.nearest(own.class, &own.stance.moved(by));
                let sum: f64 = nearest.iter().map(|touch| entropies[own.class][*touch]).sum();
                p[own.class] * own.share * sum / nearest.len().max(1) as f64
            };
            considered.iter().map(of).sum()
        };
        moves.iter().map(after).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(yaw_deg: f64, offset: [f64; 3]) -> Scene {
        let mut scene = Scene::default();
        (scene.gripper.mount.yaw_deg, scene.gripper.mount.offset) = (yaw_deg, offset);
        scene
    }

    /// Two objects that differ in what is felt across, and not in what is felt along.
    #[test]
    fn the_move_that_tells_two_objects_apart_is_found() {
        let channels = ["curvature_left", "curvature_right"].map(str::to_owned);
        let felt = |curvature: f32| Sequence { t_s: vec![0.0, 1.0], values: vec![curvature; 4] };
        // Along: both 1; across: 2 and 3.
        let readings = [felt(1.0), felt(2.0), felt(3.0)];
        let mut grasps = Vec::new();
        for (class, across) in [(0, 1), (1, 2)] {
            for k in 0..24 {
                let yaw_deg = 15.0 * f64::from(k) - 180.0;
                let is_across = (yaw_deg.to_radians().cos()).abs() < 0.5;
                let certain = if class == 0 { [0.95, 0.05] } else { [0.05, 0.95] };
                let answer = Pmf::from_weights(if is_across { certain } else { [0.5, 0.5] });
                let reading = if is_across { across } else { 0 };
                grasps.push((class, Stance::of(&scene(yaw_deg, [0.0; 3])), &readings[reading], answer));
            }
        }
        let library = TouchLibrary::new(&channels, 2, &grasps);
        let mut guide = Guide::new(Arc::new(library));
        guide.felt(&readings[0], &GripperMove::default());
        let moves = [0.0, 90.0].map(|turn_deg| GripperMove { turn_deg, ..GripperMove::default() });
        let [stay, turn] = guide.expected_entropy(&Pmf::from_weights([0.5, 0.5]), &moves)[..] else { panic!("two") };
        assert!(turn < stay - 0.1 && stay <= 2.0_f64.ln() + 1e-9, "{stay} and {turn}");

        // Once it is felt across, the belief names the object, and the guide where it is gripped.
        guide.felt(&readings[1], &moves[1]);
        let sure = Pmf::from_weights([1.0, 0.0]);
        assert!(guide.expected_entropy(&sure, &moves).iter().all(|entropy| *entropy < 1e-3));
    }
}
