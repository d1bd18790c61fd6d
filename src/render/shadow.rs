//! The shadow of the key light: a depth map seen from the light, compared by the passes that are lit.

use super::targets::DEPTH;
use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec3};
use palpate_geometry::drawing::Detail;
use wgpu::{Device, Sampler, TextureView};

/// Texels along each side: 0.3 mm in a scene 300 mm across, and twice that where speed matters more.
const FULL: u32 = 1024;
const FAST: u32 = 512;

#[derive(Debug)]
pub(crate) struct ShadowMap {
    pub(crate) view: TextureView,
    pub(crate) sampler: Sampler,
}

impl ShadowMap {
    /// The map for pictures of this detail.
    pub(crate) fn new(device: &Device, detail: Detail) -> Self {
        let side = match detail {
            Detail::Full => FULL,
            Detail::Fast => FAST,
        };
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow map"),
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow comparison"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        Self { view: texture.create_view(&wgpu::TextureViewDescriptor::default()), sampler }
    }
}

/// From world coordinates to the light's clip coordinates, so that a ball of `radius` about `centre` fits.
pub(crate) fn light_from_world(towards_light: Vec3, centre: Vec3, radius: f32) -> Mat4 {
    let eye = centre + towards_light * (2.0 * radius);
    let view = view::look_at_mat4(eye, centre, Vec3::Y);
    directx::orthographic(-radius, radius, -radius, radius, 0.0, 4.0 * radius) * view
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ball_fills_the_map() {
        let centre = Vec3::new(0.1, -0.2, 0.3);
        let light = Vec3::new(0.3, -0.5, 0.8).normalize();
        let matrix = light_from_world(light, centre, 0.15);
        for k in 0..50 {
            let direction = Vec3::new((k as f32).sin(), (k as f32 * 1.7).cos(), (k as f32 * 0.3).sin()).normalize();
            let clip = matrix.project_point3(centre + direction * 0.15);
            assert!(clip.x.abs() <= 1.0 && clip.y.abs() <= 1.0 && (0.0..=1.0).contains(&clip.z), "{clip}");
        }
    }
}
