//! The textures a picture is drawn into: four samples with depth, resolved into one that can be shown or read.

use wgpu::{Device, Texture, TextureFormat, TextureUsages, TextureView};

/// Linear light in, sRGB texels out: blending and resolving happen in linear light.
pub(crate) const COLOUR: TextureFormat = TextureFormat::Rgba8UnormSrgb;
pub(crate) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
pub(crate) const SAMPLES: u32 = 4;

#[derive(Debug)]
pub(crate) struct Targets {
    pub(crate) size: [u32; 2],
    pub(crate) samples: TextureView,
    pub(crate) depth: TextureView,
    pub(crate) resolved: Texture,
    pub(crate) resolved_view: TextureView,
}

impl Targets {
    pub(crate) fn new(device: &Device, size: [u32; 2]) -> Self {
        let texture = |label, format, samples, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let view = |texture: &Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let attached = TextureUsages::RENDER_ATTACHMENT;
        let samples = texture("picture samples", COLOUR, SAMPLES, attached);
        let depth = texture("picture depth", DEPTH, SAMPLES, attached);
        let copied = TextureUsages::COPY_SRC | TextureUsages::COPY_DST;
        let shown = attached | TextureUsages::TEXTURE_BINDING | copied;
        let resolved = texture("picture", COLOUR, 1, shown);
        Self { size, samples: view(&samples), depth: view(&depth), resolved_view: view(&resolved), resolved }
    }
}
