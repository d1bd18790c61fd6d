//! Finding contacts: every contact spring of the pads casts a short ray from its foot along its axis.
//!
//! The ray is thick: a ball of the contact spring's radius moves from the foot outwards by sphere tracing until it
//! touches something. Point samples of a distance field tunnel, since a 1 mm plate or a needle passes between taxels;
//! rays that are as thick as the gaps between contact springs do not.
//!
//! With the rest position of the ball's centre at s and the touch at t, the spring would have to give way by x = s - t
//! along its axis u, or by c x along the surface normal n, c = -n . u; apart, it is the same number below zero. Rubber
//! gives way along its axis with the stiffness k of its law, and sideways with G / E of that, k / 3. Of all ways that
//! keep the ball outside, the one of least energy shares the load between both, which are springs in series along n:
//!
//! ```text
//! 1 / k_n = c² / k + (1 - c²) / (k / 3)          force k_n c x along n
//! ```
//!
//! Head-on this is the law itself; a spring that grazes an edge leans on it with its side, and slips off without a
//! jump. A spring that could not give way sideways would press with k x / c, thrown off and springing back step by
//! step, without end.
//!
//! The force acts where the axis touches. Energy would be conserved where the end sits in the way of least energy, beside
//! that by 3 x sqrt(1 - c²) for small angles, with the surface's normal there: undamped fingers that bounce on a round
//! object with the sides of their tips gain and lose energy, whatever the step (hard case "passive swing"). Finding that
//! place by one to four rounds of projection onto the surface cures it, but at an edge the rounds jump from one side to
//! the other, and more holds chatter.
//!
//! Distances, normals and arms are those of the layout in the workspace, which is ahead of the state; see
//! [`super::step`].

use super::contact::{Acting, Against, Contact, SHEAR_SHARE};
use super::effects::{FingerContact, Shell};
use super::environment::Environment;
use super::finger_pair::{Fronts, OtherFinger, in_series};
use super::model::{Body, PhysicsModel};
use super::spatial::Spatial;
use super::state::State;
use super::workspace::Workspace;
use crate::gripper::{FingerPlane, PadLaw, SegmentPose};
use glam::{DMat3, DVec3};
use palpate_geometry::Pose;

/// Gaps up to this are contacts in waiting even when nothing moves (m).
const STILL_MARGIN: f64 = 2e-4;
/// Speed gained within a step that a contact in waiting allows for (m/s).
const SPEED_MARGIN: f64 = 0.1;
/// Factor on the speed within one step up to which contacts are found in time.
const SPEED_FACTOR: f64 = 1.5;

/// A surface that a contact spring has met.
struct Hit {
    /// Compression along the surface normal (m), negative while apart.
    compression: f64,
    /// Outward normal of the surface, unit length.
    normal: DVec3,
    /// Counterpart that is met.
    point: DVec3,
    /// Cosine between the spring's axis and the surface normal, c: from zero to one.
    cosine: f64,
}

/// Place where a ray meets a surface.
struct Touch {
    /// Way of the ball from the foot (m).
    way: f64,
    /// Centre of the ball there.
    centre: DVec3,
    /// Distance of the ball from the surface (m), about zero, or negative where the foot's own ball overlaps it.
    gap: f64,
    normal: DVec3,
    /// Cosine between the spring's axis and the normal; negative where the surface looks the way that the spring does.
    cosine: f64,
}

/// Cosine below which a spring is taken to meet a surface at this one: lengths along the normal stay finite.
const LEAST_COSINE: f64 = 0.02;

/// Fills `workspace.contacts` with everything that touches or may touch within the step.
pub(super) fn detect(model: &PhysicsModel, state: &State, workspace: &mut Workspace) {
    workspace.contacts.clear();
    let h = workspace.step.h;
    let object = model.body.as_ref().map(|body| Solid::new(body, &workspace.body));
    let (linear, angular) = state.body_velocity(model);
    // Out of the workspace, which the rest of it fills.
    let moved_world = workspace.moved_world.take();
    let environment = moved_world.as_ref().unwrap_or(&model.environment);
    let passing = workspace.passing.velocity.length();
    let pose = object.as_ref().map(|solid| (solid.object_from_gripper, solid.centre));
    let frames = workspace.space.as_ref().map_or(&[][..], |space| &space.frames);
    let world = environment.way_from(&model.environment);
    workspace.clearances.follow(model, (&workspace.segments, frames), pose, world);
    // No segment is farther from its axis than this.
    let reach = model.springs.reach.iter().copied().fold(0.0, f64::max);
    let mut turning: f64 = state.velocity[..model.joint_count()].iter().map(|rate| rate.abs()).sum();
    if let Some(sideways) = &model.sideways {
        turning += sideways.turning(state.sway_rates(model));
    }
    let fastest = state.fastest(model) + turning * reach;
    let farthest = margin(h, fastest + passing);
    workspace.fingers_meet = false;
    let in_space = workspace.space.is_some();
    let may_meet = workspace.clearances.of_fingers() <= margin(h, 2.0 * fastest);
    let fronts = if may_meet { fronts_of_near_fingers(model, workspace) } else { None };
    for finger in 0..2 {
        let first_link = finger * (model.chain.joints + 1);
        for j in 0..=model.chain.joints {
            let link = first_link + j;
            let clear = workspace.clearances.of_link(link) > farthest;
            if clear && fronts.is_none() {
                continue;
            }
            let segment = workspace.segments[link];
            let may_meet = |fronts: &Fronts, margin: f64| {
                let segment = (&segment, workspace.frames().get(link), model.chain.lengths[j]);
                fronts.may_meet(model, finger, segment, margin)
            };
            let any_margin = margin(h, 2.0 * fastest);
            if clear && !fronts.as_ref().is_some_and(|(fronts, _)| may_meet(fronts, any_margin)) {
                continue;
            }
            let half = 0.5 * model.chain.lengths[j];
            let middle = if in_space {
                workspace.frames()[link].point(half, 0.0, 0.0)
            } else {
                model.planes[finger].point(segment.point(half, 0.0), 0.0)
            };
            let reach = model.springs.reach[j] + model.springs.radius;
            let link_velocity = workspace.spatial[link];
            let speed =
                link_velocity.linear_at(middle - workspace.reference).length() + link_velocity.angular.length() * reach;
            let against_world = margin(h, speed + passing);
            let object_speed = linear.length() + object.as_ref().map_or(0.0, |o| angular.length() * o.body.radius);
            let against_object = margin(h, speed + object_speed);
            let to_object = object.as_ref().map_or(f64::INFINITY, |o| o.distance(middle));
            let to_world = environment.distance(middle);
            let near_object = object.as_ref().filter(|_| to_object < reach + against_object);
            let near_world = to_world < reach + against_world;
            let against_finger = fronts.as_ref().and_then(|(fronts, fastest)| {
                let margin = margin(h, speed + fastest[1 - finger]);
                may_meet(fronts, margin).then_some((fronts, margin))
            });
            if near_object.is_none() && !near_world && against_finger.is_none() {
                workspace.clearances.note_link(link, to_object.min(to_world) - reach);
                continue;
            }
            let near = Near {
                solid: object.as_ref(),
                environment,
                object: near_object.map(|o| (o, against_object)),
                world: near_world.then_some(against_world),
                finger: against_finger,
                least_to_world: to_world - reach,
            };
            detect_segment(model, state, workspace, &near, Place { finger, segment_index: j, link, segment });
        }
    }
    if let Some(body) = model.free_body()
        && !environment.is_empty()
    {
        let speed = linear.length() + angular.length() * body.radius + passing;
        detect_resting(model, state, (workspace, environment), body, margin(h, speed));
    }
    workspace.moved_world = moved_world;
}

/// Gap up to which contacts are kept, given the speed of approach (m).
fn margin(h: f64, speed: f64) -> f64 {
    STILL_MARGIN + h * (SPEED_MARGIN + SPEED_FACTOR * speed)
}

/// Counterparts within reach of one segment, and the reach.
struct Near<'a> {
    /// The object, near or not.
    solid: Option<&'a Solid<'a>>,
    environment: &'a Environment,
    object: Option<(&'a Solid<'a>, f64)>,
    world: Option<f64>,
    /// The other finger.
    finger: Option<(&'a Fronts, f64)>,
    /// Distance of the whole segment from the world, at least (m).
    least_to_world: f64,
}

impl Near<'_> {
    /// Largest reach (m).
    fn farthest(&self) -> f64 {
        self.object.map_or(0.0, |(_, margin)| margin).max(self.world.unwrap_or(0.0))
    }

    /// Distances of a point of the segment from the object and from the nearer of object and world (m), or lower bounds,
    /// near or not: what is noted for later must hold when the other one has come near.
    fn distances(&self, p: DVec3) -> (f64, f64) {
        let to_object = self.solid.map_or(f64::INFINITY, |solid| solid.distance(p));
        if self.least_to_world >= to_object {
            return (to_object, to_object);
        }
        (to_object, to_object.min(self.environment.distance(p)))
    }
}

#[derive(Clone, Copy)]
struct Place {
    finger: usize,
    segment_index: usize,
    link: usize,
    segment: SegmentPose,
}

fn detect_segment(model: &PhysicsModel, state: &State, workspace: &mut Workspace, near: &Near<'_>, place: Place) {
    let plane = model.planes[place.finger];
    let in_space = workspace.space.is_some();
    let local_axes = if in_space { workspace.frames()[place.link].axes } else { segment_axes(&plane, &place.segment) };
    for k in model.springs.of_segment(place.segment_index) {
        let spring = &model.springs.all[k];
        let site = place.finger * model.springs.all.len() + k;
        if near.finger.is_none() && workspace.clearances.of_spring(site, place.link) > spring.height + near.farthest() {
            continue;
        }
        let (foot, axis) = if in_space {
            spring.ray_in_space(&workspace.frames()[place.link])
        } else {
            let (foot, axis) = spring.ray(&place.segment);
            (plane.point(foot, spring.across), plane.direction(axis))
        };
        let ray = Ray { foot, axis, radius: model.springs.radius, rest: spring.height - model.springs.radius };
        let finger = near.finger.and_then(|(fronts, margin)| {
            let gap = fronts.least_distance(model, place.finger, foot) - spring.height;
            (in_space || gap <= margin).then_some(margin)
        });
        let (to_object, clearance) = near.distances(ray.foot);
        if finger.is_none() {
            workspace.clearances.note_spring(site, place.link, clearance);
            if clearance > spring.height + near.farthest() {
                continue;
            }
        }
        let on_object = near.object.and_then(|(solid, margin)| ray.cast_solid(solid, to_object, margin));
        let on_world = near.world.and_then(|margin| ray.cast_environment(near.environment, margin));
        let (mut hit, mut against) = match (on_object, on_world) {
            (Some(object), Some(world)) if world.compression > object.compression => (Some(world), Against::World),
            (Some(object), _) => (Some(object), Against::Object),
            (None, world) => (world, Against::World),
        };
        if let Some(margin) = finger {
            let other = OtherFinger::opposite(model, workspace, place.finger, spring.across);
            if let Some(met) = ray.cast_finger(&other, margin) {
                // A contact in waiting gives way to all others.
                let deepest = hit.as_ref().map_or(f64::NEG_INFINITY, |hit| hit.compression.max(0.0));
                if met.compression > deepest {
                    let first_link = (1 - place.finger) * (model.chain.joints + 1);
                    against = Against::Finger((first_link + other.segment(met.point)) as u32);
                    hit = Some(met);
                }
            }
        }
        let Some(hit) = hit else { continue };
        workspace.fingers_meet |= matches!(against, Against::Finger(_));
        let mu = match against {
            Against::Object => model.pad_friction.on_object,
            Against::World => model.pad_friction.on_world,
            Against::Finger(_) => model.pad_friction.on_pad,
        };
        let (stiffness, height) = match against {
            Against::Finger(_) => in_series(spring.stiffness, spring.height),
            _ => (spring.stiffness, spring.height),
        };
        let shear = local_axes * state.touched.shear[site];
        let mut shear_stiffness = SHEAR_SHARE * stiffness;
        // Axial and sideways compliance in series, along the normal.
        let squared = hit.cosine * hit.cosine;
        let compliance = squared + (1.0 - squared) / SHEAR_SHARE;
        // Its bottom is its rest length whichever way it gives; two pads that shear past each other have none.
        let height = match against {
            Against::Finger(_) => height * compliance / hit.cosine.max(LEAST_COSINE),
            Against::Object | Against::World => height,
        };
        let (mut stiffness, mut height) = (stiffness / compliance, height);
        if let (Against::Object, Some(shell)) = (against, &model.shell) {
            let under = shell.under(spring.stiffness, spring.height);
            (stiffness, height) = shell.in_series((stiffness, height), under);
            shear_stiffness = Shell::shear_in_series(shear_stiffness, under);
        }
        workspace.contacts.push(Contact {
            site: site as u32,
            acting: Acting::Segment(place.link as u32),
            against,
            arm: hit.point - workspace.reference,
            normal: hit.normal,
            compression: hit.compression,
            law: model.pad_law,
            stiffness,
            height,
            shear_stiffness,
            mu,
            limit: mu * state.expected_impulse(site, workspace.step.h),
            shear: shear - hit.normal * hit.normal.dot(shear),
            velocity: DVec3::ZERO,
            change: DVec3::ZERO,
        });
    }
}

/// Protrusion of the fingers towards each other, and the fastest segment of each (m/s); `None` where no segment of
/// one can come near the other within the step, or where they pass through each other.
fn fronts_of_near_fingers(model: &PhysicsModel, workspace: &mut Workspace) -> Option<(Fronts, [f64; 2])> {
    if model.finger_contact == FingerContact::Never {
        return None;
    }
    let links = model.chain.joints + 1;
    let fastest = [0, 1].map(|finger| {
        let speed = |j: usize| {
            let link = finger * links + j;
            let half = 0.5 * model.chain.lengths[j];
            let middle = match workspace.frames().get(link) {
                Some(frame) => frame.point(half, 0.0, 0.0),
                None => model.planes[finger].point(workspace.segments[link].point(half, 0.0), 0.0),
            };
            let arm = middle - workspace.reference;
            let velocity = &workspace.spatial[link];
            velocity.linear_at(arm).length() + velocity.angular.length() * model.springs.reach[j]
        };
        (0..links).map(speed).fold(0.0, f64::max)
    });
    let fronts = Fronts::new(model, workspace);
    let clearance = fronts.clearance(model);
    workspace.clearances.note_fingers(clearance);
    (clearance < margin(workspace.step.h, fastest[0] + fastest[1])).then_some((fronts, fastest))
}

/// Axes in which a pad's shear is remembered: along the segment, across it, inward. Columns, in the gripper frame.
pub(super) fn segment_axes(plane: &FingerPlane, segment: &SegmentPose) -> DMat3 {
    DMat3::from_cols(plane.direction(segment.along), DVec3::Y, plane.direction(segment.inward()))
}

/// Object in its present pose.
struct Solid<'a> {
    body: &'a Body,
    object_from_gripper: DMat3,
    centre: DVec3,
}

impl<'a> Solid<'a> {
    fn new(body: &'a Body, pose: &Pose) -> Self {
        Self { body, object_from_gripper: pose.matrix().transpose(), centre: pose.position }
    }

    #[inline]
    fn local(&self, p: DVec3) -> DVec3 {
        self.object_from_gripper * (p - self.centre) + self.body.centre
    }

    /// Distance (m), or a lower bound where the object is far.
    #[inline]
    fn distance(&self, p: DVec3) -> f64 {
        let to_ball = (p - self.centre).length() - self.body.radius;
        if to_ball > self.body.radius { to_ball } else { self.body.field.distance(self.local(p)) }
    }
}

/// The path of a contact spring's round end.
struct Ray {
    foot: DVec3,
    axis: DVec3,
    radius: f64,
    /// Distance of the end's centre from the foot at rest (m).
    rest: f64,
}

/// Below this gap the touch is computed from the slope of the distance instead of by more steps (m); the error is
/// its square over the surface's radius, 1e-8 m on a 10 mm ball.
const CLOSE: f64 = 1e-5;
/// Steps of sphere tracing before a ray that grazes along a surface is taken to touch where it is.
const MOST_STEPS: usize = 32;
/// A surface whose normal points ahead along the contact spring by more than this was passed, not met sideways: things
/// beside a finger have a normal across it.
const FROM_BEHIND: f64 = -0.7;

impl Ray {
    /// `distance` is that of the foot from the object (m).
    fn cast_solid(&self, solid: &Solid<'_>, distance: f64, margin: f64) -> Option<Hit> {
        if distance - self.radius > self.rest + margin {
            return None;
        }
        let foot = solid.local(self.foot);
        let axis = solid.object_from_gripper * self.axis;
        let field = &solid.body.field;
        let gap = distance - self.radius;
        let (distance, surface) = (|p| field.distance(p), |p| field.surface(p));
        let touch = self.trace((foot, axis), gap, margin, distance, surface)?;
        let passed = touch.cosine < FROM_BEHIND && touch.way == 0.0;
        let hit = if passed {
            self.trace_back((foot, axis), touch.gap, distance, surface)
        } else {
            self.pressed(&touch, touch.cosine, margin)?
        };
        let to_gripper = solid.object_from_gripper.transpose();
        Some(Hit {
            normal: to_gripper * hit.normal,
            point: to_gripper * (hit.point - solid.body.centre) + solid.centre,
            ..hit
        })
    }

    fn cast_environment(&self, environment: &Environment, margin: f64) -> Option<Hit> {
        let surface = |p| (environment.distance(p), environment.normal(p));
        let gap = environment.distance(self.foot) - self.radius;
        let touch = self.trace((self.foot, self.axis), gap, margin, |p| environment.distance(p), surface)?;
        self.pressed(&touch, touch.cosine.max(0.0), margin)
    }

    #[inline(never)]
    fn cast_finger(&self, other: &OtherFinger<'_>, margin: f64) -> Option<Hit> {
        let gap = other.distance(self.foot) - self.radius;
        let (distance, surface) = (|p| other.distance(p), |p| other.surface(p));
        let touch = self.trace((self.foot, self.axis), gap, margin, distance, surface)?;
        self.pressed(&touch, touch.cosine.max(0.0), margin)
    }

    /// A contact spring pressed by what it meets. A table, a pedestal or a finger is too thick to be passed: where one
    /// looks the way that the spring does, the spring leans on it with its side, at a cosine of zero.
    #[inline]
    fn pressed(&self, touch: &Touch, cosine: f64, margin: f64) -> Option<Hit> {
        // The surface is `gap` away along the normal, `gap / cosine` along the axis; a foot inside has gap < 0.
        let compression = (self.rest - touch.way) * cosine - touch.gap;
        (compression > -margin).then(|| Hit {
            compression,
            normal: touch.normal,
            point: touch.centre - touch.normal * (self.radius + touch.gap),
            cosine: cosine.max(0.0),
        })
    }

    /// The foot has come through a thin body: the contact spring is compressed down to where it went in, and pushes
    /// back the way it came.
    #[cold]
    fn trace_back(
        &self,
        (foot, axis): (DVec3, DVec3),
        mut gap: f64,
        distance: impl Fn(DVec3) -> f64,
        surface: impl Fn(DVec3) -> (f64, DVec3),
    ) -> Hit {
        let mut back = 0.0;
        for _ in 0..MOST_STEPS {
            if gap > 0.0 {
                break;
            }
            back += (-gap).max(CLOSE);
            gap = distance(foot - axis * back) - self.radius;
        }
        let centre = foot - axis * back;
        let (away, normal) = surface(centre);
        let gap = away - self.radius;
        let cosine = (-normal.dot(axis)).max(LEAST_COSINE);
        let point = centre - normal * (self.radius + gap);
        Hit { compression: (self.rest + back) * cosine - gap, normal, point, cosine }
    }

    /// Sphere tracing along a path given by its foot and axis, both in the frame of the distance. `gap` is that at the
    /// foot, or a lower bound of it (m).
    #[inline]
    fn trace(
        &self,
        (foot, axis): (DVec3, DVec3),
        mut gap: f64,
        margin: f64,
        distance: impl Fn(DVec3) -> f64,
        surface: impl Fn(DVec3) -> (f64, DVec3),
    ) -> Option<Touch> {
        let limit = self.rest + margin;
        let mut way = 0.0;
        if gap > limit {
            return None;
        }
        for _ in 0..MOST_STEPS {
            if gap < CLOSE {
                break;
            }
            way += gap;
            if way > limit {
                return None;
            }
            gap = distance(foot + axis * way) - self.radius;
        }
        let centre = foot + axis * way;
        let (away, normal) = surface(centre);
        Some(Touch { way, centre, gap: away - self.radius, normal, cosine: -normal.dot(axis) })
    }
}

/// The object against its support: its resting points against table and pedestal, and the pedestal's rim against it.
fn detect_resting(
    model: &PhysicsModel,
    state: &State,
    (workspace, environment): (&mut Workspace, &Environment),
    body: &Body,
    margin: f64,
) {
    let (h, pose) = (workspace.step.h, workspace.body);
    if environment.distance(pose.position) > body.radius + margin {
        return;
    }
    let gripper_from_object = pose.matrix();
    let place = |p: DVec3| gripper_from_object * (p - body.centre) + pose.position;
    let first_site = 2 * model.springs.all.len();
    let (contacts, reference) = (&mut workspace.contacts, workspace.reference);
    let mut touch = |site: usize, compression: f64, normal: DVec3, point: DVec3| {
        let shear = state.touched.shear[site];
        contacts.push(Contact {
            site: site as u32,
            acting: Acting::Object,
            against: Against::World,
            arm: point - reference,
            normal,
            compression,
            law: PadLaw::Linear,
            stiffness: body.support_stiffness,
            shear_stiffness: SHEAR_SHARE * body.support_stiffness,
            height: 1.0,
            mu: body.support_friction,
            limit: body.support_friction * state.expected_impulse(site, h),
            shear: shear - normal * normal.dot(shear),
            velocity: DVec3::ZERO,
            change: DVec3::ZERO,
        });
    };
    let local = |p: DVec3| gripper_from_object.transpose() * (p - pose.position) + body.centre;
    let nearby = workspace.clearances.resting(margin, |gap, nearby| {
        // Height above the highest surface, as a plane in the object's frame: three products per point.
        let up = gripper_from_object.transpose() * environment.up();
        let base = environment.height_above_top(place(DVec3::ZERO));
        let balls = body.resting.0.iter().zip(0..);
        nearby.points.extend(balls.filter_map(|(b, k)| (base + up.dot(b.centre) - b.radius < gap).then_some(k)));
        let rim = environment.rim().iter().zip(0..);
        nearby.rim.extend(rim.filter_map(|(p, k)| (body.field.distance(local(*p)) < gap).then_some(k)));
    });
    for k in nearby.points.iter().map(|k| *k as usize) {
        let ball = &body.resting.0[k];
        let centre = place(ball.centre);
        let gap = environment.distance(centre) - ball.radius;
        if gap < margin {
            let normal = environment.normal(centre);
            touch(first_site + k, -gap, normal, centre - normal * ball.radius);
        }
    }
    let first_rim = first_site + model.resting_points();
    for k in nearby.rim.iter().map(|k| *k as usize) {
        let p = environment.rim()[k];
        if body.field.distance(local(p)) < margin {
            let (gap, normal) = body.field.surface(local(p));
            let out_of_object = gripper_from_object * normal;
            touch(first_rim + k, -gap, -out_of_object, p);
        }
    }
}

impl Spatial {
    /// Velocity of the point at `arm` from the reference point.
    #[inline]
    pub(super) fn linear_at(&self, arm: DVec3) -> DVec3 {
        self.linear + self.angular.cross(arm)
    }
}
