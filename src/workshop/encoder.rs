//! The shipped geometry encoders: grasps random shapes, trains on them, and judges the estimates on the sixteen objects.

use super::{Failure, report};
use palpate_geometry::units::three_digits;
use palpate_lab::datasets::SensorView;
use palpate_lab::grasping::{KnownGrasps, SHAPES, random_shapes};
use palpate_learn::{Fitting, GeometryEncoder, GeometryScores, Measure, Shipped};
use palpate_sim::objects::catalogue;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_tactile::model::SensorModel;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The pose preset: any face the object rests on, any turn.
const PRESET: &str = "B";
/// Poses of each of the sixteen that judge the estimates.
const JUDGED: u64 = 30;
/// Seeds of the training poses, and of those that judge.
const SEEDS: [u64; 2] = [1, 2];
/// Number of drawn grippers that read each grasp for training.
const DRAWS: u32 = 4;

/// Grasps of objects that an encoder is for.
fn grasps(which: Shipped, objects: Vec<String>, poses: u64, fixed: &[bool]) -> Result<KnownGrasps, Failure> {
    let mut pose = PosePreset::named(PRESET).ok_or("the preset is gone")?.poses();
    let mut view = SensorView::default();
    if which == Shipped::AnyGripper {
        (pose.build, view.sensors) = (1.0, SensorModel::Drawn);
    }
    let scene = Scene { pose, ..Scene::default() };
    Ok(KnownGrasps { scene, view, objects, poses, fixed: fixed.to_vec(), seed: SEEDS[1] })
}

/// Trains an encoder on this many shapes, and writes it.
pub(crate) fn make(which: Shipped, out: &Path, shapes: u64, poses: u64) -> Result<(), Failure> {
    std::fs::create_dir_all(out)?;
    let stop = AtomicBool::new(false);
    let mut plan = grasps(which, random_shapes(0..shapes), poses, &[false, true])?;
    (plan.seed, plan.view.draws) = (SEEDS[0], DRAWS);
    let (channels, touches) = (plan.channels()?, plan.simulate(&stop)?);
    report(format_args!("{} readings of grasps of {shapes} shapes, free and fixed", touches.len()));
    let names = SHAPES.map(|shape| shape.name().to_owned());
    let fitting = Fitting::new(1, false, &stop);
    let encoder = GeometryEncoder::fit(&channels, &names, &touches, &fitting)?;
    let bytes = encoder.to_bytes()?;
    let path = out.join(which.encoder_file());
    std::fs::write(&path, &bytes)?;
    report(format_args!("saved as {}, {} bytes", path.display(), bytes.len()));
    let sixteen: Vec<String> = catalogue().iter().map(|object| object.name.clone()).collect();
    for (name, fixed) in [("free", false), ("fixed", true)] {
        let touches = grasps(which, sixteen.clone(), JUDGED, &[fixed])?.simulate(&stop)?;
        for seconds in [1.5, 2.0, 4.0] {
            describe(&format!("the sixteen, {name}, {seconds} s"), &encoder.judge(&touches, seconds));
        }
    }
    Ok(())
}

fn describe(title: &str, scores: &GeometryScores) {
    let of_measure = |score: &palpate_learn::MeasureScore| {
        let (factor, unit) = if score.measure == Measure::Mass { (1e3, "g") } else { (1e3, "mm") };
        let error = three_digits(score.median_error * factor);
        format!("{:?} {error} {unit} ({:.0} % inside)", score.measure, 100.0 * score.inside)
    };
    let measures: Vec<String> = scores.measures.iter().map(of_measure).collect();
    let (shape, grasps) = (100.0 * scores.shape, scores.grasps);
    report(format_args!("{title}, {grasps} grasps: shape {shape:.0} %; {}", measures.join(", ")));
}
