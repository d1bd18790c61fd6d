//! Meshes of the fixed parts: the gripper's palm with its clamps and air fittings, and the pedestal.

use glam::DVec3;
use palpate_geometry::palette::Rgb;
use palpate_geometry::{Finish, Pose, Primitive, SurfaceMesh, TriMesh, rounded_box};
use palpate_sim::gripper::{GripperModel, Side};
use palpate_sim::scene::Support;

const BODY: Rgb = Rgb(98, 106, 116);
const CLAMP: Rgb = Rgb(74, 81, 90);
const FITTING: Rgb = Rgb(184, 190, 198);
const HOSE: Rgb = Rgb(70, 128, 178);
/// Radius of the piece that the hoses lead into (m).
const WRIST_RADIUS: f64 = 0.013;
const PEDESTAL: Rgb = Rgb(150, 155, 163);
/// Letters on the palm that name the fingers.
const LETTER: Rgb = Rgb(236, 238, 240);
/// Height of a letter, width of its strokes, and how far it stands out (m).
const LETTER_HEIGHT: f64 = 0.0086;
const STROKE: f64 = 0.0016;
const RELIEF: f64 = 0.0003;

/// The palm in the gripper frame: z = 0 is where the fingers leave it.
pub(super) fn palm(gripper: &GripperModel) -> SurfaceMesh {
    let finger = &gripper.finger;
    let half_gap = gripper.half_gap();
    let half_width = 0.5 * finger.width;
    let mut surface = SurfaceMesh::default();
    let outer = half_gap + finger.back;
    let plate = DVec3::new(outer + 0.006, half_width + 0.005, 0.007);
    surface.add(&moved(rounded_box(plate, 0.003), DVec3::new(0.0, 0.0, 0.013)), BODY, Finish::Metal);
    // The flange to the robot's wrist.
    let flange = Primitive::Cylinder { radius: 0.018, half_length: 0.006 };
    surface.add(&moved(flange.tessellate(), DVec3::new(0.0, 0.0, 0.025)), CLAMP, Finish::Plastic);
    let wrist = Primitive::Cylinder { radius: WRIST_RADIUS, half_length: 0.010 };
    surface.add(&moved(wrist.tessellate(), DVec3::new(0.0, 0.0, 0.039)), BODY, Finish::Metal);
    for side in Side::BOTH {
        let sign = side.closing_sign();
        // The clamp holds the first millimetres of the finger, pad and bellows.
        let (back, front) = (finger.back + 0.003, gripper.pad.thickness + 0.002);
        let clamp = DVec3::new(0.5 * (back + front), half_width + 0.002, 0.006);
        let middle = -sign * (half_gap + 0.5 * (back - front));
        surface.add(&moved(rounded_box(clamp, 0.0015), DVec3::new(middle, 0.0, 0.003)), CLAMP, Finish::Plastic);
        let at = DVec3::new(-sign * half_gap, 0.0, 0.0);
        let nut = Primitive::Cylinder { radius: 0.0042, half_length: 0.004 };
        surface.add(&moved(nut.tessellate(), at + DVec3::Z * 0.023), FITTING, Finish::Metal);
        surface.add(&hose(at + DVec3::Z * 0.026, sign), HOSE, Finish::Plastic);
        for facing in [-1.0, 1.0] {
            let letter = letter(side, facing);
            let place = DVec3::new(-sign * half_gap, facing * plate.y, 0.013);
            surface.add(&moved(letter, place), LETTER, Finish::Matt);
        }
    }
    surface
}

/// L or R in relief, in the plane y = 0 about the origin, legible from the side of y that `facing` names.
fn letter(side: Side, facing: f64) -> TriMesh {
    let strokes: &[[[f64; 2]; 2]] = match side {
        Side::Left => &[[[-0.3, 0.5], [-0.3, -0.5]], [[-0.3, -0.5], [0.35, -0.5]]],
        Side::Right => &[
            [[-0.3, 0.5], [-0.3, -0.5]],
            [[-0.3, 0.5], [0.15, 0.5]],
            [[0.15, 0.5], [0.35, 0.3]],
            [[0.35, 0.3], [0.35, 0.2]],
            [[0.35, 0.2], [0.15, 0.0]],
            [[0.15, 0.0], [-0.3, 0.0]],
            [[0.0, 0.0], [0.35, -0.5]],
        ],
    };
    let mut mesh = TriMesh::default();
    for [from, to] in strokes {
        // Right of the reader is +x from in front (facing -y), -x from behind.
        let point = |[x, z]: [f64; 2]| DVec3::new(-facing * x, 0.0, z) * LETTER_HEIGHT;
        let (from, to) = (point(*from), point(*to));
        let along = to - from;
        let half = DVec3::new(0.5 * (along.length() + STROKE), RELIEF, 0.5 * STROKE);
        let mut bar = Primitive::Cuboid { half }.tessellate();
        let turn = glam::DQuat::from_rotation_arc(DVec3::X, along.normalize());
        bar.transform(&Pose::new(0.5 * (from + to), turn));
        mesh.append(&bar);
    }
    mesh
}

/// An air hose from a fitting up and in towards the wrist.
fn hose(from: DVec3, sign: f64) -> TriMesh {
    const STEPS: u32 = 24;
    const AROUND: u32 = 14;
    let radius = 0.0026;
    let (up, inward) = (0.016, (from.x.abs() - WRIST_RADIUS).max(0.0));
    let point = |t: f64| {
        // A quarter of an ellipse: straight up at first, level where it meets the wrist.
        let angle = 0.5 * std::f64::consts::PI * t;
        from + DVec3::new(sign * inward * (1.0 - angle.cos()), 0.0, up * angle.sin())
    };
    let mut mesh = TriMesh::default();
    for k in 0..=STEPS {
        let t = f64::from(k) / f64::from(STEPS);
        let along = (point(t + 1e-3) - point(t - 1e-3)).normalize();
        let side = along.cross(DVec3::Y).normalize();
        for a in 0..AROUND {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(a) / f64::from(AROUND)).sin_cos();
            mesh.points.push(point(t) + (side * cos + DVec3::Y * sin) * radius);
        }
    }
    for k in 0..STEPS {
        for a in 0..AROUND {
            let (b, lower, upper) = ((a + 1) % AROUND, k * AROUND, (k + 1) * AROUND);
            let quad = [lower + a, lower + b, upper + b, upper + a];
            mesh.triangles.push([quad[0], quad[2], quad[1]]);
            mesh.triangles.push([quad[0], quad[3], quad[2]]);
        }
    }
    mesh
}

/// The pedestal in world coordinates, on a foot that spreads its load.
pub(super) fn pedestal(support: &Support) -> SurfaceMesh {
    let mut surface = SurfaceMesh::default();
    let column = Primitive::Cylinder { radius: support.radius, half_length: (0.5 * support.height).max(1e-4) };
    surface.add(&moved(column.tessellate(), DVec3::Z * (0.5 * support.height)), PEDESTAL, Finish::Plastic);
    let foot = Primitive::Cylinder { radius: support.radius * 1.9, half_length: 0.001 };
    surface.add(&moved(foot.tessellate(), DVec3::Z * 0.001), PEDESTAL, Finish::Plastic);
    surface
}

fn moved(mut mesh: TriMesh, by: DVec3) -> TriMesh {
    mesh.transform(&Pose::from_position(by));
    mesh
}
