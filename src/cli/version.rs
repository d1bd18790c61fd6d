//! `palpate --version`: version, commit, physics, and what this build has.

use palpate_exchange::FORMATS;
use palpate_sim::PHYSICS_VERSION;
use palpate_sim::scene::{EngineKind, Scene};
use std::sync::LazyLock;

/// Letters of a commit that are printed.
const COMMIT: usize = 9;

/// Version and commit in one line, then the features of the build.
pub(super) static LONG: LazyLock<String> = LazyLock::new(long);

fn long() -> String {
    let commit = commit(option_env!("PALPATE_COMMIT"), include_str!("../../assets/commit.txt"));
    let engines = EngineKind::ALL.into_iter().filter(|engine| is_built(*engine)).map(EngineKind::name);
    let formats = FORMATS.iter().filter_map(|format| format.kind().endings().first()).copied();
    format!(
        "{} ({}, physics {PHYSICS_VERSION})\nplatform: {} {}{}\nengines: {}\ntrials as: {}",
        env!("CARGO_PKG_VERSION"),
        commit.map_or_else(|| "commit not recorded".to_owned(), |commit| format!("commit {commit}")),
        std::env::consts::OS,
        std::env::consts::ARCH,
        if cfg!(debug_assertions) { ", not optimised" } else { "" },
        engines.collect::<Vec<_>>().join(", "),
        formats.collect::<Vec<_>>().join(", "),
    )
}

/// The commit that a build was told of, else that of the source archive. A checkout names none: each commit would build
/// the program again.
fn commit(told: Option<&'static str>, archived: &'static str) -> Option<&'static str> {
    let archived = archived.trim();
    let known = told.filter(|told| !told.is_empty()).or_else(|| (!archived.starts_with('$')).then_some(archived))?;
    known.get(..COMMIT).or(Some(known))
}

/// True where the engine can be selected.
fn is_built(engine: EngineKind) -> bool {
    let mut scene = Scene::default();
    scene.solver.engine = engine;
    scene.check().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_commit_is_that_of_the_build_else_of_the_archive() {
        assert_eq!(commit(Some("0123456789abcdef"), "$Format:%h$\n"), Some("012345678"));
        assert_eq!(commit(Some("0123456789abcdef"), "fedcba98\n"), Some("012345678"));
        assert_eq!(commit(Some(""), "fedcba98\n"), Some("fedcba98"));
        assert_eq!(commit(None, "$Format:%h$\n"), None);
    }

    #[test]
    fn the_default_engine_and_all_formats_are_named() {
        let text = long();
        assert!(text.contains(&format!("physics {PHYSICS_VERSION})")) && text.contains("engines: palpate"), "{text}");
        assert!(text.ends_with("csv, mcap, npz, parquet"), "{text}");
    }
}
