//! Dynamics of one planar finger: inertia, bias forces, stiffness and damping of the chain.
//!
//! With joint angles q, rigid segments l of mass m_l, inertia I_l and centre c_l, joints at p_i (finger plane):
//!
//! - inertia  M_ij = sum over l >= max(i, j) of  m_l (c_l - p_i) . (c_l - p_j) + I_l
//! - bias     b_i  = sum over l >= i of  (c_l - p_i) x m_l a_l,  a_l the acceleration at zero joint acceleration
//!   with gravity taken as an upward acceleration of the base (d'Alembert)
//! - implicit A    = M + h C + h² K,  C and K diagonal
//!
//! A cross product here is the generalised force of a planar force f at r from a joint that turns x into y... in
//! the finger plane theta grows from "along" towards "inward", so that it reads r.y f.x - r.x f.y.

use super::hessian::Lanes;
use crate::gripper::{Finger, Pad, SegmentPose, bend};
use glam::DVec2;

/// A segment of both fingers, each in its plane: x, y.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BothSegments {
    /// Starts (m).
    pub(super) start: [Lanes; 2],
    /// Unit vectors towards the tips.
    pub(super) along: [Lanes; 2],
}

impl BothSegments {
    #[cfg(any(test, feature = "rapier"))]
    pub(super) fn pair(left: &SegmentPose, right: &SegmentPose) -> Self {
        let lanes = |a: DVec2, b: DVec2| [Lanes::new([a.x, b.x]), Lanes::new([a.y, b.y])];
        Self { start: lanes(left.start, right.start), along: lanes(left.along, right.along) }
    }

    /// The segment of one finger.
    pub(super) fn of(&self, finger: usize) -> SegmentPose {
        let point = |[x, y]: [Lanes; 2]| DVec2::new(x.to_array()[finger], y.to_array()[finger]);
        SegmentPose { start: point(self.start), along: point(self.along) }
    }

    fn centre(&self, length: f64) -> [Lanes; 2] {
        [self.start[0] + self.along[0] * (0.5 * length), self.start[1] + self.along[1] * (0.5 * length)]
    }
}

/// Constants of a chain; both fingers share them.
#[derive(Clone, Debug)]
pub(super) struct ChainModel {
    /// Joints, N.
    pub(super) joints: usize,
    /// Lengths of the N + 1 segments (m).
    pub(super) lengths: Vec<f64>,
    /// Masses of the segments (kg).
    pub(super) masses: Vec<f64>,
    /// Inertias of the segments about their own centres (kg m²).
    pub(super) inertias: Vec<f64>,
    /// Stiffness of each joint (N m/rad).
    pub(super) stiffness: f64,
    /// Damping of each joint (N m s/rad).
    pub(super) damping: f64,
    /// Largest angle of each joint, either way (rad).
    pub(super) angle_limit: f64,
    /// Stiffness of a joint beyond its limit (N m/rad).
    pub(super) limit_stiffness: f64,
}

/// Beyond its limit a joint is this much stiffer: bellows that have closed up are solid rubber.
const LIMIT_STIFFENING: f64 = 100.0;

impl ChainModel {
    pub(super) fn new(finger: &Finger, pad: &Pad) -> Self {
        let lengths: Vec<f64> = finger.segment_lengths().collect();
        let thickness = finger.back + pad.thickness;
        let masses: Vec<f64> = lengths.iter().map(|l| finger.mass * l / finger.length).collect();
        let inertias = masses.iter().zip(&lengths).map(|(m, l)| m * (l * l + thickness * thickness) / 12.0).collect();
        Self {
            joints: finger.joints,
            stiffness: finger.joint_stiffness(),
            damping: finger.joint_damping(),
            angle_limit: finger.curvature_limit * finger.segment_length(),
            limit_stiffness: LIMIT_STIFFENING * finger.joint_stiffness(),
            lengths,
            masses,
            inertias,
        }
    }

    /// Lays out the segments; returns the tip.
    pub(super) fn bend(&self, q: &[f64], segments: &mut [SegmentPose]) -> DVec2 {
        bend(&self.lengths, q, segments)
    }

    /// Centre of a segment (m).
    pub(super) fn centre(&self, segments: &[SegmentPose], j: usize) -> DVec2 {
        segments[j].point(0.5 * self.lengths[j], 0.0)
    }

    /// Lays out the segments of both fingers at 2 N angles.
    pub(super) fn bend_both(&self, q: &[f64], both: &mut [BothSegments]) {
        let n = self.joints;
        let (mut start, mut angle) = ([Lanes::ZERO; 2], Lanes::ZERO);
        for (j, (segment, length)) in both.iter_mut().zip(&self.lengths).enumerate() {
            if j > 0 {
                angle += Lanes::new([q[j - 1], q[n + j - 1]]);
            }
            let (sin, cos) = angle.sin_cos();
            *segment = BothSegments { start, along: [sin, cos] };
            start = [start[0] + sin * *length, start[1] + cos * *length];
        }
    }

    /// Fills the inertia matrices M of both fingers (N x N, both triangles) for the current layout.
    pub(super) fn inertia(&self, both: &[BothSegments], m: &mut [Lanes]) {
        let n = self.joints;
        // Composite of the segments from the tip inward: mass, first and second moment about the plane's origin.
        let (mut mass, mut first, mut second) = (0.0, [Lanes::ZERO; 2], Lanes::ZERO);
        for i in (0..n).rev() {
            let link = i + 1;
            let [x, y] = both[link].centre(self.lengths[link]);
            mass += self.masses[link];
            first = [first[0] + x * self.masses[link], first[1] + y * self.masses[link]];
            second += (x * x + y * y) * self.masses[link] + self.inertias[link];
            let [x, y] = both[link].start;
            // second - (p_i + p_j) . first + mass p_i . p_j
            let at_i = second - (x * first[0] + y * first[1]);
            let per_j = [x * mass - first[0], y * mass - first[1]];
            for (j, segment) in both[1..=link].iter().enumerate() {
                let [x, y] = segment.start;
                let value = at_i + (x * per_j[0] + y * per_j[1]);
                m[i * n + j] = value;
                m[j * n + i] = value;
            }
        }
    }

    /// Gives `put` the bias torque of each joint: Coriolis, centrifugal and gravity (`gravity` in the finger planes (m/s²)),
    /// for a step of h (s). Forces that grow with the square of the rates are explicit; to be no source of energy where a
    /// segment turns by a radian within a step, they are divided by 1 + (h w)², w the fastest turn of a segment.
    pub(super) fn bias(
        &self,
        both: &[BothSegments],
        (rates, h): (impl Fn(usize) -> Lanes, f64),
        gravity: [Lanes; 2],
        accelerations: &mut [[Lanes; 2]],
        mut put: impl FnMut(usize, Lanes),
    ) {
        let n = self.joints;
        let (mut turn, mut fastest) = (Lanes::ZERO, Lanes::ZERO);
        for i in 0..n {
            turn += rates(i);
            fastest = fastest.max(turn.abs());
        }
        let turned = fastest * h;
        let share = Lanes::ONE / (turned * turned + Lanes::ONE);
        let mut at_start = [-gravity[0], -gravity[1]];
        let mut rate = Lanes::ZERO;
        for link in 1..=n {
            rate += rates(link - 1);
            let pull = share * rate * rate * self.lengths[link];
            let [x, y] = both[link].along;
            let inward_pull = [x * pull, y * pull];
            accelerations[link] = [at_start[0] - inward_pull[0] * 0.5, at_start[1] - inward_pull[1] * 0.5];
            at_start = [at_start[0] - inward_pull[0], at_start[1] - inward_pull[1]];
        }
        let (mut force, mut moment) = ([Lanes::ZERO; 2], Lanes::ZERO);
        for i in (0..n).rev() {
            let link = i + 1;
            let f = accelerations[link].map(|a| a * self.masses[link]);
            force = [force[0] + f[0], force[1] + f[1]];
            let ([x, y], [start_x, start_y]) = (both[link].centre(self.lengths[link]), both[link].start);
            moment += y * f[0] - x * f[1];
            put(i, moment - (start_y * force[0] - start_x * force[1]));
        }
    }

    /// Torque (N m) with which a joint at angle `q` resists beyond its limit, and its slope (N m/rad).
    #[inline]
    pub(super) fn limit_torque(&self, q: f64) -> (f64, f64) {
        let beyond = q.abs() - self.angle_limit;
        if beyond <= 0.0 { (0.0, 0.0) } else { (self.limit_stiffness * beyond * q.signum(), self.limit_stiffness) }
    }
}

/// Generalised force of a planar force at r: positive when it turns "along" towards "inward".
#[inline]
pub(super) fn turning(r: DVec2, f: DVec2) -> f64 {
    r.y * f.x - r.x * f.y
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(joints: usize) -> ChainModel {
        ChainModel::new(&Finger { joints, ..Finger::default() }, &Pad::default())
    }

    /// Kinetic energy straight from segment velocities.
    fn kinetic_energy(model: &ChainModel, q: &[f64], qd: &[f64]) -> f64 {
        let mut segments = vec![SegmentPose::default(); model.joints + 1];
        model.bend(q, &mut segments);
        let (mut at_start, mut rate, mut energy) = (DVec2::ZERO, 0.0, 0.0);
        for link in 1..=model.joints {
            rate += qd[link - 1];
            let swing = segments[link].inward() * rate;
            let centre = at_start + swing * (0.5 * model.lengths[link]);
            energy += 0.5 * (model.masses[link] * centre.length_squared() + model.inertias[link] * rate * rate);
            at_start += swing * model.lengths[link];
        }
        energy
    }

    fn alike(segments: &[SegmentPose]) -> Vec<BothSegments> {
        segments.iter().map(|segment| BothSegments::pair(segment, segment)).collect()
    }

    /// The number of both fingers, which is one.
    fn one(lanes: Lanes) -> f64 {
        let [left, right] = lanes.to_array();
        assert_eq!(left, right);
        left
    }

    fn inertia_of_one(model: &ChainModel, segments: &[SegmentPose]) -> Vec<f64> {
        let mut lanes = vec![Lanes::ZERO; model.joints * model.joints];
        model.inertia(&alike(segments), &mut lanes);
        lanes.into_iter().map(one).collect()
    }

    fn bias_of_one(model: &ChainModel, segments: &[SegmentPose], qd: &[f64], gravity: DVec2) -> Vec<f64> {
        let (mut accelerations, mut bias) = (vec![[Lanes::ZERO; 2]; model.joints + 1], vec![0.0; model.joints]);
        let rates = |i: usize| Lanes::splat(qd[i]);
        let gravity = [gravity.x, gravity.y].map(Lanes::splat);
        model.bias(&alike(segments), (rates, 0.0), gravity, &mut accelerations, |i, lanes| bias[i] = one(lanes));
        bias
    }

    #[test]
    fn both_fingers_bend_like_one() {
        let model = chain(7);
        let q: Vec<f64> = (0..14).map(|i| 0.1 * f64::from(i) - 0.6).collect();
        let mut both = vec![BothSegments::default(); 8];
        model.bend_both(&q, &mut both);
        for finger in 0..2 {
            let mut segments = vec![SegmentPose::default(); 8];
            model.bend(&q[7 * finger..7 * (finger + 1)], &mut segments);
            for (segment, both) in segments.iter().zip(&both) {
                let got = both.of(finger);
                assert!(got.start.abs_diff_eq(segment.start, 1e-14) && got.along.abs_diff_eq(segment.along, 1e-14));
            }
        }
    }

    #[test]
    fn inertia_gives_the_kinetic_energy() {
        let model = chain(7);
        let q: Vec<f64> = (0..7).map(|i| 0.1 * f64::from(i) - 0.2).collect();
        let qd: Vec<f64> = (0..7).map(|i| (f64::from(i) * 1.7).sin()).collect();
        let mut segments = vec![SegmentPose::default(); 8];
        model.bend(&q, &mut segments);
        let m = inertia_of_one(&model, &segments);
        let quadratic: f64 =
            (0..7).flat_map(|i| (0..7).map(move |j| (i, j))).map(|(i, j)| 0.5 * qd[i] * m[i * 7 + j] * qd[j]).sum();
        let direct = kinetic_energy(&model, &q, &qd);
        assert!((quadratic / direct - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bias_obeys_lagrange() {
        // d/dt (dT/dqd) - dT/dq at zero joint acceleration: sum_j dM_ij/dt qd_j - dT/dq_i, by central differences.
        let n = 5;
        let model = chain(n);
        let q: Vec<f64> = (0..n).map(|i| 0.3 - 0.1 * i as f64).collect();
        let qd: Vec<f64> = (0..n).map(|i| 2.0 + (i as f64 * 1.1).cos()).collect();
        let momentum = |q: &[f64]| -> Vec<f64> {
            let mut segments = vec![SegmentPose::default(); n + 1];
            model.bend(q, &mut segments);
            let m = inertia_of_one(&model, &segments);
            (0..n).map(|i| (0..n).map(|j| m[i * n + j] * qd[j]).sum()).collect()
        };
        let step = 1e-6;
        let moved = |sign: f64| -> Vec<f64> { q.iter().zip(&qd).map(|(q, v)| q + sign * step * v).collect() };
        let (ahead, behind) = (momentum(&moved(1.0)), momentum(&moved(-1.0)));
        let mut segments = vec![SegmentPose::default(); n + 1];
        model.bend(&q, &mut segments);
        let bias = bias_of_one(&model, &segments, &qd, DVec2::ZERO);
        for i in 0..n {
            let shifted = |sign: f64| {
                let mut q = q.clone();
                q[i] += sign * step;
                kinetic_energy(&model, &q, &qd)
            };
            let slope = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
            let want = (ahead[i] - behind[i]) / (2.0 * step) - slope;
            assert!((bias[i] - want).abs() < 1e-9, "joint {i}: {} instead of {want}", bias[i]);
        }
    }

    #[test]
    fn a_straight_hanging_finger_has_no_gravity_torque() {
        let model = chain(10);
        let mut segments = vec![SegmentPose::default(); 11];
        model.bend(&[0.0; 10], &mut segments);
        let bias = bias_of_one(&model, &segments, &[0.0; 10], DVec2::new(0.0, 9.81));
        assert!(bias.iter().all(|b| b.abs() < 1e-18));
        // Held out level by gravity across it, the first joint carries the weight of 95 mm at its middle.
        let bias = bias_of_one(&model, &segments, &[0.0; 10], DVec2::new(9.81, 0.0));
        let want = -0.95 * 0.030 * 9.81 * 0.5 * 0.095;
        assert!((bias[0] / want - 1.0).abs() < 1e-12);
    }
}
