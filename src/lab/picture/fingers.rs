//! Soft fingers of a frame: frames along the neutral axis, and taxel loads.

use palpate_geometry::Pose;
use palpate_geometry::drawing::{FingerFrame, FingerSensors, Section, SoftFinger, TaxelField, Veil};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, PlacedFinger, Side, TaxelGrid};

/// Both fingers as draw-list items.
pub(super) fn soft_fingers(
    gripper: &GripperModel,
    world_from_gripper: &Pose,
    frame: &Frame,
    full_scale: f32,
) -> Vec<SoftFinger> {
    let grid = gripper.taxels();
    let section = Section {
        width: gripper.finger.width as f32,
        pad: gripper.pad.thickness as f32,
        crown_radius: gripper.pad.crown_radius as f32,
        back: gripper.finger.back.max(1e-3) as f32,
    };
    Side::BOTH
        .into_iter()
        .map(|side| SoftFinger {
            frames: axis_frames(gripper, world_from_gripper, frame, side),
            section,
            taxels: taxel_field(&grid, frame, side),
            full_scale,
            veil: Veil::default(),
            sensors: FingerSensors::default(),
        })
        .collect()
}

/// The palm, the middle of each whole segment, and the tip: a smooth curve through these with their directions
/// passes where the rigid segments are.
fn axis_frames(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame, side: Side) -> Vec<FingerFrame> {
    let placed = frame.placed(gripper, side);
    let last = placed.lengths.len() - 1;
    let mut frames = Vec::with_capacity(last + 2);
    let mut arc = 0.0;
    for (j, length) in placed.lengths.iter().enumerate() {
        let along = if j == 0 { 0.0 } else { 0.5 * length };
        if j < last {
            frames.push(axis_frame(&placed, world_from_gripper, (j, along), arc + along));
        }
        arc += length;
    }
    frames.push(axis_frame(&placed, world_from_gripper, (last, placed.lengths[last]), arc));
    frames
}

fn axis_frame(
    placed: &PlacedFinger,
    world_from_gripper: &Pose,
    (segment, along): (usize, f64),
    arc: f64,
) -> FingerFrame {
    let axes = placed.axes(segment);
    FingerFrame {
        arc: arc as f32,
        position: world_from_gripper.point(placed.point(segment, along, 0.0, 0.0)).as_vec3(),
        along: world_from_gripper.direction(axes.x_axis).as_vec3(),
        inward: world_from_gripper.direction(axes.z_axis).as_vec3(),
    }
}

fn taxel_field(grid: &TaxelGrid, frame: &Frame, side: Side) -> TaxelField {
    let mut loads = vec![[0.0; 2]; grid.count()];
    for (taxel, load) in frame.loads(side, grid.count()) {
        let force = f64::from(load.normal).max(0.0);
        // The renderer's "across" is inward x along: +y for the left finger, -y for the right.
        let mirrored = match side {
            Side::Left => taxel,
            Side::Right => taxel + grid.columns - 1 - 2 * (taxel % grid.columns),
        };
        loads[mirrored] = [(force / grid.area()) as f32, grid.compression(taxel, force) as f32];
    }
    TaxelField { rows: grid.rows as u32, columns: grid.columns as u32, loads }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use palpate_sim::frame::TaxelLoad;
    use palpate_sim::gripper::Phase;

    #[test]
    fn straight_fingers_hang_from_the_palm() {
        let gripper = GripperModel::default();
        let frame = Frame {
            sample: 0,
            t: 0.0,
            line_bar: 0.0,
            phase: Phase::Close,
            q: vec![0.0; 20],
            sways: [palpate_sim::gripper::Sway::NONE; 2],
            hand: glam::DVec3::ZERO,
            world_from_object: None,
            taxels: [1, 161].map(|taxel| TaxelLoad { taxel, normal: 0.1, along: 0.0, across: 0.0 }).into(),
        };
        let [left, right]: [SoftFinger; 2] =
            soft_fingers(&gripper, &Pose::IDENTITY, &frame, 1e4).try_into().expect("two");
        assert_eq!(left.frames.len(), 11);
        assert!((left.frames[10].position - Vec3::new(-0.05, 0.0, -0.1)).length() < 1e-6);
        assert_eq!((left.frames[0].arc, left.frames[1].arc), (0.0, 0.01));
        assert!(left.frames[3].inward.x > 0.999 && right.frames[3].inward.x < -0.999);
        // The second taxel of the first row is drawn where it is, on either finger.
        let grid = gripper.taxels();
        for finger in [left, right] {
            let column = finger.taxels.loads.iter().position(|l| l[0] > 0.0).expect("loaded") as f32;
            let across = finger.frames[0].inward.cross(finger.frames[0].along);
            let offset = ((column + 0.5) / grid.columns as f32 - 0.5) * finger.section.width;
            assert!((across.y * offset - grid.across(1) as f32).abs() < 1e-6, "column {column}");
        }
    }
}
