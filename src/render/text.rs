//! Text for overlays: glyphs of one font, drawn once into an atlas by ab_glyph and copied from there.

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont};
use glam::Vec2;
use palpate_geometry::drawing::Align;
use std::collections::HashMap;
use wgpu::{Device, Queue, Texture, TextureView};

/// Side of the atlas (texels): several hundred glyphs at the sizes that overlays use.
const SIDE: u32 = 512;
/// Free texels between glyphs.
const GAP: u32 = 1;

/// A glyph to be copied from the atlas to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlacedGlyph {
    /// Top left corner in the picture (pixels).
    pub(crate) at: Vec2,
    /// Its size (pixels).
    pub(crate) size: Vec2,
    /// Top left corner in the atlas (texels).
    pub(crate) texel: Vec2,
}

/// A glyph in the atlas.
#[derive(Clone, Copy, Debug)]
struct Stored {
    texel: Vec2,
    size: Vec2,
    /// From the pen on the baseline to its top left corner.
    bearing: Vec2,
}

#[derive(Debug)]
pub(crate) struct Glyphs {
    /// The font of the window, and that of the characters that it lacks.
    fonts: [FontRef<'static>; 2],
    texture: Texture,
    view: TextureView,
    texels: Vec<u8>,
    stored: HashMap<(usize, GlyphId, u32), Option<Stored>>,
    /// Position of the next glyph: x, y, and the height of the row.
    free: [u32; 3],
    changed: bool,
}

impl Glyphs {
    pub(crate) fn new(device: &Device) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("glyphs"),
            size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let fonts = [epaint_default_fonts::UBUNTU_LIGHT, epaint_default_fonts::HACK_REGULAR].map(|bytes| {
            FontRef::try_from_slice(bytes).expect("the font is compiled into the program and its crate tests it")
        });
        Self {
            fonts,
            texture,
            view,
            texels: vec![0; (SIDE * SIDE) as usize],
            stored: HashMap::new(),
            free: [0; 3],
            changed: true,
        }
    }

    pub(crate) fn atlas_view(&self) -> &TextureView {
        &self.view
    }

    /// Places a line of text `size` pixels high, centred vertically on `at`.
    pub(crate) fn lay_out(&mut self, at: Vec2, align: Align, size: f32, text: &str) -> Vec<PlacedGlyph> {
        let fonts = self.fonts.clone();
        let glyph = |c: char| {
            let font = usize::from(fonts[0].glyph_id(c) == GlyphId(0));
            let scaled = fonts[font].as_scaled(PxScale::from(size));
            (font, scaled.glyph_id(c), scaled.h_advance(scaled.glyph_id(c)))
        };
        let glyphs: Vec<(usize, GlyphId, f32)> = text.chars().map(glyph).collect();
        let width: f32 = glyphs.iter().map(|(.., advance)| advance).sum();
        let start = match align {
            Align::Left => at.x,
            Align::Centre => at.x - 0.5 * width,
            Align::Right => at.x - width,
        };
        let baseline = at.y + 0.36 * size; // capitals of this font are 0.72 of its height
        let mut pen = start;
        let mut placed = Vec::new();
        for (font, id, advance) in glyphs {
            if let Some(glyph) = self.stored((font, id), size) {
                // Whole pixels keep stems sharp.
                let corner = (Vec2::new(pen, baseline) + glyph.bearing).round();
                placed.push(PlacedGlyph { at: corner, size: glyph.size, texel: glyph.texel });
            }
            pen += advance;
        }
        placed
    }

    fn stored(&mut self, (font, id): (usize, GlyphId), size: f32) -> Option<Stored> {
        let key = (font, id, (size * 8.0).round() as u32);
        if let Some(known) = self.stored.get(&key) {
            return *known;
        }
        let glyph = id.with_scale(PxScale::from(size));
        let made = self.fonts[font].outline_glyph(glyph).and_then(|outline| self.store(&outline));
        self.stored.insert(key, made);
        made
    }

    fn store(&mut self, outline: &ab_glyph::OutlinedGlyph) -> Option<Stored> {
        let bounds = outline.px_bounds();
        let (width, height) = (bounds.width().ceil() as u32, bounds.height().ceil() as u32);
        if self.free[0] + width + GAP > SIDE {
            self.free = [0, self.free[1] + self.free[2] + GAP, 0];
        }
        let [x, y, row] = self.free;
        if width > SIDE || y + height > SIDE {
            // Full: what does not fit is not drawn, rather than drawn wrongly.
            return None;
        }
        outline.draw(|dx, dy, coverage| {
            let at = ((y + dy) * SIDE + x + dx) as usize;
            if let Some(texel) = self.texels.get_mut(at) {
                *texel = (coverage.clamp(0.0, 1.0) * 255.0).round() as u8;
            }
        });
        self.free = [x + width + GAP, y, row.max(height)];
        self.changed = true;
        Some(Stored {
            texel: Vec2::new(x as f32, y as f32),
            size: Vec2::new(width as f32, height as f32),
            bearing: Vec2::new(bounds.min.x, bounds.min.y),
        })
    }

    /// Copies new glyphs to the device.
    pub(crate) fn upload(&mut self, queue: &Queue) {
        if self.changed {
            upload_texels(queue, &self.texture, [SIDE, SIDE], 1, &self.texels);
            self.changed = false;
        }
    }
}

/// Replaces all texels of a texture.
pub(crate) fn upload_texels(queue: &Queue, texture: &Texture, size: [u32; 2], bytes_per_texel: u32, bytes: &[u8]) {
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d::ZERO,
            aspect: wgpu::TextureAspect::All,
        },
        bytes,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size[0] * bytes_per_texel),
            rows_per_image: Some(size[1]),
        },
        wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
    );
}
