//! Random scenes over wide ranges: how often a result is wrong, how often silently so, and what it costs to do better.

mod judged;
mod report;
mod scene;

pub use judged::{ComparedResult, JudgedScene, LevelResult, SceneVerdict};
pub use report::{FlagRow, Policy, PolicyRow, RandomReport, SilentShareRow};
pub use scene::RandomScene;
