//! Tactile signatures as heat maps: a pad unrolled at one instant; joints, and rows of taxels, over time.
//!
//! Colours of loads stand for pressure, whichever unit the numbers have; on a pad at one instant, with the limit of the 3-D
//! view. A row's pressure is its force over the area of all its taxels. Rows between the palm and the first one that is
//! touched are left out.

use palpate_geometry::drawing::{CellAxis, ColourScale, HeatMap};
use palpate_geometry::units::mm;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};
use serde::{Deserialize, Serialize};
use std::borrow::Borrow;
use std::ops::Range;

/// Pressure that has the brightest colour (Pa): taxel pressures of an ordinary hold reach some 30 kPa.
pub const PAD_FULL_SCALE: f32 = 40e3;
/// Pressures that may have the brightest colour (Pa).
const FULL_SCALES: [f32; 10] = [1e3, 2e3, 5e3, 10e3, 20e3, 40e3, 100e3, 200e3, 500e3, 1000e3];

/// Pressure that has the brightest colour (Pa) in pictures of these frames of a grasp: a round number that holds the highest
/// pressure of any taxel.
pub fn full_scale_of<'a>(gripper: &GripperModel, frames: impl IntoIterator<Item = &'a Frame>) -> f32 {
    let area = gripper.taxels().area() as f32;
    let highest = frames.into_iter().flat_map(|frame| &frame.taxels).map(|load| load.normal / area).fold(0.0, f32::max);
    full_scale(highest, 5e3)
}

/// A round number that holds a pressure, of at least so much (Pa).
fn full_scale(highest: f32, least: f32) -> f32 {
    let holds = |full: &f32| *full >= least && highest <= *full;
    FULL_SCALES.into_iter().find(holds).unwrap_or(FULL_SCALES[FULL_SCALES.len() - 1])
}

/// Rows of taxels are shown by so many, from the tip on.
const ROWS_BY: usize = 4;
/// Least rows that are shown.
const LEAST_ROWS: usize = 8;

/// Rows of taxels that any of these frames touches on either pad, with those from there to the tip: in even steps, so that
/// few touches change them as a grasp goes on.
pub fn touched_rows<'a>(gripper: &GripperModel, frames: impl IntoIterator<Item = &'a Frame>) -> Range<usize> {
    let grid = gripper.taxels();
    let taxels = frames.into_iter().flat_map(|frame| &frame.taxels).filter(|load| load.normal > 0.0);
    let first = taxels.map(|load| usize::from(load.taxel) % grid.count() / grid.columns).min().unwrap_or(grid.rows);
    // One untouched row beyond the first.
    let count = (grid.rows - first + 1).max(LEAST_ROWS).next_multiple_of(ROWS_BY);
    grid.rows.saturating_sub(count)..grid.rows
}

/// Curvature that has the strongest colour (1/m): a radius of 50 mm.
const STRONGEST_BEND: f64 = 20.0;

/// Unit of the loads in heat maps of pads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoadUnit {
    /// Pressure in kPa.
    #[default]
    Pressure,
    /// Force in N.
    Force,
}

/// Unit of the bending of joints in heat maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BendUnit {
    /// Joint angle in degrees, from the straight finger.
    #[default]
    Angle,
    /// Curvature in 1/m: joint angle over the length of a segment.
    Curvature,
}

impl LoadUnit {
    /// Its symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Pressure => "kPa",
            Self::Force => "N",
        }
    }

    fn quantity(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Force => "force",
        }
    }

    /// Factor from a force (N) on an area (m²) to a value.
    fn factor(self, area: f64) -> f64 {
        match self {
            Self::Pressure => 1e-3 / area,
            Self::Force => 1.0,
        }
    }

    /// Scale whose end is a pressure (Pa) on an area (m²).
    fn scale(self, area: f64, full_scale: f32) -> ColourScale {
        ColourScale::Load((f64::from(full_scale) * area * self.factor(area)) as f32)
    }
}

impl BendUnit {
    /// Its symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Angle => "°",
            Self::Curvature => "1/m",
        }
    }

    fn quantity(self) -> &'static str {
        match self {
            Self::Angle => "joint angle",
            Self::Curvature => "joint curvature",
        }
    }

    /// Value of a joint angle (rad), for segments of a length (m).
    fn value(self, q: f64, segment: f64) -> f64 {
        match self {
            Self::Angle => q.to_degrees(),
            Self::Curvature => q / segment,
        }
    }
}

/// Both pads unrolled and lying, left and right: columns from the palm to the tip, of the rows of taxels given, and rows from
/// negative to positive y of the gripper. The brightest colour is that of a pressure of `full_scale` (Pa), as in
/// [`full_scale_of`].
pub fn pads_at(
    gripper: &GripperModel,
    frame: &Frame,
    unit: LoadUnit,
    full_scale: f32,
    shown: &Range<usize>,
) -> [HeatMap; 2] {
    let grid = gripper.taxels();
    let half_width = 0.5 * mm(gripper.finger.width);
    Side::BOTH.map(|side| {
        let mut values = vec![0.0; grid.columns * shown.len()];
        for (taxel, load) in frame.loads(side, grid.count()) {
            let (row, column) = (taxel / grid.columns, taxel % grid.columns);
            if shown.contains(&row) {
                values[column * shown.len() + row - shown.start] =
                    (f64::from(load.normal) * unit.factor(grid.area())) as f32;
            }
        }
        let axes = [rows(gripper, shown), axis("across", "mm", grid.columns, [-half_width, half_width])];
        let quantity = format!("taxel {}", unit.quantity());
        map(side, [&quantity, unit.symbol()], axes, values, unit.scale(grid.area(), full_scale))
    })
}

/// Both pads of a gripper that reads one force on each (N), NaN where it is unknown, over an area (m²): a single cell.
pub fn whole_pads(gripper: &GripperModel, force: [f64; 2], area: f64, unit: LoadUnit) -> [HeatMap; 2] {
    let half_width = 0.5 * mm(gripper.finger.width);
    Side::BOTH.map(|side| {
        let across = axis("across", "mm", 1, [-half_width, half_width]);
        let axes = [axis("from palm", "mm", 1, [0.0, mm(gripper.finger.length)]), across];
        let values = vec![(force[side.index()] * unit.factor(area)) as f32];
        let quantity = format!("pad {}", unit.quantity());
        map(side, [&quantity, unit.symbol()], axes, values, unit.scale(area, PAD_FULL_SCALE))
    })
}

/// Bending of every joint over time, left and right: rows from the palm to the tip, a column for each frame.
pub fn joints_over_time<F: Borrow<Frame>>(gripper: &GripperModel, frames: &[F], unit: BendUnit) -> [HeatMap; 2] {
    let (joints, segment) = (gripper.finger.joints, gripper.finger.segment_length());
    let strongest = STRONGEST_BEND * segment;
    Side::BOTH.map(|side| {
        let values = over_time(frames, joints, |frame, row| {
            frame.joints(side).get(row).map_or(f32::NAN, |q| unit.value(*q, segment) as f32)
        });
        let axes = [time_axis(frames), axis("joint", "", joints, [0.5, joints as f64 + 0.5])];
        let scale = ColourScale::Signed(unit.value(strongest, segment) as f32);
        map(side, [unit.quantity(), unit.symbol()], axes, values, scale)
    })
}

/// Load on the given rows of taxels over time, left and right: from the palm to the tip, a column for each frame. The
/// brightest colour is that of a round pressure that none exceeds.
pub fn pad_rows_over_time<F: Borrow<Frame>>(
    gripper: &GripperModel,
    frames: &[F],
    unit: LoadUnit,
    shown: &Range<usize>,
) -> [HeatMap; 2] {
    let grid = gripper.taxels();
    let area = grid.area() * grid.columns as f64;
    let forces = Side::BOTH.map(|side| {
        let mut forces = vec![0.0_f32; shown.len() * frames.len()];
        for (column, frame) in frames.iter().enumerate() {
            for (taxel, load) in frame.borrow().loads(side, grid.count()) {
                let row = taxel / grid.columns;
                if shown.contains(&row) {
                    forces[(row - shown.start) * frames.len() + column] += load.normal;
                }
            }
        }
        forces
    });
    let highest = forces.iter().flatten().copied().fold(0.0, f32::max) / area as f32;
    let scale = unit.scale(area, full_scale(highest, FULL_SCALES[0]));
    Side::BOTH.map(|side| {
        let factor = unit.factor(area) as f32;
        let values = forces[side.index()].iter().map(|force| force * factor).collect();
        let axes = [time_axis(frames), rows(gripper, shown)];
        map(side, [&format!("row {}", unit.quantity()), unit.symbol()], axes, values, scale)
    })
}

/// Quantity of sensors that are shown over time, a row for each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorRows {
    /// Curvature in 1/m.
    Curvature,
    /// Pressure in Pa, shown in kPa.
    Pressure,
    /// Force in N on a pad of that area (m²).
    Force(f64),
}

/// Sensors over time, left and right, a row for each. Samples come at any times `t_s` (s); each holds until the next one,
/// and NaN where nothing was read. At most `most` columns; each keeps the value farthest from zero.
pub fn channels_over_time(t_s: &[f64], sides: [&[&[f32]]; 2], rows: SensorRows, most: usize) -> [HeatMap; 2] {
    let (quantity, unit, factor, scale) = match rows {
        SensorRows::Curvature => ("curvature", "1/m", 1.0, ColourScale::Signed(STRONGEST_BEND as f32)),
        SensorRows::Pressure => ("pressure", "kPa", 1e-3, LoadUnit::Pressure.scale(1.0, PAD_FULL_SCALE)),
        SensorRows::Force(area) => ("force", "N", 1.0, LoadUnit::Force.scale(area, PAD_FULL_SCALE)),
    };
    let range = [t_s.first(), t_s.last()].map(|t| t.copied().unwrap_or(0.0));
    let columns = most.min(t_s.len());
    let time = axis("time", "s", columns, range);
    Side::BOTH.map(|side| {
        let sensors = sides[side.index()];
        let mut values = vec![f32::NAN; sensors.len() * columns];
        for (row, sensor) in sensors.iter().enumerate() {
            let row = &mut values[row * columns..(row + 1) * columns];
            for (k, value) in sensor.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                let Some(from) = t_s.get(k).and_then(|t| time.cell(*t)) else { continue };
                let until = t_s.get(k + 1).and_then(|t| time.cell(*t)).unwrap_or(from);
                for cell in &mut row[from..until.max(from + 1)] {
                    if cell.is_nan() || value.abs() * factor > cell.abs() {
                        *cell = value * factor;
                    }
                }
            }
        }
        let axes = [time.clone(), axis("sensor", "", sensors.len(), [0.5, sensors.len() as f64 + 0.5])];
        map(side, [quantity, unit], axes, values, scale)
    })
}

/// Map of one finger, of a quantity in its unit.
fn map(
    side: Side,
    [quantity, unit]: [&str; 2],
    [x, y]: [CellAxis; 2],
    values: Vec<f32>,
    scale: ColourScale,
) -> HeatMap {
    HeatMap { title: side.name().to_owned(), quantity: quantity.to_owned(), unit: unit.to_owned(), x, y, values, scale }
}

fn axis(name: &str, unit: &str, count: usize, range: [f64; 2]) -> CellAxis {
    CellAxis { name: name.to_owned(), unit: unit.to_owned(), count, range }
}

/// Rows of taxels by their distance from the palm along the finger.
fn rows(gripper: &GripperModel, shown: &Range<usize>) -> CellAxis {
    let each = mm(gripper.finger.length) / gripper.taxels().rows as f64;
    axis("from palm", "mm", shown.len(), [shown.start, shown.end].map(|row| row as f64 * each))
}

/// A column for each frame; frames come at even times.
fn time_axis<F: Borrow<Frame>>(frames: &[F]) -> CellAxis {
    let ends = frames.first().zip(frames.last()).map_or([0.0; 2], |(first, last)| [first.borrow().t, last.borrow().t]);
    let half = 0.5 * (ends[1] - ends[0]) / (frames.len().max(2) - 1) as f64;
    axis("time", "s", frames.len(), [ends[0] - half, ends[1] + half])
}

/// Values row by row, with a column for each frame.
fn over_time<F: Borrow<Frame>>(frames: &[F], rows: usize, value: impl Fn(&Frame, usize) -> f32) -> Vec<f32> {
    (0..rows)
        .flat_map(|row| frames.iter().map(move |frame| (row, frame)))
        .map(|(row, f)| value(f.borrow(), row))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::frame::TaxelLoad;
    use palpate_sim::gripper::{Phase, Sway};
    use palpate_sim::scene::Scene;
    use palpate_tactile::trial::SimulatedTrial;

    fn frame(sample: u32, q: Vec<f64>, loads: &[(u16, f32)]) -> Frame {
        let load = |&(taxel, normal): &(u16, f32)| TaxelLoad { taxel, normal, along: 0.0, across: 0.0 };
        Frame {
            sample,
            t: 0.02 * f64::from(sample),
            line_bar: 0.0,
            phase: Phase::Close,
            q,
            sways: [Sway::NONE; 2],
            hand: glam::DVec3::ZERO,
            world_from_object: None,
            taxels: loads.iter().map(load).collect(),
        }
    }

    #[test]
    fn each_taxel_stands_in_its_row_and_column() {
        let gripper = GripperModel::default();
        // Second row, third column of the left pad; last taxel of the right one.
        let frame = frame(0, vec![0.0; 20], &[(6, 0.25), (319, 0.1)]);
        let [left, right] = pads_at(&gripper, &frame, LoadUnit::Force, PAD_FULL_SCALE, &(0..40));
        assert_eq!((left.x.count, left.y.count, left.value(2, 1), right.value(3, 39)), (40, 4, 0.25, 0.1));
        assert_eq!(left.values.iter().filter(|value| **value != 0.0).count(), 1);
        assert_eq!((left.x.text(1), left.y.text(2)), ("from palm 3.75\u{a0}mm".into(), "across 2.50\u{a0}mm".into()));
        // 0.25 N on 2.5 mm by 5 mm.
        let pressure = &pads_at(&gripper, &frame, LoadUnit::Pressure, PAD_FULL_SCALE, &(0..40))[0];
        assert!((pressure.value(2, 1) - 20.0).abs() < 1e-5, "{}", pressure.value(2, 1));
        // The colour does not depend on the unit.
        assert_eq!((left.scale, pressure.scale), (ColourScale::Load(0.5), ColourScale::Load(40.0)));
        // Cut, each stays where it is.
        let [left, right] = pads_at(&gripper, &frame, LoadUnit::Force, PAD_FULL_SCALE, &(30..40));
        assert_eq!((right.x.range, right.value(3, 9)), ([75.0, 100.0], 0.1));
        assert!(left.values.iter().all(|value| *value == 0.0) && left.values.len() == 40);
    }

    #[test]
    fn rows_are_shown_from_the_first_that_is_touched_to_the_tip() {
        let gripper = GripperModel::default();
        let touching = |taxel: u16| frame(0, vec![0.0; 20], &[(taxel, 0.1)]);
        let rows = |frames: &[&Frame]| touched_rows(&gripper, frames.iter().copied());
        // Both tips; row 27 of the right pad, with the one before; all rows.
        let [tip, middle, palm] = [159, 160 + 4 * 27, 0].map(touching);
        assert_eq!([rows(&[]), rows(&[&tip]), rows(&[&tip, &middle]), rows(&[&palm])], [32..40, 32..40, 24..40, 0..40]);
    }

    #[test]
    fn a_pad_that_reads_one_force_has_one_cell() {
        let [left, right] = whole_pads(&GripperModel::default(), [2.0, f64::NAN], 1e-4, LoadUnit::Pressure);
        assert_eq!((left.value(0, 0), left.x.count, left.y.count), (20.0, 1, 1));
        assert!(right.value(0, 0).is_nan() && right.scale.colour(right.value(0, 0)).is_none());
    }

    #[test]
    fn sensors_hold_their_value_until_the_next_sample() {
        // Ten even columns over a second; nothing is read from 0.4 s to 0.8 s.
        let t = [0.0, 0.1, 0.25, 0.4, 0.8, 0.95, 1.0];
        let strip = [1.0, 2.0, 3.0, f32::NAN, 5.0, -6.0, 4.0];
        let most = 5;
        let [left, right] = channels_over_time(&t, [&[&strip], &[]], SensorRows::Curvature, most);
        let shown: Vec<f32> = (0..most).map(|column| left.value(0, column)).collect();
        assert!(shown[2].is_nan() && shown[3].is_nan(), "{shown:?}");
        assert_eq!([shown[0], shown[1], shown[4]], [2.0, 3.0, -6.0]);
        assert_eq!((left.y.text(0), right.y.count, right.values.len()), ("sensor 1".to_owned(), 0, 0));
        let pressure = &channels_over_time(&[0.0, 1.0], [&[&[20e3, 10e3]], &[]], SensorRows::Pressure, most)[0];
        assert_eq!((pressure.values.as_slice(), pressure.scale), (&[20.0, 10.0][..], ColourScale::Load(40.0)));
        let nothing = channels_over_time(&[], [&[&[]], &[&[]]], SensorRows::Force(1e-4), most);
        assert_eq!((nothing[0].x.count, nothing[0].values.len()), (0, 0));
    }

    #[test]
    fn joints_and_rows_have_a_column_for_each_frame() {
        let gripper = GripperModel::default();
        let frames = [0, 1, 2].map(|k| {
            let mut q = vec![0.0; 20];
            q[3] = 0.1 * f64::from(k);
            q[19] = -0.05;
            frame(k, q, &[(4, 0.1), (7, 0.1 * k as f32)])
        });
        let [left, right] = joints_over_time(&gripper, &frames, BendUnit::Angle);
        assert_eq!((left.y.count, left.x.count, left.x.range), (10, 3, [-0.01, 0.05]));
        assert!((left.value(3, 2) - 0.2f32.to_degrees()).abs() < 1e-5 && left.value(3, 0) == 0.0);
        assert!((right.value(9, 1) + 0.05f32.to_degrees()).abs() < 1e-5);
        // 0.2 rad in 10 mm.
        let curved = &joints_over_time(&gripper, &frames, BendUnit::Curvature)[0];
        assert!((curved.value(3, 2) - 20.0).abs() < 1e-5);
        let [left, right] = pad_rows_over_time(&gripper, &frames, LoadUnit::Force, &(0..40));
        assert!((left.value(1, 2) - 0.3).abs() < 1e-6 && left.value(0, 2) == 0.0);
        assert!(right.values.iter().all(|value| *value == 0.0) && right.values.len() == 120);
        // 0.3 N on 50 mm²: 6 kPa of at most 10.
        assert_eq!(left.scale, ColourScale::Load(0.5));
        let cut = &pad_rows_over_time(&gripper, &frames, LoadUnit::Pressure, &(1..40))[0];
        assert!((cut.value(0, 2) - 6.0).abs() < 1e-5 && cut.scale == ColourScale::Load(10.0));
        // Nothing yet: no column, and no panic.
        let none = joints_over_time::<Frame>(&gripper, &[], BendUnit::Angle);
        assert_eq!((none[0].x.count, none[0].values.len()), (0, 0));
    }

    fn held(object: &str) -> (SimulatedTrial, Scene) {
        let mut scene = Scene::default();
        object.clone_into(&mut scene.object.source);
        let model = scene.load_object().expect("built in");
        (grasp(&scene, model.as_ref(), 0), scene)
    }

    #[test]
    fn taxels_and_rows_add_up_to_the_force_on_the_finger() {
        let (trial, scene) = held("lemon");
        let (gripper, grid, frames) = (&scene.gripper, scene.gripper.taxels(), trial.frames());
        let shown = touched_rows(gripper, frames);
        let rows = pad_rows_over_time(gripper, frames, LoadUnit::Force, &shown);
        let mut largest = 0.0f64;
        for (k, frame) in frames.iter().enumerate() {
            let pads = pads_at(gripper, frame, LoadUnit::Force, PAD_FULL_SCALE, &shown);
            for side in Side::BOTH {
                let force = frame.normal_force(side, grid.count());
                let taxels: f64 = pads[side.index()].values.iter().map(|value| f64::from(*value)).sum();
                let in_rows: f64 = (0..shown.len()).map(|row| f64::from(rows[side.index()].value(row, k))).sum();
                assert!((taxels - force).abs() < 1e-6 && (in_rows - force).abs() < 1e-6, "{side:?} at {}", frame.t);
                largest = largest.max(force);
            }
        }
        assert!(largest > 0.5, "the lemon is held with {largest} N");
    }

    #[test]
    fn both_fingers_feel_a_symmetric_object_alike() {
        let (trial, scene) = held("ball");
        let frames = trial.frames();
        let [left, right] = pad_rows_over_time(&scene.gripper, frames, LoadUnit::Pressure, &(0..40));
        let peak = left.values.iter().copied().fold(0.0, f32::max);
        assert!(peak > 1.0, "{peak} kPa");
        for (a, b) in left.values.iter().zip(&right.values) {
            assert!((a - b).abs() < 0.02 * peak, "{a} and {b} of {peak} kPa");
        }
        let [left, right] = joints_over_time(&scene.gripper, frames, BendUnit::Angle);
        assert!(left.values.iter().zip(&right.values).all(|(a, b)| (a - b).abs() < 0.05));
    }
}
