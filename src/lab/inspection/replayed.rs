//! Opening a trial of a board or of another program: its readings replayed as the live gripper read them, its phases, and the
//! fingers as the flex strips bend them.

use super::open_trial::{Column, Keep, OpenOptions, OpenTrial};
use super::phases::{PhaseTimes, onset};
use crate::grasping::{IdentificationView, prepare};
use crate::picture::{Stage, evenly_bent};
use crate::recording::{OpenTrialError, Replay};
use palpate_geometry::Pose;
use palpate_learn::Shipped;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};
use palpate_sim::objects::EMPTY;
use palpate_store::Store;
use palpate_tactile::board::{Gap, SensorKind};
use palpate_tactile::trial::{Trial, TrialHeader, TrialSource};
use palpate_tactile::{Channel, Quantity, Signals, unit_of_channel};
use std::sync::Arc;

impl OpenTrial {
    /// Takes the rows and answers that the live gripper gave.
    pub(super) fn read_replayed(
        &mut self,
        store: &Store,
        trial: Trial,
        options: &OpenOptions,
        began_s: f64,
        gaps: &[Gap],
    ) -> Result<(), OpenTrialError> {
        let id = self.id;
        let kind = match self.source {
            TrialSource::Recorded => Shipped::AnyGripper,
            TrialSource::Simulated | TrialSource::Imported => Shipped::PerfectSensors,
        };
        let model = options.models.of(kind);
        let mut replay = Replay::of_loaded(store, id, trial, model.cloned())?;
        let mut gaps = gaps.iter().peekable();
        let mut newest: Option<Arc<IdentificationView>> = None;
        while let Some(row) = replay.next_row().map_err(|cause| OpenTrialError::Replay { id, cause })? {
            while self.columns.len() < replay.channels().len() {
                let name = &replay.channels()[self.columns.len()];
                let sensors = self.board.as_ref().map(|board| board.sensors).unwrap_or_default();
                let channel = sensors.channels().into_iter().find(|channel| channel.name() == *name);
                let (own, unit) = unit_of_channel(name);
                let unit = if self.source == TrialSource::Recorded && unit.is_empty() { "counts" } else { unit };
                let values = vec![f32::NAN; self.t_s.len()];
                self.columns.push(Column { name: own.to_owned(), channel, unit, values });
            }
            while let Some(gap) = gaps.next_if(|gap| gap.from_s < row.t_s) {
                self.push_gap(gap.from_s - began_s);
                self.answers.extend(newest.clone());
            }
            self.push(&row, row.t_s - began_s);
            if let Some(identification) = replay.identification() {
                let view = identification.view();
                if newest.as_deref() != Some(&view) {
                    newest = Some(Arc::new(view));
                }
                self.answers.extend(newest.clone());
            }
        }
        // The verdict of a grasp is known at its end.
        if let (Some(identification), Some(last)) = (replay.identification(), self.answers.last_mut()) {
            *last = Arc::new(identification.view());
        }
        let nothing = replay.identification().is_some_and(|own| own.verdict().is_none());
        let unread = |column: &Column| column.channel.is_some() && !column.is_read();
        let unread: Vec<String> = self.columns.iter().filter(|column| unread(column)).map(|c| c.name.clone()).collect();
        self.recognition_off = match replay.why_off() {
            Some(_) if !unread.is_empty() => Some("the sensors were not calibrated: adapt before recording".to_owned()),
            Some(cause) => Some(cause.to_string()),
            None if nothing => Some("no grasp was found in it".to_owned()),
            None => None,
        };
        if self.recognition_off.is_some() {
            self.answers.clear();
        }
        if !unread.is_empty() {
            self.remarks.push(format!("Not calibrated: {}. The raw counts can be plotted.", unread.join(", ")));
        }
        Ok(())
    }

    /// Curves break where readings are missing.
    fn push_gap(&mut self, from_s: f64) {
        self.t_s.push(from_s + 1e-6);
        self.line_bar.push(f64::NAN);
        self.columns.iter_mut().for_each(|column| column.values.push(f32::NAN));
    }

    /// Takes out what stands in the gaps of an imported trial.
    pub(super) fn break_at_gaps(&mut self, signals: &Signals) {
        for gap in signals.gaps() {
            let columns = gap.channels.iter().filter_map(|channel| signals.channels.get(*channel));
            for name in columns {
                let own = unit_of_channel(name).0;
                if let Some(column) = self.columns.iter_mut().find(|column| column.name == own) {
                    column.values.iter_mut().take(gap.samples.end).skip(gap.samples.start).for_each(|v| *v = f32::NAN);
                }
            }
        }
    }

    /// Phases of a grasp of a board: as corrected, marked or measured, or else from the line pressure; contact from the pads.
    pub(super) fn find_phases(&mut self, marked: PhaseTimes) {
        let line = PhaseTimes::of_line(&self.t_s, &self.line_bar);
        let closing = marked.closing.or(line.closing);
        let begin = closing.or(self.t_s.first().copied()).unwrap_or(0.0);
        let onsets = |is_load: &dyn Fn(&Column) -> bool| {
            let loads = self.columns.iter().filter(|column| is_load(column));
            loads.filter_map(|column| onset(&self.t_s, &column.values, begin, 0.0)).reduce(f64::min)
        };
        let is_calibrated = |column: &Column| {
            column.channel.as_ref().is_some_and(|own| {
                matches!(own.quantity, Quantity::Pressure | Quantity::ContactPressure | Quantity::Force)
            })
        };
        // The pads as calibrated, or else as the board counted them, or another program named them.
        let pads: Vec<&String> = self
            .board
            .iter()
            .flat_map(|board| {
                let pads = board.sensors.of_kind(SensorKind::Pad);
                pads.filter_map(|pad| board.channels.get(board.channel_of(pad)?))
            })
            .collect();
        let touched_s = Side::BOTH.map(|side| {
            let is_own = |own: &Channel| own.side() == Some(side);
            onsets(&|column| is_calibrated(column) && column.channel.as_ref().is_some_and(is_own))
        });
        let contact = onsets(&is_calibrated)
            .or_else(|| onsets(&|column| pads.contains(&&column.name)))
            .or_else(|| onsets(&|column| column.name.contains("pressure") || column.name.contains("force")));
        let corrected = self.header.phases.unwrap_or_default();
        let times = PhaseTimes {
            closing: corrected.closing.or(Some(begin)),
            contact: corrected.contact.or(contact),
            hold: corrected.hold.or(marked.hold).or(line.hold),
            release: corrected.release.or(marked.release).or(line.release),
        };
        let [first_s, last_s] = self.span_s();
        self.phases = times.spans(first_s, last_s);
        // What a person has seen is not measured again.
        self.touched_s = if corrected.contact.is_some() { [None; 2] } else { touched_s };
    }

    /// Fingers as arcs of the curvature that was read, where it was.
    pub(super) fn reconstruct(&mut self, options: &OpenOptions) {
        if options.keep < Keep::Frames {
            return;
        }
        let gripper = GripperModel::default();
        let columns = Side::BOTH.map(|side| {
            let bends = |channel: &Channel| channel.quantity == Quantity::Curvature && channel.side() == Some(side);
            self.columns.iter().find(|column| column.channel.as_ref().is_some_and(bends))
        });
        let read = |k: usize| columns.map(|column| column.map(|c| f64::from(c.values[k])).filter(|v| v.is_finite()));
        if (0..self.t_s.len()).any(|k| read(k).iter().any(Option::is_some)) {
            let frame = |(k, t_s): (usize, &f64)| {
                let line_bar = self.line_bar[k];
                Arc::new(Frame { t: *t_s, sample: k as u32, line_bar, ..evenly_bent(&gripper, read(k)) })
            };
            self.frames = self.t_s.iter().enumerate().map(frame).collect();
            if options.keep >= Keep::Scenery {
                self.stage = Some(Arc::new(Stage::new(&self.header.scene, None, resting_pose(&self.header))));
            }
            self.remarks.push("Fingers as their flex strips read, without the object.".to_owned());
        }
    }
}

/// Pose of the gripper in the scene of a trial, without its object.
fn resting_pose(header: &TrialHeader) -> Pose {
    let mut scene = header.scene.clone();
    EMPTY.clone_into(&mut scene.object.source);
    prepare(&scene, None, header.seed).begun().data.world_from_gripper
}
