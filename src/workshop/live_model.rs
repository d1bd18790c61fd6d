//! The shipped recognition model: collects its grasps, trains it, evaluates it on grasps of another seed, and writes it
//! with its card.

use super::{Failure, report};
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_lab::grasping::{CollectionPlan, collect};
use palpate_lab::study::Comparison;
use palpate_learn::evaluation::prefix_calibration;
use palpate_learn::{Dataset, Fitting, Model, Signatures, StopRule, method};
use palpate_sim::scene::{PosePreset, Scene};
use palpate_store::Store;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Name of the file.
const FILE: &str = "live.safetensors";
/// The method, and what differs from its own settings: many grasps need fewer rounds through them.
const METHOD: &str = "ids-lstm-cross";
const EPOCHS: usize = 60;
/// Grasps of each object to learn from, and to judge by.
const TRIALS: [u32; 2] = [300, 100];
const SEEDS: [u64; 2] = [1, 2];
/// The pose preset: any face the object rests on, any turn.
const PRESET: &str = "B";

/// Grasps to learn from (0) or to judge by (1).
fn collected(set: usize, store: &mut Store) -> Result<Dataset, Failure> {
    let preset = PosePreset::named(PRESET).ok_or("the preset is gone")?;
    let scene = Scene { pose: preset.poses(), ..Scene::default() };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let plan = CollectionPlan::of_all_objects(scene, TRIALS[set], SEEDS[set]);
    let report = collect(&plan, store, threads, &mut |_| ControlFlow::Continue(()))?;
    let source = DatasetQuery { collection: Some(report.collection), ..DatasetQuery::default() };
    Ok(source.read(store, &SensorView::default(), &mut |_, _| ())?)
}

/// Stores the class signatures of the training grasps in the shipped model, whose weights stay.
pub(crate) fn add_signatures(out: &Path, store: &mut Store) -> Result<(), Failure> {
    let path = out.join(FILE);
    let model = Model::load(&path)?;
    let before = model.recogniser.arrays();
    let grasps = collected(0, store)?;
    model.check_channels(&grasps.channels)?;
    let signatures = grasps.relabelled(&model.card.labels).as_ref().and_then(Signatures::of);
    let model = model.with_signatures(Some(signatures.ok_or("the model lacks a class of the training grasps")?));
    model.save(&path)?;
    if Model::load(&path)?.recogniser.arrays() != before {
        return Err("the weights of the saved model differ".into());
    }
    let (now, then) = (&grasps.about, &model.card.data);
    report(format_args!(
        "{} grasps of collection {}; trained on {} of {}",
        now.grasps,
        now.collections.join(", "),
        then.grasps,
        then.collections.join(", ")
    ));
    report(format_args!("saved as {}, {} bytes", path.display(), std::fs::metadata(&path)?.len()));
    Ok(())
}

pub(crate) fn make(out: &Path, store: &mut Store) -> Result<(), Failure> {
    // Training takes minutes: what cannot be written fails before it.
    std::fs::create_dir_all(out)?;
    let [train, test] = [collected(0, store)?, collected(1, store)?];
    let method = method(METHOD).ok_or("the method is gone")?;
    let settings = serde_json::json!({ "epochs": EPOCHS }).as_object().cloned().unwrap_or_default();
    let interrupted = AtomicBool::new(false);
    let progress = |_share: f64| ();
    let fitting = Fitting { seed: 1, quick: false, settings, second: None, progress: &progress, stop: &interrupted };
    let mut model = method.train(&train, &fitting)?;
    let objects: Vec<usize> =
        (0..test.examples.len()).filter(|k| test.labels.classes[test.examples[*k].class].size.is_some()).collect();
    let objects = test.part(&objects);
    let stop = StopRule::default();
    let comparison = Comparison {
        train: &train,
        second: None,
        test: &objects,
        seed: 1,
        quick: false,
        stop,
        interrupted: &interrupted,
    };
    let row = comparison.of_fitted(METHOD, &model)?;
    let halfway = prefix_calibration(model.recogniser.as_ref(), &objects, 0.5);
    let test =
        format!("{} further grasps of the sixteen: {}", objects.examples.len(), objects.about.lines().join("; "));
    model.card.metrics = row.evaluation.metrics(&test);
    model.card.metrics["ece_halfway"] = serde_json::json!(halfway);
    // How long it took depends on the machine, and the file should not.
    model.card.train_cpu_s = 0.0;
    let path = out.join(FILE);
    model.save(&path)?;
    let e = &row.evaluation;
    report(format_args!(
        "F1 {:.3}, after three grasps {:.3}",
        e.f1_macro,
        e.f1_by_grasps.get(2).copied().unwrap_or(0.0)
    ));
    report(format_args!("saved as {}", path.display()));
    Ok(())
}
