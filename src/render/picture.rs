//! Pictures without a window: draw a list, read the pixels back, write a PNG.

use super::{Gpu, Renderer};
use palpate_geometry::drawing::DrawList;

/// Pixels, sRGB with opacity, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width (pixels).
    pub width: u32,
    /// Height (pixels).
    pub height: u32,
    /// Four bytes per pixel.
    pub rgba: Vec<u8>,
}

/// Error of making a picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    #[error("the picture could not be read back from the graphics driver: {cause}")]
    Device {
        /// Message of the driver.
        cause: String,
    },
    #[error("the picture cannot be written as PNG: {cause}")]
    Encode {
        /// Message of the encoder.
        cause: String,
    },
    #[error("these bytes are not a PNG picture: {cause}")]
    Decode { cause: String },
}

impl Picture {
    /// Draws a list off-screen, `size` pixels at `pixels_per_point`.
    pub fn draw(
        gpu: &Gpu,
        renderer: &mut Renderer,
        list: &DrawList,
        size: [u32; 2],
        pixels_per_point: f32,
    ) -> Result<Self, PictureError> {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.render(&gpu.device, &gpu.queue, &mut encoder, list, size, pixels_per_point);
        let (texture, _) =
            renderer.picture_texture().ok_or_else(|| PictureError::Device { cause: "nothing was drawn".to_owned() })?;
        Self::read_back(&gpu.device, &gpu.queue, encoder, texture)
    }

    /// Runs the commands and reads a texture back that they draw. It holds RGBA or BGRA, eight bits each.
    pub fn read_back(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mut encoder: wgpu::CommandEncoder,
        texture: &wgpu::Texture,
    ) -> Result<Self, PictureError> {
        let fault = |cause: &dyn std::fmt::Display| PictureError::Device { cause: cause.to_string() };
        let (width, height) = (texture.width(), texture.height());
        // Rows of a copy start at multiples of 256 bytes.
        let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: Some(height),
                },
            },
            texture.size(),
        );
        queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |outcome| {
            // The receiver waits below; it is gone only if this function has returned with an error.
            let _received = sender.send(outcome);
        });
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| fault(&e))?;
        match receiver.recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(fault(&error)),
            Err(error) => return Err(fault(&error)),
        }
        let mapped = buffer.slice(..).get_mapped_range().map_err(|e| fault(&e))?;
        let mut rgba: Vec<u8> =
            mapped.chunks_exact(row as usize).flat_map(|r| &r[..width as usize * 4]).copied().collect();
        if matches!(texture.format(), wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb) {
            rgba.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        Ok(Self { width, height, rgba })
    }

    /// Decodes a PNG file's bytes.
    pub fn from_png(bytes: &[u8]) -> Result<Self, PictureError> {
        let decoded = image::load_from_memory_with_format(bytes, image::ImageFormat::Png);
        let pixels = decoded.map_err(|e| PictureError::Decode { cause: e.to_string() })?.into_rgba8();
        Ok(Self { width: pixels.width(), height: pixels.height(), rgba: pixels.into_raw() })
    }

    /// The bytes of a PNG file with texts, each with its key.
    pub fn to_png_with(&self, texts: &[(&str, String)]) -> Result<Vec<u8>, PictureError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        let added = texts.iter().try_for_each(|(key, text)| encoder.add_itxt_chunk((*key).to_owned(), text.clone()));
        let written = added.and_then(|()| encoder.write_header()?.write_image_data(&self.rgba));
        written.map_err(|cause| PictureError::Encode { cause: cause.to_string() })?;
        Ok(bytes)
    }

    /// Text of a PNG file under this key, before its pixels.
    pub fn text_of_png(bytes: &[u8], key: &str) -> Option<String> {
        let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
        let texts = &reader.info().utf8_text;
        texts.iter().find(|text| text.keyword == key).and_then(|text| text.get_text().ok())
    }

    /// The bytes of a PNG file.
    pub fn to_png(&self) -> Result<Vec<u8>, PictureError> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let (format, colours) = (image::ImageFormat::Png, image::ColorType::Rgba8);
        image::write_buffer_with_format(&mut bytes, &self.rgba, self.width, self.height, colours, format)
            .map_err(|cause| PictureError::Encode { cause: cause.to_string() })?;
        Ok(bytes.into_inner())
    }
}
