//! The emulated gripper in place of a port, so that everything can be tried without hardware.

use crate::messages::{Fault, GripperPose};
use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts};
use palpate_lab::grasping::{AdaptError, Adaptation};
use palpate_lab::gripper::{EmulatedStream, Listen, SerialGripper, SharedEmulator};
use palpate_lab::recording::{RecordError, TrialRequest, record};
use palpate_sim::objects::{EMPTY, ObjectError, anchored};
use palpate_sim::scene::Scene;
use palpate_store::{Store, StoreError};
use palpate_tactile::board::{SensorKind, SensorList};
use palpate_tactile::trial::Control;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Readings of its board (1/s), and its highest pressure in steps of 0.05 bar.
const RATE_HZ: u32 = 50;
const MOST_STEPS: u8 = 30;

/// Why there is no emulated gripper.
#[derive(Debug, thiserror::Error)]
pub enum EmulationError {
    /// The object cannot be read.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The store cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The empty hand did not close.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Its close adapted nothing.
    #[error(transparent)]
    Adapt(#[from] AdaptError),
}

/// An emulated gripper, with an object that requests place in its hand.
#[derive(Clone)]
pub struct EmulatedHand {
    gripper: SharedEmulator,
    sensors: SensorList,
    object: String,
    look: Duration,
}

impl EmulatedHand {
    /// The gripper and the object of a scene. `speed` is that of its clock, as a multiple of real time. The first time, the hand
    /// closes empty, so that the store has calibrations of its sensors.
    pub fn new(scene: &Scene, seed: u64, speed: f64, store: &mut Store) -> Result<Self, EmulationError> {
        let (sensors, object) = (store.calibrations().sensors()?, scene.object.source.clone());
        let wanted = sensors.iter().filter(|sensor| sensor.kind() != SensorKind::Raw).count();
        let adapts = store.calibrations().serving(None, &[])?.calibrations.len() < wanted;
        let empty = adapts.then(|| EMPTY.to_owned());
        let setup = EmulatorSetup {
            hand: HandPlan {
                sensors,
                scene: scene.clone(),
                objects: empty.into_iter().chain([object.clone()]).collect(),
                seed,
                grasp_every_s: None,
                script: Vec::new(),
            },
            parts: HiddenParts::drawn(seed),
            rate_hz: RATE_HZ,
            channels: sensors.len(),
            most_steps: MOST_STEPS,
            clock_start_us: 0,
            faults: Vec::new(),
            seed,
        };
        let gripper = SharedEmulator::new(EmulatedGripper::new(setup)?);
        let hand = Self { gripper, sensors, object, look: Duration::from_secs_f64(EmulatedStream::LOOK_S / speed) };
        if adapts {
            hand.adapt(scene, store)?;
        }
        Ok(hand)
    }

    /// Calibrates the sensors by a close of the empty hand, as fast as it can be computed.
    fn adapt(&self, scene: &Scene, store: &mut Store) -> Result<(), EmulationError> {
        let stream = EmulatedStream::new(self.gripper.clone(), self.sensors, Duration::ZERO);
        let mut gripper = SerialGripper::new(Box::new(stream));
        let request =
            TrialRequest { object: Some(EMPTY.to_owned()), control: Control::Driven, length_s: None, adds: false };
        let (path, stop) = (store.path().to_owned(), AtomicBool::new(false));
        let recording = record(&mut gripper, scene, request, path, &stop, &mut |_progress| ())?;
        Adaptation::from_close(store, recording.trial.id, scene, &[], false)?.keep(store)?;
        Ok(())
    }

    /// Opens a stream of it, in place of a port.
    pub fn listen(&self) -> Listen {
        let hand = self.clone();
        Arc::new(move |_port, sensors| Ok(Box::new(EmulatedStream::new(hand.gripper.clone(), sensors, hand.look))))
    }

    /// Puts an object into the hand, or moves the gripper by `by` from where it grasped last.
    pub(crate) fn place(&mut self, object: Option<&str>, by: Option<&GripperPose>) -> Result<(), Fault> {
        let mut gripper = self.gripper.lock();
        let object = object.map_or_else(|| self.object.clone(), anchored);
        let from = gripper.scene().filter(|scene| scene.object.source == object);
        let scene = by.map(|by| {
            let none =
                || Fault::of("move", "there is no grasp of this object to move from; place it without a move first");
            Ok::<_, Fault>(by.of_gripper().after(from.ok_or_else(none)?))
        });
        let scene = scene.transpose()?;
        let field = if by.is_some() { "move" } else { "object" };
        gripper.place(&object, scene).map_err(|error| Fault::of(field, error.to_string()))?;
        drop(gripper);
        self.object = object;
        Ok(())
    }
}
