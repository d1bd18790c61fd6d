//! What the commands that learn and judge share: which grasps, which threads, which models, and stopping.

use super::Failure;
use super::terminal::warn;
use indicatif::{ProgressBar, ProgressStyle};
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_learn::{Dataset, METHODS, Method, method};
use palpate_store::Store;
use palpate_tactile::model::SensorModel;

/// Which grasps to learn from or to judge by.
#[derive(Debug, clap::Args)]
pub(super) struct DataArguments {
    /// Only trials of this collection; the beginning of its name is enough.
    #[arg(long, value_name = "NAME")]
    pub(super) collection: Option<String>,
    /// Only trials of this rig: sim, or serial for the real gripper.
    #[arg(long, value_name = "NAME")]
    pub(super) rig: Option<String>,
    /// Only these objects, separated by commas.
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    pub(super) objects: Vec<String>,
    /// Sensor layout through which simulated trials are seen: C1 to C8, each also as C1+F.
    #[arg(long, value_name = "NAME", default_value = "C1+F")]
    pub(super) layout: String,
    /// Sensors through which simulated trials are seen: virtual (perfect) or physical-like (as the real gripper has).
    #[arg(long, value_name = "MODEL", default_value = "virtual", value_parser = parse_sensors)]
    pub(super) sensors: SensorModel,
    /// Other seeds give other initial weights, orders and draws.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// Small networks and few epochs: a quick look with worse results.
    #[arg(long)]
    pub(super) quick: bool,
}

fn parse_sensors(text: &str) -> Result<SensorModel, String> {
    SensorModel::named(text).ok_or_else(|| "choose virtual or physical-like".to_owned())
}

impl DataArguments {
    pub(super) fn view(&self) -> SensorView {
        SensorView { layout: self.layout.clone(), sensors: self.sensors }
    }

    /// Reads the grasps from the store.
    pub(super) fn read(
        &self,
        store: &Store,
        without_empty: bool,
        most_of_each: Option<usize>,
    ) -> Result<Dataset, Failure> {
        let (collection, rig, objects) = (self.collection.clone(), self.rig.clone(), self.objects.clone());
        let source = DatasetQuery { collection, rig, objects, without_empty, most_of_each };
        let bar = progress_bar("reading trials")?;
        let data = source.read(store, &self.view(), &mut |done, of| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        let data = data?;
        if data.about.collections.len() > 1 {
            let names = data.about.collections.join(", ");
            warn(&format!("the trials are from several collections ({names}); choose one with --collection"));
        }
        let left_out = data.about.left_out;
        if left_out > 0 {
            warn(&format!("{left_out} trial(s) left out: they did not stay finite or did not converge"));
        }
        Ok(data)
    }
}

/// A bar that draws on standard error, and only on a terminal.
pub(super) fn progress_bar(what: &str) -> Result<ProgressBar, Failure> {
    let style = ProgressStyle::with_template("{msg} {bar:40} {pos}/{len} {eta} left")?;
    Ok(ProgressBar::new(0).with_style(style).with_message(what.to_owned()))
}

/// A method by its key, or a failure that lists them all.
pub(super) fn known_method(key: &str) -> Result<&'static Method, Failure> {
    method(key).ok_or_else(|| {
        let keys: Vec<&str> = METHODS.iter().map(|m| m.key).collect();
        format!("there is no method \"{key}\"; there are {}", keys.join(", ")).into()
    })
}
