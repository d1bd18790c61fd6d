//! Finding contacts: each contact spring of the pads beside the object, its support and the other finger.
//!
//! [`super::stretch`] says how far a spring has to give way. Most springs touch nothing: segments and springs are looked
//! at again only after they have gone what they were clear of ([`super::clearances`]).
//!
//! Distances, normals and arms are those of the layout in the workspace, which is ahead of the state; see
//! [`super::step`].

use super::contact::{Acting, Against, Contact, SHEAR_SHARE};
use super::contact_springs::ContactSpring;
use super::effects::{FingerContact, Shell};
use super::environment::Environment;
use super::finger_pair::{Fronts, OtherFinger, in_series};
use super::model::{Body, PhysicsModel};
use super::spatial::Spatial;
use super::state::State;
use super::stretch::{Met, SpringAtRest, Touch};
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
            spring.ray(&plane, &place.segment)
        };
        let at_rest = SpringAtRest { foot, axis, height: spring.height, end: model.springs.radius };
        let finger = near.finger.and_then(|(fronts, margin)| {
            let gap = fronts.least_distance(model, place.finger, foot) - spring.height;
            (in_space || gap <= margin).then_some(margin)
        });
        let (to_object, clearance) = near.distances(foot);
        if finger.is_none() {
            workspace.clearances.note_spring(site, place.link, clearance);
            if clearance > spring.height + near.farthest() {
                continue;
            }
        }
        let pressed = PressedSpring { model, state, place, spring, site, local_axes };
        let on_object = near.object.and_then(|(solid, margin)| meet_solid(&at_rest, solid, to_object, margin));
        if let Some(touch) = on_object {
            pressed.add(workspace, Against::Object, &touch);
        }
        let world = near.environment;
        let surface = |p| (world.distance(p), world.normal(p));
        let on_world = near.world.and_then(|margin| meet_thick(&at_rest, world.distance(foot), margin, surface));
        if let Some(touch) = on_world {
            pressed.add(workspace, Against::World, &touch);
        }
        if let Some(margin) = finger {
            let other = OtherFinger::opposite(model, workspace, place.finger, spring.across);
            let touch = meet_thick(&at_rest, other.distance(foot), margin, |p| other.surface(p));
            if let Some((touch, segment)) = touch.map(|touch| (touch, other.segment(touch.point))) {
                let first_link = (1 - place.finger) * (model.chain.joints + 1);
                workspace.fingers_meet = true;
                pressed.add(workspace, Against::Finger((first_link + segment) as u32), &touch);
            }
        }
    }
}

/// A contact spring that is pressed.
struct PressedSpring<'a> {
    model: &'a PhysicsModel,
    state: &'a State,
    place: Place,
    spring: &'a ContactSpring,
    site: usize,
    /// Axes of the segment, in the gripper frame.
    local_axes: DMat3,
}

impl PressedSpring<'_> {
    /// Adds the contact with one of the things that press it: each has its own energy.
    fn add(&self, workspace: &mut Workspace, against: Against, touch: &Touch) {
        let Self { model, state, spring, .. } = self;
        let own = (spring.stiffness, spring.height);
        let ((stiffness, height), shear_stiffness, mu, place) = match (against, &model.shell) {
            (Against::Object, Some(shell)) => {
                let under = shell.under(own.0, own.1);
                let shear = Shell::shear_in_series(SHEAR_SHARE * own.0, under);
                (shell.in_series(own, under), shear, model.pad_friction.on_object, 0)
            }
            (Against::Object, None) => (own, SHEAR_SHARE * own.0, model.pad_friction.on_object, 0),
            (Against::World, _) => (own, SHEAR_SHARE * own.0, model.pad_friction.on_world, 1),
            (Against::Finger(_), _) => {
                let both = in_series(own.0, own.1);
                (both, SHEAR_SHARE * both.0, model.pad_friction.on_pad, 2)
            }
        };
        let site = place * 2 * model.springs.all.len() + self.site;
        // The law along the axis, scaled to the normal.
        let scale = touch.length / spring.height;
        let shear = self.local_axes * state.touched.shear[site];
        workspace.contacts.push(Contact {
            site: site as u32,
            acting: Acting::Segment(self.place.link as u32),
            against,
            arm: touch.point - workspace.reference,
            normal: touch.normal,
            compression: touch.compression,
            law: model.pad_law,
            stiffness: stiffness / (scale * scale),
            height: height * scale,
            shear_stiffness,
            mu,
            limit: mu * state.expected_impulse(site, workspace.step.h),
            shear: shear - touch.normal * touch.normal.dot(shear),
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

/// The touch of a contact spring and the object; `distance` is that of the foot (m).
fn meet_solid(spring: &SpringAtRest, solid: &Solid<'_>, distance: f64, margin: f64) -> Option<Touch> {
    if distance > spring.height + margin {
        return None;
    }
    let local =
        SpringAtRest { foot: solid.local(spring.foot), axis: solid.object_from_gripper * spring.axis, ..*spring };
    let surface = |p| solid.body.field.surface(p);
    let touch = match local.meet(distance, margin, surface)? {
        Met::Outside(touch) => touch,
        Met::Inside => local.trace_back(distance, surface)?,
        Met::InFrontOf(touch) => local.trace_back(distance, surface).unwrap_or(touch),
    };
    let to_gripper = solid.object_from_gripper.transpose();
    Some(Touch {
        normal: to_gripper * touch.normal,
        point: to_gripper * (touch.point - solid.body.centre) + solid.centre,
        ..touch
    })
}

/// The touch of a contact spring and something too thick to be passed: table, pedestal, the other finger.
fn meet_thick(
    spring: &SpringAtRest,
    distance: f64,
    margin: f64,
    surface: impl Fn(DVec3) -> (f64, DVec3),
) -> Option<Touch> {
    Some(match spring.meet(distance, margin, &surface)? {
        Met::Outside(touch) | Met::InFrontOf(touch) => touch,
        Met::Inside => spring.push_out(&surface),
    })
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
    let first_site = model.first_resting_site();
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
    // Height above the highest surface, as a plane in the object's frame: three products per point.
    let up = gripper_from_object.transpose() * environment.up();
    let base = environment.height_above_top(place(DVec3::ZERO));
    let nearby = workspace.clearances.resting(margin, |gap, nearby| {
        let balls = body.resting.0.iter().zip(0..);
        nearby.points.extend(balls.filter_map(|(b, k)| (base + up.dot(b.centre) - b.radius < gap).then_some(k)));
        let rim = environment.rim().iter().zip(0..);
        nearby.rim.extend(rim.filter_map(|(p, k)| (body.field.distance(local(*p)) < gap).then_some(k)));
    });
    for k in nearby.points.iter().map(|k| *k as usize) {
        let ball = &body.resting.0[k];
        if base + up.dot(ball.centre) - ball.radius > margin {
            continue;
        }
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
            let (gap, slope) = body.field.surface(local(p));
            let out_of_object = gripper_from_object * slope.normalize_or(DVec3::Z);
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
