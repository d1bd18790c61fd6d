//! `palpate collect`: collects a simulated data set in parallel, resumable, in parts.

use super::prelude::*;
use super::setup::{RecomputeArguments, classes_of, threads};
use palpate_lab::grasping::{CollectionError, CollectionPlan, CollectionReport, Shard, all_objects};
use palpate_sim::objects::titled;
use palpate_store::StoreError;
use std::ops::ControlFlow;

/// Arguments of `palpate collect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate collect --preset B --store set.sqlite
  palpate collect --objects ball,cube --trials 200 --seed 7
  palpate collect --trials 1000 --shard 3/20 --store part3.sqlite

See also: palpate help datasets")]
pub(super) struct CollectArguments {
    /// Trials per object.
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    trials: u32,
    /// Built-in names or files, separated by commas (default: the sixteen and the empty hand).
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    objects: Vec<String>,
    /// Classes of the objects, separated by commas (default: the names in their files, or of the files or their folders).
    #[arg(long = "class", value_name = "A,B,..", value_delimiter = ',', requires = "objects")]
    classes: Vec<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Random seed of the poses.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Collect only part K of N, for several machines; `palpate trials merge` joins the stores.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Number of threads (default: one per core). The data do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    #[command(flatten)]
    recompute: RecomputeArguments,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct CollectReport {
    #[serde(flatten)]
    collection: CollectionReport,
    /// CPU time of the whole command (s).
    cpu_s: f64,
    threads: usize,
    #[serde(skip)]
    store: PathBuf,
}

pub(super) fn run(arguments: &CollectArguments, store: Option<&Path>) -> Result<(), Failure> {
    let objects = if arguments.objects.is_empty() { all_objects() } else { arguments.objects.clone() };
    let plan = CollectionPlan {
        scene: arguments.scene.scene(None)?,
        classes: classes_of(&arguments.classes, objects.len())?,
        objects,
        trials: arguments.trials,
        seed: arguments.seed,
        shard: arguments.shard.unwrap_or(Shard::WHOLE),
        recompute: arguments.recompute.chosen(),
    };
    let threads = threads(arguments.threads);
    // Before the store, which is made where there is none.
    let ready = plan.ready()?;
    let mut store = open_store(store)?;
    let stop = stop_flag()?;
    let bar = Progress::new("{bar:40} {pos}/{len} {msg} {eta} left");
    let start = cpu_time::ProcessTime::now();
    let (mut kept, mut of) = (0, 0);
    let outcome = ready.collect(&mut store, threads, &mut |progress| {
        bar.0.set_message(titled(&progress.object));
        bar.show(progress.done as usize, progress.of as usize);
        (kept, of) = (progress.done, progress.of);
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    drop(bar);
    let collection = outcome.map_err(|error| match error {
        // Of a store that is gone nothing is kept.
        CollectionError::Store(StoreError::FileLost { .. }) => error.to_string(),
        _ if kept == 0 => error.to_string(),
        error => format!("{error}. {kept} of {of} trials are kept; the same command resumes with the rest"),
    })?;
    let cpu_s = start.elapsed().as_secs_f64();
    let report = CollectReport { collection, cpu_s, threads, store: store.path().to_owned() };
    report.print(arguments.json)?;
    let CollectionReport { interrupted, known, stored, .. } = report.collection;
    if interrupted {
        let (kept, path) = (known + stored, store.path().display());
        let text = format!("stopped: {kept} of {of} trials are kept in {path}; the same command resumes with the rest");
        return Err(text.into());
    }
    Ok(())
}

impl Report for CollectReport {
    fn text(&self, page: &mut Page) {
        let Self { collection, cpu_s, threads, store } = self;
        let CollectionReport { stored, known, redrawn, recomputed, unsound, .. } = collection;
        page.fact("collection", format!("{} in {}", collection.collection, store.display()));
        page.fact("stored", format!("{stored} new trials, {known} already there"));
        page.fact("poses", format!("{redrawn} redrawn because the open fingers had no room"));
        let finer = || format!("{recomputed} trials at a finer accuracy than the scene asks for");
        page.fact("recomputed", (*recomputed > 0).then(finer));
        let unsound_ones = || {
            format!(
                "{unsound} trials did not converge in every step or did not come to rest at any accuracy; they are marked, \
                 and data sets exclude them"
            )
        };
        page.fact("unsound", (*unsound > 0).then(unsound_ones));
        page.fact("cost", format!("{cpu_s:.1} s CPU on {threads} threads"));
    }
}
