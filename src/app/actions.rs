//! What panels ask for. Nothing in a panel changes anything: it pushes an action, and the workbench applies it.

use super::gripper_tools::ToolWish;
use super::labelling::ShownTrials;
use super::modes::Mode;
use super::panels::Source;
use palpate_geometry::drawing::Camera;
use palpate_geometry::palette::Theme;
use palpate_tactile::trial::TrialId;
use palpate_tactile::trial::Control;
use palpate_sim::scene::Scene;
use palpate_lab::workers::{Command, GripperWish, LabelWish};
use std::path::PathBuf;

/// A wish of the user's.
#[derive(Clone)]
pub enum Action {
    /// Tell the simulation something.
    Simulation(Command),
    /// Grasp this scene.
    SetScene(Box<Scene>),
    /// Grasp this object: a built-in name or a file.
    OpenObject(String),
    /// Grasp another of the built-in objects, whichever comes next at random.
    NextObject,
    /// Ask for a file to open.
    PickFile,
    /// Write the scene into a file.
    SaveScene,
    /// Write another scene into a file.
    SaveSceneAs(Box<Scene>),
    /// Measure what the effects of the scene cost and change.
    MeasureEffects,
    /// Tell the real gripper's thread something.
    Gripper(GripperWish),
    /// Something at the desk where trials are recorded and labelled.
    Desk(DeskAction),
    /// Connect the real gripper, or give its port back.
    ToggleGripper,
    /// Something about labels, plan or journal.
    Label(LabelWish),
    /// Stop everything: vent the fingers, and close what is open over the window.
    Stop,
    /// Who moves the fingers of the real gripper.
    SetControl(Control),
    /// From which probability on a class is taken as certain.
    SetThreshold(f64),
    /// Go to another mode.
    SetMode(Mode),
    /// Show the simulated or the real gripper.
    Show(Source),
    /// Doctor, fit or training.
    Tool(ToolWish),
    /// Let the model in this file listen to the real gripper, or without one that which comes with the program.
    UseModel(Option<PathBuf>),
    /// Look from here.
    SetCamera(Camera),
    /// Show the whole gripper.
    FrameAll,
    /// Dark or light.
    SetTheme(Theme),
    /// Force arrows on or off.
    SetForces(bool),
    /// The other engine's fingers and object, translucent, on or off.
    SetGhost(bool),
    /// The stretch of time that all plots show (s); `None` for the whole grasp.
    SetTimeWindow(Option<[f64; 2]>),
    /// Tell, or keep hidden, what is in the hand in truth.
    ShowTruth(bool),
    /// The key sheet on or off.
    ShowKeys(bool),
    /// Write the 3-D view into a PNG file.
    SavePicture,
    /// Put all panels back.
    ResetLayout,
    /// Something to tell the user.
    Tell(Message),
}

/// What is done at the desk where trials of the real gripper are recorded and labelled.
#[derive(Clone, Debug)]
pub enum DeskAction {
    /// Record a grasp; one that goes on, or has no label yet, is given up for it.
    Record,
    /// Give up the trial that goes on, or throw away the one that the card asks about.
    Discard,
    /// Say what the trial is of that the card asks about: the object that is chosen.
    Give,
    /// Choose the object at this place of the list.
    Choose(usize),
    /// Find objects by a part of their names.
    Search(String),
    /// The cursor goes into the search field, after what was typed on its way there.
    FocusSearch(String),
    /// The cursor is there.
    SearchFocused,
    /// Ask about this trial; without one about the newest that has no label.
    Select(Option<TrialId>),
    /// Ask about the trial so many places further in the list.
    Step(isize),
    /// Which trials the list shows.
    Show(ShownTrials),
    /// The note of a trial, while it is being written.
    WriteNote(TrialId, String),
    /// The tags of a trial, while they are being written.
    WriteTags(TrialId, String),
    /// The label of the trial that the card asks about is a guess, or is not.
    ToggleUnsure,
    /// Hide what the model says until the label is given, or do not.
    ToggleBlind,
    /// The next way in which the fingers may be moved.
    NextControl,
    /// Trials begin and end by themselves, or do not.
    ToggleWatch,
    /// Write all labelled trials into a new folder beside the store.
    Export,
    /// Train on all labelled trials.
    Train,
}

/// A message to the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Message {
    /// Good to know.
    Info(String),
    /// Deserves a look.
    Warning(String),
    /// Something failed.
    Error(String),
}

/// What a file dialog or a background job has come back with.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    /// Open this file.
    Open(PathBuf),
    /// Write the scene here.
    SaveScene(PathBuf, Box<Scene>),
    /// Write the picture here.
    SavePicture(PathBuf),
    /// Tell the user.
    Tell(Message),
}
