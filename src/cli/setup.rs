//! Arguments shared by commands, of scenes and of sensors, and opening the store.

use super::Failure;
use super::terminal::{Progress, warn};
use palpate_lab::datasets::SensorView;
use palpate_lab::grasping::Recompute;
use palpate_sim::objects::{ObjectModel, anchored};
use palpate_sim::scene::{Accuracy, Between, EngineKind, PRESETS, PosePreset, Scene};
use palpate_store::labels::class_name;
use palpate_store::{Store, StoreError};
use palpate_tactile::board::{Sensor, SensorKind, SensorList};
use palpate_tactile::{SensorLayout, SignalDefinition};
use std::fmt::Display;
use std::io::ErrorKind;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The object between two grasps.
#[derive(Debug, clap::Args)]
pub(super) struct BetweenArguments {
    /// Leave the object as released between grasps instead of placing it anew.
    #[arg(long)]
    as_released: bool,
    /// The same, and choose each next grasp by what is expected to be learned from it instead of at random.
    #[arg(long, conflicts_with = "as_released")]
    guided: bool,
}

impl BetweenArguments {
    /// None where nothing is asked for.
    pub(super) fn chosen(&self) -> Option<Between> {
        match (self.as_released, self.guided) {
            (_, true) => Some(Between::Guided),
            (true, _) => Some(Between::AsReleased),
            _ => None,
        }
    }
}

/// Scene and changes to it.
#[derive(Debug, clap::Args)]
pub(super) struct SceneArguments {
    /// Scene by name (default, paper; `palpate scene list`) or scene file (TOML); `palpate grasp --print-scene` prints all
    /// keys with their defaults.
    #[arg(long, value_name = "NAME|FILE")]
    pub(super) scene: Option<PathBuf>,
    /// Accuracy: draft, standard, reference, or a tolerance such as 1e-4 (see palpate help accuracy).
    #[arg(long, value_name = "NAME|TOL")]
    pub(super) accuracy: Option<Accuracy>,
    /// Physics engine: palpate, or rapier for comparison.
    #[arg(long, value_name = "NAME", value_parser = one_of(EngineKind::ALL.map(|engine| (engine.name(), engine))))]
    pub(super) engine: Option<EngineKind>,
    /// Fix the object in place.
    #[arg(long)]
    pub(super) fixed: bool,
    /// Spread of random poses: A (3 mm, 10 degrees), M (5 mm, 25 degrees), B (8 mm, any turn, any resting face) or
    /// C (12 mm, any orientation).
    #[arg(long, value_name = "A|M|B|C", value_parser = one_of(PRESETS.map(|preset| (preset.name, preset))))]
    pub(super) preset: Option<PosePreset>,
    /// Set a key of the scene, e.g. --set gripper.finger.joints=20 (may be repeated).
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) settings: Vec<String>,
}

/// Channels through which simulated trials are read.
#[derive(Debug, clap::Args)]
pub(super) struct SignalArguments {
    /// Sensor layout: C1 to C8, with --signals contact or hull each also with force, as C1+F; or gripper, the sensors of the
    /// gripper file that the store remembers (default: C1, or gripper where the store remembers a file).
    #[arg(long, value_name = "NAME")]
    pub(super) layout: Option<String>,
    /// Signals of simulated trials: parts (what strips and pads measure, as on a real gripper), contact (circle through
    /// all joints, force over participation area) or hull (force over the convex hull of the contacts, as in the paper).
    #[arg(long, value_name = "NAME", default_value = "parts", value_parser = one_of(SignalDefinition::ALL.map(|own| (own.name(), own))))]
    pub(super) signals: SignalDefinition,
}

impl SignalArguments {
    /// The view through perfect sensors.
    pub(super) fn view(&self) -> SensorView {
        let usual = SensorView::default();
        SensorView { layout: self.layout.clone().unwrap_or(usual.layout), signals: self.signals, ..usual }
    }

    /// The same on the gripper that a store remembers, where no other layout is named.
    pub(super) fn of_store(&self, view: SensorView, store: &Store) -> Result<SensorView, Failure> {
        let of_file = |name: &String| name.eq_ignore_ascii_case(SensorLayout::OF_FILE);
        let file = self.layout.as_ref().is_none_or(of_file) && self.signals == SignalDefinition::Parts;
        if !file {
            return Ok(view);
        }
        let missing: Vec<&str> = store.calibrations().sensors()?.not_simulated().map(Sensor::channel).collect();
        if self.layout.is_some() && !missing.is_empty() {
            warn(&format!("the simulation cannot give {}: simulated trials are read without", missing.join(", ")));
        }
        Ok(view.of_store(store)?)
    }
}

/// When a grasp is computed again at a finer accuracy.
#[derive(Debug, clap::Args)]
pub(super) struct RecomputeArguments {
    /// Compute again at a tenth of the tolerance until three levels in a row end alike, and take the finest (default:
    /// only where forces change in the hold).
    #[arg(long)]
    until_agreement: bool,
}

impl RecomputeArguments {
    pub(super) fn chosen(&self) -> Recompute {
        if self.until_agreement { Recompute::UntilAgreement } else { Recompute::Unsettled }
    }
}

/// The object of a scene, with progress: the first time, a mesh of a million triangles takes seconds.
pub(super) fn load_object(scene: &Scene) -> Result<Option<ObjectModel>, Failure> {
    let _waiting = Progress::waiting(&format!("preparing {}", scene.object.source));
    Ok(scene.load_object()?)
}

/// Number of threads: as asked for, or one per core.
pub(super) fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from)
}

/// Parser of a number within a range.
pub(super) fn within<T: FromStr + PartialOrd + Display + Clone>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("write a number from {} to {}", range.start(), range.end()))
    }
}

/// Parser of one of several names, in either case.
pub(super) fn one_of<T: Clone>(
    all: impl IntoIterator<Item = (&'static str, T)>,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    let (names, values): (Vec<&str>, Vec<T>) = all.into_iter().unzip();
    move |text| {
        let found = names.iter().position(|name| name.eq_ignore_ascii_case(text.trim()));
        let last = names.len() - 1;
        found
            .map(|k| values[k].clone())
            .ok_or_else(|| format!("choose {} or {}", names[..last].join(", "), names[last]))
    }
}

impl SceneArguments {
    /// Builds the scene, with another object where one is named.
    pub(super) fn scene(&self, object: Option<&str>) -> Result<Scene, Failure> {
        self.with_file(self.scene.as_deref(), object)
    }

    /// Builds the scene on top of another file.
    pub(super) fn with_file(&self, file: Option<&Path>, object: Option<&str>) -> Result<Scene, Failure> {
        let mut scene = match file {
            Some(path) => Scene::named_or_from_file(path)?,
            None => Scene::default(),
        };
        if let Some(object) = object {
            (scene.object.source, scene.object.name) = (anchored(object), None);
        }
        if let Some(accuracy) = self.accuracy {
            scene.solver.accuracy = accuracy;
        }
        if let Some(engine) = self.engine {
            scene.solver.engine = engine;
        }
        if let Some(preset) = self.preset {
            scene.pose = preset.poses();
        }
        if self.fixed {
            scene.set_object_fixed(true);
        }
        Ok(scene.with_settings(&self.settings)?)
    }
}

/// Classes of as many objects, checked; none where none are named.
pub(super) fn classes_of(named: &[String], objects: usize) -> Result<Vec<String>, Failure> {
    if !named.is_empty() && named.len() != objects {
        return Err(format!("--class names {} classes for {objects} objects; name one for each", named.len()).into());
    }
    Ok(named.iter().map(|name| class_name(name)).collect::<Result<_, _>>()?)
}

/// Path of the named store, or of the default one. Folders are not created for a named one, but for one beside the default one.
pub(super) fn store_path(path: Option<&Path>) -> Result<PathBuf, Failure> {
    let Some(path) = path else { return Ok(Store::default_path()) };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let is_usual = |folder: &Path| Store::default_path().parent() == Some(folder);
    match folder.filter(|folder| !folder.is_dir() && !is_usual(folder)) {
        Some(folder) => {
            let (store, folder) = (path.display(), folder.display());
            Err(format!("no store \"{store}\": there is no folder \"{folder}\". Create it, or name another --store")
                .into())
        }
        None => Ok(path.to_owned()),
    }
}

/// Opens the named store, or the default one; creates the file where there is none.
pub(super) fn open_store(path: Option<&Path>) -> Result<Store, Failure> {
    warned(Store::open(&store_path(path)?)?)
}

/// Sensors of the gripper that a store remembers; the paper's where there is no store.
pub(super) fn sensors(path: Option<&Path>) -> Result<SensorList, Failure> {
    let store = existing_store(path)?;
    Ok(store.map(|store| store.calibrations().sensors()).transpose()?.unwrap_or_default())
}

/// The sensor of the gripper with this name, which takes a calibration.
pub(super) fn sensor_called(sensors: SensorList, name: &str) -> Result<Sensor, Failure> {
    let found = sensors.called(name).filter(|sensor| sensor.kind() != SensorKind::Raw);
    found.ok_or_else(|| {
        let calibrated = sensors.iter().filter(|sensor| sensor.kind() != SensorKind::Raw).map(Sensor::channel);
        let names = calibrated.collect::<Vec<_>>().join(", ");
        format!("no strip or pad is called \"{name}\"; the gripper has {names}. --gripper FILE names others").into()
    })
}

/// Opens the named store, or the default one, to read it; `None` where there is none, or an empty file: neither is made a
/// store.
pub(super) fn existing_store(path: Option<&Path>) -> Result<Option<Store>, Failure> {
    existing(path, Store::open_to_read)
}

/// The same for a command that changes what is there.
pub(super) fn existing_store_to_change(path: Option<&Path>) -> Result<Option<Store>, Failure> {
    existing(path, Store::open)
}

fn existing(
    path: Option<&Path>,
    open: impl FnOnce(&Path) -> Result<Store, StoreError>,
) -> Result<Option<Store>, Failure> {
    let path = store_path(path)?;
    match std::fs::metadata(&path) {
        Ok(file) if file.is_file() && file.len() == 0 => Ok(None),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(format!("cannot open the store \"{}\": {error}", path.display()).into()),
        Ok(_) => warned(open(&path)?).map(Some),
    }
}

/// [`existing_store`] for a command that cannot do without.
pub(super) fn read_store(path: Option<&Path>) -> Result<Store, Failure> {
    existing_store(path)?.ok_or_else(|| none_yet(path))
}

/// [`existing_store_to_change`] for a command that cannot do without.
pub(super) fn store_to_change(path: Option<&Path>) -> Result<Store, Failure> {
    existing_store_to_change(path)?.ok_or_else(|| none_yet(path))
}

fn none_yet(path: Option<&Path>) -> Failure {
    let path = path.map_or_else(Store::default_path, Path::to_owned);
    format!("no trials yet: there is no store \"{}\"; `palpate grasp lemon` makes one", path.display()).into()
}

fn warned(store: Store) -> Result<Store, Failure> {
    for warning in store.warnings() {
        super::terminal::warn(warning);
    }
    Ok(store)
}
