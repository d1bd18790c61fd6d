//! The model at the desk: it hears what the calibrated sensors feel while the fingers close and hold.

use super::Desk;
use crate::workers::Notice;
use crate::workers::listener::Listener;
use palpate_learn::Model;
use palpate_tactile::Channel;
use palpate_tactile::calibration::SensorEstimate;
use std::sync::Arc;

impl Desk {
    // Recognition.

    pub(super) fn set_model(&mut self, model: Option<Arc<Model>>) {
        self.model = model.as_ref().map(|model| model.card.method.clone());
        self.listener = model.map(|model| Listener::new(model, self.grasps));
    }

    pub(super) fn start_over(&mut self) {
        if let Some(listener) = &mut self.listener {
            listener.start_over();
        }
    }

    pub(super) fn begin_recognition(&mut self) {
        let (Some(listener), Some(connection)) = (&mut self.listener, &self.connection) else { return };
        let channels: Vec<String> = connection.readout.channels().iter().map(Channel::name).collect();
        if let Some(warning) = listener.begin_grasp_of(&channels) {
            self.outlets.tell(Notice::Warning(warning));
        }
    }

    /// Lets the model hear a reading of the grasp that goes on.
    pub(super) fn recognise(&mut self, t_s: f64, felt: &SensorEstimate) {
        let (Some(listener), Some(running)) = (&mut self.listener, &self.running) else { return };
        let Some(t) = running.closing_s.map(|closing_s| t_s - closing_s).filter(|t| *t >= 0.0) else { return };
        let names = listener.channels();
        let value =
            |name: &String| self.channels.iter().find(|channel| channel.name() == *name).and_then(|c| felt.of(c));
        // A reading in which a sensor is at an end of its range is passed over.
        let row: Option<Vec<f32>> = names.iter().map(|name| value(name).map(|value| value as f32)).collect();
        if let Some(row) = row {
            listener.push_row(t as f32, &row);
        }
    }

    /// Recognises what was heard since the closing began, where that was found out later.
    pub(super) fn catch_up(&mut self, closing_s: f64, until_s: f64) {
        let Some(connection) = &self.connection else { return };
        let heard = connection.recent.between(closing_s, until_s);
        let felt: Vec<(f64, SensorEstimate)> =
            heard.iter().map(|reading| (reading.t_s, connection.readout.estimate(reading))).collect();
        for (t_s, felt) in felt {
            self.recognise(t_s, &felt);
        }
    }
}
