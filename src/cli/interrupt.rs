//! Ctrl+C and termination requests as a flag, so that a command stops without losing data. A second Ctrl+C ends the program
//! at once.

use super::Failure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Returns a flag that Ctrl+C sets. To be called once.
pub(super) fn stop_flag() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let set_by_handler = Arc::clone(&stop);
    on_request(move || set_by_handler.store(true, Ordering::Relaxed))?;
    Ok(stop)
}

/// Stops by `stop` at the first Ctrl+C. To be called once.
pub(super) fn on_request(stop: impl Fn() + Send + 'static) -> Result<(), Failure> {
    let asked = AtomicBool::new(false);
    ctrlc::set_handler(move || {
        if asked.swap(true, Ordering::Relaxed) {
            #[expect(clippy::exit, reason = "the second request: the orderly way takes too long")]
            std::process::exit(130);
        }
        stop();
    })?;
    Ok(())
}
