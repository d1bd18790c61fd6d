//! The demo with the simulated gripper: the object lies in another pose at each grasp.

use super::super::output::make_folder;
use super::super::prelude::*;
use super::super::recognise::{load_model, warn_of_other_fingers, warn_unless_learned};
use super::super::snapshot::Drawer;
use super::{DemoArguments, GraspReport, Hand, PoseReport, grasp_until_recognised};
use glam::Vec2;
use palpate_exchange::file_name_of;
use palpate_geometry::drawing::StandardView;
use palpate_geometry::palette::Theme;
use palpate_geometry::units::{mm, three_digits};
use palpate_lab::datasets::knows_fingers;
use palpate_lab::grasping::{Advisor, GraspSummary, Identification, Recompute, Row, grasp_soundly};
use palpate_lab::picture::{PictureView, Stage};
use palpate_learn::Shipped;
use palpate_render::DriverChoice;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::{EMPTY, ObjectModel, catalogue, titled};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::Scene;
use palpate_store::Stored;
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Channel, Sensors};
use rand::{RngExt, SeedableRng};
use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;

/// Pixels of a picture.
const SIZE: [u32; 2] = [1280, 800];

/// The simulated gripper.
struct SimulatedHand<'a> {
    object: Option<&'a ObjectModel>,
    sampler: PoseSampler,
    /// Seed of the next pose.
    seed: u64,
    /// Scene of the last grasp, and its end.
    before: Option<(Scene, Frame)>,
    advisor: Advisor,
    /// Absent where no pictures are wanted, or possible.
    drawer: Option<Drawer>,
    folder: &'a Path,
    /// Number of pictures so far.
    pictures: usize,
    store: Option<Store>,
}

pub(super) fn run(arguments: &DemoArguments, store: Option<&Path>) -> Result<(), Failure> {
    let seed = arguments.seed.unwrap_or_else(|| RandomState::new().hash_one(0) % 1_000_000);
    let random = (arguments.object.is_none() && arguments.scene.scene.is_none()).then(|| random_object(seed));
    let mut nominal = arguments.scene.scene(arguments.object.as_deref().or(random.as_deref()))?;
    nominal.pose.between = arguments.between.chosen().unwrap_or(nominal.pose.between);
    let object = load_object(&nominal)?;
    let model = Arc::new(load_model(arguments.model.as_deref(), Shipped::simulated(nominal.holds_object()))?);
    warn_unless_learned(&model, nominal.holds_object());
    if !knows_fingers(&model.card, &nominal) {
        warn_of_other_fingers();
    }
    let drawer = (!arguments.no_pictures)
        .then(|| Drawer::new(DriverChoice::Any))
        .and_then(|drawer| drawer.inspect_err(|error| warn(&format!("no pictures: {error}"))).ok());
    if drawer.is_some() {
        make_folder(&arguments.out)?;
    }
    let store = if arguments.no_store { None } else { Some(open_store(store)?) };
    let truth = object.as_ref().map_or_else(|| EMPTY.to_owned(), |o| o.name.clone());
    if !arguments.json {
        introduce(&nominal.object.source, object.as_ref(), seed)?;
    }
    let mut hand = SimulatedHand {
        object: object.as_ref(),
        sampler: PoseSampler::new(&nominal, object.as_ref()),
        seed,
        before: None,
        advisor: Advisor::default(),
        drawer,
        folder: &arguments.out,
        pictures: 0,
        store,
    };
    grasp_until_recognised(&mut hand, &model, arguments, Some(truth), (Some(seed), nominal.pose.between))
}

impl Hand for SimulatedHand<'_> {
    fn grasp(&mut self, identification: &mut Identification) -> Result<GraspReport, Failure> {
        self.seed = self.seed.wrapping_add(1);
        let released = self.before.as_ref().map(|(_, released)| released);
        let (drawn, _) = self.sampler.draw_after(self.object, self.seed, released);
        let before = self.before.as_ref().zip(identification.last());
        let guided =
            before.and_then(|((last, _), grasp)| self.advisor.next(grasp, [last, &drawn], &self.sampler, self.object));
        let (guided, scene) = guided.map_or((None, drawn), |(by, scene)| (Some(by.to_string()), scene));
        let trial = grasp_soundly(&scene, self.object, self.seed, Recompute::Unsettled);
        let reader = Sensors::of(identification.channels_on(&scene.gripper)?, &scene.gripper);
        identification.begin_grasp(reader.channels().iter().map(Channel::name).enumerate())?;
        for row in trial.frames().iter().map(|frame| Row::of_frame(frame, &reader)) {
            identification.push(row.t_s, &row);
        }
        identification.end_grasp();
        let trial_id = self.store.as_mut().map(|store| store.insert(&trial)).transpose()?.map(Stored::id);
        let picture = self.paint(&scene, &trial)?;
        let summary = GraspSummary::new(&trial, &scene);
        // Those of the object were printed before.
        let known = self.object.map_or(&[][..], |object| &object.warnings);
        let warnings = summary.warnings.iter().filter(|warning| !known.contains(warning)).cloned().collect();
        let mount = &scene.gripper.mount;
        let pose = PoseReport {
            seed: self.seed,
            offset_mm: mount.offset.map(|x| (x * 1e5).round() * 1e-2),
            yaw_deg: (mount.yaw_deg * 10.0).round() * 0.1,
            guided,
            picture,
        };
        self.before = trial.frames().last().map(|released| (scene, released.clone()));
        Ok(GraspReport { pose: Some(pose), trial_id, summary: Some(summary), warnings, ..GraspReport::default() })
    }
}

impl SimulatedHand<'_> {
    /// Draws the end of the hold.
    fn paint(&mut self, scene: &Scene, trial: &SimulatedTrial) -> Result<Option<PathBuf>, Failure> {
        let Some(drawer) = &mut self.drawer else { return Ok(None) };
        self.pictures += 1;
        let path = self.folder.join(format!("{}_grasp_{}.png", file_name_of(&trial.header.object), self.pictures));
        let held = trial.frames().iter().rfind(|f| f.phase == Phase::Hold).or(trial.frames().last());
        let Some(frame) = held else { return Ok(Some(path)) };
        let stage = Stage::new(scene, self.object, trial.data.world_from_gripper);
        let view = PictureView {
            theme: Theme::Dark,
            size: Vec2::from(SIZE.map(|side| side as f32)),
            badge: Some("SIMULATED".to_owned()),
            ..PictureView::default()
        };
        let camera = stage.camera(StandardView::Home, frame, &view);
        let picture = drawer.draw(&stage.draw(frame, &PictureView { camera, ..view }), SIZE)?;
        write_new(&path, FileKind::Png, &picture.to_png()?)?;
        Ok(Some(path))
    }
}

fn random_object(seed: u64) -> String {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let all = catalogue();
    all[random.random_range(0..all.len())].name.clone()
}

fn introduce(name: &str, object: Option<&ObjectModel>, seed: u64) -> Result<(), Failure> {
    let Some(object) = object else { return say("Object: none, an empty hand.") };
    let built_in = catalogue().iter().any(|b| b.name == name);
    let title = if built_in { titled(name) } else { object.name.clone() };
    let size = object.bounds.size().to_array().map(|side| format!("{:.0}", mm(side)));
    let grams = three_digits(object.mass.mass * 1e3);
    say(format!("Object: {title} ({} mm, {grams} g). Seed {seed}.", size.join(" x ")))?;
    for warning in &object.warnings {
        warn(warning);
    }
    Ok(())
}
