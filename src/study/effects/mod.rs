//! Physical effects: what each one costs and changes in a scene, and an audit of the rules that switch them on.

mod audit;
mod explanation;

pub(crate) use audit::LISTED;
pub use audit::{AuditReport, AuditRow, AuditedEffect, AuditedScene, EffectAudit, EffectSize, SEEN, SceneNumber};
pub use explanation::{EffectChange, ExplainedEffect, Explanation, explain_effects};
