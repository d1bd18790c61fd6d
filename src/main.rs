//! Parses arguments, opens the window or runs a headless command, prints the error.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpate::cli::run()
}
