//! Random scenes through the door that users take: keys of the scene file set to whatever the ranges permit, objects from
//! random primitives and meshes. A typed error, a sound trial or one that is marked as not sound may come out; never a
//! panic, never a hang, never a sound trial with numbers that are none.
//!
//! A second or two of it run with every test. `PALPATE_FUZZ_S=3600 cargo test --test suite fuzz` runs for an hour, from
//! `PALPATE_FUZZ_SEED` on, and tells every find with its seed.

use crate::bench::HANG;
use palpate_lab::grasping::grasp;
use palpate_sim::objects::catalogue;
use palpate_sim::scene::{Scene, SceneKey};
use palpate_tactile::trial::SimulatedTrial;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// Steps times strands in one trial: what keeps a case below a second or so.
const MOST_WORK: f64 = 2e6;

/// What came of a seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// The object or the scene was refused in words.
    Refused,
    /// A trial that may be learned from.
    Sound,
    /// A trial that is marked as not to be trusted.
    Flagged,
}

const WORDS: [&str; 12] = [
    "auto",
    "pedestal",
    "table",
    "none",
    "linear",
    "neo-hookean",
    "draft",
    "standard",
    "reference",
    "hull",
    "file",
    "visual",
];

fn number(random: &mut ChaCha8Rng, default: f64) -> f64 {
    let wide = 10f64.powf(random.random_range(-5.0..5.0));
    match random.random_range(0..12) {
        0 => [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300][random.random_range(0..6)],
        1 => 10f64.powf(random.random_range(-14.0..12.0)),
        2 => -default * wide,
        3..=5 if default == 0.0 => random.random_range(-0.1..0.1),
        6 if default == 0.0 => random.random_range(-360.0..360.0),
        _ if default == 0.0 => 0.01 * wide,
        _ => default * wide,
    }
}

/// Another value of the kind that a key has.
fn value(random: &mut ChaCha8Rng, key: &SceneKey) -> String {
    let text = |x: f64| if x.is_finite() { format!("{x:?}") } else { x.to_string().to_lowercase() };
    if key.name == "gripper.actuation.curve" {
        let torque = number(random, 0.09);
        return format!("[{{bar = 0.0, torque = 0.0}}, {{bar = 1.5, torque = {}}}]", text(torque));
    }
    match key.default.as_bytes().first() {
        Some(b'[') => {
            let count = key.default.split(',').count();
            let parts: Vec<String> = (0..count).map(|_| text(number(random, 0.0))).collect();
            format!("[{}]", parts.join(", "))
        }
        Some(b'"') if random.random_bool(0.5) => text(number(random, 0.1)),
        Some(b'"') => format!("\"{}\"", WORDS[random.random_range(0..WORDS.len())]),
        Some(b't' | b'f') => random.random_bool(0.5).to_string(),
        _ if key.default.contains('.') => text(number(random, key.default.parse().unwrap_or(0.0))),
        _ => (10f64.powf(random.random_range(0.0..4.5)) as u64).to_string(),
    }
}

/// A random scene that is within all ranges, with its object's file written into `folder`.
fn scene(random: &mut ChaCha8Rng, folder: &Path) -> Scene {
    let keys = Scene::keys();
    let mut scene = Scene::default();
    for _ in 0..random.random_range(1..16) {
        let key = &keys[random.random_range(0..keys.len())];
        let setting = format!("{}={}", key.name, value(random, key));
        match scene.with_settings(std::slice::from_ref(&setting)) {
            Ok(changed) => scene = changed,
            Err(error) => assert!(!error.to_string().is_empty(), "{setting}"),
        }
    }
    scene.object.source = object(random, folder);
    // A trial that takes minutes is nobody's fault; here it must be shorter.
    let work = |scene: &Scene| {
        let taxels = (2 * scene.gripper.pad.rows * scene.gripper.pad.columns) as f64;
        scene.timing.clock(scene.solver.accuracy).total_ticks() as f64 * taxels
    };
    let least = 1.0 / f64::from(scene.timing.sample_hz);
    if work(&scene) > MOST_WORK {
        scene.timing.duration_s = (scene.timing.duration_s * MOST_WORK / work(&scene)).max(least);
    }
    if work(&scene) > MOST_WORK {
        (scene.gripper.pad.rows, scene.gripper.pad.columns) = (10, 2);
    }
    scene.solver.max_iterations = scene.solver.max_iterations.min(1000);
    scene
}

fn object(random: &mut ChaCha8Rng, folder: &Path) -> String {
    let kind = random.random_range(0..5);
    if kind == 0 {
        return catalogue()[random.random_range(0..catalogue().len())].name.clone();
    }
    let (name, text) = match kind {
        1 | 2 => ("thing.urdf", urdf(random)),
        3 => ("thing.obj", heap_of_triangles(random)),
        _ => ("thing.obj", dented_ball(random)),
    };
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// One to three primitives of any size, of any mass or none given.
fn urdf(random: &mut ChaCha8Rng) -> String {
    let mut links = String::new();
    for k in 0..random.random_range(1..4) {
        let mut size = || 10f64.powf(random.random_range(-4.5..-0.5));
        let [a, b, c] = [size(), size(), size()];
        let shape = match random.random_range(0..3) {
            0 => format!("<sphere radius='{a}'/>"),
            1 => format!("<box size='{a} {b} {c}'/>"),
            _ => format!("<cylinder radius='{a}' length='{b}'/>"),
        };
        let mass = 10f64.powf(random.random_range(-6.0..2.0));
        let inertia = mass * 10f64.powf(random.random_range(-10.0..-2.0));
        let inertial = if random.random_bool(0.5) {
            format!(
                "<inertial><mass value='{mass}'/><inertia ixx='{inertia}' ixy='0' ixz='0' iyy='{inertia}' iyz='0' \
                 izz='{inertia}'/></inertial>"
            )
        } else {
            String::new()
        };
        write!(links, "<link name='l{k}'>{inertial}<collision><geometry>{shape}</geometry></collision></link>")
            .unwrap();
        if k > 0 {
            write!(
                links,
                "<joint name='j{k}' type='fixed'><parent link='l{}'/><child link='l{k}'/><origin xyz='{} 0 {}' \
                 rpy='0 {} 0'/></joint>",
                k - 1,
                random.random_range(-0.05..0.05),
                random.random_range(-0.05..0.05),
                random.random_range(-3.0..3.0)
            )
            .unwrap();
        }
    }
    format!("<robot name='r'>{links}</robot>")
}

/// Triangles anywhere, of which most make no solid.
fn heap_of_triangles(random: &mut ChaCha8Rng) -> String {
    let size = 10f64.powf(random.random_range(-4.0..0.0));
    let points = random.random_range(3..12);
    let mut text = String::new();
    for _ in 0..points {
        let [x, y, z] = [(); 3].map(|()| size * random.random_range(-1.0..1.0));
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for _ in 0..random.random_range(1..20) {
        let [a, b, c] = [(); 3].map(|()| random.random_range(1..=points));
        writeln!(text, "f {a} {b} {c}").unwrap();
    }
    text
}

/// A closed surface, dented, stretched and perhaps inside out.
fn dented_ball(random: &mut ChaCha8Rng) -> String {
    const RINGS: usize = 6;
    const AROUND: usize = 8;
    let size = 10f64.powf(random.random_range(-3.5..-1.0));
    let [a, b, c] = [(); 3].map(|()| size * 10f64.powf(random.random_range(-1.5..0.5)));
    let mut text = format!("v 0 0 {c}\nv 0 0 {}\n", -c);
    for ring in 1..=RINGS {
        let polar = std::f64::consts::PI * ring as f64 / (RINGS + 1) as f64;
        for k in 0..AROUND {
            let turn = std::f64::consts::TAU * k as f64 / AROUND as f64;
            let dent = random.random_range(0.2..1.2);
            let (x, y, z) =
                (a * dent * polar.sin() * turn.cos(), b * dent * polar.sin() * turn.sin(), c * dent * polar.cos());
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
    }
    let at = |ring: usize, k: usize| 3 + ring * AROUND + k % AROUND;
    let inside_out = random.random_bool(0.2);
    let mut face = |p: usize, q: usize, r: usize| {
        let (q, r) = if inside_out { (r, q) } else { (q, r) };
        writeln!(text, "f {p} {q} {r}").unwrap();
    };
    for k in 0..AROUND {
        face(1, at(0, k), at(0, k + 1));
        face(2, at(RINGS - 1, k + 1), at(RINGS - 1, k));
        for ring in 0..RINGS - 1 {
            face(at(ring, k), at(ring + 1, k), at(ring + 1, k + 1));
            face(at(ring, k), at(ring + 1, k + 1), at(ring, k + 1));
        }
    }
    text
}

/// True when every number of every frame is one.
fn is_finite(trial: &SimulatedTrial) -> bool {
    trial.frames().iter().all(|frame| {
        frame.q.iter().all(|q| q.is_finite())
            && frame.world_from_object.is_none_or(|pose| pose.is_finite())
            && frame.taxels.iter().all(|load| [load.normal, load.along, load.across].iter().all(|f| f.is_finite()))
    })
}

/// Grasps what a seed stands for.
fn outcome(seed: u64) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scene = scene(&mut random, folder.path());
    let object = match scene.load_object() {
        Ok(object) => object,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return Outcome::Refused;
        }
    };
    let trial = grasp(&scene, object.as_ref(), seed);
    assert!(is_finite(&trial), "a frame holds a number that is none: {:?}", trial.data.quality);
    let quality = &trial.data.quality;
    assert!(quality.friction_residual.is_finite() && quality.static_residual.is_finite(), "{quality:?}");
    if quality.is_sound() { Outcome::Sound } else { Outcome::Flagged }
}

/// The outcome, unless it takes for ever or there is a fault, which is told with the seed.
fn watched(seed: u64) -> Result<Outcome, String> {
    let (sender, receiver) = channel();
    let thread = std::thread::spawn(move || {
        // Whoever waited may have given up.
        let _heard = sender.send(outcome(seed));
    });
    match receiver.recv_timeout(HANG) {
        Ok(outcome) => Ok(outcome),
        Err(_) if thread.is_finished() => {
            let fault = thread.join().err();
            let words = fault.and_then(|fault| fault.downcast_ref::<String>().cloned());
            Err(format!("seed {seed}: {}", words.unwrap_or_else(|| "a panic".to_owned())))
        }
        Err(_) => Err(format!("seed {seed}: hangs")),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_scenes_are_refused_sound_or_flagged(seed: u64) {
        let found = watched(seed);
        prop_assert!(found.is_ok(), "{found:?}");
    }
}

#[test]
fn an_hour_where_one_is_asked_for() {
    let setting = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let (seconds, first) = (setting("PALPATE_FUZZ_S").unwrap_or(1), setting("PALPATE_FUZZ_SEED").unwrap_or(0));
    let start = Instant::now();
    let mut counts = [0u32; 3];
    let mut finds = Vec::new();
    let mut seed = first;
    while start.elapsed() < Duration::from_secs(seconds) {
        let began = Instant::now();
        match watched(seed) {
            Ok(outcome) => counts[outcome as usize] += 1,
            Err(find) => {
                eprintln!("{find}");
                finds.push(find);
            }
        }
        if began.elapsed() > Duration::from_secs(20) {
            eprintln!("seed {seed}: took {:.0} s", began.elapsed().as_secs_f64());
        }
        seed += 1;
    }
    let [refused, sound, flagged] = counts;
    eprintln!("{} seeds: {refused} refused, {sound} sound, {flagged} flagged", seed - first);
    assert!(finds.is_empty(), "{finds:#?}");
    assert!(sound > 0, "nothing was ever grasped");
}
