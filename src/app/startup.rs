//! Checks before the window opens: display, its libraries, graphics driver. Everything missing is reported at once, with the
//! command that installs it.

use std::env;
use std::path::{Path, PathBuf};

/// Display that the window opens on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Surroundings {
    /// Windowing system.
    pub display: Display,
    /// Remark that does not stop the window.
    pub note: Option<String>,
}

/// Windowing system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Display {
    /// Wayland compositor that answers.
    Wayland,
    /// X server.
    X11,
    /// Windows or macOS.
    Native,
}

/// Reason why the window does not open.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    #[error("no display to open a window on (neither Wayland nor X11); {hint}", hint = WITHOUT_DISPLAY)]
    NoDisplay,
    #[error("the display \"{0}\" does not answer; {hint}", hint = WITHOUT_DISPLAY)]
    DeadDisplay(String),
    #[error("the window needs {hint}", hint = install_hint(.0))]
    Missing(Vec<Needed>),
    #[error("no graphics driver can draw into the window ({0}); it needs {hint}", hint = install_hint(&[DRIVER]))]
    NoDriver(String),
    #[error("cannot open the window: {0}")]
    Other(String),
}

/// Thread that could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start {thread}: {source}")]
pub struct ThreadError {
    /// Purpose of the thread.
    pub thread: &'static str,
    /// Cause.
    pub source: std::io::Error,
}

impl ThreadError {
    /// Names the thread of an error.
    pub(super) fn of(thread: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self { thread, source }
    }
}

const WITHOUT_DISPLAY: &str = "without one, `palpate demo` grasps and writes pictures";

/// Library that the window loads, and the packages that contain it.
#[derive(Clone, Copy, Debug)]
pub struct Needed {
    library: &'static str,
    debian: &'static str,
    fedora: &'static str,
    arch: &'static str,
}

const fn needed(library: &'static str, debian: &'static str, fedora: &'static str, arch: &'static str) -> Needed {
    Needed { library, debian, fedora, arch }
}

const X11: [Needed; 5] = [
    needed("libX11.so.6", "libx11-6", "libX11", "libx11"),
    needed("libXcursor.so.1", "libxcursor1", "libXcursor", "libxcursor"),
    needed("libX11-xcb.so.1", "libx11-xcb1", "libX11-xcb", "libx11"),
    needed("libXi.so.6", "libxi6", "libXi", "libxi"),
    needed("libxkbcommon-x11.so.0", "libxkbcommon-x11-0", "libxkbcommon-x11", "libxkbcommon-x11"),
];

const WAYLAND: [Needed; 3] = [
    needed("libwayland-client.so.0", "libwayland-client0", "libwayland-client", "wayland"),
    needed("libxkbcommon.so.0", "libxkbcommon0", "libxkbcommon", "libxkbcommon"),
    needed("libwayland-egl.so.1", "libwayland-egl1", "libwayland-egl", "wayland"),
];

const KEYBOARDS: Needed = needed("keyboard layouts", "xkb-data", "xkeyboard-config", "xkeyboard-config");
const DRIVER: Needed = needed(
    "a graphics driver",
    "mesa-vulkan-drivers",
    "vulkan-loader mesa-vulkan-drivers",
    "vulkan-icd-loader vulkan-swrast",
);

/// Checks display, libraries and graphics driver.
pub fn check_surroundings() -> Result<Surroundings, WindowError> {
    if !cfg!(target_os = "linux") {
        return Ok(Surroundings { display: Display::Native, note: None });
    }
    let surroundings = find_display(&|name| env::var(name).ok(), &answers)?;
    let libraries: &[Needed] = match surroundings.display {
        Display::Wayland => &WAYLAND,
        Display::X11 => &X11,
        Display::Native => &[],
    };
    let mut missing: Vec<Needed> = libraries.iter().filter(|n| !can_load(n.library)).copied().collect();
    if !keyboards_folder().join("rules/evdev").exists() {
        missing.push(KEYBOARDS);
    }
    if !has_driver() {
        missing.push(DRIVER);
    }
    if missing.is_empty() { Ok(surroundings) } else { Err(WindowError::Missing(missing)) }
}

/// Finds a live Wayland socket, else X11.
fn find_display(
    variable: &dyn Fn(&str) -> Option<String>,
    answers: &dyn Fn(&Path) -> bool,
) -> Result<Surroundings, WindowError> {
    let set = |name: &str| variable(name).filter(|value| !value.is_empty());
    let socket = set("WAYLAND_DISPLAY").map(|name| {
        let folder = set("XDG_RUNTIME_DIR").unwrap_or_default();
        if name.starts_with('/') { PathBuf::from(name) } else { Path::new(&folder).join(name) }
    });
    let inherited = set("WAYLAND_SOCKET").is_some();
    if inherited || socket.as_deref().is_some_and(answers) {
        return Ok(Surroundings { display: Display::Wayland, note: None });
    }
    if set("DISPLAY").is_none() {
        return Err(WindowError::NoDisplay);
    }
    let note = socket.map(|path| format!("the Wayland display {} does not answer; X11 is used", path.display()));
    Ok(Surroundings { display: Display::X11, note })
}

#[cfg(unix)]
fn answers(socket: &Path) -> bool {
    std::os::unix::net::UnixStream::connect(socket).is_ok()
}

#[cfg(not(unix))]
fn answers(_socket: &Path) -> bool {
    false
}

#[expect(
    unsafe_code,
    reason = "loading a library runs its initialisers; these are the very ones the window loads next"
)]
fn can_load(library: &str) -> bool {
    // SAFETY: system libraries of the windowing system, loaded a moment later by the window in the same way; nothing
    // is called in them here.
    unsafe { libloading::Library::new(library).is_ok() }
}

fn keyboards_folder() -> PathBuf {
    env::var_os("XKB_CONFIG_ROOT").map_or_else(|| PathBuf::from("/usr/share/X11/xkb"), PathBuf::from)
}

/// Looks for a driver's files: asking the drivers takes a second on software rendering.
fn has_driver() -> bool {
    let named = ["VK_ICD_FILENAMES", "VK_DRIVER_FILES", "VK_ADD_DRIVER_FILES"].iter().any(|v| env::var_os(v).is_some());
    let holds_files = |folder: &str| std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some());
    let vulkan = named || ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"].iter().any(|f| holds_files(f));
    (vulkan && can_load("libvulkan.so.1")) || can_load("libEGL.so.1")
}

/// Missing libraries, and the command that installs them on this system.
fn install_hint(missing: &[Needed]) -> String {
    install_hint_for(missing, &std::fs::read_to_string("/etc/os-release").unwrap_or_default())
}

fn install_hint_for(missing: &[Needed], os_release: &str) -> String {
    let ids: String = os_release.lines().filter(|l| l.starts_with("ID=") || l.starts_with("ID_LIKE=")).collect();
    let (command, package): (&str, fn(&Needed) -> &'static str) = if ids.contains("debian") || ids.contains("ubuntu") {
        ("sudo apt install", |n| n.debian)
    } else if ids.contains("fedora") || ids.contains("rhel") {
        ("sudo dnf install", |n| n.fedora)
    } else if ids.contains("arch") {
        ("sudo pacman -S", |n| n.arch)
    } else {
        ("install the packages that Debian calls", |n| n.debian)
    };
    let mut packages: Vec<&str> = missing.iter().map(package).collect();
    packages.dedup();
    let names: Vec<&str> = missing.iter().map(|n| n.library).collect();
    format!("{}. To install it:\n  {command} {}", names.join(", "), packages.join(" "))
}

impl Surroundings {
    /// Logs the remark.
    pub(super) fn apply(&self) {
        if let Some(note) = &self.note {
            tracing::warn!("{note}");
        }
    }

    /// Selects X11 where it was found: the library would try a dead Wayland socket first.
    pub(super) fn event_loop_hook(&self) -> Option<eframe::EventLoopBuilderHook> {
        #[cfg(target_os = "linux")]
        if self.display == Display::X11 {
            return Some(Box::new(|builder| {
                winit::platform::x11::EventLoopBuilderExtX11::with_x11(builder);
            }));
        }
        None
    }

    /// Explains an error of the windowing library.
    pub(super) fn explain(&self, error: &eframe::Error) -> WindowError {
        let text = error.to_string();
        let dead = text.contains("XOpenDisplayFailed")
            || text.contains("NoCompositor")
            || text.contains("Connection")
            || text.contains("X server");
        if dead {
            return WindowError::DeadDisplay(env::var("DISPLAY").unwrap_or_default());
        }
        match error {
            eframe::Error::Wgpu(_) => WindowError::NoDriver(text),
            _ => WindowError::Other(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn display(variables: &[(&str, &str)], live: bool) -> Result<Surroundings, WindowError> {
        let variable = |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned());
        find_display(&variable, &|_| live)
    }

    #[test]
    fn wayland_comes_before_x11_and_without_either_the_demo_is_named() {
        let both = [("WAYLAND_DISPLAY", "wayland-0"), ("XDG_RUNTIME_DIR", "/run/user/1"), ("DISPLAY", ":0")];
        assert_eq!(display(&both, true).unwrap().display, Display::Wayland);
        let fallen_back = display(&both, false).unwrap();
        assert_eq!(fallen_back.display, Display::X11);
        assert!(fallen_back.note.unwrap().contains("wayland-0 does not answer"));
        assert_eq!(display(&[("DISPLAY", ":0")], false).unwrap().note, None);
        for nothing in [&[][..], &[("DISPLAY", ""), ("WAYLAND_DISPLAY", "")][..]] {
            assert!(display(nothing, false).unwrap_err().to_string().contains("palpate demo"));
        }
    }

    #[test]
    fn everything_missing_is_one_line_to_type() {
        let missing = [X11[1], X11[2], DRIVER];
        let debian = install_hint_for(&missing, "NAME=x\nID=debian\n");
        assert!(debian.ends_with("sudo apt install libxcursor1 libx11-xcb1 mesa-vulkan-drivers"), "{debian}");
        assert!(install_hint_for(&missing, "ID=ubuntu\nID_LIKE=debian").contains("apt"));
        assert!(install_hint_for(&missing, "ID=fedora").contains("dnf install libXcursor"));
        assert!(install_hint_for(&missing, "ID=arch").contains("pacman -S libxcursor"));
        assert!(install_hint_for(&missing, "").contains("Debian calls"));
    }
}
