//! Beginning of rounds and grasps: object, pose, sensors, recording, and what the recogniser thinks so far.

use super::super::current::Current;
use super::super::held_object::{LoadedObject, card_of, stamp_of};
use super::super::live_recognition::LiveRecognition;
use super::super::messages::Notice;
use super::super::pace::Pace;
use super::Session;
use super::jobs::GhostRequest;
use crate::grasping::{RefinedRun, prepare};
use crate::picture::Stage;
use palpate_learn::{Model, Shipped};
use palpate_sim::objects::{EMPTY, ObjectError};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::Scene;
use palpate_tactile::{Channel, Sensors};
use std::sync::Arc;

impl Session {
    /// Begins with the scene that was asked for or, where that cannot be had, with an empty hand.
    pub(super) fn begin_somehow(&mut self) {
        if let Err(cause) = self.load_object(&self.nominal.clone()) {
            let refused = self.nominal.clone();
            EMPTY.clone_into(&mut self.nominal.object.source);
            self.refuse(refused, &cause);
        }
        self.begin_round();
    }

    /// The first grasp of a round.
    pub(super) fn begin_round(&mut self) {
        self.status.grasp_of_round = 0;
        self.choose_model();
        if let Some(recognition) = &mut self.recognition {
            recognition.start_over();
            recognition.set_between(self.nominal.pose.between);
        }
        self.begin_grasp();
    }

    /// The model of such grasps listens.
    fn choose_model(&mut self) {
        let model = self.models.of(Shipped::simulated(self.nominal.holds_object()));
        let listens =
            |model: &Arc<Model>| self.recognition.as_ref().is_some_and(|recognition| recognition.follows(model));
        if model.is_some_and(listens) {
            return;
        }
        self.recognition = model.map(|model| LiveRecognition::new(Arc::clone(model), self.status.grasps));
        if let (Some(recognition), Some(threshold)) = (&mut self.recognition, self.threshold) {
            recognition.set_threshold(threshold);
        }
    }

    pub(super) fn begin_grasp(&mut self) {
        self.next_grasp_at = None;
        if let Err(cause) = self.load_object(&self.nominal.clone()) {
            // The file has changed for the worse since; the object as it was will do.
            self.publisher.notify(Notice::Failed(cause.to_string()));
        }
        let model = self.object.as_ref().and_then(|object| object.model.clone());
        self.status.finished = false;
        self.status.grasp_of_round += 1;
        let again = self.own_pose_done;
        self.own_pose_done = true;
        // The first grasp is the scene as written; the following ones come from random poses, on the object as it was
        // released if the scene asks for it.
        let mut after = None;
        self.status.guided = None;
        let (scene, seed) = if again {
            self.poses_drawn += 1;
            let sampler = self.sampler.get_or_insert_with(|| PoseSampler::new(&self.nominal, model.as_deref()));
            let before = self.current.as_ref().filter(|current| current.ended && self.status.grasp_of_round > 1);
            let released = before.map(|current| current.frame.as_ref());
            let drawn = sampler.draw_after(model.as_deref(), self.poses_drawn, released).0;
            after = before.filter(|_| sampler.is_left(&drawn)).and_then(|current| current.run.header().identity());
            let last = self.recognition.as_ref().and_then(LiveRecognition::last);
            let guided = before.zip(last).and_then(|(current, last)| {
                self.advisor.next(&last, [current.scene.as_ref(), &drawn], sampler, model.as_deref())
            });
            self.status.guided = guided.as_ref().map(|(by, _)| *by);
            (guided.map_or(drawn, |(_, scene)| scene), self.poses_drawn)
        } else {
            (self.nominal.clone(), 0)
        };
        let more =
            self.recognition.as_ref().map(|recognition| recognition.channels_on(&scene.gripper)).unwrap_or_default();
        let signals = self.sensors.signals;
        let reader = self.sensors.shown().and_then(|layout| {
            let plotted = layout.channels(&scene.gripper, signals)?.len();
            let mut sensors = Sensors::new(&layout, &scene.gripper, signals)?;
            sensors.add(&more);
            Ok((sensors, plotted))
        });
        let (reader, plotted) = match reader {
            Ok(reader) => reader,
            Err(error) => return self.publisher.notify(Notice::Failed(error.to_string())),
        };
        if !again && self.measured.as_ref() != Some(&scene) {
            self.measured = Some(scene.clone());
            self.accuracy.start((scene.clone(), model.clone()));
        }
        let mut run = prepare(&scene, model.as_deref(), seed);
        run.set_after(after);
        let mut begun = run.begun();
        begun.header.earlier = self.recognition.as_ref().and_then(LiveRecognition::earlier);
        if !again {
            for warning in &begun.header.warnings {
                self.publisher.notify(Notice::Warning(warning.clone()));
            }
        }
        if let Some(warning) = self.recognition.as_mut().and_then(|recognition| {
            recognition.begin_grasp(reader.channels().iter().map(Channel::name).enumerate(), None)
        }) {
            self.publisher.notify(Notice::Warning(warning));
        }
        self.grasp += 1;
        self.status.duration = scene.timing.duration_s;
        self.status.nothing_held = false;
        // What the recogniser reads beyond the layout is not plotted.
        let reader = reader.with_palm(begun.data.world_from_gripper.position);
        self.channels = reader.channels()[..plotted].into();
        let stage = Arc::new(Stage::new(&scene, model.as_deref(), begun.data.world_from_gripper));
        let frame = Arc::new(run.simulation_mut().first_look());
        self.card = model.as_deref().map(|model| Arc::new(card_of(model, &scene)));
        let (warned, scene, plan) = (begun.header.warnings.len(), Arc::new(scene), Arc::new(begun.data.plan));
        let channels = reader.channels().len();
        let refined_run = self.status.error_band.then(|| RefinedRun::new(&scene, model.as_deref(), seed, channels));
        self.current = Some(Current {
            earlier: begun.header.earlier,
            run,
            refined_run,
            plan,
            scene,
            stage,
            reader,
            frame,
            recorded: self.status.recording,
            warned,
            pulled: false,
            ended: false,
        });
        self.pace = Pace::starting_at(0.0);
        self.begin_ghost();
        self.publish();
    }

    /// The other engine computes the same grasp, where a ghost is wanted.
    pub(super) fn begin_ghost(&mut self) {
        self.ghost.stop();
        if let Some(current) = self.current.as_ref().filter(|_| self.ghost_wanted) {
            let object = self.object.as_ref().and_then(|object| object.model.clone());
            let mut scene = Scene::clone(&current.scene);
            scene.solver.engine = scene.solver.engine.other();
            self.ghost.start(GhostRequest { grasp: self.grasp, scene, object });
        }
    }

    /// Loads a scene's object, unless it is the present one, which stays on failure.
    pub(super) fn load_object(&mut self, scene: &Scene) -> Result<(), ObjectError> {
        let (source, name, options) = (scene.object.source.clone(), scene.object.name.clone(), scene.load_options());
        let stamp = stamp_of(&source);
        let is_known =
            |o: &LoadedObject| o.source == source && o.name == name && o.options == options && o.stamp == stamp;
        if self.object.as_ref().is_some_and(is_known) {
            return Ok(());
        }
        self.status.loading = Some(source.clone());
        self.publish();
        // Loading a large file cannot be interrupted; a window that closes does not wait for it.
        self.publisher.set_detached(true);
        let loaded = scene.load_object();
        self.publisher.set_detached(false);
        self.status.loading = None;
        self.publish();
        let model = loaded?.map(Arc::new);
        self.object = Some(LoadedObject { source, name, options, stamp, model });
        self.sampler = None;
        Ok(())
    }
}
