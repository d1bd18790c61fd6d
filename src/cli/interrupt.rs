//! Ctrl+C and termination requests as a flag, so that a command stops without losing data. A second Ctrl+C ends the program
//! at once.

use super::Failure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Returns a flag that Ctrl+C sets. To be called once.
pub(super) fn stop_flag() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let set_by_handler = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if set_by_handler.swap(true, Ordering::Relaxed) {
            #[expect(clippy::exit, reason = "the second request: the orderly way takes too long")]
            std::process::exit(130);
        }
    })?;
    Ok(stop)
}
