//! Before the window opens: is there a display, are its libraries here, is there a graphics driver? Whatever is missing
//! is said all at once, with the one line that mends it, instead of one library's error after another.

use std::env;
use std::path::{Path, PathBuf};

/// What the program finds around itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Surroundings {
    /// Which windowing system will be used.
    pub display: Display,
    /// Something worth knowing, though it does not stop anything.
    pub note: Option<String>,
}

/// The windowing systems.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Display {
    /// A Wayland compositor answers.
    Wayland,
    /// An X server is named.
    X11,
    /// Windows or macOS, which bring everything.
    Native,
}

/// A library that is loaded while the window opens, and the packages that hold it.
struct Needed {
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

const NO_DISPLAY: &str = "there is no display to open a window on (neither Wayland nor X11); \
                          without one, `palpate demo` grasps, tells the story and writes pictures";

/// Checks everything that opening a window takes. The error is a text for the user.
pub fn check_surroundings() -> Result<Surroundings, String> {
    if !cfg!(target_os = "linux") {
        return Ok(Surroundings { display: Display::Native, note: None });
    }
    let surroundings = find_display(&|name| env::var(name).ok(), &answers)?;
    let libraries: &[Needed] = match surroundings.display {
        Display::Wayland => &WAYLAND,
        Display::X11 => &X11,
        Display::Native => &[],
    };
    let mut missing: Vec<&Needed> = libraries.iter().filter(|n| !can_load(n.library)).collect();
    if !keyboards_folder().join("rules/evdev").exists() {
        missing.push(&KEYBOARDS);
    }
    if !has_driver() {
        missing.push(&DRIVER);
    }
    if missing.is_empty() {
        return Ok(surroundings);
    }
    Err(shopping_list(&missing, &std::fs::read_to_string("/etc/os-release").unwrap_or_default()))
}

/// A live Wayland socket, else X11, else a message.
fn find_display(
    variable: &dyn Fn(&str) -> Option<String>,
    answers: &dyn Fn(&Path) -> bool,
) -> Result<Surroundings, String> {
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
        return Err(NO_DISPLAY.to_owned());
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

/// Looks for what a driver leaves on the disk: asking the drivers themselves takes a second on software rendering.
fn has_driver() -> bool {
    let named = ["VK_ICD_FILENAMES", "VK_DRIVER_FILES", "VK_ADD_DRIVER_FILES"].iter().any(|v| env::var_os(v).is_some());
    let holds_files = |folder: &str| std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some());
    let vulkan = named || ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"].iter().any(|f| holds_files(f));
    (vulkan && can_load("libvulkan.so.1")) || can_load("libEGL.so.1")
}

/// The sentence that lists what is missing and the command that brings it.
fn shopping_list(missing: &[&Needed], os_release: &str) -> String {
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
    let mut packages: Vec<&str> = missing.iter().map(|n| package(n)).collect();
    packages.dedup();
    let names: Vec<&str> = missing.iter().map(|n| n.library).collect();
    format!("the window needs {}; to get it:\n  {command} {}", names.join(", "), packages.join(" "))
}

impl Surroundings {
    /// Makes the windowing library use the display that was found, and mentions what is odd.
    pub(super) fn apply(&self) {
        if let Some(note) = &self.note {
            tracing::warn!("{note}");
        }
    }

    /// X11 has to be asked for where it was chosen, because the library would try a dead Wayland socket first.
    pub(super) fn event_loop_hook(&self) -> Option<eframe::EventLoopBuilderHook> {
        #[cfg(target_os = "linux")]
        if self.display == Display::X11 {
            return Some(Box::new(|builder| {
                winit::platform::x11::EventLoopBuilderExtX11::with_x11(builder);
            }));
        }
        None
    }

    /// What still came out of the windowing library, in our words.
    pub(super) fn explain(&self, error: &eframe::Error) -> String {
        let text = error.to_string();
        let dead = text.contains("XOpenDisplayFailed")
            || text.contains("NoCompositor")
            || text.contains("Connection")
            || text.contains("X server");
        if dead {
            let display = env::var("DISPLAY").unwrap_or_default();
            return format!("the display \"{display}\" does not answer; {NO_DISPLAY}");
        }
        match error {
            eframe::Error::Wgpu(_) => {
                let os = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
                format!("no graphics driver can draw into the window ({text}); {}", shopping_list(&[&DRIVER], &os))
            }
            _ => format!("the window could not be opened: {text}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn display(variables: &[(&str, &str)], live: bool) -> Result<Surroundings, String> {
        let variable = |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned());
        find_display(&variable, &|_| live)
    }

    #[test]
    fn wayland_first_then_x11_then_a_word_about_the_demo() {
        let both = [("WAYLAND_DISPLAY", "wayland-0"), ("XDG_RUNTIME_DIR", "/run/user/1"), ("DISPLAY", ":0")];
        assert_eq!(display(&both, true).unwrap().display, Display::Wayland);
        let fallen_back = display(&both, false).unwrap();
        assert_eq!(fallen_back.display, Display::X11);
        assert!(fallen_back.note.unwrap().contains("/run/user/1/wayland-0"));
        assert_eq!(display(&[("DISPLAY", ":0")], false).unwrap().note, None);
        for nothing in [&[][..], &[("DISPLAY", ""), ("WAYLAND_DISPLAY", "")][..]] {
            assert!(display(nothing, false).unwrap_err().contains("palpate demo"));
        }
    }

    #[test]
    fn everything_missing_is_one_line_to_type() {
        let missing: Vec<&Needed> = X11[1..3].iter().chain([&DRIVER]).collect();
        let debian = shopping_list(&missing, "NAME=x\nID=debian\n");
        assert!(debian.ends_with("sudo apt install libxcursor1 libx11-xcb1 mesa-vulkan-drivers"), "{debian}");
        assert!(shopping_list(&missing, "ID=ubuntu\nID_LIKE=debian").contains("apt"));
        assert!(shopping_list(&missing, "ID=fedora").contains("dnf install libXcursor"));
        assert!(shopping_list(&missing, "ID=arch").contains("pacman -S libxcursor"));
        assert!(shopping_list(&missing, "").contains("Debian calls"));
    }
}
