//! Whole rounds of simulated grasps, by which a model's sets of classes and its automatic stops are calibrated and tested.
//!
//! In each round one gripper grasps one object, which is put down anew for every grasp, stays as the fingers leave it, or is
//! grasped where a guide expects to learn most; where the gripper varies, it varies from round to round.

use super::agreement::{Recompute, grasp_soundly};
use super::guidance::Advisor;
use super::identify::RecognisedGrasp;
use super::lessons::{scene_of, view_of};
use crate::datasets::{SensorView, sequence_of};
use palpate_learn::{AnswerSets, Belief, Class, Model, OTHER, ROUNDS_OF_A_CLASS, Round, Sequence, StopRule};
use palpate_sim::gripper::GripperModel;
use palpate_sim::objects::{EMPTY, ObjectError, ObjectModel, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Between, Scene};
use palpate_tactile::LayoutError;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Rounds to simulate.
pub struct GraspRounds<'a> {
    /// Rounds of each class.
    pub rounds: usize,
    /// Grasps of a round.
    pub grasps: usize,
    /// Random seed of the poses.
    pub seed: u64,
    /// Receives the number of finished rounds, and of all.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
    /// Flag that cancels the work.
    pub stop: &'a AtomicBool,
}

/// Grasps of one round.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspedRound {
    /// Number of the class.
    pub class: usize,
    /// Readings of each grasp through each view.
    pub grasps: Vec<Vec<Sequence>>,
}

/// Reason why nothing was calibrated.
#[derive(Debug, thiserror::Error)]
pub enum PromiseError {
    #[error("stopped; the model was not changed")]
    Stopped,
    #[error(transparent)]
    Object(#[from] ObjectError),
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error(
        "no grasps in known poses are at hand for the channels of this model, by which a guide could choose. Leave --guided out"
    )]
    NoGuide,
    #[error("{0} rounds are too few: take at least {least} in all, and {least} of each class for a promise of its own", least = 3 * ROUNDS_OF_A_CLASS)]
    TooFew(usize),
}

/// Distances between seeds, of which each counts from its own: sets of rounds, the rounds of a class, the grasps of a round. They
/// are far apart, so that neighbouring seeds share no grasp.
const NEXT_SEED: u64 = 0xbf58_476d_1ce4_e5b9;
const NEXT_CLASS: u64 = 0x9e37_79b9_7f4a_7c15;
const NEXT_GRASP: u64 = 0xd1b5_4a32_d192_ed03;

impl GraspRounds<'_> {
    /// The model with sets of classes that lose the true one in at most a share of rounds, and with a stop rule whose automatic
    /// stops are wrong in at most as many; it never stops by itself where no confidence keeps that.
    pub fn promised(&self, model: &Arc<Model>, risk: f64, between: Between) -> Result<Model, PromiseError> {
        let (mut scene, view) = (scene_of(&model.card), SensorView { draws: 1, ..view_of(&model.card) });
        scene.pose.between = between;
        let classes = model.card.labels.classes.iter().enumerate();
        let known: Vec<(usize, String)> =
            classes.filter_map(|(number, class)| Some((number, source_of(class, model)?))).collect();
        let grasped = self.simulated(&scene, &[view], &known, (between == Between::Guided).then_some(model))?;
        let rounds: Vec<Round> = grasped.iter().map(|round| round.judged(model, 0)).collect();
        let card = &model.card;
        let sets = AnswerSets::calibrate(&card.labels, &rounds, card.rejection.as_ref(), risk, self.seed);
        let mut sets = sets.ok_or(PromiseError::TooFew(rounds.len()))?;
        between.name().clone_into(&mut sets.between);
        let mut promised = Model::clone(model);
        promised.card.stop = StopRule { threshold: sets.stop.level.unwrap_or(1.0), most_grasps: sets.most_grasps() };
        promised.card.answer_sets = Some(sets);
        Ok(promised)
    }

    /// Rounds of objects, each with the number of its class and its source, in poses of a scene, each grasp read through all
    /// views. Those of a class follow each other. Where the scene is guided, it is by the answers of a model through the first
    /// view.
    pub fn simulated(
        &self,
        scene: &Scene,
        views: &[SensorView],
        objects: &[(usize, String)],
        guided_by: Option<&Arc<Model>>,
    ) -> Result<Vec<GraspedRound>, PromiseError> {
        let advisor = guided_by.map(|model| Advisor::of(model).ok_or(PromiseError::NoGuide)).transpose()?;
        let guide = guided_by.zip(advisor.as_ref());
        let (done, of) = (AtomicUsize::new(0), objects.len() * self.rounds);
        let mut all = Vec::new();
        for (class, source) in objects {
            let mut scene = scene.clone();
            scene.object.source.clone_from(source);
            let object = scene.load_object()?;
            let sampler = PoseSampler::new(&scene, object.as_ref());
            let own = ObjectRounds { views, sampler, object: object.as_ref(), guide };
            let first = self.seed.wrapping_mul(NEXT_SEED).wrapping_add((*class as u64 + 1).wrapping_mul(NEXT_CLASS));
            let round = |number: usize| {
                let grasps = own.grasps(first.wrapping_add(number as u64), self.grasps, self.stop)?;
                (self.progress)(done.fetch_add(1, Ordering::Relaxed) + 1, of);
                Ok(GraspedRound { class: *class, grasps })
            };
            all.extend((0..self.rounds).into_par_iter().map(round).collect::<Result<Vec<_>, PromiseError>>()?);
        }
        Ok(all)
    }
}

/// Source of the object of a class: a built-in one, the empty hand or a taught file; none of others.
fn source_of(class: &Class, model: &Model) -> Option<String> {
    let taught = model.card.taught_from.get(&class.name).map(|(_, path)| path.as_str());
    let built_in = catalogue().iter().any(|built_in| built_in.name == class.name) || class.name == EMPTY;
    Some(taught.or((built_in && class.name != OTHER).then_some(class.name.as_str()))?.to_owned())
}

impl GraspedRound {
    /// Answers of a model to its grasps through one of the views, each fed with the belief before.
    pub fn judged(&self, model: &Model, view: usize) -> Round {
        let mut belief = Belief::default();
        self.grasps.iter().for_each(|grasp| feel(model, &mut belief, &grasp[view]));
        Round { truth: self.class, belief }
    }
}

/// Adds the answer of a model to one more grasp, fed with the belief before.
fn feel(model: &Model, belief: &mut Belief, grasp: &Sequence) {
    let (recogniser, prior) = (&model.recogniser, model.card.prior());
    let before = belief.now().or(prior.as_ref());
    let with = recogniser.recognise(grasp, before).pmf;
    let alone = if before.is_some() { recogniser.recognise(grasp, None).pmf } else { with.clone() };
    belief.add(with, alone);
}

/// Rounds of one object.
struct ObjectRounds<'a> {
    views: &'a [SensorView],
    sampler: PoseSampler,
    object: Option<&'a ObjectModel>,
    /// The model by whose answers grasps are guided, and who guides.
    guide: Option<(&'a Arc<Model>, &'a Advisor)>,
}

impl ObjectRounds<'_> {
    /// Readings of the grasps of a round. The seed names the gripper, too.
    fn grasps(&self, seed: u64, count: usize, stop: &AtomicBool) -> Result<Vec<Vec<Sequence>>, PromiseError> {
        let nominal = self.sampler.scene();
        let (first, _) = self.sampler.draw(self.object, seed);
        let same_gripper = (nominal.pose.build > 0.0 && count > 1).then(|| {
            let mut nominal = nominal.clone();
            nominal.gripper = GripperModel { mount: nominal.gripper.mount.clone(), ..first.gripper.clone() };
            nominal.pose.build = 0.0;
            PoseSampler::new(&nominal, self.object)
        });
        let sampler = same_gripper.as_ref().unwrap_or(&self.sampler);
        let mut guide = self.guide.map(|(model, advisor)| (model, advisor.clone(), Belief::default()));
        let mut grasps: Vec<Vec<Sequence>> = Vec::new();
        let mut scene = first;
        for number in 0..count as u64 {
            if stop.load(Ordering::Relaxed) {
                return Err(PromiseError::Stopped);
            }
            let seed_of = |number: u64| seed.wrapping_add(number.wrapping_mul(NEXT_GRASP));
            let trial = grasp_soundly(&scene, self.object, seed_of(number), Recompute::Unsettled);
            let read = |view: &SensorView| view.signals_on(&trial, seed).map(|signals| sequence_of(&signals));
            let read: Vec<Sequence> = self.views.iter().map(read).collect::<Result<_, LayoutError>>()?;
            if number + 1 < count as u64 {
                let drawn = sampler.draw_after(self.object, seed_of(number + 1), trial.frames().last()).0;
                let guided = guide.as_mut().zip(read.first()).and_then(|((model, advisor, belief), grasp)| {
                    feel(model, belief, grasp);
                    let (model, belief) = (Arc::clone(model), belief.clone());
                    let last = RecognisedGrasp { model, grasp: grasp.clone(), hold_s: None, belief };
                    advisor.next(&last, [&scene, &drawn], sampler, self.object)
                });
                scene = guided.map_or(drawn, |(_, scene)| scene);
            }
            grasps.push(read);
        }
        Ok(grasps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_of_neighbouring_seeds_share_no_grasp() {
        let stop = AtomicBool::new(false);
        let grasps = |seed: u64| {
            let rounds = GraspRounds { rounds: 3, grasps: 2, seed, progress: &|_, _| (), stop: &stop };
            let mut scene = Scene::default();
            scene.solver.accuracy = palpate_sim::scene::Accuracy::Draft;
            scene.pose.shift = [0.008; 3];
            let all =
                rounds.simulated(&scene, &[SensorView::default()], &[(0, "box".to_owned())], None).expect("grasped");
            all.into_iter().flat_map(|round| round.grasps).map(|grasp| grasp[0].clone()).collect::<Vec<_>>()
        };
        let (mut all, other) = (grasps(1), grasps(2));
        all.extend(other);
        for (k, own) in all.iter().enumerate() {
            assert!(all[..k].iter().all(|before| before != own), "grasp {k} comes twice");
        }
    }

    #[test]
    fn a_guide_chooses_the_later_grasps_of_a_round_by_the_answers_of_a_model() {
        let stop = AtomicBool::new(false);
        let model = Arc::new(palpate_learn::Shipped::PerfectSensors.model().expect("shipped"));
        let (mut scene, view) = (scene_of(&model.card), SensorView { draws: 1, ..view_of(&model.card) });
        scene.solver.accuracy = palpate_sim::scene::Accuracy::Draft;
        let mut grasps = |between: Between, guide: Option<&Arc<Model>>| {
            scene.pose.between = between;
            let rounds = GraspRounds { rounds: 1, grasps: 2, seed: 3, progress: &|_, _| (), stop: &stop };
            let mut all = rounds
                .simulated(&scene, std::slice::from_ref(&view), &[(0, "box".to_owned())], guide)
                .expect("grasped");
            all.remove(0).grasps
        };
        let (left, guided) = (grasps(Between::AsReleased, None), grasps(Between::Guided, Some(&model)));
        assert_eq!(left[0], guided[0]);
        assert!(left[1] != guided[1] && guided[0] != guided[1]);
        assert_eq!(guided, grasps(Between::Guided, Some(&model)));

        let mut other = Model::clone(&model);
        other.card.channels = vec!["palm".to_owned()];
        assert!(Advisor::of(&Arc::new(other)).is_none());
    }
}
