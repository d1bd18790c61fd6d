//! The shipped recognition model: collects its grasps, trains it, evaluates it on grasps of another seed, and writes it
//! with its card.

use super::{Failure, report};
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_lab::grasping::{CollectionPlan, collect};
use palpate_lab::study::Comparison;
use palpate_learn::evaluation::prefix_calibration;
use palpate_learn::{Dataset, Fitting, StopRule, method};
use palpate_sim::scene::{PosePreset, Scene};
use palpate_store::Store;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The method, and what differs from its own settings: many grasps need fewer rounds through them.
const METHOD: &str = "ids-lstm-cross";
const EPOCHS: usize = 60;
/// Grasps of each object to learn from, and to judge by.
const TRIALS: [u32; 2] = [300, 100];
const SEEDS: [u64; 2] = [1, 2];
/// The pose preset: any face the object rests on, any turn.
const PRESET: &str = "B";

pub(crate) fn make(out: &Path, store: &mut Store) -> Result<(), Failure> {
    let preset = PosePreset::named(PRESET).ok_or("the preset is gone")?;
    let scene = Scene { pose: preset.poses(), ..Scene::default() };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut sets = Vec::new();
    for (trials, seed) in TRIALS.into_iter().zip(SEEDS) {
        let plan = CollectionPlan::of_all_objects(scene.clone(), trials, seed);
        let report = collect(&plan, store, threads, &mut |_| ());
        let source = DatasetQuery { collection: Some(report?.collection), ..DatasetQuery::default() };
        sets.push(source.read(store, &SensorView::default(), &mut |_, _| ())?);
    }
    let [train, test]: [Dataset; 2] = sets.try_into().map_err(|_others| "two data sets were asked for")?;
    let method = method(METHOD).ok_or("the method is gone")?;
    let settings = serde_json::json!({ "epochs": EPOCHS }).as_object().cloned().unwrap_or_default();
    let interrupted = AtomicBool::new(false);
    let progress = |_share: f64| ();
    let fitting = Fitting { seed: 1, quick: false, settings, progress: &progress, stop: &interrupted };
    let mut model = method.train(&train, &fitting)?;
    let objects: Vec<usize> =
        (0..test.examples.len()).filter(|k| test.labels.classes[test.examples[*k].class].size.is_some()).collect();
    let objects = test.part(&objects);
    let stop = StopRule::default();
    let comparison =
        Comparison { train: &train, test: &objects, seed: 1, quick: false, stop, interrupted: &interrupted };
    let row = comparison.of_fitted(METHOD, &model)?;
    let halfway = prefix_calibration(model.recogniser.as_ref(), &objects, 0.5);
    model.card.metrics = serde_json::json!({
        "test": format!("{} further grasps of the sixteen: {}", objects.examples.len(), objects.about.described()),
        "f1_macro": row.evaluation.f1_macro,
        "ci95": row.evaluation.ci95,
        "f1_by_grasps": row.evaluation.f1_by_grasps,
        "stage_one": row.evaluation.stage_one,
        "ece": row.evaluation.ece,
        "ece_halfway": halfway,
        "stopping": row.evaluation.stopping,
    });
    // How long it took depends on the machine, and the file should not.
    model.card.train_cpu_s = 0.0;
    let path = out.join("live.safetensors");
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
