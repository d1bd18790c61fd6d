//! The shipped recognition models: collects their grasps, trains them, evaluates them on grasps of another seed, and writes
//! them with their cards.

use super::{Failure, report};
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_lab::grasping::{CollectionPlan, KnownTouches, Stance, collect, random_shapes};
use palpate_learn::comparison::Comparison;
use palpate_learn::evaluation::prefix_calibration;
use palpate_learn::{Dataset, Fitting, Shipped, StopRule, method};
use palpate_sim::scene::{PosePreset, Scene};
use palpate_store::Store;
use palpate_tactile::model::SensorModel;
use std::ops::{ControlFlow, Range};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// How a shipped model is made.
struct Recipe {
    which: Shipped,
    method: &'static str,
    /// Passes over the grasps.
    epochs: usize,
    /// Grasps of each object to learn from, to judge by, and to guide by, and the seeds of their poses.
    trials: [u32; 3],
    seeds: [u64; 3],
    /// Seeds of random shapes, each grasped once, of the class "other".
    others: Range<u64>,
    view: SensorView,
    /// Number of further readings of each training grasp through noisy sensors.
    noisy: u32,
    /// How much the build of the gripper varies.
    build: f64,
}

/// The pose preset: any face the object rests on, any turn.
const PRESET: &str = "B";

impl Recipe {
    fn of(which: Shipped) -> Self {
        let virtual_view = SensorView::default();
        match which {
            // The studies judge by grasps of other seeds.
            Shipped::PerfectSensors => Self {
                which,
                method: "geometry-network",
                epochs: 60,
                trials: [900, 100, 200],
                seeds: [7, 2, 11],
                others: 5000..6000,
                view: virtual_view,
                noisy: 2,
                build: 0.0,
            },
            // Its random shapes are not those that the encoder has learned from.
            Shipped::AnyGripper => Self {
                which,
                method: "geometry-network",
                epochs: 14,
                trials: [800, 50, 200],
                seeds: [1, 2, 11],
                others: 5000..9000,
                view: SensorView { sensors: SensorModel::Drawn, draws: 6, ..virtual_view },
                noisy: 0,
                build: 1.0,
            },
            // Poses of fixed objects differ more: more grasps and passes pay.
            Shipped::FixedObjects => Self {
                which,
                method: "geometry-network",
                epochs: 100,
                trials: [1200, 100, 100],
                seeds: [7, 2, 11],
                others: 5000..6000,
                view: virtual_view,
                noisy: 2,
                build: 0.0,
            },
        }
    }

    /// Grasps to learn from (0), to judge by (1) or to guide by (2).
    fn collected(&self, set: usize, store: &mut Store) -> Result<Dataset, Failure> {
        let mut pose = PosePreset::named(PRESET).ok_or("the preset is gone")?.poses();
        pose.build = self.build;
        let mut scene = Scene { pose, ..Scene::default() };
        scene.object.fixed = self.which == Shipped::FixedObjects;
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let mut plan = CollectionPlan::of_all_objects(scene, self.trials[set], self.seeds[set]);
        let mut collection = collect(&plan, store, threads, &mut |_| ControlFlow::Continue(()))?.collection;
        if set == 0 && !self.others.is_empty() {
            // Plans that differ in objects alone make one collection.
            (plan.objects, plan.trials) = (random_shapes(self.others.clone()), 1);
            collection = collect(&plan, store, threads, &mut |_| ControlFlow::Continue(()))?.collection;
        }
        let source = DatasetQuery { collection: Some(collection), ..DatasetQuery::default() };
        let mut grasps = source.read(store, &self.view, &mut |_, _| ())?;
        if set == 0 && self.noisy > 0 {
            let noisy = SensorView { sensors: SensorModel::Noisy, draws: self.noisy, ..self.view.clone() };
            grasps.add_readings(&source.read(store, &noisy, &mut |_, _| ())?);
        }
        Ok(grasps)
    }
}

/// Collects and writes the grasps in known poses that guide the next grasp.
pub(crate) fn make_touches(which: Shipped, out: &Path, store: &mut Store) -> Result<(), Failure> {
    std::fs::create_dir_all(out)?;
    let mut recipe = Recipe::of(which);
    recipe.view.draws = 1;
    let grasps = recipe.collected(2, store)?;
    let mut touches = Vec::new();
    for example in &grasps.examples {
        let header = store.load(example.id)?.header;
        touches.push((example.class, Stance::of(&header.scene), example.grasp.as_ref()));
    }
    let classes = grasps.labels.classes.iter().map(|class| class.name.clone()).collect();
    let about = grasps.about.lines();
    let touches = KnownTouches::new(grasps.channels.clone(), classes, about, &touches);
    let path = out.join(KnownTouches::file(which));
    let bytes = touches.to_bytes()?;
    std::fs::write(&path, &bytes)?;
    report(format_args!("{} grasps saved as {}, {} bytes", grasps.examples.len(), path.display(), bytes.len()));
    Ok(())
}

/// Collects, trains and writes a model.
pub(crate) fn make(which: Shipped, out: &Path, store: &mut Store) -> Result<(), Failure> {
    let recipe = Recipe::of(which);
    // Training takes minutes: what cannot be written fails before it.
    std::fs::create_dir_all(out)?;
    let [train, test] = [recipe.collected(0, store)?, recipe.collected(1, store)?];
    let method = method(recipe.method).ok_or("the method is gone")?;
    let settings = [("epochs".to_owned(), recipe.epochs.into())].into_iter().collect();
    let interrupted = AtomicBool::new(false);
    let fitting = Fitting { settings, ..Fitting::new(1, false, &interrupted) };
    let mut model = method.train(&train, &fitting)?;
    let objects: Vec<usize> =
        (0..test.examples.len()).filter(|k| test.labels.classes[test.examples[*k].class].size.is_some()).collect();
    let objects = test.part(&objects).relabelled(&train.labels).ok_or("an object was not learned")?;
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
    let row = comparison.of_fitted(recipe.method, &model)?;
    let halfway = prefix_calibration(model.recogniser.as_ref(), &objects, 0.5);
    let test =
        format!("{} further grasps of the sixteen: {}", objects.examples.len(), objects.about.lines().join("; "));
    model.card.metrics = row.evaluation.metrics(&test);
    model.card.metrics["ece_halfway"] = serde_json::json!(halfway);
    // How long it took depends on the machine, and the file should not.
    model.card.train_cpu_s = 0.0;
    let path = out.join(recipe.which.model_file());
    palpate_lab::datasets::save_model(&model, &path)?;
    let e = &row.evaluation;
    report(format_args!(
        "F1 {:.3}, after three grasps {:.3}",
        e.f1_macro,
        e.f1_by_grasps.get(2).copied().unwrap_or(0.0)
    ));
    report(format_args!("saved as {}", path.display()));
    Ok(())
}
