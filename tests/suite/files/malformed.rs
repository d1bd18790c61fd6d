//! Malformed files of every kind: whatever comes in, a typed error or an object with finite numbers comes out, in good
//! time and without a panic.

use super::obj_text;
use glam::DVec3;
use palpate_geometry::{Primitive, TriMesh};
use palpate_lab::grasping::grasp;
use palpate_sim::objects::{LoadOptions, ObjectModel, load};
use palpate_sim::scene::Scene;
use proptest::prelude::*;
use std::path::Path;
use std::sync::mpsc::channel;
use std::time::Duration;

/// Longer than anything that is not a hang, however slow the machine.
const HANG: Duration = Duration::from_secs(120);

/// Loads a file in a thread that may hang or panic, and says what came of it.
fn outcome(path: &Path) -> Result<Option<ObjectModel>, String> {
    let source = path.to_str().unwrap().to_owned();
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let loaded = load(&source, &LoadOptions::default()).map_err(|error| error.to_string());
        // The test may have given up waiting.
        let _heard = sender.send(loaded);
    });
    receiver.recv_timeout(HANG).unwrap_or_else(|cause| panic!("{} hangs or panics: {cause}", path.display()))
}

/// What must hold of anything that loads.
fn check_sound(object: &ObjectModel) {
    assert!(object.mass.is_physical(), "{:?}", object.mass);
    let bounds = object.bounds;
    assert!(bounds.min.is_finite() && bounds.max.is_finite() && bounds.size().min_element() >= 0.0, "{bounds:?}");
    assert!(bounds.size().max_element() < 10.0, "an absurd size got through: {bounds:?}");
    assert!(object.surface.vertices.iter().all(|v| v.position.iter().all(|x| x.is_finite())));
    assert!(object.field.distance(bounds.centre()).is_finite());
    assert!(object.friction.is_finite() && object.friction >= 0.0);
}

/// Loads text under a name and checks whatever comes out; true when something loaded.
fn survives(name: &str, bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    match outcome(&path) {
        Ok(Some(object)) => {
            check_sound(&object);
            true
        }
        Ok(None) => panic!("a file is never an empty hand"),
        Err(text) => {
            assert!(!text.is_empty() && text.len() < 2000, "{text}");
            false
        }
    }
}

/// Loads text that must be refused, in words that hold `wanted`.
fn refused(name: &str, bytes: &[u8], wanted: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    match outcome(&path) {
        Ok(_) => panic!("{name} was accepted: {}", String::from_utf8_lossy(&bytes[..bytes.len().min(400)])),
        Err(text) => assert!(text.to_lowercase().contains(wanted), "\"{text}\" does not say \"{wanted}\""),
    }
}

const URDF: &str = r#"<robot name="thing">
  <link name="a">
    <inertial><origin xyz="0 0 0.001"/><mass value="0.04"/>
      <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
    <visual><geometry><box size="0.03 0.04 0.02"/></geometry><material name="m"><color rgba="1 0 0 1"/></material></visual>
    <collision><origin xyz="0 0 0" rpy="0 0 0.3"/><geometry><box size="0.03 0.04 0.02"/></geometry></collision>
  </link>
  <link name="b"><collision><geometry><cylinder radius="0.01" length="0.03"/></geometry></collision></link>
  <joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0.01 0 0.015"/></joint>
</robot>
"#;

fn cube() -> TriMesh {
    Primitive::Cuboid { half: DVec3::new(0.015, 0.02, 0.018) }.tessellate()
}

fn binary_stl() -> Vec<u8> {
    let mesh = cube();
    let mut bytes = vec![b' '; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        bytes.extend([0; 12]);
        for corner in mesh.corners(*triangle) {
            bytes.extend(corner.to_array().iter().flat_map(|x| (*x as f32).to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// A blow to a file.
#[derive(Clone, Debug)]
enum Blow {
    /// Cut after this share of it.
    Cut(f64),
    /// Overwrite a byte.
    Byte(f64, u8),
    /// Replace one of its numbers.
    Number(f64, &'static str),
    /// Remove one line.
    Drop(f64),
    /// Say one line many times over.
    Repeat(f64, u8),
    /// Insert noise.
    Noise(f64, Vec<u8>),
}

/// Numbers that programs write when something went wrong before, and some that nobody means.
const BAD_NUMBERS: [&str; 12] =
    ["nan", "-inf", "1e400", "1e30", "-1", "0", "1e-30", "", "99999999999999", "0x10", "1,5", "-0.0"];

fn blows() -> impl Strategy<Value = Vec<Blow>> {
    let number = proptest::sample::select(&BAD_NUMBERS[..]);
    let blow = prop_oneof![
        (0.0..1.0).prop_map(Blow::Cut),
        (0.0..1.0, any::<u8>()).prop_map(|(at, byte)| Blow::Byte(at, byte)),
        (0.0..1.0, number).prop_map(|(at, number)| Blow::Number(at, number)),
        (0.0..1.0).prop_map(Blow::Drop),
        (0.0..1.0, 1u8..40).prop_map(|(at, times)| Blow::Repeat(at, times)),
        (0.0..1.0, proptest::collection::vec(any::<u8>(), 1..40)).prop_map(|(at, noise)| Blow::Noise(at, noise)),
    ];
    proptest::collection::vec(blow, 1..4)
}

fn index(share: f64, length: usize) -> usize {
    ((share * length as f64) as usize).min(length.saturating_sub(1))
}

fn strike(bytes: &[u8], blow: &Blow) -> Vec<u8> {
    let mut struck = bytes.to_vec();
    if struck.is_empty() {
        return struck;
    }
    let lines = || bytes.split_inclusive(|b| *b == b'\n').collect::<Vec<_>>();
    match blow {
        Blow::Cut(share) => struck.truncate(index(*share, bytes.len())),
        Blow::Byte(share, byte) => struck[index(*share, bytes.len())] = *byte,
        Blow::Number(share, number) => {
            let digit = |b: &u8| b.is_ascii_digit() || *b == b'.';
            let from = index(*share, bytes.len());
            if let Some(start) = bytes[from..].iter().position(digit).map(|at| from + at) {
                let length = bytes[start..].iter().take_while(|b| digit(b)).count();
                struck.splice(start..start + length, number.bytes());
            }
        }
        Blow::Drop(share) => {
            let mut lines = lines();
            lines.remove(index(*share, lines.len()));
            struck = lines.concat();
        }
        Blow::Repeat(share, times) => {
            let mut lines = lines();
            let at = index(*share, lines.len());
            let line = lines[at];
            lines.splice(at..at, std::iter::repeat_n(line, usize::from(*times)));
            struck = lines.concat();
        }
        Blow::Noise(share, noise) => {
            let at = index(*share, bytes.len());
            struck.splice(at..at, noise.iter().copied());
        }
    }
    struck
}

fn beaten(bytes: &[u8], blows: &[Blow]) -> Vec<u8> {
    blows.iter().fold(bytes.to_vec(), |bytes, blow| strike(&bytes, blow))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn beaten_urdf_survives(blows in blows()) {
        survives("thing.urdf", &beaten(URDF.as_bytes(), &blows));
    }

    #[test]
    fn beaten_obj_survives(blows in blows()) {
        survives("thing.obj", &beaten(obj_text(&cube()).as_bytes(), &blows));
    }

    #[test]
    fn beaten_stl_survives(blows in blows()) {
        survives("thing.stl", &beaten(&binary_stl(), &blows));
    }

    #[test]
    fn noise_survives(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        for name in ["a.urdf", "a.obj", "a.stl"] {
            survives(name, &bytes);
        }
    }

    #[test]
    fn beaten_scenes_survive(blows in blows()) {
        let text = beaten(Scene::default().to_toml().as_bytes(), &blows);
        match Scene::from_toml(&String::from_utf8_lossy(&text)) {
            // Whatever is accepted can be written down, and read again as the same scene.
            Ok(scene) => prop_assert!(Scene::from_toml(&scene.to_toml()).is_ok_and(|again| again == scene)),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// Scenes within the accepted ranges run and stay finite, whatever their numbers.
    #[test]
    fn accepted_scenes_run(
        joints in 2u32..=80,
        stiffness in -2.0f64..3.0,
        modulus in -1.5f64..1.5,
        mass in -4.0f64..1.5,
        friction in 0.0f64..3.0,
        fixed: bool,
        draft: bool,
    ) {
        let settings = [
            format!("gripper.finger.joints={joints}"),
            format!("gripper.finger.bending_stiffness={}", 0.01 * 10f64.powf(stiffness)),
            format!("gripper.pad.modulus={}", 1e5 * 10f64.powf(modulus)),
            format!("object.mass={}", 10f64.powf(mass)),
            format!("object.friction={friction}"),
            format!("object.fixed={fixed}"),
            format!("solver.accuracy=\"{}\"", if draft { "draft" } else { "standard" }),
            "object.source=\"cube\"".to_owned(),
            "timing.duration_s=1.2".to_owned(),
        ];
        let scene = Scene::default().with_settings(&settings);
        prop_assert!(scene.is_ok(), "{settings:?}: {scene:?}");
        let scene = scene.unwrap();
        let trial = grasp(&scene, scene.load_object().unwrap().as_ref(), 0);
        prop_assert!(trial.data.quality.finite, "{settings:?}");
        prop_assert!(trial.frames().iter().all(|f| f.q.iter().all(|q| q.abs() < 10.0)), "{settings:?}");
    }
}

#[test]
fn sound_files_pass_the_same_gate() {
    assert!(
        survives("a.urdf", URDF.as_bytes())
            && survives("a.obj", obj_text(&cube()).as_bytes())
            && survives("a.stl", &binary_stl())
    );
}

#[test]
fn every_cut_of_every_kind_survives() {
    for (name, bytes) in
        [("a.urdf", URDF.as_bytes().to_vec()), ("a.obj", obj_text(&cube()).into_bytes()), ("a.stl", binary_stl())]
    {
        for length in (0..bytes.len()).step_by(23) {
            survives(name, &bytes[..length]);
        }
    }
}

#[test]
fn broken_trees_of_links_are_refused() {
    let robot = |inside: &str| format!("<robot name='r'>{inside}</robot>").into_bytes();
    let link = |name: &str| {
        format!("<link name='{name}'><collision><geometry><sphere radius='0.02'/></geometry></collision></link>")
    };
    let joint = |from: &str, to: &str| {
        format!("<joint name='{from}{to}' type='fixed'><parent link='{from}'/><child link='{to}'/></joint>")
    };
    let (a, b) = (link("a"), link("b"));
    refused("x.urdf", &robot(&format!("{a}{b}{}{}", joint("a", "b"), joint("b", "a"))), "loop");
    refused("x.urdf", &robot(&format!("{a}{}", joint("a", "a"))), "loop");
    refused("x.urdf", &robot(&format!("{a}{}", joint("a", "nobody"))), "nobody");
    refused("x.urdf", &robot(""), "no link");
    refused("x.urdf", &robot("<link name='a'/>"), "no shape");
    refused("x.urdf", b"<mujoco><worldbody/></mujoco>", "urdf");
    // The file is named with its ending.
    refused("empty.urdf", b"", "\"empty.urdf\" is malformed");
    refused("empty.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "\"empty.obj\" cannot be grasped");
    // Nesting without end is not followed without end.
    refused("x.urdf", "<robot>".repeat(200_000).as_bytes(), "malformed");
}

#[test]
fn absurd_shapes_are_refused() {
    let shape = |tag: &str| {
        format!("<robot name='r'><link name='a'><collision><geometry>{tag}</geometry></collision></link></robot>")
            .into_bytes()
    };
    for (tag, wanted) in [
        ("<sphere radius='nan'/>", "radius"),
        ("<sphere radius='-0.02'/>", "radius"),
        ("<sphere radius='0'/>", "radius"),
        ("<box size='0.01 inf 0.01'/>", "size"),
        ("<cylinder radius='0.01' length='1e30'/>", "across"),
        ("<mesh filename='gone.obj'/>", "gone.obj"),
        ("<mesh filename='robot.dae'/>", ".dae"),
        ("<mesh filename='../../../../../../etc/passwd'/>", "passwd"),
        ("<mesh filename='package://nowhere/a.stl'/>", "a.stl"),
        ("<mesh filename=''/>", "empty"),
    ] {
        refused("x.urdf", &shape(tag), wanted);
    }
}

#[test]
fn worthless_meshes_are_refused() {
    refused("x.obj", b"", "");
    refused("x.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "");
    refused("x.obj", b"v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nf 1 2 99\n", "");
    refused("x.obj", b"v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nf 1 2 3\n", "");
    refused("x.obj", b"v nan 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 0.01\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n", "");
    refused("x.stl", b"solid nothing\nendsolid nothing\n", "");
    let mut liar = vec![0; 84];
    liar[80..].copy_from_slice(&u32::MAX.to_le_bytes());
    refused("x.stl", &liar, "4294967295");
}

#[test]
fn masses_that_make_no_sense_come_from_the_shape_with_a_warning() {
    let with_mass = |inertial: &str| {
        let text = URDF.replace(&URDF[URDF.find("<inertial>").unwrap()..URDF.find("</inertial>").unwrap()], inertial);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("thing.urdf");
        std::fs::write(&path, text).unwrap();
        outcome(&path).unwrap().unwrap()
    };
    let tensor = |value: &str| format!("<inertia ixx='{value}' ixy='0' ixz='0' iyy='{value}' iyz='0' izz='{value}'/>");
    for (mass, inertia) in
        [("0", "1e-5"), ("-3", "1e-5"), ("nan", "1e-5"), ("0.04", "-1"), ("0.04", "0"), ("0.04", "inf")]
    {
        let object = with_mass(&format!("<inertial><mass value='{mass}'/>{}", tensor(inertia)));
        check_sound(&object);
        let mentioned = object.warnings.iter().any(|w| w.contains("mass") || w.contains("inertia"));
        assert!(mentioned, "mass {mass}, inertia {inertia}: {:?}", object.warnings);
    }
}
