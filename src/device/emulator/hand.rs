//! Fingers of the emulated gripper: they grasp by a programme of their own, as a host drives them, or are bent and loaded by a
//! bench script. Grasps are simulated.

use super::event::{EmulatorError, EmulatorEventKind};
use super::parts::{Stimuli, between};
use super::script::Step;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{Phase, Programme, Side};
use palpate_sim::objects::{EMPTY, ObjectError, ObjectModel, catalogue};
use palpate_sim::poses::{PoseSampler, has_room};
use palpate_sim::run::{SimEvent, SimRun};
use palpate_sim::scene::Scene;
use palpate_tactile::board::{Measures, Sensor, SensorKind, SensorList};
use palpate_tactile::electronics::StripPart;
use palpate_tactile::{Channel, Quantity, Sensors};
use std::collections::VecDeque;

/// Length of a simulation that a host drives (s): a day, after which the fingers stop.
const LONGEST_GRASP_S: f64 = 86_400.0;

/// Rest after a programme (s).
const SETTLE_S: f64 = 0.5;

/// Actuation rate of fingers that a host drives (1/s): a host may set a pressure at any moment.
const DRIVEN_HZ: u32 = 300;

/// After venting for this time (s), the next pressure begins another grasp.
const LET_GO_S: f64 = 0.5;

/// Time to bend a strip or place a weight (s).
const RAMP_S: f64 = 0.3;

/// Object to grasp.
#[derive(Clone, Debug)]
struct Graspable {
    name: String,
    model: Option<ObjectModel>,
    poses: PoseSampler,
}

/// Plan of the hand.
#[derive(Clone, Debug)]
pub struct HandPlan {
    /// Sensors of the gripper.
    pub sensors: SensorList,
    /// The gripper, its programme, and how objects lie.
    pub scene: Scene,
    /// What is in the hand, grasp by grasp and then again. If the list starts with `empty`, the hand is empty for the
    /// first grasp of a host only. Without a list, the hand grasps the built-in objects by itself, and is empty once a
    /// host drives.
    pub objects: Vec<String>,
    /// Random seed of the poses.
    pub seed: u64,
    /// Period of its own grasps (s); none: it waits for a host.
    pub grasp_every_s: Option<f64>,
    /// Bench script, in place of its own grasps.
    pub script: Vec<Step>,
}

/// Activity of the fingers.
#[derive(Debug)]
enum HandActivity {
    Rest,
    Held { from: Stimuli, to: Stimuli, since_s: f64, until_s: f64 },
    Grasp(Box<LiveGrasp>),
}

/// The hand.
#[derive(Debug)]
pub(super) struct Hand {
    plan: HandPlan,
    things: Vec<Graspable>,
    script: VecDeque<Step>,
    scripted: bool,
    doing: HandActivity,
    grasps: u32,
    /// Grasps since the hand was last emptied.
    turn: usize,
    next_s: f64,
    /// Scene of the last grasp, and of the next one where it was placed.
    scene: Option<Scene>,
    placed: Option<Scene>,
    /// A host drives.
    driven: bool,
    vented_since_s: Option<f64>,
    began: Vec<EmulatorEventKind>,
    last: Stimuli,
}

impl Hand {
    /// Loads the objects, some tenths of a second for each.
    pub(super) fn new(plan: HandPlan) -> Result<Self, ObjectError> {
        let in_script = plan.script.iter().filter_map(|step| match step {
            Step::Grasp { object, .. } => Some(object.clone()),
            Step::Hold { .. } => None,
        });
        let nobody = plan.objects.is_empty().then_some(EMPTY.to_owned());
        let own = plan.grasp_every_s.filter(|_| plan.objects.is_empty()).map(|_| built_in());
        let named = plan.objects.iter().cloned().chain(in_script);
        let mut wanted: Vec<String> = named.chain(nobody).chain(own.into_iter().flatten()).collect();
        wanted.sort();
        wanted.dedup();
        let mut hand = Self {
            script: plan.script.iter().cloned().collect(),
            scripted: !plan.script.is_empty(),
            last: rest(&plan),
            plan,
            things: Vec::new(),
            doing: HandActivity::Rest,
            grasps: 0,
            turn: 0,
            next_s: 0.0,
            scene: None,
            placed: None,
            driven: false,
            vented_since_s: None,
            began: Vec::new(),
        };
        for name in wanted {
            hand.load(&name)?;
        }
        Ok(hand)
    }

    fn load(&mut self, name: &str) -> Result<usize, ObjectError> {
        if let Some(known) = self.things.iter().position(|thing| thing.name == name) {
            return Ok(known);
        }
        let mut scene = self.plan.scene.clone();
        (scene.object.source, scene.object.name) = (name.to_owned(), None);
        let model = scene.load_object()?;
        let poses = PoseSampler::new(&scene, model.as_ref());
        self.things.push(Graspable { name: name.to_owned(), model, poses });
        Ok(self.things.len() - 1)
    }

    /// Adds a step to the script.
    pub(super) fn add(&mut self, step: Step) -> Result<(), ObjectError> {
        if let Step::Grasp { object, .. } = &step {
            self.load(&object.clone())?;
        }
        self.script.push_back(step);
        self.scripted = true;
        Ok(())
    }

    /// Puts an object into the hand for the next grasps of a host, first as in a scene.
    pub(super) fn place(&mut self, object: &str, scene: Option<Scene>) -> Result<(), EmulatorError> {
        let thing = self.load(object).map_err(|error| EmulatorError(error.to_string()))?;
        if scene.as_ref().is_some_and(|scene| !has_room(scene, self.things[thing].model.as_ref())) {
            return Err(EmulatorError("the fingers would stand inside the object, or outside of the scene".to_owned()));
        }
        self.plan.objects = vec![object.to_owned()];
        self.placed = scene;
        Ok(())
    }

    /// Scene of the last grasp.
    pub(super) fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// Takes the starts since the last call.
    pub(super) fn take_began(&mut self) -> Vec<EmulatorEventKind> {
        std::mem::take(&mut self.began)
    }

    /// Line pressure of the hand's own programme (bar), if it has one.
    pub(super) fn own_bar(&self) -> Option<f64> {
        match &self.doing {
            HandActivity::Grasp(grasp) if grasp.programme.is_some() => Some(grasp.line_bar),
            HandActivity::Rest | HandActivity::Held { .. } if !self.driven => Some(0.0),
            HandActivity::Rest | HandActivity::Held { .. } | HandActivity::Grasp(_) => None,
        }
    }

    /// Hands control to a host that sets a pressure at a time (s), in place of `was_bar` (bar).
    pub(super) fn take_over(&mut self, t: f64, was_bar: f64) {
        if self.driven {
            // Until now the old pressure was on.
            self.at(t, was_bar);
        } else {
            (self.driven, self.doing, self.turn) = (true, HandActivity::Rest, 0);
            self.script.clear();
        }
    }

    /// Stimuli of the sensors at a time (s), which never decreases; `host_bar` is the pressure set by the host (bar).
    pub(super) fn at(&mut self, t: f64, host_bar: f64) -> Stimuli {
        if self.driven {
            self.follow_host(t, host_bar);
        } else {
            self.go_on(t);
        }
        self.last = match &mut self.doing {
            HandActivity::Rest => rest(&self.plan),
            HandActivity::Held { from, to, since_s, .. } => {
                between(from, to, ((t - *since_s) / RAMP_S).clamp(0.0, 1.0))
            }
            HandActivity::Grasp(grasp) => {
                let stimulus = grasp.at(t, host_bar);
                self.began.extend(grasp.failed.take().map(|reason| EmulatorEventKind::Failed { reason }));
                stimulus
            }
        };
        self.last.clone()
    }

    fn follow_host(&mut self, t: f64, bar: f64) {
        if bar <= 0.0 {
            self.vented_since_s.get_or_insert(t);
            return;
        }
        let let_go = self.vented_since_s.take().is_some_and(|since| t - since >= LET_GO_S);
        if let_go || matches!(self.doing, HandActivity::Rest) {
            self.grasp_next(t, None);
        }
    }

    /// Continues the script, or its own grasps.
    fn go_on(&mut self, t: f64) {
        let busy = match &self.doing {
            HandActivity::Rest => false,
            HandActivity::Held { until_s, .. } => t < *until_s,
            HandActivity::Grasp(grasp) => t < grasp.ends_s,
        };
        if busy {
            return;
        }
        if let Some(step) = self.script.pop_front() {
            self.take_step(&step, t);
        } else if self.scripted {
            if !matches!(self.doing, HandActivity::Rest) {
                self.began.push(EmulatorEventKind::ScriptDone);
                self.doing = HandActivity::Rest;
            }
        } else if let Some(every) = self.plan.grasp_every_s.filter(|_| t >= self.next_s) {
            self.next_s = t + every;
            let programme = self.plan.scene.programme.clone();
            self.grasp_next(t, Some(programme));
        }
    }

    fn take_step(&mut self, step: &Step, t: f64) {
        match step {
            Step::Hold { bend, load, seconds } => {
                let mut to = rest(&self.plan);
                for sensor in self.plan.sensors.iter() {
                    let Some(side) = sensor.side().map(Side::index) else { continue };
                    match sensor.kind() {
                        SensorKind::Flex => to[sensor.index()] = bend[side] / StripPart::ACTIVE_LENGTH,
                        SensorKind::Pad => to[sensor.index()] = load[side],
                        SensorKind::Raw => {}
                    }
                }
                self.doing = HandActivity::Held { from: self.last.clone(), to, since_s: t, until_s: t + seconds };
                let bend_deg = bend.map(f64::to_degrees);
                self.began.push(EmulatorEventKind::Hold { bend_deg, load_n: *load, seconds: *seconds });
            }
            Step::Grasp { object, bar } => {
                let mut programme = self.plan.scene.programme.clone();
                programme.peak_bar = bar.unwrap_or(programme.peak_bar);
                // Loaded when the step was added.
                if let Some(thing) = self.things.iter().position(|thing| thing.name == *object) {
                    self.grasp(thing, t, Some(programme));
                }
            }
        }
    }

    fn grasp_next(&mut self, t: f64, programme: Option<Programme>) {
        let name = self.next_object();
        if let Some(thing) = self.things.iter().position(|thing| thing.name == name) {
            self.grasp(thing, t, programme);
        }
    }

    /// What is in the hand at the next grasp.
    fn next_object(&mut self) -> String {
        let turn = self.turn;
        self.turn += 1;
        let (place, objects) = match self.plan.objects.as_slice() {
            [] if !self.driven => (turn, built_in()),
            [empty, others @ ..] if self.driven && turn > 0 && empty == EMPTY && !others.is_empty() => {
                (turn - 1, others.to_vec())
            }
            objects => (turn, objects.to_vec()),
        };
        objects.get(place % objects.len().max(1)).map_or(EMPTY, String::as_str).to_owned()
    }

    fn grasp(&mut self, thing: usize, t: f64, programme: Option<Programme>) {
        self.grasps += 1;
        let Graspable { name, model, poses } = &self.things[thing];
        let drawn = || poses.draw(model.as_ref(), self.plan.seed.wrapping_add(u64::from(self.grasps))).0;
        let scene = self.placed.take().unwrap_or_else(drawn);
        self.began.push(EmulatorEventKind::Grasp { number: self.grasps, object: name.clone() });
        self.doing = HandActivity::Grasp(Box::new(LiveGrasp::new(&self.plan, &scene, model.as_ref(), t, programme)));
        self.scene = Some(scene);
    }
}

/// Names of the built-in objects.
fn built_in() -> Vec<String> {
    catalogue().iter().map(|object| object.name.clone()).collect()
}

/// Simulated grasp, driven while it runs.
#[derive(Debug)]
struct LiveGrasp {
    rig: SimRun,
    sensors: Sensors,
    /// The sensor that each of their channels belongs to.
    places: Vec<usize>,
    rest: Stimuli,
    start_s: f64,
    ends_s: f64,
    /// The hand's own programme; none when a host drives.
    programme: Option<Programme>,
    line_bar: f64,
    /// Time since the start (s) and stimulus, at the last frame and at the next.
    frames: [(f64, Stimuli); 2],
    failed: Option<String>,
}

impl LiveGrasp {
    fn new(
        plan: &HandPlan,
        scene: &Scene,
        object: Option<&ObjectModel>,
        start_s: f64,
        programme: Option<Programme>,
    ) -> Self {
        let lasts = |p: &Programme| f64::from(p.total_ticks()) / f64::from(scene.timing.actuation_hz.max(1)) + SETTLE_S;
        let ends_s = start_s + programme.as_ref().map_or(LONGEST_GRASP_S, lasts);
        let mut endless = scene.clone();
        endless.timing.duration_s = LONGEST_GRASP_S;
        if programme.is_none() {
            (endless.timing.sample_hz, endless.timing.actuation_hz) = (DRIVEN_HZ, DRIVEN_HZ);
        }
        let felt = |channel: &Channel| plan.sensors.iter().find(|sensor| sensor.gives(channel)).map(Sensor::index);
        let mut channels = plan.sensors.simulated_on(&scene.gripper);
        // A pad is loaded by a force; its pressure follows from it.
        channels.retain(|channel| channel.quantity != Quantity::Pressure);
        let places = channels.iter().filter_map(felt).collect();
        let (rig, placement) = SimRun::new(&endless, object);
        let sensors = Sensors::of(channels, &scene.gripper).with_palm(placement.world_from_gripper.position);
        let rest = rest(plan);
        let frames = [(0.0, rest.clone()), (0.0, rest.clone())];
        Self { rig, sensors, places, rest, start_s, ends_s, programme, line_bar: 0.0, frames, failed: None }
    }

    fn at(&mut self, t: f64, host_bar: f64) -> Stimuli {
        let t = t - self.start_s;
        while self.frames[1].0 < t {
            match self.rig.next_event() {
                Ok(SimEvent::ActuationDue { tick }) => {
                    let own = self.programme.as_ref().map(|programme| programme.command(tick));
                    let (bar, phase) = own.unwrap_or((host_bar, Phase::Close));
                    self.line_bar = bar;
                    self.rig.command(bar, phase);
                }
                Ok(SimEvent::Sampled(frame)) => {
                    self.frames.swap(0, 1);
                    self.frames[1] = (frame.t, self.feel(&frame));
                }
                Ok(SimEvent::Finished) => self.frames[1].0 = f64::INFINITY,
                Err(error) => {
                    self.failed = Some(error.to_string());
                    self.frames[1].0 = f64::INFINITY;
                }
            }
        }
        let [(before_s, before), (after_s, after)] = &self.frames;
        let (before_s, after_s) = (*before_s, *after_s);
        // No frame yet: nothing to interpolate from.
        if !after_s.is_finite() || after_s <= before_s {
            return after.clone();
        }
        between(before, after, ((t - before_s) / (after_s - before_s)).clamp(0.0, 1.0))
    }

    fn feel(&self, frame: &Frame) -> Stimuli {
        let mut stimuli = self.rest.clone();
        for (place, value) in self.places.iter().zip(self.sensors.read(frame)) {
            stimuli[*place] = value.unwrap_or_default();
        }
        stimuli
    }
}

/// Stimuli of an open, empty hand without pressure.
fn rest(plan: &HandPlan) -> Stimuli {
    let of = |sensor: Sensor| match sensor.row().measures {
        Some(Measures::PalmDistance) => plan.scene.gripper.finger.length,
        Some(Measures::ChamberPressure) | None => 0.0,
    };
    plan.sensors.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::scene::Accuracy;

    fn plan() -> HandPlan {
        let mut scene = Scene::default();
        scene.solver.accuracy = Accuracy::Draft;
        scene.object.fixed = true;
        HandPlan {
            sensors: SensorList::default(),
            scene,
            objects: vec![EMPTY.to_owned()],
            seed: 1,
            grasp_every_s: None,
            script: Vec::new(),
        }
    }

    fn run(hand: &mut Hand, from_s: f64, to_s: f64, bar: f64) -> Stimuli {
        let samples = ((to_s - from_s) * 50.0).round() as u32;
        (1..=samples).map(|k| hand.at(from_s + f64::from(k) / 50.0, bar)).last().unwrap_or_default()
    }

    #[test]
    fn bends_and_loads_are_held_as_the_script_says() {
        let script = super::super::script::parse_script("angle=90 hold=1; load=1N hold=1").expect("sound");
        let mut hand = Hand::new(HandPlan { script, ..plan() }).expect("nothing to load");
        let bent = run(&mut hand, 0.0, 0.9, 0.0);
        // 90 degrees over 55.37 mm: 28.4 1/m.
        assert!((bent[0] - 28.37).abs() < 0.01 && bent[0] == bent[1] && bent[2..] == [0.0; 2]);
        let loaded = run(&mut hand, 0.9, 1.9, 0.0);
        assert_eq!(loaded, [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(run(&mut hand, 1.9, 3.0, 0.0), [0.0; 4]);
        let began = hand.take_began();
        assert!(
            matches!(
                began[..],
                [EmulatorEventKind::Hold { .. }, EmulatorEventKind::Hold { .. }, EmulatorEventKind::ScriptDone]
            ),
            "{began:?}"
        );
    }

    #[test]
    fn a_host_bends_the_fingers_as_far_as_the_pressure_says() {
        let mut hand = Hand::new(plan()).expect("nothing to load");
        hand.take_over(0.0, 0.0);
        assert_eq!(hand.at(0.02, 0.0), [0.0; 4]);
        // 0.5 bar are 0.03 N m on joints of 0.42 N m/rad and 10 mm: 7.14 1/m, less what gravity does.
        let bent = run(&mut hand, 0.02, 1.5, 0.5);
        assert!((bent[0] - 7.14).abs() < 0.4 && bent[2..] == [0.0; 2], "{bent:?}");
        let open = run(&mut hand, 1.5, 3.0, 0.0);
        assert!(open[0].abs() < 0.6, "{open:?}");
        run(&mut hand, 3.0, 3.1, 0.5);
        assert!((0..50).all(|k| hand.at(3.1 + 0.02 * f64::from(k), 0.5)[0].is_finite()));
        let began = hand.take_began();
        assert_eq!(began.len(), 2, "a new grasp after it has let go: {began:?}");
    }

    #[test]
    fn a_pressure_is_obeyed_when_it_is_set_and_not_at_some_tick() {
        // The same step, a tenth of a tick of the programme apart: the bend follows by as much.
        let after = |late_s: f64| {
            let mut hand = Hand::new(plan()).expect("nothing to load");
            hand.take_over(0.0, 0.0);
            run(&mut hand, 0.0, 1.0, 0.3);
            hand.take_over(1.0 + late_s, 0.3);
            hand.at(1.06, 0.6)[0]
        };
        let bends = [0.0, 0.01, 0.02, 0.03].map(after);
        assert!(bends.windows(2).all(|pair| pair[0] > pair[1] + 0.05), "{bends:?}");
    }

    #[test]
    fn the_palm_is_as_far_as_the_object_lies() {
        let text = "[[sensor]]\nname = \"palm\"\nkind = \"raw\"\nmeasures = \"palm-distance\"\n";
        let sensors = SensorList::parse(text).expect("sound");
        let held = |object: &str| {
            let mut hand =
                Hand::new(HandPlan { sensors, objects: vec![object.to_owned()], ..plan() }).expect("built in");
            hand.take_over(0.0, 0.0);
            run(&mut hand, 0.0, 1.0, 0.5)[0]
        };
        let finger = Scene::default().gripper.finger.length;
        assert_eq!(held(EMPTY), finger);
        assert!((0.3 * finger..0.99 * finger).contains(&held("ball")), "{}", held("ball"));
    }

    #[test]
    fn by_itself_it_grasps_again_and_again() {
        let mut hand = Hand::new(HandPlan { grasp_every_s: Some(5.0), ..plan() }).expect("nothing to load");
        let held = run(&mut hand, 0.0, 2.5, 0.0);
        assert!(held[0] > 5.0 && hand.own_bar() == Some(1.0), "{held:?}");
        run(&mut hand, 2.5, 10.2, 0.0);
        let grasps = hand.take_began();
        assert_eq!(grasps.len(), 3, "at 0, 5 and 10 s: {grasps:?}");
    }
}
