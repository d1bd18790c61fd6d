//! Trials of the session: begun by command or automatically, driven, recorded and ended.

use super::GripperSession;
use crate::gripper::Gripper;
use crate::labelling::SegmentEvent;
use crate::recording::{BoardTrialRecording, RecorderNotice, TrialRequest};
use crate::workers::Notice;
use crate::workers::gripper::messages::{EndedTrial, TrialView};
use crate::workers::live_recognition::LiveRecognition;
use palpate_device::serial::LinkState;
use palpate_sim::gripper::Phase;
use palpate_store::Stored;
use palpate_store::labels::{cadence_line, flaws};
use palpate_tactile::board::Reading;
use palpate_tactile::trial::Control;
use std::sync::Arc;

impl GripperSession {
    /// Begins and ends automatic trials.
    pub(super) fn watch(&mut self, reading: &Reading) {
        let Some(connection) = &mut self.connection else { return };
        let events = connection.segmenter.push(reading);
        // Movements for a calibration or a test are no grasps.
        let free = self.calibration.running.is_none() && self.crosstalk.running.is_none();
        let Some(request) = self.watching.clone().filter(|_| free) else { return };
        // A trial begun by command is not ended automatically.
        if self.recording.as_ref().is_some_and(|recording| !recording.automatic) {
            return;
        }
        for event in events {
            match event {
                SegmentEvent::Began { from_s } => self.begin(request.clone(), Some(from_s)),
                SegmentEvent::Phase(mark) => {
                    let recording = self.recording.as_mut().zip(self.recorder.as_ref());
                    let phase = recording.and_then(|(recording, recorder)| recording.mark(recorder, mark));
                    phase.into_iter().for_each(|phase| self.begin_phase(phase, reading.t_s));
                }
                SegmentEvent::Ended { .. } => self.end(false, None),
            }
        }
    }

    /// Turns the detection of trials on or off; turning it off ends a running automatic trial.
    pub(super) fn set_watching(&mut self, request: Option<TrialRequest>) {
        self.watching = request;
        if self.watching.is_none() && self.recording.as_ref().is_some_and(|recording| recording.automatic) {
            self.end(false, None);
        }
    }

    pub(super) fn vent(&mut self) {
        let Some(connection) = &mut self.connection else {
            return self.publisher.notify(Notice::Warning("no board is connected: vent at the control box".to_owned()));
        };
        self.pressing = None;
        let driven = self.recording.as_ref().is_some_and(|recording| recording.is_driven());
        connection.taken_over = true;
        let sent = connection.gripper.vent();
        match sent {
            Err(error) => self.publisher.notify(Notice::Failed(format!("{error}: vent at the control box"))),
            Ok(()) if connection.board.firmware.is_none() => self.publisher.notify(Notice::Warning(
                "Vent sent, but this board reports no pressure output. Vent by hand.".to_owned(),
            )),
            Ok(()) if connection.board.emulated && !driven => self.publisher.notify(Notice::Warning(
                "Vent sent. The emulated hand stays open until a trial with actuation \"board\" drives it.".to_owned(),
            )),
            Ok(()) => self.publisher.notify(Notice::Warning("Vent sent.".to_owned())),
        }
        if let (Some(_), Some(recorder)) = (&self.recording, &self.recorder) {
            recorder.interrupted("vented by the user");
        }
        self.end(false, None);
    }

    /// Sets the line pressure, and ends a trial whose programme is over.
    pub(super) fn drive(&mut self) {
        let (Some(connection), Some(recording), Some(recorder)) =
            (&mut self.connection, &mut self.recording, &self.recorder)
        else {
            return;
        };
        let phase = recording.drive(recorder, &mut connection.gripper);
        let over = recording.is_over(&connection.gripper);
        if let Some(phase) = phase {
            self.begin_phase(phase, f64::INFINITY);
        }
        self.end_aborted();
        if over {
            self.end(false, None);
        }
    }

    /// Ends an aborted trial.
    pub(super) fn end_aborted(&mut self) {
        let cause = self.recording.as_ref().and_then(|recording| recording.controller.abort_cause());
        let Some(cause) = cause.map(str::to_owned) else { return };
        let told = self.tell_to_vent();
        self.publisher.notify(Notice::Warning(format!("trial ended: {cause}; {told}")));
        self.end(false, None);
    }

    /// Tells the fingers to vent after a fault; says whether that could be sent. Our firmware vents within a second without it.
    pub(super) fn tell_to_vent(&mut self) -> &'static str {
        let sent = self.connection.as_mut().map(|own| (own.gripper.vent(), own.board.firmware.is_some()));
        match sent {
            Some((Ok(()), _)) => "fingers told to vent",
            Some((Err(_), true)) => "the fingers could not be told to vent; the board vents within a second",
            Some((Err(_), false)) | None => "the fingers could not be told to vent: vent at the control box",
        }
    }

    /// Begins a phase; readings before `until_s` are passed to recognition afterwards.
    fn begin_phase(&mut self, phase: Phase, until_s: f64) {
        match phase {
            Phase::Close => {
                let closing_s = self
                    .recording
                    .as_ref()
                    .and_then(|recording| recording.controller.closing_s())
                    .unwrap_or(f64::INFINITY);
                self.zero_from_rest(closing_s);
                self.begin_recognition();
                self.catch_up(closing_s, until_s);
            }
            Phase::Hold => {}
            Phase::Release => {
                if let Some(recognition) = &mut self.recognition {
                    recognition.end_grasp();
                }
            }
        }
    }

    // Trials.

    /// Begins a trial; ends a running one first.
    pub(super) fn begin(&mut self, request: TrialRequest, from_s: Option<f64>) {
        self.end(false, None);
        if let Some(occupied) = self.occupied() {
            return self.publisher.notify(Notice::Warning(format!("trial not started: {occupied}")));
        }
        let Some(connection) = &mut self.connection else {
            let text = "no board is connected: connect the gripper first";
            return self.publisher.notify(Notice::Warning(text.to_owned()));
        };
        let state = connection.gripper.stream().status().state;
        if connection.latest.is_none() || matches!(state, LinkState::Lost { .. } | LinkState::Silent { .. }) {
            let cause = match state {
                LinkState::Listening => "the board has sent no readings yet".to_owned(),
                state => state.sentence(),
            };
            return self.publisher.notify(Notice::Warning(format!("nothing is recorded: {cause}")));
        }
        let Some(recorder) = &self.recorder else {
            return self.publisher.notify(Notice::Failed("trials cannot be stored: restart Palpate".to_owned()));
        };
        let adds = request.adds;
        connection.taken_over |= request.control == Control::Driven;
        // A driven trial vents before it closes.
        self.pressing.take_if(|_| request.control == Control::Driven);
        let recording = BoardTrialRecording::begin(
            recorder,
            &mut connection.gripper,
            &connection.recent,
            &self.scene,
            request,
            from_s,
        );
        self.begin_stretch(recording.began_s);
        self.recording = Some(recording);
        self.recording_id = None;
        self.begun += 1;
        let decided = self.recognition.as_ref().is_some_and(|recognition| recognition.decision().is_some());
        if !adds || decided {
            self.start_over();
        }
    }

    /// Handles the notices of the recorder.
    pub(super) fn take_recorded(&mut self) {
        for notice in self.recorded.try_iter().collect::<Vec<_>>() {
            match notice {
                RecorderNotice::Begun(id) => self.recording_id = Some(id),
                RecorderNotice::Recorded(trial) => {
                    let Some((request, discarded, complete)) = self.ending.pop_front() else { continue };
                    let adapted = self.adapting;
                    let discarded = self.adapt_to(trial.id, discarded);
                    let by_hand = request.control == Control::ByHand && !adapted && !discarded;
                    if by_hand && trial.about.course.phases.is_empty() {
                        // The hand did not move, or was closed already.
                        self.start_over();
                        let text =
                            format!("trial {}: no close from open fingers was seen, so there is no answer", trial.id);
                        self.publisher.notify(Notice::Warning(text));
                    }
                    // What was adapted says more than that a trial is stored.
                    if !discarded && !adapted {
                        self.publisher.notify(Notice::Stored(Stored::New(trial.id)));
                    }
                    let cadence = cadence_line(&trial.about.course.cadence);
                    let (flags, warnings) = (flaws(trial.about.flags, request.object.as_deref()), trial.warnings);
                    let ended = EndedTrial { id: trial.id, request, discarded, complete, flags, warnings, cadence };
                    self.ended = Some(Arc::new(ended));
                    self.publish();
                }
                RecorderNotice::Warning(text) => self.publisher.notify(Notice::Warning(text)),
                RecorderNotice::Failed(cause) => self.stop_recording(&cause),
                RecorderNotice::Stored(_) | RecorderNotice::Logged(..) => {}
            }
        }
    }

    /// Ends a trial that cannot be recorded any further, and vents driven fingers.
    fn stop_recording(&mut self, cause: &str) {
        self.adapting = false;
        if self.ending.pop_front().is_some() {
            return self.publisher.notify(Notice::Failed(format!("the end of the trial was not stored: {cause}")));
        }
        let driven = self.recording.take().is_some_and(|recording| recording.is_driven());
        let vented = self.connection.as_mut().filter(|_| driven).map(|connection| connection.gripper.vent());
        if let Some(Err(error)) = vented {
            self.publisher.notify(Notice::Failed(format!("{error}; the board vents within a second")));
        }
        self.start_over();
        self.begin_stretch(0.0);
        self.publisher.notify(Notice::Failed(format!("recording stopped: {cause}")));
    }

    /// Ends the trial that is recorded, if any. The recorder reports the result.
    pub(super) fn end(&mut self, discarded: bool, note: Option<String>) {
        let Some(mut recording) = self.recording.take() else { return };
        if let Some(note) = note {
            recording.note(note);
        }
        let (Some(connection), Some(recorder)) = (&mut self.connection, &self.recorder) else { return };
        let adds = recording.request.adds;
        if let Some(recognition) = &mut self.recognition {
            if discarded && !adds {
                recognition.start_over();
            } else {
                recognition.end_grasp();
            }
        }
        // A guess that adds to earlier grasps says nothing of this trial alone.
        let alone = !discarded && !adds && recording.controller.closing_s().is_some();
        let guess = self.recognition.as_ref().filter(|_| alone).and_then(LiveRecognition::guess);
        let guess = self.model.clone().zip(guess);
        self.ending.push_back((recording.request.clone(), discarded, recording.is_complete()));
        recording.finish(recorder, &mut connection.gripper, discarded, guess);
        self.begin_stretch(0.0);
    }

    /// The view of a trial that is recorded.
    pub(super) fn trial_view(&self, recording: &BoardTrialRecording, now_s: f64) -> TrialView {
        let controller = &recording.controller;
        let emulated = self.connection.as_ref().is_some_and(|connection| connection.board.emulated);
        let (stage, stage_s) = controller.stage(now_s);
        // An emulated hand that moves by itself has other stages.
        let own_stages = emulated && recording.request.control == Control::ByHand;
        let until_s = if own_stages { controller.end_s() } else { stage_s };
        TrialView {
            id: self.recording_id,
            request: recording.request.clone(),
            stage,
            left_s: until_s.map(|until_s| (until_s - now_s).max(0.0)),
            t_s: now_s - recording.began_s,
            length_s: controller.end_s().map(|end_s| end_s - recording.began_s),
            samples: recording.samples,
            automatic: recording.automatic,
            adapting: self.adapting,
            emulated,
        }
    }
}
