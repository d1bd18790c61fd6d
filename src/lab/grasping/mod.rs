//! Grasping: the controller of every grasp, runs and their summaries, collections of simulated grasps, identification of
//! an object by successive grasps, and advice on the next one. Adapting to a real gripper by one close of its empty hand.
//! Lessons: grasps by which a model learns new objects. Promises: rounds by which its answers are calibrated.
//! Presentations: the objects and poses of a demo.

mod accuracy_cost;
mod adaptation;
mod agreement;
mod collect;
mod controller;
mod error_band;
mod felt_geometry;
mod felt_rows;
mod guidance;
mod identify;
mod known_geometry;
mod lessons;
mod presentation;
mod pressure_watch;
mod promise;
mod row;
mod run;
mod shuffled_objects;
mod summary;
mod timed_grasp;

pub use accuracy_cost::{AccuracyCost, accuracy_cost};
pub use adaptation::{AdaptError, Adaptation, AdaptedSensor};
pub use agreement::{
    Agreed, EndComparison, EndState, EndWatch, GraspComparison, OtherRun, PUSH, Push, Recompute, compare, compare_end,
    ends_alike, grasp_soundly, grasp_until_agreement, until_agreement,
};
pub use collect::{
    CollectionError, CollectionPlan, CollectionProgress, CollectionReport, NoShard, ReadyCollection, SUCCESSION, Shard,
    all_objects, collect,
};
pub use controller::{GraspController, GraspPlan, GraspStage, LEAD_S, PressureCommand};
pub(crate) use error_band::RefinedRun;
pub use error_band::{ErrorBand, ErrorNorms, band_half_width, error_band};
pub(crate) use felt_rows::FeltRows;
pub use guidance::{Advisor, GripperMove, Guide, KnownTouches, ObjectMove, Stance, TouchLibrary, TouchesError};
pub use identify::{Identification, IdentificationView, IdentifyError, RecognisedGrasp};
pub use known_geometry::{KnownGeometryError, KnownGrasps, SHAPES, geometry_of, random_shapes};
pub use lessons::{
    LESSON_GRASPS, LessonError, LessonStage, Lessons, Taught, is_doubtful, lesson_result, lesson_warning,
};
pub use presentation::Presentation;
pub(crate) use pressure_watch::PressureFault;
pub use promise::{GraspRounds, GraspedRound, PromiseError};
pub use row::Row;
pub use run::{GraspRun, grasp, prepare, prepare_refined};
pub use shuffled_objects::ShuffledObjects;
pub use summary::{CONTACT_FORCE, GraspSummary, HoldSummary, OutOfPlaneSummary, ShakenSummary};
pub use timed_grasp::{posed_object, timed_grasp, truth_of};
