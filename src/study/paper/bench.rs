//! The bench of a study: its store, from which data sets are read, and where missing grasps are collected.

use super::plan::{DataWanted, StudyPlan};
use crate::frame::{Measuring, StudyError, StudyProgress, StudyStep, TrialNumbers};
use palpate_lab::datasets::{DatasetError, DatasetQuery};
use palpate_lab::grasping::{CollectionPlan, collect};
use palpate_learn::{Dataset, Fitting, LearnError, Method, Model};
use palpate_sim::fingerprint;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_store::Store;
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::{SimulatedTrial, Trial, TrialData, TrialId};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

/// Bench of a study.
pub struct StudyData<'a> {
    plan: &'a StudyPlan,
    work: Measuring<'a>,
    store: Mutex<Store>,
    /// Data sets read last, newest last.
    read: Mutex<Vec<(DataWanted, Arc<Dataset>)>>,
    /// Numbers of all trials that were read.
    trials: Mutex<TrialNumbers>,
}

/// Data sets kept in memory: as many as are in use at a time.
const KEPT: usize = 4;

impl<'a> StudyData<'a> {
    /// A bench on a store.
    pub fn new(store: Store, plan: &'a StudyPlan, work: Measuring<'a>) -> Self {
        Self { plan, work, store: Mutex::new(store), read: Mutex::default(), trials: Mutex::default() }
    }

    /// Plan of the study.
    pub fn plan(&self) -> &StudyPlan {
        self.plan
    }

    /// Threads, stop flag and progress.
    pub fn work(&self) -> Measuring<'a> {
        self.work
    }

    /// Numbers of the trials that were read.
    pub(super) fn trials(&self) -> TrialNumbers {
        self.trials.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// True once the study is to stop.
    pub fn is_cancelled(&self) -> bool {
        self.work.cancelled.load(Ordering::Relaxed)
    }

    /// An error once the study is to stop.
    pub(super) fn check_stop(&self) -> Result<(), StudyError> {
        if self.is_cancelled() { Err(StudyError::Stopped) } else { Ok(()) }
    }

    /// Reads grasps: those of the plan's query, or simulated ones, which are collected where the store lacks them. The
    /// empty hand is left out.
    pub fn data(&self, wanted: &DataWanted) -> Result<Arc<Dataset>, StudyError> {
        // One thread collects and reads, others wait for it and find the data set here.
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = read.iter().position(|(own, _)| own == wanted) {
            let found = read.remove(at);
            let data = Arc::clone(&found.1);
            read.push(found);
            return Ok(data);
        }
        let mut store = self.store.lock().unwrap_or_else(PoisonError::into_inner);
        let query = match &self.plan.query {
            Some(query) => query.clone(),
            None => self.collected(&mut store, wanted)?,
        };
        let most_of_each = Some(query.most_of_each.map_or(wanted.grasps, |most| most.min(wanted.grasps)));
        let query = DatasetQuery { without_empty: true, most_of_each, ..query };
        let data = Arc::new(query.read(&store, &wanted.view, &mut |_, _| ())?);
        let numbers: Vec<u8> = data.examples.iter().flat_map(|example| example.id.to_le_bytes()).collect();
        let trials = query.collection.as_deref().unwrap_or("stored trials");
        self.trials.lock().unwrap_or_else(PoisonError::into_inner).insert(
            format!("{} of each object, {trials}", wanted.grasps),
            format!("{:016x}", fingerprint([numbers.as_slice()])),
        );
        if read.len() == KEPT {
            read.remove(0);
        }
        read.push((wanted.clone(), Arc::clone(&data)));
        Ok(data)
    }

    /// What can be told of recorded grasps without touch, a line for each check; nothing of simulated ones.
    pub(super) fn leaks(&self) -> Vec<String> {
        let wanted = self.plan.wanted(usize::MAX, SensorModel::Virtual);
        let recorded = self.plan.query.is_some().then(|| self.data(&wanted).ok()).flatten();
        let recorded = recorded.filter(|data| data.about.is_recorded());
        recorded.map_or_else(Vec::new, |data| data.leak_checks(self.plan.seed).map(|check| check.to_string()).into())
    }

    /// A simulated trial of the store; none for others.
    pub fn simulated(&self, id: TrialId) -> Result<Option<SimulatedTrial>, StudyError> {
        let store = self.store.lock().unwrap_or_else(PoisonError::into_inner);
        let Trial { header, data } = store.load(id).map_err(DatasetError::Store)?;
        Ok(match data {
            TrialData::Simulated(data) => Some(SimulatedTrial { header, data }),
            TrialData::Recorded(_) | TrialData::Imported(_) => None,
        })
    }

    /// Collects what is missing; returns the query for it.
    fn collected(&self, store: &mut Store, wanted: &DataWanted) -> Result<DatasetQuery, StudyError> {
        let preset = PosePreset::named(&wanted.preset);
        let preset = preset.ok_or_else(|| StudyError::Unknown(format!("preset {}", wanted.preset)))?;
        let mut scene = Scene { pose: preset.poses(), ..wanted.scene.clone() };
        scene.object.fixed = wanted.fixed;
        (scene.pose.between, scene.pose.build) = (wanted.between, wanted.build);
        let objects = if wanted.objects.is_empty() { self.plan.objects() } else { wanted.objects.clone() };
        let plan = CollectionPlan {
            objects: objects.clone(),
            ..CollectionPlan::of_all_objects(scene, wanted.grasps as u32, wanted.poses)
        };
        let report = collect(&plan, store, self.work.threads, &mut |made| {
            let (done, of) = (made.done as usize, made.of as usize);
            (self.work.progress)(StudyProgress { step: StudyStep::Collecting, done, of });
            if self.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        if report.interrupted {
            return Err(StudyError::Stopped);
        }
        Ok(DatasetQuery { collection: Some(report.collection), objects, ..DatasetQuery::default() })
    }

    /// Fits a method.
    pub fn fit(&self, method: &Method, data: &Dataset) -> Result<Model, StudyError> {
        self.fitted(method.key, |fitting| method.train(data, fitting))
    }

    /// Teaches a model further grasps.
    pub fn teach(&self, model: &Model, grasps: &Dataset) -> Result<Model, StudyError> {
        self.fitted(&model.card.method, |fitting| model.taught(grasps, fitting))
    }

    fn fitted(
        &self,
        method: &str,
        fit: impl FnOnce(&Fitting<'_>) -> Result<Model, LearnError>,
    ) -> Result<Model, StudyError> {
        let fitting = Fitting::new(self.plan.seed, self.plan.has_quick_fits(), self.work.cancelled);
        fit(&fitting).map_err(|cause| StudyError::of_fit(method, cause))
    }
}
