//! The program: window and commands.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpate::cli::run()
}
