//! Which grasp next: the move of the gripper after which least is expected to be unknown about the object in the hand.
//!
//! A library holds grasps of known objects in known poses, and the recogniser's answer to each. Every one of them is a
//! hypothesis: the object is this one, and it was gripped like this. The readings of the grasps so far weigh the
//! hypotheses; the probabilities of the objects stay those of the recogniser. After a move of the gripper each hypothesis
//! predicts the answers of the library's grasps in the nearest poses. The best move has the least expected entropy of the
//! belief after such answers.

use glam::{DQuat, DVec2, EulerRot};
use palpate_learn::{Pmf, Sequence, mirror};
use palpate_sim::scene::Scene;

/// Differences of pose that a grasp feels, for distances between poses: a turn, a shift in the plane, a lift.
const TURN_DEG: f64 = 12.0;
const SHIFT: f64 = 0.012;
const LIFT: f64 = 0.003;
/// Nearest poses whose answers are predicted: single ones are of little weight, as answers vary between like poses.
const NEAREST: usize = 6;

/// Times of a grasp at which readings are compared, from this share of it to its end.
const TIMES: usize = 12;
const FROM: f32 = 0.2;
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

/// Moves that are compared: turns by this much up to a quarter turn to either side, as the fingers are alike; shifts and
/// lifts on these grids (degrees, m).
const TURN_STEP_DEG: f64 = 15.0;
const ACROSS: [f64; 3] = [-0.006, 0.0, 0.006];
const ALONG: [f64; 3] = [-0.008, 0.0, 0.008];
const HEIGHTS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// Pose of the gripper as seen from an object at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// Orientation of the gripper in the frame of the object.
    turned: DQuat,
    /// Place of the gripper from that of the object, in the gripper's frame: across the pads, and along their width (m).
    offset: DVec2,
    /// Height above the nominal one (m).
    height: f64,
}

/// A move of the gripper between two grasps: a turn, then a shift in the new frame, and a lift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GripperMove {
    /// Turn about the vertical, counter-clockwise from above (degrees).
    pub turn_deg: f64,
    /// Shift across the pads, in the direction of closing, and along their width (m).
    pub shift: [f64; 2],
    /// Lift (m).
    pub lift: f64,
}

impl Stance {
    /// The stance in a scene.
    pub fn of(scene: &Scene) -> Self {
        let [roll, pitch, yaw] = scene.object.rotation_deg.map(f64::to_radians);
        let object = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
        let mount = &scene.gripper.mount;
        let turn = mount.yaw_deg.to_radians();
        let [x, y, height] = mount.offset;
        let place = DVec2::new(x, y) - DVec2::from_array(scene.object.shift);
        let offset = DVec2::from_angle(-turn).rotate(place);
        Self { turned: object.inverse() * DQuat::from_rotation_z(turn), offset, height }
    }

    /// The stance after a move.
    #[must_use]
    pub fn moved(&self, by: &GripperMove) -> Self {
        let turn = by.turn_deg.to_radians();
        Self {
            turned: self.turned * DQuat::from_rotation_z(turn),
            offset: DVec2::from_angle(-turn).rotate(self.offset) + DVec2::from_array(by.shift),
            height: self.height + by.lift,
        }
    }

    /// Squared distance, in differences that a grasp feels.
    fn distance2(&self, other: &Self) -> f64 {
        let turn_deg = 2.0 * self.turned.dot(other.turned).abs().min(1.0).acos().to_degrees();
        let squared = |difference: f64, felt: f64| (difference / felt) * (difference / felt);
        squared(turn_deg, TURN_DEG)
            + squared((self.offset - other.offset).length(), SHIFT)
            + squared(self.height - other.height, LIFT)
    }
}

impl GripperMove {
    /// All moves from a scene that keep to the poses of the nominal one, each with the scene after it.
    pub fn all(from: &Scene, nominal: &Scene) -> Vec<(Self, Scene)> {
        let (here, centre, most) = (&from.gripper.mount, nominal.gripper.mount.offset, nominal.pose.shift);
        let quarter = (90.0 / TURN_STEP_DEG) as i32;
        let mut all = Vec::new();
        for turn_deg in (1 - quarter..=quarter).map(|k| TURN_STEP_DEG * f64::from(k)) {
            let yaw_deg = here.yaw_deg + turn_deg;
            for (across, along) in ACROSS.iter().flat_map(|across| ALONG.map(|along| (*across, along))) {
                let shift = DVec2::from_angle(yaw_deg.to_radians()).rotate(DVec2::new(across, along));
                for height in HEIGHTS.map(|share| centre[2] + share * most[2]) {
                    let offset = [here.offset[0] + shift.x, here.offset[1] + shift.y, height];
                    let is_far = |axis: usize| (offset[axis] - centre[axis]).abs() > most[axis] + 1e-9;
                    if (0..3).any(is_far) {
                        continue;
                    }
                    let mut scene = from.clone();
                    scene.gripper.mount.offset = offset;
                    scene.gripper.mount.yaw_deg = (yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
                    let by = Self { turn_deg, shift: [across, along], lift: height - here.offset[2] };
                    all.push((by, scene));
                }
            }
        }
        all
    }
}

/// A grasp in a known pose.
#[derive(Clone, Debug)]
struct KnownTouch {
    stance: Stance,
    /// Readings at [`TIMES`] times, in deviations.
    felt: Vec<f32>,
    /// Answer of the recogniser.
    answer: Pmf,
}

/// Grasps of known objects in known poses, for one recogniser that did not learn from them.
#[derive(Clone, Debug)]
pub struct TouchLibrary {
    /// Those of each class, each also with both fingers exchanged.
    touches: Vec<Vec<KnownTouch>>,
    scale: Scale,
}

/// Scale on which readings are compared.
#[derive(Clone, Debug)]
struct Scale {
    /// End of the last time (s).
    end_s: f32,
    /// Start of the logarithmic range of each channel; 0 for a linear one.
    knees: Vec<f32>,
    /// Deviation of each channel over all grasps and times.
    deviations: Vec<f32>,
}

impl Scale {
    /// Readings at all times.
    fn felt(&self, grasp: &Sequence) -> Vec<f32> {
        let width = self.knees.len();
        let mut felt = Vec::with_capacity(TIMES * width);
        let mut row = 0;
        for k in 0..TIMES {
            let t_s = self.end_s * (FROM + (1.0 - FROM) * k as f32 / (TIMES - 1) as f32);
            while grasp.t_s.get(row + 1).is_some_and(|next| *next <= t_s) {
                row += 1;
            }
            let values = grasp.values.get(row * width..(row + 1) * width).unwrap_or(&[]);
            for (channel, x) in values.iter().enumerate() {
                let knee = self.knees[channel];
                let x = if knee > 0.0 { (x / knee).asinh() } else { *x };
                felt.push(x / self.deviations[channel]);
            }
        }
        felt
    }
}

impl TouchLibrary {
    /// A library of so many classes in these channels: class, pose, readings and answer of each grasp.
    pub fn new(channels: &[String], classes: usize, grasps: &[(usize, Stance, &Sequence, Pmf)]) -> Self {
        let width = channels.len();
        let readings = |channel: usize| {
            let of = move |grasp: &&Sequence| {
                grasp.values.iter().skip(channel).step_by(width.max(1)).copied().collect::<Vec<f32>>()
            };
            grasps.iter().map(|(_, _, grasp, _)| *grasp).collect::<Vec<_>>().iter().flat_map(of).collect::<Vec<f32>>()
        };
        // Forces and pressures span decades; a twentieth of the largest is a light touch.
        let knee = |channel: usize| match channels[channel].starts_with("curvature") {
            true => 0.0,
            false => 0.05 * readings(channel).into_iter().fold(0.0, f32::max),
        };
        let mut ends: Vec<f32> = grasps.iter().filter_map(|(_, _, grasp, _)| grasp.t_s.last().copied()).collect();
        ends.sort_by(f32::total_cmp);
        let end_s = ends.get(ends.len() / 2).copied().unwrap_or(1.0);
        let mut scale = Scale { end_s, knees: (0..width).map(knee).collect(), deviations: vec![1.0; width] };
        let raw: Vec<Vec<f32>> = grasps.iter().map(|(_, _, grasp, _)| scale.felt(grasp)).collect();
        let deviation = |channel: usize| {
            let all = || raw.iter().flat_map(move |felt| felt.iter().skip(channel).step_by(width));
            let count = all().count().max(1) as f32;
            let mean = all().sum::<f32>() / count;
            (all().map(|x| (x - mean) * (x - mean)).sum::<f32>() / count).sqrt().max(f32::MIN_POSITIVE)
        };
        scale.deviations = (0..width).map(deviation).collect();
        let counterparts = mirror(channels).unwrap_or_else(|| (0..width).collect());
        let half_turn = GripperMove { turn_deg: 180.0, ..GripperMove::default() };
        let mut touches = vec![Vec::new(); classes];
        for (class, stance, grasp, answer) in grasps {
            let felt = scale.felt(grasp);
            let exchanged = (0..felt.len()).map(|k| felt[k / width * width + counterparts[k % width]]).collect();
            let answer = || answer.clone();
            touches[*class].push(KnownTouch { stance: *stance, felt, answer: answer() });
            touches[*class].push(KnownTouch { stance: stance.moved(&half_turn), felt: exchanged, answer: answer() });
        }
        Self { touches, scale }
    }

    /// Touches of a class in the nearest stances, nearest first, by their index.
    fn nearest(&self, class: usize, stance: &Stance) -> Vec<usize> {
        let mut nearest: Vec<(f64, usize)> = Vec::with_capacity(NEAREST + 1);
        for (touch, own) in self.touches[class].iter().enumerate() {
            let distance2 = own.stance.distance2(stance);
            if nearest.len() < NEAREST || nearest.last().is_some_and(|(most, _)| distance2 < *most) {
                let at = nearest.partition_point(|(own, _)| *own <= distance2);
                nearest.insert(at, (distance2, touch));
                nearest.truncate(NEAREST);
            }
        }
        nearest.into_iter().map(|(_, touch)| touch).collect()
    }
}

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
pub struct Guide<'a> {
    library: &'a TouchLibrary,
    hypotheses: Vec<Hypothesis>,
}

impl<'a> Guide<'a> {
    /// Before the first grasp.
    pub fn new(library: &'a TouchLibrary) -> Self {
        Self { library, hypotheses: Vec::new() }
    }

    /// Takes in the readings of a grasp, `by` the move of the gripper since the one before.
    pub fn felt(&mut self, grasp: &Sequence, by: &GripperMove) {
        let felt = self.library.scale.felt(grasp);
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

    #[test]
    fn a_stance_after_a_move_is_that_of_the_scene_after_it() {
        let mut from = scene(20.0, [0.003, -0.002, 0.004]);
        from.object.rotation_deg = [90.0, 10.0, -30.0];
        let mut nominal = Scene::default();
        nominal.pose.shift = [0.008; 3];
        let all = GripperMove::all(&from, &nominal);
        assert!(
            all.len() > 100 && all.iter().any(|(by, _)| *by == GripperMove { lift: -0.004, ..GripperMove::default() })
        );
        for (by, after) in all {
            let (own, wanted) = (Stance::of(&from).moved(&by), Stance::of(&after));
            assert!(own.distance2(&wanted) < 1e-9, "{by:?}: {own:?}, {wanted:?}");
            let mount = &after.gripper.mount;
            assert!(mount.offset.iter().all(|x| x.abs() <= 0.008 + 1e-9) && mount.yaw_deg.abs() <= 180.0);
        }
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
        let mut guide = Guide::new(&library);
        guide.felt(&readings[0], &GripperMove::default());
        let moves = [0.0, 90.0].map(|turn_deg| GripperMove { turn_deg, ..GripperMove::default() });
        let [stay, turn] = guide.expected_entropy(&Pmf::from_weights([0.5, 0.5]), &moves)[..] else { panic!("two") };
        assert!(turn < stay - 0.1 && stay <= 2.0_f64.ln() + 1e-9, "{stay} and {turn}");

        // Once it is felt across, the belief tells the object, and the guide where it is gripped.
        guide.felt(&readings[1], &moves[1]);
        let sure = Pmf::from_weights([1.0, 0.0]);
        assert!(guide.expected_entropy(&sure, &moves).iter().all(|entropy| *entropy < 1e-3));
    }
}
