//! How much a contact spring has to shrink to be clear of a surface.
//!
//! A spring is a piece of rubber between its foot and the skin: at rest a spheroid about the foot, with half-axes H along
//! its axis and w = sqrt(ρ H) across, ρ the radius at its tip. What presses makes it smaller: it shrinks towards its foot
//! by one factor in all directions, the stretch λ, just so far that it is clear of the surface. Its energy is that of
//! the pad's law at this stretch,
//!
//! ```text
//! U = E a H ψ(λ)          head-on on a flat surface: λ = 1 - x / H, the law itself
//! ```
//!
//! which depends on nothing but where the surface is. The force is its gradient, so that springs which slide around an
//! edge and back do no work. A law that shares the load between the axis and the sides, and lets it act where the axis
//! meets the surface, is no gradient: undamped fingers that bounced on a ball gained energy, whatever the step. Nor does
//! any spring give way to one side or the other of a thin body, or jump between them: the nearer the foot, the harder it
//! presses.
//!
//! A spheroid that is longer than wide is the union of balls about its axis. That of stretch λ has balls with centre z
//! and radius sqrt(ρ (H λ² - z² / (H - ρ))). With φ(z) the distance of the place z on the axis from the surface,
//!
//! ```text
//! H λ² = min over z of  z² / (H - ρ) + φ(z)² / ρ          force = -dU/dλ / L along the normal,  L = ρ H λ / φ
//! ```
//!
//! where L is the length by which the law is scaled: H head-on, w sideways. Only distances are needed. For a convex body
//! φ is convex, the minimum is one, and λ changes smoothly, whatever its edges; objects have no hollows in which there
//! could be two (see `hollows.rs` of `palpate-geometry`).

use glam::DVec3;

/// A contact spring beside a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpringAtRest {
    /// Its foot, in the frame of the distance (m).
    pub(super) foot: DVec3,
    /// Unit vector from the foot to the tip.
    pub(super) axis: DVec3,
    /// Length from foot to tip, H (m).
    pub(super) height: f64,
    /// Radius at the tip, ρ (m); less than H.
    pub(super) end: f64,
}

/// Place of a surface beside a contact spring.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Compression along the normal, (1 - λ) L (m); negative while apart.
    pub(super) compression: f64,
    /// Length of which it is a share, L (m).
    pub(super) length: f64,
    /// Outward normal of the surface.
    pub(super) normal: DVec3,
    /// Place on the surface (m).
    pub(super) point: DVec3,
}

/// Where a contact spring's foot is.
#[derive(Clone, Copy, Debug)]
pub(super) enum Met {
    /// Beside the surface.
    Outside(Touch),
    /// So close to a surface behind it that it may have come through.
    InFrontOf(Touch),
    /// Inside.
    Inside,
}

/// Steps along the axis this short (m) change nothing.
const CLOSE: f64 = 1e-9;
/// Steps this short (m) are taken by what is known. At an edge that begins in between, the normal is then off by 5e-4 at
/// most.
const NEAR: f64 = 1e-6;
/// Iterations, at most; one on a flat surface met head-on, else two or three.
const MOST_STEPS: usize = 32;
/// Cosine between axis and normal from which on a surface lies behind the foot.
const BEHIND: f64 = 0.7;
/// Least cosine between the axis and a surface that the foot has gone through.
const LEAST_COSINE: f64 = 0.2;
/// Steps of the way back out, and the shortest (m).
const MOST_STEPS_BACK: usize = 64;
const SHORTEST_STEP_BACK: f64 = 1e-5;

impl SpringAtRest {
    /// The touch of a surface, given by its distance and the gradient of the distance; `None` where the gap along the
    /// normal is larger than `margin` (m). `distance` is that of the foot (m), or a lower bound.
    #[inline]
    pub(super) fn meet(&self, distance: f64, margin: f64, surface: impl Fn(DVec3) -> (f64, DVec3)) -> Option<Met> {
        if distance > self.height + margin {
            return None;
        }
        if distance <= 0.0 {
            return Some(Met::Inside);
        }
        let (stem, end) = (self.height - self.end, self.end);
        // Where a flat surface is met head-on.
        let mut z = distance * stem / self.height;
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut before: Option<(f64, f64, DVec3)> = None;
        for _ in 0..MOST_STEPS {
            let (gap, slope) = surface(self.foot + self.axis * z);
            if gap <= 0.0 {
                if z == 0.0 {
                    return Some(Met::Inside);
                }
                (high, z, before) = (z, 0.5 * (low + z), None);
                continue;
            }
            // Half the derivative of z² / stem + φ² / end, and half its second derivative.
            let along = slope.dot(self.axis);
            let half_slope = z / stem + gap * along / end;
            let squared = slope.length_squared();
            let curvature = match before {
                Some((z_before, slope_before, _)) => {
                    // Not `clamp`, which panics where a surface has no slope.
                    let curvature = (half_slope - slope_before) / (z - z_before);
                    curvature.max(1.0 / stem).min(1.0 / stem + 4.0 * squared / end)
                }
                None => {
                    if self.is_beyond(margin, distance, (z, gap)) {
                        return None;
                    }
                    let bend = 2.0 * gap * (distance - gap + along * z) / (z * z).max(f64::MIN_POSITIVE);
                    let bend = bend.clamp(0.0, (squared - along * along).max(0.0));
                    1.0 / stem + (along * along + bend) / end
                }
            };
            if half_slope > 0.0 {
                high = z;
            } else {
                low = z;
            }
            let newton = (z - half_slope / curvature).max(0.0);
            let next = if newton < low || newton > high { 0.5 * (low + high) } else { newton };
            let step = next - z;
            // The last step is taken without another look, by the slope and its change.
            let turn =
                before.filter(|_| step.abs() <= NEAR).map(|(z_before, _, before)| (slope - before) / (z - z_before));
            if let Some(turn) = turn.or((step.abs() <= CLOSE).then_some(DVec3::ZERO)) {
                let gap = gap + step * (along + 0.5 * step * turn.dot(self.axis));
                let touch = self.touch(next, gap, slope + turn * step);
                let in_front = next <= CLOSE && along > BEHIND && gap < end;
                let met = if in_front { Met::InFrontOf(touch) } else { Met::Outside(touch) };
                return (touch.compression > -margin).then_some(met);
            }
            before = Some((z, half_slope, slope));
            z = next;
        }
        None
    }

    /// True where distances known at the foot and at z, which change no faster than by the way, leave a gap larger than
    /// `margin` (m).
    #[inline]
    fn is_beyond(&self, margin: f64, distance: f64, (z, gap): (f64, f64)) -> bool {
        let (stem, end) = (self.height - self.end, self.end);
        let nearest = 0.5 * (distance - gap + z);
        let before = nearest * nearest / stem + (distance - nearest).powi(2) / end;
        let after = (gap + z).powi(2) / self.height;
        let farthest = 1.0 + margin / (self.height * end).sqrt();
        before.min(after) > self.height * farthest * farthest
    }

    /// The touch at z on the axis, at a distance (m) whose gradient is `slope`.
    #[inline]
    fn touch(&self, z: f64, gap: f64, slope: DVec3) -> Touch {
        let stretch = ((z * z / (self.height - self.end) + gap * gap / self.end) / self.height).sqrt();
        let size = slope.length();
        let normal = slope / size;
        let length = self.end * self.height * stretch / (gap * size);
        let point = self.foot + self.axis * z - normal * gap;
        Touch { compression: (1.0 - stretch) * length, length, normal, point }
    }

    /// The foot has come into a body, or through a thin one: the spring is compressed down to where it went in, and pushes
    /// back the way it came. `gap` is the distance of the foot (m). `None` where there is nothing on the way back.
    #[cold]
    pub(super) fn trace_back(&self, mut gap: f64, surface: impl Fn(DVec3) -> (f64, DVec3)) -> Option<Touch> {
        let farthest = 2.0 * gap.max(0.0);
        let (mut back, mut entered) = (0.0, gap <= 0.0);
        for _ in 0..MOST_STEPS_BACK {
            if entered && gap > 0.0 {
                break;
            }
            back += gap.abs().max(SHORTEST_STEP_BACK);
            gap = surface(self.foot - self.axis * back).0;
            entered |= gap <= 0.0;
            if !entered && back > farthest {
                return None;
            }
        }
        let point = self.foot - self.axis * back;
        let (gap, slope) = surface(point);
        let normal = slope.normalize_or(-self.axis);
        let cosine = (-normal.dot(self.axis)).max(LEAST_COSINE);
        let compression = (self.height + back) * cosine - gap;
        Some(Touch { compression, length: self.height * cosine, normal, point })
    }

    /// The foot is inside something too thick to be passed, which pushes it out the shortest way.
    #[cold]
    pub(super) fn push_out(&self, surface: impl Fn(DVec3) -> (f64, DVec3)) -> Touch {
        let (distance, slope) = surface(self.foot);
        let normal = slope.normalize_or(-self.axis);
        let point = self.foot - normal * distance;
        Touch { compression: self.height - distance, length: self.height, normal, point }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use palpate_geometry::Primitive;
    use proptest::prelude::*;

    const H: f64 = 0.008;
    const END: f64 = 0.002;

    fn spring() -> SpringAtRest {
        SpringAtRest { foot: DVec3::ZERO, axis: DVec3::Z, height: H, end: END }
    }

    /// A primitive somewhere.
    #[derive(Clone, Copy, Debug)]
    struct Placed(Primitive, DQuat, DVec3);

    impl Placed {
        fn surface(&self, p: DVec3) -> (f64, DVec3) {
            let local = self.1.inverse() * (p - self.2);
            (self.0.distance(local), self.1 * self.0.gradient(local))
        }

        fn meet(&self) -> Option<Touch> {
            match spring().meet(self.surface(DVec3::ZERO).0, H, |p| self.surface(p)) {
                Some(Met::Outside(touch) | Met::InFrontOf(touch)) => Some(touch),
                Some(Met::Inside) | None => None,
            }
        }

        fn stretch(&self) -> f64 {
            self.meet().map_or(2.0, |touch| 1.0 - touch.compression / touch.length)
        }
    }

    /// A plane at a distance from the foot, its normal turned by an angle from the axis.
    fn plane(distance: f64, angle: f64) -> Option<Touch> {
        let normal = DVec3::new(angle.sin(), 0.0, -angle.cos());
        match spring().meet(distance, H, |p| (distance + normal.dot(p), normal)) {
            Some(Met::Outside(touch) | Met::InFrontOf(touch)) => Some(touch),
            Some(Met::Inside) | None => None,
        }
    }

    #[test]
    fn a_plane_is_met_by_the_spheroid_that_it_touches() {
        // A spheroid reaches L = sqrt(H² cos² + w² sin²) in a direction, w² = ρ H.
        for angle in [0.0_f64, 0.3, 0.8, 1.3, 1.57] {
            let reach = ((H * angle.cos()).powi(2) + END * H * angle.sin().powi(2)).sqrt();
            for share in [0.1, 0.5, 0.99, 1.1] {
                let touch = plane(share * reach, angle).expect("near");
                assert!((touch.length / reach - 1.0).abs() < 1e-9, "{angle} {share}: {}", touch.length);
                assert!((touch.compression / ((1.0 - share) * reach) - 1.0).abs() < 1e-8, "{angle} {share}");
                let beyond = touch.point - DVec3::Z * touch.point.z;
                let at = (touch.point.z / H).powi(2) + beyond.length_squared() / (END * H);
                assert!((at.sqrt() / share - 1.0).abs() < 1e-9, "the place lies on the spheroid");
            }
        }
    }

    #[test]
    fn a_needle_is_pressed_from_the_side_that_it_comes_from() {
        let needle = |x: f64| {
            Placed(Primitive::Capsule { radius: 1e-4, half_length: 0.05 }, DQuat::IDENTITY, DVec3::new(x, 0.0, 0.004))
        };
        let (left, right) = (needle(-0.001).meet().expect("touched"), needle(0.001).meet().expect("touched"));
        assert!(left.normal.x > 0.9 && right.normal.x < -0.9, "{left:?} {right:?}");
        assert!((left.compression - right.compression).abs() < 1e-12);
    }

    #[test]
    fn a_foot_inside_or_behind_is_pushed_back_the_way_it_came() {
        let half = DVec3::new(0.05, 0.05, 5e-4);
        for depth in [1e-4, 4e-4, 9e-4, 1.3e-3] {
            // The plate's lower face lies `depth` below the foot.
            let plate = Placed(Primitive::Cuboid { half }, DQuat::IDENTITY, DVec3::Z * (half.z - depth));
            let distance = plate.surface(DVec3::ZERO).0;
            let touch = match spring().meet(distance, H, |p| plate.surface(p)).expect("near") {
                Met::Inside | Met::InFrontOf(_) => spring().trace_back(distance, |p| plate.surface(p)).expect("found"),
                Met::Outside(touch) => panic!("{touch:?}"),
            };
            assert!((touch.compression - H - depth).abs() < 2e-5 && touch.normal.z < -0.99, "{depth}: {touch:?}");
        }
    }

    fn some_body() -> impl Strategy<Value = Placed> {
        let shape = prop_oneof![
            (0.003..0.03).prop_map(|radius| Primitive::Sphere { radius }),
            [0.001..0.02, 0.001..0.02, 0.001..0.02].prop_map(|half| Primitive::Cuboid { half: half.into() }),
            (0.002..0.02, 0.001..0.02).prop_map(|(radius, half_length)| Primitive::Cylinder { radius, half_length }),
        ];
        (shape, [-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0], [-0.02..0.02, -0.02..0.02, -0.005..0.03]).prop_map(
            |(shape, turn, at)| {
                let turn = DQuat::from_array(turn);
                Placed(shape, if turn.length() > 0.1 { turn.normalize() } else { DQuat::IDENTITY }, at.into())
            },
        )
    }

    proptest! {
        #[test]
        fn the_stretch_is_the_least_over_the_axis(body in some_body()) {
            let touched = body.surface(DVec3::ZERO).0 > 1e-5 && body.stretch() < 1.5;
            prop_assume!(touched);
            let at = |z: f64| {
                let gap = body.surface(DVec3::Z * z).0.max(0.0);
                ((z * z / (H - END) + gap * gap / END) / H).sqrt()
            };
            // The least of even steps, then of finer ones beside it.
            let least_of = |from: f64, step: f64, count: u32| {
                let steps = (0..=count).map(|k| from + f64::from(k) * step).map(|z| (at(z), z));
                steps.min_by(|a, b| a.0.total_cmp(&b.0)).expect("steps")
            };
            let (_, near) = least_of(0.0, 1e-6, 20_000);
            let (least, _) = least_of((near - 1e-6).max(0.0), 1e-9, 2_000);
            prop_assert!((body.stretch() - least).abs() < 3e-6, "{} instead of {least}", body.stretch());
        }

        /// Along edges and around corners.
        #[test]
        fn the_force_is_the_gradient_of_the_stretch(body in some_body(), way in [-1.0..1.0, -1.0..1.0, -1.0..1.0], turn in [-1.0..1.0, -1.0..1.0, -1.0..1.0]) {
            let touched = body.surface(DVec3::ZERO).0 > 2e-4 && body.stretch() < 1.3;
            prop_assume!(touched);
            let touch = body.meet().expect("touched");
            let (way, turn, step) = (DVec3::from(way), DVec3::from(turn) * 100.0, 1e-7);
            let moved = |share: f64| {
                let turned = DQuat::from_scaled_axis(turn * share);
                Placed(body.0, turned * body.1, turned * body.2 + way * share).stretch()
            };
            let slope = (moved(step) - moved(-step)) / (2.0 * step);
            let speed = way + turn.cross(touch.point);
            let want = -touch.normal.dot(speed) / touch.length;
            prop_assert!((slope - want).abs() < 1e-3 * speed.length() / touch.length, "{slope} instead of {want}");
        }
    }
}
