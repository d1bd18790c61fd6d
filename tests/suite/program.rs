//! Runs the program as a user would.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// The program, with no display, a store of its own and a folder "data" beside it for what it keeps for itself.
pub(crate) fn palpate(store: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.arg("--store").arg(store).env("XDG_DATA_HOME", store.with_file_name("data"));
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    command
}

/// What a run came to.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

/// Runs it to its end in `folder`, with the store there.
pub(crate) fn run<A: AsRef<OsStr>>(folder: &Path, arguments: &[A]) -> Ran {
    let output = palpate(&folder.join("trials.sqlite")).args(arguments).current_dir(folder).output().unwrap();
    ran(&output)
}

pub(crate) fn ran(output: &Output) -> Ran {
    Ran {
        code: output.status.code(),
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// Runs something that must succeed and print JSON.
pub(crate) fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let ran = run(folder, arguments);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    serde_json::from_str(&ran.out).unwrap()
}

/// Runs something that is wrong use: exit code 2 and a message that holds `wanted`.
pub(crate) fn misused(folder: &Path, arguments: &[&str], wanted: &[&str]) {
    let ran = run(folder, arguments);
    assert!(ran.code == Some(2) && ran.out.is_empty(), "{arguments:?}: {ran:?}");
    for part in wanted {
        assert!(ran.err.contains(part), "{arguments:?} does not say \"{part}\": {ran:?}");
    }
}

/// Runs something that must fail with exit code 1, one `error:` line that holds `wanted`, and no panic.
pub(crate) fn refused(folder: &Path, arguments: &[&str], wanted: &[&str]) {
    let ran = run(folder, arguments);
    assert_eq!(ran.code, Some(1), "{arguments:?}: {ran:?}");
    assert!(ran.out.is_empty(), "{arguments:?}: {ran:?}");
    assert!(!ran.err.contains("panicked"), "{arguments:?}: {ran:?}");
    let error = ran.err.lines().find(|line| line.starts_with("error: ")).unwrap_or_default();
    for part in wanted {
        assert!(ran.err.contains(part) && !error.is_empty(), "{arguments:?} does not say \"{part}\": {ran:?}");
    }
}
