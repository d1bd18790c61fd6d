//! Contact path: where on the object each finger touched in the course of a grasp, in the object's own frame, so that it
//! moves with the object.
//!
//! Two things are kept of each finger: every place that a loaded taxel met, and the course of the middle of its load.
//! That middle is taken along the unrolled pad and then placed on the skin: a mean of places in space would lie inside an
//! object that the finger wraps around.

use super::heat_maps::PAD_FULL_SCALE;
use glam::{DVec3, Vec3};
use palpate_geometry::palette::{Rgb, pressure_colour};
use palpate_geometry::{Finish, Pose, SurfaceMesh, SurfaceVertex};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, PlacedFinger, Side};
use std::borrow::Borrow;
use std::collections::BTreeMap;

/// Pressure from which on a taxel counts as touching (Pa): where its colour begins to differ from the silicone's.
const TOUCHES: f64 = 0.015 * PAD_FULL_SCALE as f64;
/// Places closer than this count as one (m): about half the distance between taxels.
const CELL: f64 = 1.5e-3;
/// Radius of the mark of a place, and of the line of the middle (m).
const MARK: f32 = 0.6e-3;
const LINE: f32 = 0.45e-3;

/// Colours of a contact path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathColour {
    /// Time of the first touch, from the first to the second of these times (s).
    Time([f32; 2]),
    /// Largest pressure, as on the pads: that of the brightest colour (Pa).
    Pressure(f32),
}

/// Place on an object that was touched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchedPlace {
    /// Place in the object's frame (m).
    pub at: Vec3,
    /// Time of the first touch (s).
    pub t: f32,
    /// Largest pressure (Pa).
    pub pressure: f32,
}

/// Where each finger touched the object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactPath {
    /// Places touched by either finger, each once.
    touched: BTreeMap<[i32; 3], TouchedPlace>,
    /// Course of the middle of the load of the left and of the right finger: stretches without a break.
    courses: [Vec<Vec<TouchedPlace>>; 2],
    /// The finger carried load at the last frame.
    touching: [bool; 2],
    frames: usize,
}

/// Contact path over the whole of some frames.
pub fn contact_path<F: Borrow<Frame>>(gripper: &GripperModel, world_from_gripper: &Pose, frames: &[F]) -> ContactPath {
    let mut path = ContactPath::default();
    for frame in frames {
        path.push(gripper, world_from_gripper, frame.borrow());
    }
    path
}

impl ContactPath {
    /// Adds the next frame; `world_from_gripper` is the pose in which the trial began.
    pub fn push(&mut self, gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) {
        self.frames += 1;
        let Some(world_from_object) = &frame.world_from_object else { return };
        let object_from_world = world_from_object.inverse();
        let world_from_gripper = frame.world_from_gripper(world_from_gripper);
        let grid = gripper.taxels();
        for side in Side::BOTH {
            let placed = frame.placed(gripper, side);
            let in_object = |p: DVec3| object_from_world.point(world_from_gripper.point(p));
            let mut middle = Middle::default();
            for (taxel, load) in frame.loads(side, grid.count()) {
                let force = f64::from(load.normal);
                let pressure = force / grid.area();
                if pressure < TOUCHES {
                    continue;
                }
                let (segment, along) = grid.place(taxel, &gripper.finger);
                let skin = grid.height(taxel) - grid.compression(taxel, force);
                let at = in_object(placed.point(segment, along, grid.across(taxel), skin));
                self.touch(at, frame.t as f32, pressure as f32);
                middle.add(force, [grid.arc(taxel), grid.across(taxel), skin], pressure);
            }
            let touching = middle.force > 0.0;
            let touched = std::mem::replace(&mut self.touching[side.index()], touching);
            if !touching {
                continue;
            }
            let at = in_object(middle.place(&placed)).as_vec3();
            let place = TouchedPlace { at, t: frame.t as f32, pressure: middle.pressure as f32 };
            let courses = &mut self.courses[side.index()];
            match courses.last_mut().filter(|_| touched) {
                Some(course) => course.push(place),
                None => courses.push(vec![place]),
            }
        }
    }

    /// Number of frames that it is made of.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Places touched, each once.
    pub fn touched(&self) -> impl Iterator<Item = &TouchedPlace> {
        self.touched.values()
    }

    /// Course of the middle of the load on one finger, from contact to contact.
    pub fn courses(&self, side: Side) -> &[Vec<TouchedPlace>] {
        &self.courses[side.index()]
    }

    fn touch(&mut self, at: DVec3, t: f32, pressure: f32) {
        let cell = (at / CELL).floor().to_array().map(|k| k as i32);
        let place = self.touched.entry(cell).or_insert(TouchedPlace { at: at.as_vec3(), t, pressure });
        if pressure > place.pressure {
            *place = TouchedPlace { at: at.as_vec3(), pressure, ..*place };
        }
    }

    /// The path as a mesh in the object's frame: a mark at each place, and a line along each course.
    pub fn mesh(&self, colour: PathColour) -> SurfaceMesh {
        let mut mesh = SurfaceMesh::default();
        for place in self.touched.values() {
            add_mark(&mut mesh, place.at, MARK, colour.of(place));
        }
        for course in self.courses.iter().flatten() {
            for pair in course.windows(2) {
                add_rod(&mut mesh, [pair[0].at, pair[1].at], LINE, [colour.of(&pair[0]), colour.of(&pair[1])]);
            }
        }
        mesh
    }
}

impl PathColour {
    fn of(self, place: &TouchedPlace) -> Rgb {
        pressure_colour(match self {
            Self::Time([from, to]) => (place.t - from) / (to - from),
            Self::Pressure(full_scale) => place.pressure / full_scale,
        })
    }
}

/// Middle of the load on one pad, weighted by force.
#[derive(Default)]
struct Middle {
    force: f64,
    /// Arc length, distance across and height of the skin, each times force.
    moment: [f64; 3],
    /// Largest pressure (Pa).
    pressure: f64,
}

impl Middle {
    fn add(&mut self, force: f64, place: [f64; 3], pressure: f64) {
        self.force += force;
        self.moment.iter_mut().zip(place).for_each(|(moment, at)| *moment += force * at);
        self.pressure = self.pressure.max(pressure);
    }

    /// Its place on the skin, in the gripper frame.
    fn place(&self, placed: &PlacedFinger) -> DVec3 {
        let [arc, across, skin] = self.moment.map(|moment| moment / self.force);
        let mut along = arc;
        let last = placed.lengths.len() - 1;
        for (segment, length) in placed.lengths.iter().enumerate() {
            if along <= *length || segment == last {
                return placed.point(segment, along, across, skin);
            }
            along -= length;
        }
        placed.point(last, placed.lengths[last], across, skin)
    }
}

/// Adds an octahedron.
fn add_mark(mesh: &mut SurfaceMesh, at: Vec3, radius: f32, colour: Rgb) {
    let first = mesh.vertices.len() as u32;
    let corners = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    mesh.vertices.extend(corners.map(|normal| vertex(at + normal * radius, normal, colour)));
    for (x, y, z) in [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)] {
        mesh.indices.extend([first + x, first + y, first + z]);
    }
}

/// Adds an open rod of four sides.
fn add_rod(mesh: &mut SurfaceMesh, [from, to]: [Vec3; 2], radius: f32, colours: [Rgb; 2]) {
    let Some(along) = (to - from).try_normalize() else { return };
    let (first, sides) = (mesh.vertices.len() as u32, 4);
    let (right, up) = along.any_orthonormal_pair();
    for normal in [right, up, -right, -up] {
        mesh.vertices.push(vertex(from + normal * radius, normal, colours[0]));
        mesh.vertices.push(vertex(to + normal * radius, normal, colours[1]));
    }
    for side in 0..sides {
        let (a, b) = (first + 2 * side, first + 2 * ((side + 1) % sides));
        mesh.indices.extend([a, b, b + 1, a, b + 1, a + 1]);
    }
}

fn vertex(at: Vec3, normal: Vec3, Rgb(r, g, b): Rgb) -> SurfaceVertex {
    SurfaceVertex { position: at.to_array(), normal: normal.to_array(), colour: [r, g, b, Finish::Matt as u8] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::frame::TaxelLoad;
    use palpate_sim::gripper::{Phase, Sway};
    use palpate_sim::scene::Scene;

    fn frame(t: f64, taxels: &[u16], object: DVec3) -> Frame {
        let load = |&taxel: &u16| TaxelLoad { taxel, normal: 0.1, along: 0.0, across: 0.0 };
        Frame {
            sample: 0,
            t,
            line_bar: 0.0,
            phase: Phase::Hold,
            q: vec![0.0; 20],
            sways: [Sway::NONE; 2],
            hand: DVec3::ZERO,
            world_from_object: Some(Pose::from_position(object)),
            taxels: taxels.iter().map(load).collect(),
        }
    }

    #[test]
    fn straight_fingers_touch_where_their_taxels_are() {
        let gripper = GripperModel::default();
        let grid = gripper.taxels();
        // Both middle columns of one row of the left pad, then nothing, then a row lower on an object that sank by 5 mm.
        let lower = DVec3::new(0.0, 0.0, -0.005);
        let frames = [frame(0.1, &[41, 42], DVec3::ZERO), frame(0.2, &[], DVec3::ZERO), frame(0.3, &[45, 46], lower)];
        let path = contact_path(&gripper, &Pose::IDENTITY, &frames);
        assert_eq!((path.frames(), path.touched().count(), path.courses(Side::Right).len()), (3, 4, 0));
        let [first, second] = path.courses(Side::Left) else { panic!("two contacts") };
        assert_eq!((first.len(), second.len(), second[0].t), (1, 1, 0.3));
        let skin = grid.height(41) - grid.compression(41, f64::from(0.1f32));
        let expected = DVec3::new(skin - gripper.half_gap(), 0.0, -grid.arc(41));
        assert!((first[0].at.as_dvec3() - expected).length() < 1e-7, "{} and {expected}", first[0].at);
        // The object sank, so that the place on it is higher.
        let moved = (second[0].at - first[0].at).as_dvec3();
        assert!((moved - DVec3::new(0.0, 0.0, 0.005 - grid.row_pitch())).length() < 1e-7, "{moved}");
        let pressure = 0.1 / grid.area();
        assert!(path.touched().all(|place| (f64::from(place.pressure) / pressure - 1.0).abs() < 1e-6));
        // Frame by frame, or all at once.
        let mut grown = ContactPath::default();
        frames.iter().for_each(|frame| grown.push(&gripper, &Pose::IDENTITY, frame));
        assert_eq!(grown, path);
    }

    #[test]
    fn marks_and_lines_face_outward_and_have_their_colours() {
        let mut mesh = SurfaceMesh::default();
        add_mark(&mut mesh, Vec3::ZERO, 1.0, Rgb(1, 2, 3));
        add_rod(&mut mesh, [Vec3::ZERO, Vec3::Z * 3.0], 1.0, [Rgb(4, 5, 6), Rgb(7, 8, 9)]);
        for triangle in mesh.indices.chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.vertices[triangle[k] as usize]);
            let [p, q, r] = [a, b, c].map(|vertex| Vec3::from(vertex.position));
            let normal = (q - p).cross(r - p);
            assert!([a, b, c].iter().all(|vertex| normal.dot(Vec3::from(vertex.normal)) > 0.0), "{triangle:?}");
        }
        assert_eq!(mesh.vertices[6].colour, [4, 5, 6, Finish::Matt as u8]);
        assert_eq!((mesh.vertices[7].colour, mesh.vertices[7].position[2]), ([7, 8, 9, Finish::Matt as u8], 3.0));
        let place = TouchedPlace { at: Vec3::ZERO, t: 3.0, pressure: PAD_FULL_SCALE };
        assert_eq!(PathColour::Pressure(PAD_FULL_SCALE).of(&place), pressure_colour(1.0));
        assert_eq!(PathColour::Time([1.0, 5.0]).of(&place), pressure_colour(0.5));
    }

    #[test]
    fn the_path_lies_on_the_ball_that_is_held() {
        let mut scene = Scene::default();
        "ball".clone_into(&mut scene.object.source);
        let object = scene.load_object().expect("built in").expect("an object");
        let trial = grasp(&scene, Some(&object), 0);
        let path = contact_path(&scene.gripper, &trial.data.world_from_gripper, trial.frames());
        let radius = 0.5 * object.bounds.size().max_element();
        let middle = object.bounds.centre();
        assert!(path.touched().count() >= 4, "{}", path.touched().count());
        let courses = Side::BOTH.into_iter().flat_map(|side| path.courses(side).iter().flatten());
        for place in path.touched().chain(courses) {
            let off = (place.at.as_dvec3() - middle).length() - radius;
            assert!(off.abs() < 2e-3, "{} mm off the ball", 1e3 * off);
        }
        let sides =
            Side::BOTH.map(|side| path.courses(side).last().and_then(|course| course.last()).expect("held").at.x);
        assert!(sides[0] < 0.0 && sides[1] > 0.0, "{sides:?}");
    }
}
