//! A graphics device without a window.

use std::ffi::OsStr;
use std::path::Path;
use wgpu::{Adapter, AdapterInfo, Backends, Device, Instance, Limits, Queue};

/// Choice of graphics drivers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DriverChoice {
    /// Any driver: Vulkan before OpenGL in a session with a display, hardware before software. `WGPU_BACKEND` overrides
    /// it.
    #[default]
    Any,
    /// OpenGL only: the same software rasteriser on every machine, for pictures that tests compare.
    OpenGl,
    /// Vulkan only.
    Vulkan,
    /// The processor only, through any interface: the same on machines with and without a graphics card.
    Software,
}

impl DriverChoice {
    /// All, with their names on the command line.
    pub const NAMED: [(&str, Self); 4] =
        [("any", Self::Any), ("software", Self::Software), ("gl", Self::OpenGl), ("vulkan", Self::Vulkan)];

    /// Interfaces in the order in which they are tried.
    pub fn backends(self) -> Vec<Backends> {
        match self {
            Self::OpenGl => vec![Backends::GL],
            Self::Vulkan => vec![Backends::VULKAN],
            Self::Any | Self::Software => offscreen_backends(),
        }
    }

    /// True for an adapter that may be chosen.
    pub fn allows(self, info: &AdapterInfo) -> bool {
        self != Self::Software || draws_in_software(info)
    }
}

/// Error of opening a graphics device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    #[error(
        "no graphics driver was found, not even a software one. On Debian and Ubuntu: sudo apt install \
         mesa-vulkan-drivers (or libegl1 libgl1-mesa-dri); on Fedora: sudo dnf install mesa-vulkan-drivers; on Arch: sudo \
         pacman -S vulkan-icd-loader vulkan-swrast"
    )]
    NoDriver,
    #[error("there is no graphics driver of the kind asked for: {wanted}; leave out --driver, or choose another")]
    NoSuchDriver {
        /// Name of the kind.
        wanted: &'static str,
    },
    #[error("the graphics driver {driver} cannot be used: {cause}; update the driver")]
    NoDevice {
        /// Its name.
        driver: String,
        /// Its message.
        cause: String,
    },
}

/// A device and its queue.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// Makes resources.
    pub device: Device,
    /// Takes work.
    pub queue: Queue,
    /// The driver behind it, for people.
    pub driver: String,
}

impl Gpu {
    /// Finds a device for drawing off-screen.
    pub fn headless(choice: DriverChoice) -> Result<Self, GpuError> {
        let none = || match DriverChoice::NAMED.iter().find(|(_, own)| *own == choice && choice != DriverChoice::Any) {
            Some((wanted, _)) => GpuError::NoSuchDriver { wanted },
            None => GpuError::NoDriver,
        };
        let adapter = choice.backends().into_iter().find_map(|b| best_adapter(b, choice)).ok_or_else(none)?;
        Self::from_adapter(&adapter)
    }

    fn from_adapter(adapter: &Adapter) -> Result<Self, GpuError> {
        let driver = describe_adapter(&adapter.get_info());
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("palpate"),
            required_limits: wanted_limits(adapter),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::NoDevice { driver: driver.clone(), cause: e.to_string() })?;
        Ok(Self { device, queue, driver })
    }
}

/// Interfaces in the order in which a driver for pictures without a window is looked for.
pub fn offscreen_backends() -> Vec<Backends> {
    backends_for(Backends::from_env(), std::env::var_os("XDG_RUNTIME_DIR").as_deref())
}

/// An interface is tried only if those before it have no driver, because trying makes libraries print messages. Mesa's
/// Vulkan layer that chooses the device asks the Wayland display, which prints an error if its folder is missing;
/// OpenGL needs no display. Other systems have no such layer, and their own interface comes first.
fn backends_for(named: Option<Backends>, wayland_folder: Option<&OsStr>) -> Vec<Backends> {
    match named {
        Some(named) => vec![named],
        None if !cfg!(target_os = "linux") || wayland_folder.is_some_and(|folder| Path::new(folder).is_absolute()) => {
            vec![Backends::PRIMARY, Backends::GL]
        }
        None => vec![Backends::GL, Backends::PRIMARY],
    }
}

fn best_adapter(backends: Backends, choice: DriverChoice) -> Option<Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    let instance = Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(backends));
    let allowed = adapters.into_iter().filter(|adapter| choice.allows(&adapter.get_info()));
    allowed.min_by_key(|adapter| preference(&adapter.get_info()))
}

/// WebGL2's limits, but pictures as large as the adapter can make them.
pub fn wanted_limits(adapter: &Adapter) -> Limits {
    Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits())
}

/// Lower is better: hardware first.
fn preference(info: &AdapterInfo) -> u8 {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// True if the processor draws, not a graphics card.
pub fn draws_in_software(info: &AdapterInfo) -> bool {
    info.device_type == wgpu::DeviceType::Cpu || info.name.contains("llvmpipe")
}

/// A driver in a few words: its name, its interface, and whether it draws in software.
pub fn describe_adapter(info: &AdapterInfo) -> String {
    let software = if draws_in_software(info) { ", software rendering" } else { "" };
    let name = info.name.split(" (").next().unwrap_or(&info.name);
    format!("{name} ({}{software})", info.backend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn vulkan_is_left_alone_where_it_would_ask_for_a_missing_display() {
        let first = |named, folder: Option<&str>| backends_for(named, folder.map(OsStr::new))[0];
        assert_eq!(first(None, Some("/run/user/1000")), Backends::PRIMARY);
        for folder in [None, Some(""), Some("run")] {
            assert_eq!(first(None, folder), Backends::GL);
        }
        assert_eq!(first(Some(Backends::VULKAN), None), Backends::VULKAN);
    }
}
