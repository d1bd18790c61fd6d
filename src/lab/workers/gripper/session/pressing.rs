//! Line pressure outside of driven trials: moved and kept on command, watched as in a grasp.

use super::GripperSession;
use crate::grasping::{GraspController, GraspPlan};
use crate::gripper::Gripper;
use crate::recording::BoardTrialRecording;
use crate::workers::Notice;
use palpate_tactile::trial::Control;

impl GripperSession {
    /// Moves the line pressure to `bar`. The first time, the fingers are vented before, so that a board that does not answer is
    /// noticed.
    pub(super) fn press(&mut self, bar: Option<f64>) {
        let bar = bar.unwrap_or(self.scene.programme.peak_bar);
        let driven = self.recording.as_ref().is_some_and(BoardTrialRecording::is_driven);
        if let Some(occupied) = self.occupied().filter(|_| driven || self.recording.is_none()) {
            return self.publisher.notify(Notice::Warning(format!("pressure not set: {occupied}")));
        }
        let Some(connection) = &mut self.connection else {
            let text = "pressure not set: no board is connected; connect the gripper first";
            return self.publisher.notify(Notice::Warning(text.to_owned()));
        };
        let now_s = connection.gripper.now_s();
        if self.pressing.is_none() {
            if let Err(error) = connection.gripper.vent() {
                return self.publisher.notify(Notice::Failed(format!("pressure not set: {error}")));
            }
            let mut pressing = GraspController::new(GraspPlan::recorded(&self.scene, Control::Driven), now_s);
            pressing.watch_board(now_s);
            self.pressing = Some(pressing);
        }
        connection.taken_over = true;
        self.pressing.iter_mut().for_each(|pressing| pressing.aim(bar, now_s));
    }

    /// Sets the pressure that is due; vents after a fault of the board.
    pub(super) fn keep_pressure(&mut self) {
        let (Some(connection), Some(pressing)) = (&mut self.connection, &mut self.pressing) else { return };
        pressing.check_board(connection.gripper.looked_s());
        if let Some(command) = pressing.command(connection.gripper.now_s())
            && let Err(error) = connection.gripper.set_pressure(command.bar, command.phase)
        {
            pressing.abort(error.to_string());
        }
        let Some(cause) = pressing.abort_cause().map(str::to_owned) else { return };
        self.pressing = None;
        let told = self.tell_to_vent();
        self.publisher.notify(Notice::Warning(format!("{cause}; {told}")));
    }
}
