//! Actions: panels, bars and keys push them, the workbench hands each to the feature that owns it.

use crate::app::features::files::FileAction;
use crate::app::features::gripper::GripperAction;
use crate::app::features::inspect::InspectAction;
use crate::app::features::library::LibraryAction;
use crate::app::features::recognition::RecognitionAction;
use crate::app::features::simulation::SimulationAction;
use crate::app::features::studies::StudyAction;
use crate::app::features::tools::ToolAction;
use crate::app::features::view::ViewAction;
use crate::app::notices::UserMessage;
use palpate_lab::workers::{Command, GripperCommand, LabelCommand, LabellingAction};

/// Action of the user, by the feature that applies it.
#[derive(Clone)]
pub enum Action {
    /// Simulated gripper and its scene.
    Simulation(SimulationAction),
    /// Real gripper.
    Gripper(GripperAction),
    /// Trials, labels and plan.
    Labelling(LabellingAction),
    /// All trials: search, selection, edits.
    Library(LibraryAction),
    /// Recognition by both grippers.
    Recognition(RecognitionAction),
    /// Diagnostics, fit and training.
    Tool(ToolAction),
    /// Studies of the paper.
    Study(StudyAction),
    /// Stored trials that are looked at.
    Inspect(InspectAction),
    /// View state.
    View(ViewAction),
    /// Files.
    File(FileAction),
    /// Stop: vent the fingers, and close the key sheet.
    Stop,
    /// Show a message.
    Tell(UserMessage),
}

/// Actions pushed in one frame.
#[derive(Default)]
pub struct Actions(Vec<Action>);

impl Actions {
    /// Adds an action.
    pub fn push(&mut self, action: impl Into<Action>) {
        self.0.push(action.into());
    }
}

impl IntoIterator for Actions {
    type Item = Action;
    type IntoIter = std::vec::IntoIter<Action>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

/// Conversions into the action of a feature.
macro_rules! actions_from {
    ($($part:ty => |$it:ident| $action:expr;)+) => {
        $(impl From<$part> for Action {
            fn from($it: $part) -> Self {
                $action
            }
        })+
    };
}

actions_from! {
    SimulationAction => |action| Self::Simulation(action);
    GripperAction => |action| Self::Gripper(action);
    LabellingAction => |action| Self::Labelling(action);
    LibraryAction => |action| Self::Library(action);
    RecognitionAction => |action| Self::Recognition(action);
    ToolAction => |action| Self::Tool(action);
    StudyAction => |action| Self::Study(action);
    InspectAction => |action| Self::Inspect(action);
    ViewAction => |action| Self::View(action);
    FileAction => |action| Self::File(action);
    UserMessage => |message| Self::Tell(message);
    Command => |command| Self::Simulation(SimulationAction::Send(command));
    GripperCommand => |command| Self::Gripper(GripperAction::Send(command));
    LabelCommand => |command| Self::Labelling(LabellingAction::Edit(command));
}
