//! Grasps of emulated grippers, each read as after `palpate adapt`: parts that no training saw, through board, line and decoder.

use crate::frame::StudyError;
use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts, Step};
use palpate_device::protocol::{BoardEvent, Decoder};
use palpate_lab::datasets::sequence_of;
use palpate_lab::grasping::Adaptation;
use palpate_learn::{Class, DataCard, Dataset, Example, Labels};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_tactile::Signals;
use palpate_tactile::board::{Board, Reading, Sensor, SensorList};
use palpate_tactile::calibration::{Calibration, Readout};
use palpate_tactile::trial::{BoardCourse, BoardLog, PhaseMark};
use std::sync::Arc;

/// Rest before each closing (s).
const REST_S: f64 = 0.5;
/// Time step of the host (s).
const HOST_S: f64 = 0.005;
/// Readings per second (1/s).
const RATE_HZ: u32 = 50;
/// Steps of pressure that the board puts out.
const STEPS: u8 = 30;

/// Emulated grippers and what they grasp.
pub(super) struct EmulatedGrippers<'a> {
    /// Gripper, programme and poses, those of a preset.
    pub(super) scene: &'a Scene,
    pub(super) preset: &'a str,
    /// Seeds of their parts.
    pub(super) seeds: std::ops::Range<u64>,
    /// Objects that each grasps.
    pub(super) objects: &'a [String],
    /// Grasps of each object by each gripper.
    pub(super) each: u64,
}

impl EmulatedGrippers<'_> {
    /// Their grasps in these channels, from the closing to the end of the hold.
    pub(super) fn grasps(&self, channels: &[String]) -> Result<Dataset, StudyError> {
        let class = |name: &String| Class { name: name.clone(), size: None, shape: None };
        let labels = Labels { classes: self.objects.iter().map(class).collect(), ..Labels::default() };
        let about = DataCard {
            preset: Some(self.preset.to_owned()),
            object: "free, emulated gripper".to_owned(),
            ..DataCard::default()
        };
        let mut data = Dataset { channels: channels.to_vec(), labels, examples: Vec::new(), about };
        for seed in self.seeds.clone() {
            let parts = HiddenParts::drawn(seed);
            let calibrations = self.adapted(&parts, seed)?;
            for (class, object) in self.objects.iter().enumerate() {
                for number in 0..self.each {
                    let pose = seed * 1000 + number;
                    let (board, readings) = self.readings(&parts, object, pose)?;
                    let readout = Readout::new(&board, &calibrations).map_err(StudyError::missing)?;
                    let signals = readout.derive(&readings, Some(REST_S)).signals;
                    let signals = signals
                        .chosen(channels)
                        .ok_or_else(|| StudyError::missing("channels of the emulated gripper"))?;
                    let grasp = sequence_of(&self.until_release(signals));
                    let id = data.examples.len() as i64;
                    data.examples.push(Example {
                        id,
                        class,
                        content: grasp.content(),
                        grasp: Arc::new(grasp),
                        ..Example::default()
                    });
                }
            }
        }
        data.about.grasps = data.examples.len();
        Ok(data)
    }

    /// From the closing to the release.
    fn until_release(&self, signals: Signals) -> Signals {
        let programme = &self.scene.programme;
        let ticks = programme.close_ticks() + programme.hold_ticks;
        signals.since(REST_S).until(f64::from(ticks) / f64::from(self.scene.timing.actuation_hz.max(1)))
    }

    /// Calibrations by one close of the empty hand.
    fn adapted(&self, parts: &HiddenParts, seed: u64) -> Result<Vec<(Sensor, Calibration)>, StudyError> {
        let (board, readings) = self.readings(parts, EMPTY, seed)?;
        let mark = PhaseMark { phase: Phase::Close, from_s: REST_S, line_bar: None };
        let course = BoardCourse { board, phases: vec![mark], ..BoardCourse::default() };
        let log = BoardLog { course, readings, gaps: Vec::new() };
        let adaptation = Adaptation::of_log(&log, self.scene);
        let all = adaptation.sensors.iter();
        all.map(|(sensor, adapted)| Some((*sensor, adapted.calibration()?.clone())))
            .collect::<Option<_>>()
            .ok_or_else(|| StudyError::missing("an emulated gripper that can be adapted to"))
    }

    /// What the board prints of one grasp.
    fn readings(&self, parts: &HiddenParts, object: &str, seed: u64) -> Result<(Board, Vec<Reading>), StudyError> {
        let rest = Step::Hold { bend: [0.0; 2], load: [0.0; 2], seconds: REST_S };
        let hand = HandPlan {
            sensors: SensorList::default(),
            scene: self.scene.clone(),
            objects: vec![EMPTY.to_owned()],
            seed,
            grasp_every_s: None,
            script: vec![rest, Step::Grasp { object: object.to_owned(), bar: None }],
        };
        let setup = EmulatorSetup {
            hand,
            parts: parts.clone(),
            rate_hz: RATE_HZ,
            channels: SensorList::default().len(),
            most_steps: STEPS,
            clock_start_us: 0,
            faults: Vec::new(),
            seed,
        };
        let mut gripper = EmulatedGripper::new(setup).map_err(StudyError::missing)?;
        let (mut decoder, mut events) = (Decoder::default(), Vec::new());
        let seconds =
            REST_S + f64::from(self.scene.programme.total_ticks()) / f64::from(self.scene.timing.actuation_hz.max(1));
        for k in 1..=(seconds / HOST_S) as u32 {
            let now_s = HOST_S * f64::from(k);
            gripper.advance(now_s);
            decoder.push(&gripper.take_bytes(), now_s, &mut events);
        }
        Ok((decoder.board().clone(), events.into_iter().filter_map(BoardEvent::into_reading).collect()))
    }
}
