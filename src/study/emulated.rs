//! An emulated gripper, read as after `palpate adapt`: parts that no training saw, through board, line and decoder. It grasps one
//! object after the other, each grasp with faults of its own.

use crate::frame::StudyError;
use palpate_device::emulator::{
    EmulatedFault, EmulatedGripper, EmulatorEventKind, EmulatorSetup, HandPlan, HiddenParts, Step,
};
use palpate_device::protocol::{BoardEvent, Decoder};
use palpate_lab::datasets::sequence_of;
use palpate_lab::grasping::Adaptation;
use palpate_learn::Sequence;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_tactile::board::{Board, Sensor, SensorList};
use palpate_tactile::calibration::{Calibration, Readout};
use palpate_tactile::trial::{BoardCourse, BoardLog, PhaseMark};

/// Rest before each closing (s).
pub(crate) const REST_S: f64 = 0.5;
/// Time step of the host (s).
const HOST_S: f64 = 0.005;
/// Readings per second (1/s).
const RATE_HZ: u32 = 50;
/// Steps of pressure that the board puts out.
const STEPS: u8 = 30;

/// An emulated gripper, with the calibrations by one close of its empty hand.
pub(crate) struct EmulatedHand<'a> {
    /// The gripper, and how objects lie.
    scene: &'a Scene,
    parts: HiddenParts,
    pub(crate) calibrations: Vec<(Sensor, Calibration)>,
}

impl<'a> EmulatedHand<'a> {
    /// The gripper of a scene, with parts of a seed; `modelled` is the scene that is assumed when it is adapted to.
    pub(crate) fn new(scene: &'a Scene, modelled: &Scene, seed: u64) -> Result<Self, StudyError> {
        let mut own = Self { scene, parts: HiddenParts::drawn(seed), calibrations: Vec::new() };
        let logs = own.grasps(EMPTY, seed, &[Vec::new()])?;
        let calibrations = logs.first().and_then(|log| {
            let adaptation = Adaptation::of_log(log, modelled);
            let all = adaptation.sensors.iter();
            all.map(|(sensor, adapted)| Some((*sensor, adapted.calibration()?.clone()))).collect::<Option<_>>()
        });
        own.calibrations =
            calibrations.ok_or_else(|| StudyError::missing("an emulated gripper that can be adapted to"))?;
        Ok(own)
    }

    /// Grasps of an object in poses of a seed, one for each list of faults, whose times are those since its rest began.
    pub(crate) fn grasps(
        &self,
        object: &str,
        seed: u64,
        faults: &[Vec<EmulatedFault>],
    ) -> Result<Vec<BoardLog>, StudyError> {
        let rest = Step::Hold { bend: [0.0; 2], load: [0.0; 2], seconds: REST_S };
        let grasp = Step::Grasp { object: object.to_owned(), bar: None };
        let sensors = SensorList::default();
        let setup = EmulatorSetup {
            hand: HandPlan {
                sensors,
                scene: self.scene.clone(),
                objects: vec![EMPTY.to_owned()],
                seed,
                grasp_every_s: None,
                script: faults.iter().flat_map(|_| [rest.clone(), grasp.clone()]).collect(),
            },
            parts: self.parts.clone(),
            rate_hz: RATE_HZ,
            channels: sensors.len(),
            most_steps: STEPS,
            clock_start_us: 0,
            faults: Vec::new(),
            seed,
        };
        let mut gripper = EmulatedGripper::new(setup).map_err(StudyError::missing)?;
        let (mut decoder, mut events) = (Decoder::default(), Vec::new());
        let programme = &self.scene.programme;
        let grasp_s = f64::from(programme.total_ticks()) / f64::from(self.scene.timing.actuation_hz.max(1));
        // When each rest began, from the first.
        let mut rests: Vec<f64> = Vec::new();
        for step in 1.. {
            let end_s =
                rests.last().filter(|_| rests.len() == faults.len()).map(|last| last - rests[0] + REST_S + grasp_s);
            if end_s.is_some_and(|end_s| step > (end_s / HOST_S) as u32) {
                break;
            }
            let now_s = HOST_S * f64::from(step);
            gripper.advance(now_s);
            decoder.push(&gripper.take_bytes(), now_s, &mut events);
            for event in gripper.take_happened() {
                match event.what {
                    EmulatorEventKind::Hold { .. } => {
                        for fault in faults.get(rests.len()).into_iter().flatten() {
                            let (from_s, until_s) = (event.t_s + fault.from_s, event.t_s + fault.until_s);
                            gripper.add_fault(EmulatedFault { from_s, until_s, ..*fault });
                        }
                        rests.push(event.t_s);
                    }
                    EmulatorEventKind::Failed { reason } => return Err(StudyError::missing(reason)),
                    _ => {}
                }
            }
        }
        let board: Board = decoder.board().clone();
        let mut readings = events.into_iter().filter_map(BoardEvent::into_reading).peekable();
        let (held, released) = (programme.close_ticks(), programme.close_ticks() + programme.hold_ticks);
        let mut log = |k: usize| {
            let next_s = rests.get(k + 1).copied().unwrap_or(f64::INFINITY);
            let own = std::iter::from_fn(|| readings.next_if(|reading| reading.t_s < next_s)).collect();
            let closing_s = rests[k] - rests[0] + REST_S;
            let marks = [(Phase::Close, 0), (Phase::Hold, held), (Phase::Release, released)];
            let mark = |(phase, tick): (Phase, u32)| {
                let from_s = closing_s + f64::from(tick) / f64::from(self.scene.timing.actuation_hz.max(1));
                PhaseMark { phase, from_s, line_bar: None }
            };
            let course =
                BoardCourse { board: board.clone(), phases: marks.map(mark).to_vec(), ..BoardCourse::default() };
            BoardLog { course, readings: own, gaps: Vec::new() }
        };
        Ok((0..rests.len()).map(&mut log).collect())
    }

    /// A grasp in these channels, from the closing to the end of the hold.
    pub(crate) fn sequence(&self, log: &BoardLog, channels: &[String]) -> Result<Sequence, StudyError> {
        let readout = Readout::new(&log.course.board, &self.calibrations).map_err(StudyError::missing)?;
        let [closing_s, release_s] = [Phase::Close, Phase::Release].map(|phase| {
            let mark = log.course.phases.iter().find(|mark| mark.phase == phase);
            mark.map_or(f64::INFINITY, |mark| mark.from_s)
        });
        let signals = readout.derive(&log.readings, Some(closing_s)).signals.chosen(channels);
        let signals = signals.ok_or_else(|| StudyError::missing("channels of the emulated gripper"))?;
        Ok(sequence_of(&signals.since(closing_s).until(release_s - closing_s)))
    }
}
