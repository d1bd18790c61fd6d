//! Recognition of the real gripper: the model reads calibrated rows while the fingers close and hold.

use super::GripperSession;
use crate::grasping::Row;
use crate::workers::Notice;
use crate::workers::live_recognition::LiveRecognition;
use palpate_learn::Model;
use palpate_tactile::board::Reading;
use std::sync::Arc;

impl GripperSession {
    // Recognition.

    pub(super) fn set_model(&mut self, model: Option<Arc<Model>>) {
        self.model = model.as_ref().map(|model| model.card.method.clone());
        self.recognition = model.map(|model| LiveRecognition::new(model, self.grasps));
    }

    pub(super) fn start_over(&mut self) {
        if let Some(recognition) = &mut self.recognition {
            recognition.start_over();
        }
    }

    pub(super) fn begin_recognition(&mut self) {
        if let Some(connection) = &mut self.connection {
            connection.felt.begin();
        }
        self.begin_answer();
    }

    /// Begins the answer to a grasp.
    fn begin_answer(&mut self) {
        let (Some(recognition), Some(connection)) = (&mut self.recognition, &self.connection) else { return };
        // The empty hand that calibrates the sensors.
        if self.adapting {
            return;
        }
        let calibrated = connection.readout.channels();
        let all = self.channels.iter().all(|channel| calibrated.contains(channel));
        let cause = (!all).then_some("the sensors are not calibrated (Adapt in the Gripper panel does it)");
        let columns = self.channels.iter().enumerate().filter(|(_, channel)| calibrated.contains(channel));
        let columns = columns.map(|(place, channel)| (place, channel.name()));
        if let Some(warning) = recognition.begin_grasp(columns, cause) {
            self.publisher.notify(Notice::Warning(warning));
        }
    }

    /// Passes a row to the model, from the closing on.
    pub(super) fn recognise(&mut self, row: Row) {
        let Some(recording) = &self.recording else { return };
        let since = recording.controller.closing_s().map(|closing_s| row.t_s - closing_s);
        let Some(t) = since.filter(|t| *t >= 0.0) else { return };
        let (Some(recognition), Some(connection)) = (&mut self.recognition, &mut self.connection) else { return };
        if let Some(warning) = recognition.push(t, &connection.felt.push(t, row, &self.channels)) {
            self.publisher.notify(Notice::Warning(warning));
        }
    }

    /// Recognises the running grasp anew, because a sensor has failed.
    pub(super) fn recognise_anew(&mut self) {
        if self.recognition.as_ref().and_then(LiveRecognition::view).is_none_or(|view| !view.listening) {
            return;
        }
        self.begin_answer();
        let (Some(recognition), Some(connection)) = (&mut self.recognition, &self.connection) else { return };
        connection.felt.anew(&self.channels).iter().for_each(|(t, row)| _ = recognition.push(*t, row));
    }

    /// Sensors that have failed, and from what is answered.
    pub(super) fn failed_sensors(&self) -> Option<Arc<str>> {
        let model = self.recognition.as_ref().map(LiveRecognition::channels).unwrap_or_default();
        Some(self.connection.as_ref()?.felt.watch.words(&self.channels, model)?.into())
    }

    /// Recognises the readings since the closing began, where that was detected later.
    pub(super) fn catch_up(&mut self, closing_s: f64, until_s: f64) {
        let Some(connection) = &self.connection else { return };
        let row = |reading: &Reading| connection.plotted.row(reading, &connection.readout.estimate(reading), None);
        let rows: Vec<Row> = connection.recent.between(closing_s, until_s).iter().map(row).collect();
        rows.into_iter().for_each(|row| self.recognise(row));
    }
}
