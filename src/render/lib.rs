//! Pictures of soft fingers and objects: a [`DrawList`](palpate_geometry::drawing::DrawList) in, pixels out.
//!
//! The same code draws into the window, into test pictures and off-screen. It keeps within WebGL2's limits: no compute,
//! no storage buffers, four samples.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers. All are private; their items are at the root of the crate.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | `gpu` | graphics device without a window ([`Gpu`]) |
//! | 0 | `shaders`, `targets`, `text`, `screen` | WGSL sources, render targets, glyph atlas, pipelines that cover a target |
//! | 1 | `blit`, `shadow` | copy of a picture into another render pass ([`Blit`]), shadow map |
//! | 2 | `frame` | uniforms shared by all passes |
//! | 3 | `ambient` | distances of a picture, and how much of its surroundings each place sees |
//! | 4 | `passes` | one file for each kind of item, beside its shader of the same name |
//! | 5 | `renderer` | draws a list into its own texture ([`Renderer`]) |
//! | 6 | `picture` | pixels in memory, PNG ([`Picture`]) |
//! | 7 | `difference` | how two pictures differ ([`Picture::difference`]) |
//! | 7 | `movie` | pictures one after the other as animated PNG or GIF ([`MovieWriter`]) |
//! | 7 | `figure` | figures with axes as SVG and as pixels ([`figure_svg`], [`figure_picture`]), and places of their labels ([`placed_labels`]), without a graphics card |
//!
//! # Example
//!
//! ```no_run
//! use palpate_geometry::drawing::DrawList;
//! use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
//!
//! fn save(list: &DrawList, choice: DriverChoice) -> Result<(), Box<dyn std::error::Error>> {
//!     let gpu = Gpu::headless(choice)?;
//!     let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
//!     std::fs::write("picture.png", Picture::draw(&gpu, &mut renderer, list, [640, 480], 1.0)?.to_png()?)?;
//!     Ok(())
//! }
//! ```

mod ambient;
mod blit;
mod difference;
mod figure;
mod frame;
mod gpu;
mod movie;
mod passes;
mod picture;
mod renderer;
mod screen;
mod shaders;
mod shadow;
mod targets;
mod text;

pub use blit::Blit;
pub use difference::THRESHOLDS;
pub use difference::{PictureDifference, SizeMismatch};
pub use figure::{FigureError, PlacedLabel, figure_picture, figure_svg, placed_labels};
pub use gpu::{DriverChoice, Gpu, GpuError, describe_adapter, draws_in_software, offscreen_backends, wanted_limits};
pub use movie::{MovieError, MovieFormat, MovieWriter};
pub use picture::{Picture, PictureError};
pub use renderer::Renderer;
pub use shaders::all_shaders;

pub use wgpu;
