//! Uniforms shared by all passes: camera, light and shadow.

use super::shadow::{ShadowMap, light_from_world};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use palpate_geometry::drawing::DrawList;
use wgpu::{BindGroup, BindGroupLayout, Buffer, Device, Queue};

/// Mirrors `Frame` in shaders/common/frame.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct FrameUniform {
    clip_from_world: [f32; 16],
    light_from_world: [f32; 16],
    eye: [f32; 4],
    key: [f32; 4],
    back: [f32; 4],
    sky_light: [f32; 4],
    ground_light: [f32; 4],
    key_light: [f32; 4],
    backdrop_top: [f32; 4],
    backdrop_bottom: [f32; 4],
    viewport: [f32; 4],
}

/// The uniform on the device, and the two ways in which passes see it: with the shadow map when they are lit by it,
/// without while it is being drawn.
#[derive(Debug)]
pub(crate) struct FrameBindings {
    buffer: Buffer,
    pub(crate) lit_layout: BindGroupLayout,
    pub(crate) lit: BindGroup,
    pub(crate) shadow_layout: BindGroupLayout,
    pub(crate) shadow: BindGroup,
}

impl FrameBindings {
    pub(crate) fn new(device: &Device, map: &ShadowMap) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<FrameUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty,
            count: None,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let depth = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let lit_layout = layout("frame, lit", &[entry(0, uniform), entry(1, depth), entry(2, comparison)]);
        let shadow_layout = layout("frame, shadow", &[entry(0, uniform)]);
        let bound = wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() };
        let lit = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame, lit"),
            layout: &lit_layout,
            entries: &[
                bound.clone(),
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&map.view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&map.sampler) },
            ],
        });
        let shadow = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame, shadow"),
            layout: &shadow_layout,
            entries: &[bound],
        });
        Self { buffer, lit_layout, lit, shadow_layout, shadow }
    }

    pub(crate) fn write(&self, queue: &Queue, list: &DrawList, size: [u32; 2]) {
        queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&FrameUniform::new(list, size)));
    }
}

/// Direction of the key light: from the front left, well above.
const TOWARDS_LIGHT: Vec3 = Vec3::new(-0.45, -0.60, 1.10);
/// Darkness of shadows, 0 to 1.
const SHADOW_STRENGTH: f32 = 0.92;

impl FrameUniform {
    fn new(list: &DrawList, [width, height]: [u32; 2]) -> Self {
        let (width, height) = (width as f32, height as f32);
        let camera = &list.camera;
        let towards_light = TOWARDS_LIGHT.normalize();
        let (centre, radius) = list.shadow_bounds;
        let [top, bottom] = list.backdrop.map(|colour| Vec3::from(colour.to_linear()).extend(1.0));
        let flag = if camera.parallel { 1.0 } else { 0.0 };
        let light = |strength: Vec3| strength.extend(0.0).to_array();
        Self {
            clip_from_world: camera.clip_from_world(width / height).to_cols_array(),
            light_from_world: light_from_world(towards_light, centre, radius).to_cols_array(),
            eye: camera.eye().extend(flag).to_array(),
            key: towards_light.extend(SHADOW_STRENGTH).to_array(),
            back: camera.axes()[2].extend(0.0).to_array(),
            sky_light: light(Vec3::new(0.46, 0.48, 0.52)),
            ground_light: light(Vec3::new(0.20, 0.19, 0.18)),
            key_light: light(Vec3::new(0.66, 0.64, 0.60)),
            backdrop_top: top.to_array(),
            backdrop_bottom: bottom.to_array(),
            viewport: Vec4::new(width, height, 1.0 / width, 1.0 / height).to_array(),
        }
    }
}
