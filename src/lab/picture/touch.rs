//! The touch from nearby: through the finger in front, which turns translucent where it hides its loaded pad.

use super::annotations::Plate;
use super::{PictureView, Stage};
use glam::{DVec3, Vec3};
use palpate_geometry::Pose;
use palpate_geometry::drawing::{Camera, DrawList, FingerFrame, Inset, SoftFinger, StandardView, Veil};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Force on both pads from which the touch is shown (N).
const FAINTEST: f32 = 0.01;
/// Height of the picture as a share of the object's largest side, and its least and greatest (m).
const OF_OBJECT: f32 = 0.9;
const HEIGHTS: [f32; 2] = [0.042, 0.078];
/// Way of the picture's middle from that of the touch to that of the pad in front.
const TOWARDS_PAD: f32 = 0.5;
/// Least height of the eye (m).
const ABOVE_GROUND: f32 = 0.006;
/// Yaw from beside the hand, where a finger is seen from behind, and pitch (rad): low, as fingertips curl up.
const ANGLES: [f32; 2] = [1.05, -0.16];
/// Pressure of a loaded taxel, as a share of the brightest colour.
const LOADED: f32 = 0.02;
/// Translucent stretch beyond the loaded taxels, towards the palm, whose bellows stand in the way, and the tip (m).
const MARGINS: [f32; 2] = [0.016, 0.006];
/// Force on a pad from which its finger is as clear as it gets (N).
const CLEAR: f32 = 0.012;
/// Distance of the touch from the ball around an object at which it is still the object's (m).
const NEAR_OBJECT: f32 = 0.006;

/// What both pads touch in a frame.
pub(super) struct Touch {
    /// Sum of the normal forces (N), and their middle (m).
    force: f32,
    middle: Vec3,
    /// Their middle on each pad, where it is loaded (m).
    on_pads: [Option<Vec3>; 2],
}

impl Touch {
    /// None where nothing is touched.
    pub(super) fn of(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) -> Option<Self> {
        let grid = gripper.taxels();
        let mut sums = [(0.0, DVec3::ZERO); 2];
        for side in Side::BOTH {
            let placed = frame.placed(gripper, side);
            let (force, moment) = &mut sums[side.index()];
            for (taxel, load) in frame.loads(side, grid.count()) {
                let (segment, along) = grid.place(taxel, &gripper.finger);
                let normal = load.normal.max(0.0);
                *force += normal;
                *moment += placed.point(segment, along, grid.across(taxel), grid.height(taxel)) * f64::from(normal);
            }
        }
        let place = |(force, moment): (f32, DVec3)| {
            (force > 0.0).then(|| world_from_gripper.point(moment / f64::from(force)).as_vec3())
        };
        let both = (sums[0].0 + sums[1].0, sums[0].1 + sums[1].1);
        Some(Self { force: both.0, middle: place(both)?, on_pads: sums.map(place) })
    }

    /// Force on an object (N) that a ball about this place holds; none where the fingers touch something else, such as each
    /// other.
    pub(super) fn force_on(&self, object: Vec3, radius: f32) -> Option<f32> {
        (self.force >= FAINTEST && self.middle.distance(object) <= radius + NEAR_OBJECT).then_some(self.force)
    }
}

impl Stage {
    /// Camera of the touch in a frame; none where nothing is touched.
    pub fn touch_camera(&self, frame: &Frame) -> Option<Camera> {
        let touch = self.touch(frame).filter(|touch| touch.force >= FAINTEST)?;
        let usual = Camera::default().turned_to(StandardView::Home);
        let from_side = self.yaw_from_side(usual.yaw);
        let yaw = usual.yaw + ANGLES[0].copysign(from_side) - from_side;
        let near = touch.on_pads[self.near_side(&Camera { yaw, ..usual }).index()];
        let target = touch.middle.lerp(near.unwrap_or(touch.middle), TOWARDS_PAD);
        let height = (OF_OBJECT * self.object_extent).clamp(HEIGHTS[0], HEIGHTS[1]);
        let distance = height / (2.0 * (0.5 * usual.angle_of_view).tan());
        let lowest = ((ABOVE_GROUND - target.z) / distance).clamp(-1.0, 1.0).asin();
        Some(Camera { target, distance, yaw, pitch: ANGLES[1].max(lowest), ..usual })
    }

    /// The finger that is nearer to the camera.
    fn near_side(&self, camera: &Camera) -> Side {
        let closing = self.world_from_gripper.direction(DVec3::X).as_vec3();
        if camera.axes()[2].dot(closing) < 0.0 { Side::Left } else { Side::Right }
    }

    /// A picture of the touch: a finger whose back hides its loaded pad is translucent there.
    pub fn draw_touch(&self, frame: &Frame, view: &PictureView) -> DrawList {
        let mut list = self.draw(frame, &PictureView { inset: 0.0, ..view.clone() });
        list.fingers.iter_mut().for_each(|finger| clear_the_view(finger, &view.camera));
        list
    }

    /// Adds the touch of an earlier hold, by this hand or in another pose, to a picture of a frame in which nothing is touched.
    pub fn add_hold(&self, list: &mut DrawList, frame: &Frame, view: &PictureView, (stage, held): (&Self, &Frame)) {
        let place = self.inset_place(frame, view).zip(stage.touch_camera(held));
        let mut number = DefaultHasher::new();
        format!("{} {:?} {view:?}", held.t, held.world_from_object).hash(&mut number);
        let past = Some(number.finish());
        list.inset = place.map(|place| Box::new(Inset { past, ..stage.inset(held, view, place, Some("last hold")) }));
    }

    /// The touch as a picture within a picture.
    pub(super) fn inset(&self, frame: &Frame, view: &PictureView, at: (Plate, Camera), title: Option<&str>) -> Inset {
        let (place, camera) = at;
        let (corner, size) = (place.middle - place.half, 2.0 * place.half);
        let inner =
            PictureView { camera, size, forces: false, annotations: false, path: None, badge: None, ..view.clone() };
        let mut list = self.draw_touch(frame, &inner);
        let world_from_gripper = frame.world_from_gripper(&self.world_from_gripper);
        if !view.plain {
            list.arrows = super::forces::shear(&self.gripper, &world_from_gripper, frame, view.theme);
        }
        let near = self.near_side(&inner.camera);
        let title = title.map_or_else(|| super::annotations::pad_title(near, &inner), str::to_owned);
        super::annotations::frame_inset(&mut list.overlay, &inner, &title);
        Inset { list, corner, size, past: None }
    }
}

/// Makes a finger translucent where its back hides its loaded pad from the camera.
fn clear_the_view(finger: &mut SoftFinger, camera: &Camera) {
    let (rows, columns) = (finger.taxels.rows as usize, finger.taxels.columns as usize);
    let Some(length) = finger.frames.last().map(|frame| frame.arc).filter(|_| rows > 0 && columns > 0) else { return };
    let loads: Vec<f32> = finger
        .taxels
        .loads
        .chunks_exact(columns)
        .map(|row| row.iter().map(|load| load[0]).fold(0.0, f32::max))
        .collect();
    let loaded = |load: &f32| *load > LOADED * finger.full_scale;
    let (Some(first), Some(last)) = (loads.iter().position(loaded), loads.iter().rposition(loaded)) else { return };
    let arc = |row: usize| length * row as f32 / rows as f32;
    let stretch = [arc(first) - MARGINS[0], arc(last + 1) + MARGINS[1]];
    let middle = 0.5 * (arc(first) + arc(last + 1));
    let near = |frame: &&FingerFrame| (frame.arc - middle).abs();
    let Some(frame) = finger.frames.iter().min_by(|a, b| near(a).total_cmp(&near(b))) else { return };
    let towards_eye: Vec3 =
        if camera.parallel { camera.axes()[2] } else { (camera.eye() - frame.position).normalize_or_zero() };
    // From behind; seen from the side there is nothing to clear.
    let behind = smoothstep(0.05, 0.25, -frame.inward.dot(towards_eye));
    let area = finger.section.width * length / (rows * columns) as f32;
    let force: f32 = finger.taxels.loads.iter().map(|load| load[0] * area).sum();
    finger.veil = Veil { stretch, clearness: behind * smoothstep(0.0, CLEAR, force) };
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let share = ((x - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
