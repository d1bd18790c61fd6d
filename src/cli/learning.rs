//! Arguments and helpers shared by `train` and `evaluate`.

use super::origin::OriginFilters;
use super::prelude::*;
use super::setup;
use palpate_lab::datasets::{Cut, DatasetQuery, PhysicsVersion, SensorView, check_model_path, models_folder};
use palpate_learn::comparison::{Compared, Comparison, MethodResult, compare};
use palpate_learn::{Dataset, LeakCheck, METHODS, Method, Split, StopRule, counted, method};
use palpate_store::CalibrationId;
use palpate_tactile::model::SensorModel;

/// Whether trials that were not simulated can be told apart by something else than touch; a leak is a warning.
pub(super) fn leak_checks(data: &Dataset, seed: u64) -> Vec<LeakCheck> {
    if !data.about.is_recorded() {
        return Vec::new();
    }
    let checks = data.leak_checks(seed);
    checks.iter().filter(|check| check.leaks).for_each(|check| warn(&check.to_string()));
    checks.into()
}

/// Reads grasps under a progress bar, and warns of what they mix and lack.
pub(super) fn read_dataset(query: &DatasetQuery, store: &Store, view: &SensorView) -> Result<Dataset, Failure> {
    let bar = Progress::of("reading trials");
    let data = query.read(store, view, &mut |done, of| bar.show(done, of));
    drop(bar);
    let data = data?;
    for mixed in &data.about.mixed {
        warn(&format!("the trials mix {mixed}"));
    }
    if data.about.left_out > 0 {
        warn(&format!("{} trial(s) left out: {}", data.about.left_out, counted(&data.about.left_out_for)));
    }
    Ok(data)
}

/// Selection of trials.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct QueryArguments {
    #[command(flatten)]
    pub(super) origin: OriginFilters,
    /// Only simulated trials of this version of the physics, or of an unknown one.
    #[arg(long, value_name = "N|unknown")]
    physics: Option<PhysicsVersion>,
    /// Only trials of a real gripper that these calibrations serve; name one for each part, separated by commas.
    #[arg(long, value_name = "N,..", value_delimiter = ',')]
    calibration: Vec<CalibrationId>,
    /// Keep trials with flags.
    #[arg(long)]
    include_flagged: bool,
    /// Only these objects, separated by commas.
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    pub(super) objects: Vec<String>,
}

/// Selection of trials, and how simulated ones are sensed.
#[derive(Debug, clap::Args)]
pub(super) struct DataArguments {
    #[command(flatten)]
    pub(super) trials: QueryArguments,
    #[command(flatten)]
    pub(super) signals: SignalArguments,
    /// Sensor model for simulated trials: virtual (perfect), noisy (the same with slip, drift and noise), physical-like (as on
    /// the real gripper), adapted (the same after `palpate adapt`), or drawn (as on any gripper after it, another one for each
    /// grasp).
    #[arg(long, value_name = "MODEL", default_value = "virtual", value_parser = one_of(SensorModel::ALL.map(|model| (model.name(), model))))]
    pub(super) sensors: SensorModel,
    /// With --sensors drawn or noisy: number of readings of each grasp for training, each by other sensors.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=64), requires = "sensors")]
    draws: u32,
    /// Read the readings at this rate (Hz; default: as they were sampled).
    #[arg(long, value_name = "HZ", value_parser = within(1.0..=10_000.0))]
    rate: Option<f64>,
    /// End of the readings: hold-end, whole (with the release), or seconds from the start of the closing.
    #[arg(long, value_name = "END", default_value = "hold-end")]
    cut: Cut,
    /// Random seed of initial weights, order and sampling.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// Small networks and few epochs: quick, but worse results.
    #[arg(long)]
    pub(super) quick: bool,
}

impl QueryArguments {
    /// The query for the trials.
    pub(super) fn query(&self, without_empty: bool, most_of_each: Option<usize>) -> DatasetQuery {
        let OriginFilters { source, preset, collection, tag, since, until } = self.origin.clone();
        DatasetQuery {
            collection,
            source,
            preset,
            since,
            until,
            tag,
            physics: self.physics,
            calibrations: self.calibration.clone(),
            include_flagged: self.include_flagged,
            objects: self.objects.clone(),
            without_empty,
            most_of_each,
        }
    }
}

impl DataArguments {
    pub(super) fn view(&self, store: &Store) -> Result<SensorView, Failure> {
        let view = SensorView {
            sensors: self.sensors,
            draws: self.draws,
            rate_hz: self.rate,
            cut: self.cut,
            ..self.signals.view()
        };
        self.signals.of_store(view, store)
    }

    /// Reads the grasps from the store.
    pub(super) fn read(
        &self,
        store: &Store,
        without_empty: bool,
        most_of_each: Option<usize>,
    ) -> Result<Dataset, Failure> {
        read_dataset(&self.trials.query(without_empty, most_of_each), store, &self.view(store)?)
    }

    /// Fits and tests methods on all splits, on this many threads, or one per core. Of several methods, each has a line on
    /// standard error as it ends. `interrupted` ends it with an error.
    pub(super) fn compare(
        &self,
        data: &Dataset,
        splits: &[Split],
        methods: &[&'static Method],
        threads: Option<u16>,
        interrupted: &AtomicBool,
    ) -> Result<Compared, Failure> {
        let parts: Vec<[Dataset; 3]> = splits.iter().map(|split| parts(data, split)).collect();
        let comparisons: Vec<Comparison<'_>> = parts.iter().map(|parts| self.comparison(parts, interrupted)).collect();
        let bar = Progress::of("training and testing");
        bar.show(0, methods.len() * splits.len());
        let progress = |ended: Option<MethodResult>| {
            bar.0.inc(1);
            if let Some(MethodResult { method, f1_macro, train_cpu_s }) = ended.filter(|_| methods.len() > 1) {
                let line = format!("{method}: F1 {:.1}, training {train_cpu_s:.1} CPU s", 100.0 * f1_macro);
                bar.0.suspend(|| note(&line));
            }
        };
        let compared = compare(&comparisons, methods, setup::threads(threads), &progress);
        Ok(compared.map_err(|error| {
            if interrupted.load(Ordering::Relaxed) { "stopped".to_owned() } else { error.to_string() }
        })?)
    }

    /// Comparison on one split, of its three parts.
    pub(super) fn comparison<'a>(
        &self,
        [train, second, test]: &'a [Dataset; 3],
        interrupted: &'a AtomicBool,
    ) -> Comparison<'a> {
        let second = Some(second).filter(|second| !second.examples.is_empty());
        let (seed, quick) = (self.seed, self.quick);
        Comparison { train, second, test, seed, quick, stop: StopRule::default(), interrupted }
    }
}

/// Training set, that of stage two, and test set of a split.
pub(super) fn parts(data: &Dataset, split: &Split) -> [Dataset; 3] {
    [&split.train, &split.second, &split.test].map(|part| data.part(part))
}

/// File for a model that is about to be made: the named one, or one of this name in the models folder.
pub(super) fn model_file(out: Option<&Path>, name: &str) -> Result<PathBuf, Failure> {
    let Some(out) = out else { return Ok(models_folder().join(format!("{name}.safetensors"))) };
    check_folder(out)?;
    check_model_path(out)?;
    Ok(out.to_owned())
}

/// Finds a method by its key; the error lists all keys.
pub(super) fn known_method(key: &str) -> Result<&'static Method, Failure> {
    method(key).ok_or_else(|| {
        let keys: Vec<&str> = METHODS.iter().map(|m| m.key).collect();
        format!("no method \"{key}\"; choose one of {}", keys.join(", ")).into()
    })
}
