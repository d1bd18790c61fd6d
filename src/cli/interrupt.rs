//! Ctrl+C, and a request to end from whoever started the program, as a flag: what runs until it is stopped ends where
//! nothing is lost. A second Ctrl+C ends the program at once.

use super::Failure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that becomes true when the program is asked to end. To be called once.
pub(super) fn stop_flag() -> Result<Arc<AtomicBool>, Failure> {
    let asked = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&asked);
    ctrlc::set_handler(move || {
        if told.swap(true, Ordering::Relaxed) {
            #[expect(clippy::exit, reason = "it was asked twice, so the orderly way takes too long")]
            std::process::exit(130);
        }
    })?;
    Ok(asked)
}
