//! Version of the physics, and hashes that tell grasps apart.

/// Version of the physics. It rises when equal scenes give other frames than before, and when the default of a setting
/// changes, because identities of grasps name only what differs from the defaults
/// ([`Scene::differences`](crate::scene::Scene::differences)). A test beside it compares frames of six scenes with stored
/// ones.
pub const PHYSICS_VERSION: u32 = 2;

/// Hash (FNV-1a) of several byte strings. Stored with trials: it must never change.
pub fn fingerprint<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> u64 {
    let mix = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    // The length keeps "ab", "c" and "a", "bc" apart.
    let add = |hash: u64, part: &[u8]| (part.len() as u64).to_le_bytes().iter().chain(part).fold(hash, mix);
    parts.into_iter().fold(0xcbf2_9ce4_8422_2325, add)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::SimRun;
    use crate::scene::Scene;

    /// Scenes that together use every part of the physics.
    const SCENES: [(&str, &[&str]); 6] = [
        ("syringe", &["solver.accuracy=draft"]),
        ("lemon", &["object.fixed=true", "gripper.mount.yaw_deg=35"]),
        ("tomato", &["object.modulus=40000", "solver.accuracy=draft"]),
        ("box", &["gripper.mount.offset=[0.004, 0.006, -0.003]", "solver.accuracy=draft"]),
        ("cube", &["shaking.amplitude=0.008", "shaking.frequency=4", "solver.accuracy=draft"]),
        ("empty", &[]),
    ];

    /// What the frames of a scene come to: mean joint angle (mrad), mean taxel load (mN) and the object's place at the end
    /// (mm).
    fn measured(object: &str, settings: &[&str]) -> [f64; 3] {
        let settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
        let mut scene = Scene::default().with_settings(&settings).unwrap();
        object.clone_into(&mut scene.object.source);
        let model = scene.load_object().unwrap();
        let frames = SimRun::new(&scene, model.as_ref()).0.run_programme(&scene.programme).unwrap();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let place = frames.last().and_then(|frame| frame.world_from_object).map_or(0.0, |pose| {
            pose.position.x + 2.0 * pose.position.y + 3.0 * pose.position.z + pose.rotation.x + 2.0 * pose.rotation.z
        });
        let q = frames.iter().flat_map(|frame| frame.q.iter().copied()).collect();
        let loads = frames.iter().map(|frame| frame.taxels.iter().map(|t| f64::from(t.normal)).sum::<f64>()).collect();
        [1e3 * mean(q), 1e3 * mean(loads), 1e3 * place]
    }

    /// As measured with [`PHYSICS_VERSION`]. Where the physics change on purpose, raise the version and store the new
    /// numbers that this test prints.
    const STORED: [[f64; 3]; 6] = [
        [74.657_033, 110.677_4, 171.653_983],
        [51.801_22, 664.342_775, 217.319_999],
        [45.809_669, 790.946_436, 226.947_747],
        [50.056_88, 638.957_312, 219.262_928],
        [59.462_399, 506.810_455, 217.385_253],
        [78.617_02, 73.369_567, 0.0],
    ];

    #[test]
    fn frames_are_those_of_the_physics_version() {
        let now = SCENES.map(|(object, settings)| measured(object, settings));
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs().max(1.0);
        let equal = now.iter().zip(&STORED).all(|(now, stored)| now.iter().zip(stored).all(|(a, b)| near(*a, *b)));
        assert!(equal, "physics {PHYSICS_VERSION} had {STORED:?}; now {now:?}");
    }

    #[test]
    fn hashes_tell_parts_apart() {
        let of = |parts: &[&str]| fingerprint(parts.iter().map(|part| part.as_bytes()));
        assert_ne!(of(&["ab", "c"]), of(&["a", "bc"]));
        assert_eq!(of(&["lemon"]), 0x18b6_d879_9058_d773, "stored hashes stay");
    }
}
