//! Scenes with a name: whole settings of gripper, programme and object that can be chosen like a file.

use super::{Scene, SceneError};
use std::path::Path;
use std::sync::LazyLock;

/// A scene with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NamedScene {
    /// Name, as `--scene` takes it.
    pub name: &'static str,
    /// The scene file, embedded; its first line says what it is for.
    pub text: &'static str,
}

/// All of them, the default first.
pub const SCENES: [NamedScene; 2] = [
    NamedScene { name: "default", text: include_str!("../../../assets/scenes/default.toml") },
    NamedScene { name: "paper", text: include_str!("../../../assets/scenes/paper.toml") },
];

impl NamedScene {
    /// A scene by its name, in either case.
    pub fn named(name: &str) -> Option<Self> {
        SCENES.into_iter().find(|scene| scene.name.eq_ignore_ascii_case(name))
    }

    /// What it is for: the first line of its file.
    pub fn about(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default().trim_start_matches('#').trim()
    }

    /// Its settings, read once.
    pub fn scene(&self) -> Scene {
        static READ: LazyLock<[Scene; 2]> = LazyLock::new(|| {
            SCENES.map(|named| Scene::from_toml(named.text).expect("named scenes are embedded and tested"))
        });
        let at = SCENES.iter().position(|named| named.name == self.name);
        at.map_or_else(Scene::default, |at| READ[at].clone())
    }

    /// Its gripper, programme and way of holding the object, with everything else of another scene.
    pub fn applied_to(&self, other: &Scene) -> Scene {
        let Scene { object, gripper, programme, .. } = self.scene();
        let mut scene = Scene { gripper, programme, ..other.clone() };
        scene.set_object_fixed(object.fixed);
        scene
    }
}

impl Scene {
    /// Reads a scene by its name or from a file. A file needs an ending or a folder before its name, so that a misspelt
    /// name is told from it.
    pub fn named_or_from_file(source: &Path) -> Result<Self, SceneError> {
        let name = source.to_str().filter(|_| source.extension().is_none() && source.components().count() == 1);
        match name.map(|name| (name, NamedScene::named(name))) {
            Some((_, Some(named))) => Ok(named.scene()),
            Some((name, None)) if !source.is_file() => {
                let known = SCENES.map(|scene| scene.name).join(" or ");
                Err(SceneError::Refused(format!(
                    "no scene is called \"{name}\"; choose {known}, or name a file (.toml)"
                )))
            }
            Some(_) | None => Self::from_file(source),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_found_by_name_or_as_a_file_and_a_misspelt_name_is_refused() {
        assert_eq!(Scene::named_or_from_file(Path::new("default")), Ok(Scene::default()));
        let paper = Scene::named_or_from_file(Path::new("Paper")).expect("embedded");
        assert!(paper.holds_object() && paper != Scene::default());
        let error = Scene::named_or_from_file(Path::new("papr")).expect_err("there is none");
        assert_eq!(error.to_string(), "no scene is called \"papr\"; choose default or paper, or name a file (.toml)");
        let missing = Scene::named_or_from_file(Path::new("paper.toml"));
        assert!(missing.is_err_and(|error| error.to_string().starts_with("cannot read the scene")));
    }

    #[test]
    fn a_named_scene_leaves_object_poses_and_solver_of_another_alone() {
        let mut other = Scene::default();
        other.object.source = "ball".to_owned();
        (other.pose.yaw_deg, other.solver.max_iterations) = (7.0, 33);
        let paper = NamedScene::named("paper").expect("in the list");
        let applied = paper.applied_to(&other);
        assert_eq!(
            (applied.gripper.clone(), applied.programme.clone()),
            (paper.scene().gripper, paper.scene().programme)
        );
        assert_eq!(SCENES[0].applied_to(&applied), other);
        assert!(SCENES.iter().all(|scene| scene.about().len() > 20));
    }
}
