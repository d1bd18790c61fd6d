//! Draws Palpate's soft fingers and objects: a [`DrawList`](palpate_geometry::drawing::DrawList) in, pixels out.
//!
//! The same code draws into the window, into test pictures and off-screen. It keeps within WebGL2's limits: no compute,
//! no storage buffers, four samples.
//!
//! - [`Renderer`] draws a list into a texture of its own; [`Blit`] puts that texture into a window.
//! - [`Gpu`] finds a graphics device without a window; [`Picture`] is what comes out.
//! - `passes` holds one file for each kind of thing that is drawn, beside the shader of the same name in `shaders/`.

mod blit;
mod frame;
mod gpu;
mod passes;
mod picture;
mod renderer;
mod shaders;
mod shadow;
mod targets;
mod text;

pub use blit::Blit;
pub use gpu::{DriverChoice, Gpu, GpuError, describe_adapter, wanted_limits};
pub use picture::{Picture, PictureError};
pub use renderer::Renderer;
pub use shaders::all_shaders;

pub use wgpu;
