//! Trials at the desk: they are begun by wish or by what the fingers do, conducted, written, and ended.

use super::{Desk, open};
use crate::gripper::VENT;
use crate::labelling::SegmentEvent;
use crate::workers::Notice;
use crate::workers::gripper::messages::TrialRequest;
use crate::workers::gripper::running::{BEFORE_S, Running};
use crate::workers::listener::Listener;
use palpate_sim::gripper::Phase;
use palpate_tactile::board::Reading;
use std::sync::Arc;

impl Desk {
    /// Begins and ends trials by what the fingers do, where that is wanted.
    pub(super) fn watch(&mut self, reading: &Reading) {
        let Some(connection) = &mut self.connection else { return };
        let events = connection.segmenter.push(reading);
        // Hands that bend and press for a calibration or a test make no trials.
        let free = self.calibrating.is_none() && self.crossing.is_none();
        let Some(request) = self.watching.clone().filter(|_| free) else { return };
        // A trial that was asked for goes its own way.
        if self.running.as_ref().is_some_and(|running| !running.is_by_itself()) {
            return;
        }
        for event in events {
            match event {
                SegmentEvent::Began { from_s } => self.begin(request.clone(), Some(from_s)),
                SegmentEvent::Phase(mark) => {
                    let phase = self.running.as_mut().and_then(|running| running.mark(mark));
                    phase.into_iter().for_each(|phase| self.begin_phase(phase, reading.t_s));
                }
                SegmentEvent::Ended { .. } => self.end(false, None),
            }
        }
    }

    pub(super) fn vent(&mut self) {
        let Some(connection) = &mut self.connection else {
            return self.outlets.tell(Notice::Warning("no board is connected: vent at the control box".to_owned()));
        };
        let sent = connection.stream.send(VENT);
        match sent {
            Err(error) => self.outlets.tell(Notice::Failed(format!("{error}: vent at the control box"))),
            Ok(()) if connection.board.firmware.is_none() => self.outlets.tell(Notice::Warning(
                "told to vent, but this board has not said that it drives a control box: vent by hand".to_owned(),
            )),
            Ok(()) => self.outlets.tell(Notice::Warning("told to vent".to_owned())),
        }
        if let Some(running) = &mut self.running {
            running.interrupt("vented by the user");
        }
        self.end(false, None);
    }

    /// Tells the board what is due, and ends a trial whose programme is done.
    pub(super) fn conduct(&mut self) {
        let (Some(connection), Some(running)) = (&mut self.connection, &mut self.running) else { return };
        let now_s = connection.stream.now_s();
        let (line, phase) = running.conduct(now_s);
        if let Some(line) = line
            && let Err(error) = connection.stream.send(&line)
        {
            let cause = format!("{line}: {error}");
            running.note(cause.clone());
            running.cut(cause);
        }
        let over = running.is_over(now_s);
        if let Some(phase) = phase {
            self.begin_phase(phase, f64::INFINITY);
        }
        self.end_what_is_cut();
        self.write();
        if over {
            self.end(false, None);
        }
    }

    /// Ends a trial whose fingers do not do any more what they are told.
    pub(super) fn end_what_is_cut(&mut self) {
        let Some(cause) = self.running.as_ref().and_then(Running::why_cut) else { return };
        self.outlets.tell(Notice::Warning(format!("the trial was ended, and the fingers vented: {cause}")));
        self.end(false, None);
    }

    /// What was heard before `until_s` has been passed over.
    fn begin_phase(&mut self, phase: Phase, until_s: f64) {
        match phase {
            Phase::Close => {
                let closing_s = self.running.as_ref().and_then(|running| running.closing_s).unwrap_or(f64::INFINITY);
                self.zero_from_rest(closing_s);
                self.begin_recognition();
                self.catch_up(closing_s, until_s);
            }
            Phase::Hold => {}
            Phase::Release => {
                if let Some(listener) = &mut self.listener {
                    listener.end_grasp();
                }
            }
        }
    }

    // Trials.

    /// Begins a trial; one that goes on ends before it.
    pub(super) fn begin(&mut self, request: TrialRequest, from_s: Option<f64>) {
        self.end(false, None);
        if let Some(occupied) = self.occupied() {
            return self.outlets.tell(Notice::Warning(format!("no trial was begun: {occupied}")));
        }
        let Some(connection) = &self.connection else {
            let text = "no board is connected: connect the gripper first";
            return self.outlets.tell(Notice::Warning(text.to_owned()));
        };
        if connection.latest.is_none() {
            let text = format!("nothing is recorded yet: {}", connection.stream.status().state.sentence());
            return self.outlets.tell(Notice::Warning(text));
        }
        let by_itself = from_s.is_some();
        let from_s = from_s.unwrap_or(connection.stream.now_s() - BEFORE_S);
        let status = connection.stream.status();
        let adds = request.adds;
        let store = match open(&mut self.store, &self.path) {
            Ok(store) => store,
            Err(cause) => return self.outlets.tell(Notice::Failed(cause)),
        };
        let now_s = || connection.stream.now_s();
        match Running::begin(store, request, &self.scene, &status, &connection.recent, from_s, now_s) {
            Ok(running) => {
                let running = running.began_by_itself(by_itself);
                self.another_stretch(running.closing_s.unwrap_or(running.began_s));
                self.running = Some(running);
                self.begun += 1;
                let decided = self.listener.as_ref().is_some_and(|listener| listener.decision().is_some());
                if !adds || decided {
                    self.start_over();
                }
            }
            Err(error) => self.outlets.tell(Notice::Failed(format!("no trial was begun: {error}"))),
        }
    }

    /// Writes what waits of the trial; a store that fails ends it.
    pub(super) fn write(&mut self) {
        let Some(running) = &mut self.running else { return };
        let written =
            open(&mut self.store, &self.path).and_then(|store| running.flush(store).map_err(|error| error.to_string()));
        if let Err(cause) = written {
            self.break_off(&cause);
        }
    }

    /// The trial cannot go on. Nobody conducts the fingers any more, so they are not left under pressure.
    fn break_off(&mut self, cause: &str) {
        let driven = self.running.take().is_some_and(|running| running.is_driven());
        let vented = self.connection.as_mut().filter(|_| driven).map(|connection| connection.stream.send(VENT));
        if let Some(Err(error)) = vented {
            self.outlets.tell(Notice::Failed(format!("{error}; it vents by itself within a second")));
        }
        self.start_over();
        self.another_stretch(0.0);
        self.outlets.tell(Notice::Failed(format!("the trial was broken off, what was written is safe: {cause}")));
    }

    /// Ends the trial that goes on, if any.
    pub(super) fn end(&mut self, discarded: bool, note: Option<String>) {
        let Some(mut running) = self.running.take() else { return };
        if let Some(note) = note {
            running.note(note);
        }
        let Some(connection) = &mut self.connection else { return };
        if running.is_driven() && connection.stream.send(VENT).is_err() {
            running
                .note("the board could not be told to vent at the end; it vents by itself within a second".to_owned());
        }
        let status = connection.stream.status();
        if let Some(listener) = &mut self.listener {
            if discarded && !running.request().adds {
                listener.start_over();
            } else {
                listener.end_grasp();
            }
        }
        // What was felt before belongs to a guess that adds to it; such a guess says nothing of this trial alone.
        let alone = !discarded && !running.request().adds;
        let guess = self.listener.as_ref().filter(|_| alone && running.closing_s.is_some()).and_then(Listener::guess);
        let guess = guess.zip(self.model.clone());
        let finished = open(&mut self.store, &self.path).and_then(|store| {
            let ended = running.finish(store, &status, discarded).map_err(|error| error.to_string())?;
            let guessed = guess.map_or(Ok(()), |(pmf, model)| store.labels().set_guess(ended.id, &model, &pmf));
            Ok((ended, guessed))
        });
        match finished {
            Ok((ended, guessed)) => {
                if let Err(error) = guessed {
                    self.outlets.tell(Notice::Warning(format!("what the model took it for was not stored: {error}")));
                }
                if !discarded {
                    self.outlets.tell(Notice::Stored(ended.id));
                }
                self.ended = Some(Arc::new(ended));
            }
            Err(cause) => self.outlets.tell(Notice::Failed(format!("the trial could not be ended: {cause}"))),
        }
        self.another_stretch(0.0);
    }
}
