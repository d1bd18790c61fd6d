//! A graphics device without a window.

use wgpu::{Adapter, AdapterInfo, Backends, Device, Instance, Limits, Queue};

/// Which drivers to look for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DriverChoice {
    /// Whatever there is: Vulkan before OpenGL, hardware before software. `WGPU_BACKEND` overrides it.
    #[default]
    Any,
    /// OpenGL only: the same software rasteriser on every machine, for pictures that tests compare.
    OpenGl,
}

/// Why there is no device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No driver at all.
    #[error(
        "no graphics driver was found, not even a software one. On Debian and Ubuntu: sudo apt install \
         mesa-vulkan-drivers (or libegl1 libgl1-mesa-dri); on Fedora: sudo dnf install mesa-vulkan-drivers; on Arch: sudo \
         pacman -S vulkan-icd-loader vulkan-swrast"
    )]
    NoDriver,
    /// A driver that gives no device.
    #[error("the graphics driver {driver} gives no device: {cause}")]
    NoDevice {
        /// Its name.
        driver: String,
        /// What it says.
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
        let backends = match choice {
            DriverChoice::Any => Backends::from_env().unwrap_or(Backends::PRIMARY | Backends::GL),
            DriverChoice::OpenGl => Backends::GL,
        };
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = backends;
        let instance = Instance::new(descriptor);
        let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
        adapters.sort_by_key(|adapter| preference(&adapter.get_info()));
        let adapter = adapters.into_iter().next().ok_or(GpuError::NoDriver)?;
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

/// WebGL2's limits, but pictures as large as the adapter can make them.
pub fn wanted_limits(adapter: &Adapter) -> Limits {
    Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits())
}

/// Lower is better: hardware first, and Vulkan, Metal or DirectX before OpenGL.
fn preference(info: &AdapterInfo) -> (u8, u8) {
    let hardware = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    (hardware, u8::from(info.backend == wgpu::Backend::Gl))
}

/// A driver in a few words: its name, its interface, and whether it draws in software.
pub fn describe_adapter(info: &AdapterInfo) -> String {
    let software = if info.device_type == wgpu::DeviceType::Cpu || info.name.contains("llvmpipe") {
        ", software rendering"
    } else {
        ""
    };
    format!("{} ({}{software})", info.name, info.backend)
}
