//! From a scene and a frame to a list of things to draw. No window and no graphics card: a live simulation, a stored
//! trial and a test all make their pictures here.

mod annotations;
mod circles;
mod contact_path;
mod fingers;
mod forces;
mod ghost;
mod gripper_model;
mod hand;
mod heat_maps;
mod portrait;
mod reconstructed;
mod sensors;
mod touch;

pub use annotations::{SCALE_STEPS, legend_room};
pub use contact_path::{ContactPath, PathColour, TouchedPlace, contact_path};
pub use ghost::skin_mesh;
pub use heat_maps::{
    BendUnit, LoadUnit, PAD_FULL_SCALE, SensorRows, channels_over_time, full_scale_of, joints_over_time,
    pad_rows_over_time, pads_at, touched_rows, whole_pads,
};
pub use portrait::{PORTRAIT_BACKDROP, portrait, portrait_camera};
pub(crate) use reconstructed::evenly_bent;

use annotations::Annotator;
use glam::{DVec3, Mat4, Vec2, Vec3};
use palpate_geometry::drawing::{Camera, Detail, DrawList, Ground, SoftFinger, Solid, StandardView};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::{Pose, SurfaceMesh};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, PlacedFinger, Side};
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{Scene, SupportKind};
use palpate_tactile::{CATALOGUE, SensorLayout};
use std::sync::Arc;

/// View of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureView {
    /// Camera.
    pub camera: Camera,
    /// Theme.
    pub theme: Theme,
    /// Size of the picture in points, for the overlay.
    pub size: Vec2,
    /// Draw force arrows.
    pub forces: bool,
    /// For people who have never seen such a picture: one force for each finger, and no other numbers or arrows.
    pub plain: bool,
    /// Draw the axis gizmo, scale bar and legend.
    pub annotations: bool,
    /// Pressure that has the brightest colour (Pa).
    pub full_scale: f32,
    /// Badge in the top left corner: source of the data.
    pub badge: Option<String>,
    /// Colours of the contact path; none where it is not drawn.
    pub path: Option<PathColour>,
    /// Sensors that are drawn on the fingers; none where they are not.
    pub layout: Option<SensorLayout>,
    /// Draw the circle that each flex strip reads.
    pub circles: bool,
    /// Curvatures are known to a tenth (1/m): those of real fingers, which are drawn anew only where it is seen.
    pub tenths: bool,
    /// Height of the inset with the touch, as a share of the picture's; 0 for none.
    pub inset: f32,
}

impl Default for PictureView {
    fn default() -> Self {
        Self {
            camera: Camera::default(),
            theme: Theme::Dark,
            size: Vec2::new(960.0, 600.0),
            forces: true,
            plain: false,
            annotations: true,
            full_scale: PAD_FULL_SCALE,
            badge: None,
            path: None,
            layout: Some(CATALOGUE[0].clone()),
            circles: true,
            tenths: false,
            inset: INSET,
        }
    }
}

/// Name of the palm with its tubes.
const PALM: &str = "palm";
/// Cosine of the angle between the eye and the fingers below which the palm is translucent.
const ALONG: f32 = 0.95;
/// Usual height of the inset with the touch, as a share of the picture's.
const INSET: f32 = 0.27;

/// Colour of the ghost of another run of the same scene, which no sensor has.
pub const fn ghost_colour(theme: Theme) -> Rgb {
    match theme {
        Theme::Dark => Rgb(226, 132, 214),
        Theme::Light => Rgb(164, 44, 152),
    }
}

/// Constant parts of a picture: meshes, and the gripper they belong to.
#[derive(Clone, Debug)]
pub struct Stage {
    gripper: GripperModel,
    world_from_gripper: Pose,
    object: Option<Arc<SurfaceMesh>>,
    /// Ball that holds the object: its centre in the object's frame, whose origin may be anywhere, and its radius; and the
    /// object's largest side (m). Zero for an empty hand.
    object_centre: DVec3,
    object_radius: f32,
    object_extent: f32,
    pedestal: Option<Arc<SurfaceMesh>>,
    has_table: bool,
    palm: Arc<SurfaceMesh>,
    outlines: hand::Outlines,
}

/// Radius of the ball in which shadows are cast (m), and the height of its middle above the table.
const SHADOW_RADIUS: f32 = 0.17;

impl Stage {
    /// Prepares the meshes of a scene.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>, world_from_gripper: Pose) -> Self {
        let support = &scene.support;
        let palm = Arc::new(gripper_model::palm(&scene.gripper));
        let pedestal = (support.kind == SupportKind::Pedestal).then(|| Arc::new(gripper_model::pedestal(support)));
        let outlines = hand::Outlines {
            palm: hand::outline(&palm),
            object: object.map_or_else(Vec::new, |o| hand::outline(&o.surface)),
            pedestal: pedestal.as_ref().map_or_else(Vec::new, |mesh| hand::outline(mesh)),
        };
        Self {
            gripper: scene.gripper.clone(),
            world_from_gripper,
            object: object.map(|o| Arc::clone(&o.surface)),
            object_centre: object.map_or(DVec3::ZERO, |o| o.bounds.centre()),
            object_radius: object.map_or(0.0, |o| 0.5 * o.bounds.size().length() as f32),
            object_extent: object.map_or(0.0, |o| o.bounds.size().max_element() as f32),
            pedestal,
            has_table: support.kind != SupportKind::None,
            palm,
            outlines,
        }
    }

    /// Largest distance of the fingers in two frames, joint by joint (m), and as a share of a finger's length.
    pub fn difference(&self, frame: &Frame, other: &Frame) -> [f64; 2] {
        let far = |side: Side| {
            let [a, b] = [frame, other].map(|frame| frame.placed(&self.gripper, side));
            let end = |placed: &PlacedFinger, k: usize| placed.point(k, placed.lengths[k], 0.0, 0.0);
            (0..a.lengths.len().min(b.lengths.len())).map(|k| end(&a, k).distance(end(&b, k))).fold(0.0, f64::max)
        };
        let most = Side::BOTH.map(far).into_iter().fold(0.0, f64::max);
        [most, most / self.gripper.finger.length]
    }

    /// Everything in one picture of a frame.
    pub fn draw(&self, frame: &Frame, view: &PictureView) -> DrawList {
        let colours = view.theme.colours();
        // Its place stays free where it comes and goes.
        let place = self.inset_place(frame, view);
        let inset = place.zip(self.touch_camera(frame)).map(|at| self.inset(frame, view, at, None));
        // Only labels have to keep clear of the hand.
        let hand = if view.annotations { self.held_points(frame) } else { Vec::new() };
        let hand = hand.into_iter().filter_map(view.camera.projector(view.size)).collect();
        let mut annotator = Annotator::new(view, place, hand);
        if view.forces && !view.plain {
            forces::add_key(&mut annotator, &self.gripper, frame, place);
        }
        let palm = self.world_from_gripper.position.as_vec3();
        let world_from_gripper = frame.world_from_gripper(&self.world_from_gripper);
        let layout = view.layout.as_ref().filter(|_| view.circles && view.annotations);
        let circled = |layout| circles::add(&mut annotator, layout, &self.gripper, &world_from_gripper, frame);
        let numbers = layout.map(circled).unwrap_or_default();
        if view.forces && view.annotations {
            forces::label(&mut annotator, &self.gripper, &world_from_gripper, frame);
        }
        if !view.plain {
            circles::add_numbers(&mut annotator, &numbers);
        }
        let mut fingers = self.fingers(frame, view.full_scale);
        if let Some(layout) = &view.layout {
            let drawn = sensors::on_finger(layout, &self.gripper, view.theme);
            fingers.iter_mut().for_each(|finger| finger.sensors = drawn.clone());
        }
        // Seen along the fingers, the palm would hide all that they touch.
        let along = world_from_gripper.direction(DVec3::Z).as_vec3().dot(view.camera.axes()[2]);
        let (hiding, solids): (Vec<_>, Vec<_>) =
            self.solids(frame).into_iter().partition(|(name, _)| *name == PALM && along > ALONG);
        DrawList {
            camera: view.camera,
            backdrop: [colours.sky, colours.horizon],
            shadow_bounds: (Vec3::new(palm.x, palm.y, palm.z - 0.06), SHADOW_RADIUS),
            ground: self.has_table.then_some(Ground {
                height: 0.0,
                colour: colours.ground,
                grid: colours.grid,
                radius: 0.45,
            }),
            solids: solids.into_iter().map(|(_, solid)| solid).collect(),
            ghosts: hiding.into_iter().map(|(_, solid)| Solid { tint: Some(colours.quiet_text), ..solid }).collect(),
            fingers,
            arrows: if view.forces {
                forces::arrows(&self.gripper, &world_from_gripper, frame, view)
            } else {
                Vec::new()
            },
            overlay: annotator.overlay,
            detail: Detail::Full,
            inset: inset.map(Box::new),
        }
    }

    /// Outlines of another run of the same scene, for [`DrawList::ghosts`].
    pub fn ghosts(&self, frame: &Frame, theme: Theme) -> Vec<Solid> {
        let colour = ghost_colour(theme);
        let mut ghosts: Vec<Solid> =
            self.fingers(frame, 1.0).iter().map(|finger| ghost::finger(finger, colour)).collect();
        if let (Some(mesh), Some(pose)) = (&self.object, &frame.world_from_object) {
            ghosts.push(Solid { mesh: Arc::clone(mesh), world_from_mesh: matrix(pose), tint: Some(colour) });
        }
        ghosts
    }

    /// Adds a frame to the contact path of its trial.
    pub fn extend_path(&self, path: &mut ContactPath, frame: &Frame) {
        path.push(&self.gripper, &self.world_from_gripper, frame);
    }

    /// Contact path on the object of a frame, for [`DrawList::solids`]; none for an empty hand.
    pub fn path(&self, mesh: &Arc<SurfaceMesh>, frame: &Frame) -> Option<Solid> {
        let pose = frame.world_from_object.as_ref()?;
        Some(Solid { mesh: Arc::clone(mesh), world_from_mesh: matrix(pose), tint: None })
    }

    /// Draws the fingers of a picture translucent, so that what they cover is seen.
    pub fn unveil(list: &mut DrawList, theme: Theme) {
        let colour = theme.colours().accent;
        let fingers = std::mem::take(&mut list.fingers);
        list.ghosts.extend(fingers.iter().map(|finger| ghost::finger(finger, colour)));
    }

    /// The real hand: fingers bent evenly, as their flex strips read (1/m), left and right. A finger whose strip is not read is
    /// left out, and so is whatever it holds: nothing is known of that.
    pub fn draw_real(&self, curvature: [Option<f64>; 2], view: &PictureView) -> DrawList {
        let frame = reconstructed::evenly_bent(&self.gripper, curvature);
        let mut list = self.draw(&frame, &PictureView { forces: false, tenths: true, inset: 0.0, ..view.clone() });
        let fingers = std::mem::take(&mut list.fingers);
        list.fingers = fingers.into_iter().zip(curvature).filter_map(|(finger, kappa)| kappa.map(|_| finger)).collect();
        list
    }

    /// Both fingers of a frame, left and right, without sensors; `full_scale` has the brightest colour (Pa).
    pub fn fingers(&self, frame: &Frame, full_scale: f32) -> Vec<SoftFinger> {
        let world_from_gripper = frame.world_from_gripper(&self.world_from_gripper);
        fingers::soft_fingers(&self.gripper, &world_from_gripper, frame, full_scale)
    }

    /// Rigid things of a frame, with their names.
    pub fn solids(&self, frame: &Frame) -> Vec<(&'static str, Solid)> {
        let solid = |mesh: &Arc<SurfaceMesh>, pose: &Pose| Solid {
            mesh: Arc::clone(mesh),
            world_from_mesh: matrix(pose),
            tint: None,
        };
        let mut solids = vec![(PALM, solid(&self.palm, &frame.world_from_gripper(&self.world_from_gripper)))];
        solids.extend(self.pedestal.as_ref().map(|mesh| ("pedestal", solid(mesh, &Pose::IDENTITY))));
        if let (Some(mesh), Some(pose)) = (&self.object, &frame.world_from_object) {
            solids.push(("object", solid(mesh, pose)));
        }
        solids
    }

    /// Pressure that has the brightest colour (Pa) in pictures of these frames of a grasp, as [`full_scale_of`].
    pub fn full_scale_of<'a>(&self, frames: impl IntoIterator<Item = &'a Frame>) -> f32 {
        full_scale_of(&self.gripper, frames)
    }

    /// Camera of a standard view of the whole hand, beside the annotations of a picture. The home view turns so far that a pad
    /// faces it.
    pub fn camera(&self, standard: StandardView, frame: &Frame, view: &PictureView) -> Camera {
        let camera = Camera { parallel: view.camera.parallel, ..Camera::default() }.turned_to(standard);
        let yaw = if standard == StandardView::Home { self.home_yaw(camera.yaw) } else { camera.yaw };
        self.showing_hand(Camera { yaw, ..camera }, frame, view)
    }

    /// Force of both pads on the object (N); none where they do not touch it, or less than is shown.
    pub fn force_on_object(&self, frame: &Frame) -> Option<f32> {
        let (object, radius) = self.object_ball(frame)?;
        self.touch(frame)?.force_on(object, radius)
    }

    /// A ball that holds the object: centre and radius (m); none for an empty hand.
    pub fn object_ball(&self, frame: &Frame) -> Option<(Vec3, f32)> {
        Some((frame.world_from_object.as_ref()?.point(self.object_centre).as_vec3(), self.object_radius))
    }

    /// Force of each finger across its pad (N), as its arrow shows it, left and right; none where it is not touched.
    pub fn finger_forces(&self, frame: &Frame) -> [Option<f64>; 2] {
        forces::of_fingers(&self.gripper, frame)
    }

    fn touch(&self, frame: &Frame) -> Option<touch::Touch> {
        touch::Touch::of(&self.gripper, &frame.world_from_gripper(&self.world_from_gripper), frame)
    }

    /// A ball around what matters, to be framed by a camera turned by hand: centre and radius (m).
    pub fn bounds(&self) -> (Vec3, f32) {
        let palm = self.world_from_gripper.position.as_vec3();
        let length = self.gripper.finger.length as f32;
        // A large object is shown whole; it stands between the fingers, a little below the middle.
        (palm - Vec3::Z * (0.42 * length), (1.12 * length).max(1.1 * self.object_radius + 0.3 * length))
    }
}

fn matrix(pose: &Pose) -> Mat4 {
    Mat4::from_rotation_translation(pose.rotation.as_quat(), pose.position.as_vec3())
}

/// The colour of text and marks over a picture.
fn ink(theme: Theme) -> Rgb {
    theme.colours().text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_geometry::palette::Trace;
    use palpate_sim::gripper::Phase;

    #[test]
    fn an_object_is_held_wherever_the_origin_of_its_file_is() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("far.obj");
        let corner =
            |k: u32| [0, 1, 2].map(|axis| 0.3 + if k >> axis & 1 == 1 { [0.045, 0.045, 0.06][axis] } else { 0.0 });
        let corners = (0..8).map(corner).map(|[x, y, z]| format!("v {x} {y} {z}\n"));
        let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
        std::fs::write(&file, corners.collect::<String>() + faces)?;
        let mut scene = Scene::default();
        scene.object.source = file.to_string_lossy().into_owned();
        let object = scene.load_object()?;
        let trial = grasp(&scene, object.as_ref(), 0);
        let stage = Stage::new(&scene, object.as_ref(), trial.data.world_from_gripper);
        let held = trial.frames().iter().rfind(|frame| frame.phase == Phase::Hold).ok_or("no hold")?;
        assert!(stage.force_on_object(held).is_some_and(|force| force > 0.1));
        Ok(())
    }

    #[test]
    fn ghosts_stand_out_and_have_the_colour_of_no_sensor() {
        for theme in Theme::ALL {
            let colour = ghost_colour(theme);
            assert!(colour.contrast(theme.colours().horizon) >= 3.0, "{theme:?}");
            assert!(Trace::ALL.iter().all(|trace| trace.colour(theme) != colour));
        }
    }
}
