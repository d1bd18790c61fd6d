//! Uniforms shared by all passes: camera, light and shadow.

use super::shadow::{ShadowMap, light_from_world};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use palpate_geometry::drawing::{Detail, DrawList};
use wgpu::{BindGroup, BindGroupLayout, Buffer, Device, Queue, Sampler, TextureView};

/// Mirrors `Frame` in shaders/common/frame.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct FrameUniform {
    clip_from_world: [f32; 16],
    light_from_world: [f32; 16],
    eye: [f32; 4],
    key: [f32; 4],
    back: [f32; 4],
    lens: [f32; 4],
    rim: [f32; 4],
    middle: [f32; 4],
    sky_light: [f32; 4],
    ground_light: [f32; 4],
    key_light: [f32; 4],
    backdrop_top: [f32; 4],
    backdrop_bottom: [f32; 4],
    viewport: [f32; 4],
}

/// The uniform on the device, and the two ways in which passes see it: with shadow and openness when they are lit, alone
/// while these are being drawn.
#[derive(Debug)]
pub(crate) struct FrameBindings {
    buffer: Buffer,
    smooth: Sampler,
    pub(crate) lit_layout: BindGroupLayout,
    pub(crate) unlit_layout: BindGroupLayout,
    pub(crate) unlit: BindGroup,
}

impl FrameBindings {
    pub(crate) fn new(device: &Device) -> Self {
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
        let openness = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let [comparison, filtering] =
            [wgpu::SamplerBindingType::Comparison, wgpu::SamplerBindingType::Filtering].map(wgpu::BindingType::Sampler);
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let lit_layout = layout(
            "frame, lit",
            &[entry(0, uniform), entry(1, depth), entry(2, comparison), entry(3, openness), entry(4, filtering)],
        );
        let unlit_layout = layout("frame, unlit", &[entry(0, uniform)]);
        let unlit = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame, unlit"),
            layout: &unlit_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        let smooth = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("openness"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self { buffer, smooth, lit_layout, unlit_layout, unlit }
    }

    /// The frame as lit passes see it, with the openness of a picture.
    pub(crate) fn lit(&self, device: &Device, map: &ShadowMap, openness: &TextureView) -> BindGroup {
        let resources = [
            self.buffer.as_entire_binding(),
            wgpu::BindingResource::TextureView(&map.view),
            wgpu::BindingResource::Sampler(&map.sampler),
            wgpu::BindingResource::TextureView(openness),
            wgpu::BindingResource::Sampler(&self.smooth),
        ];
        let entries: Vec<wgpu::BindGroupEntry<'_>> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame, lit"),
            layout: &self.lit_layout,
            entries: &entries,
        })
    }

    pub(crate) fn write(&self, queue: &Queue, list: &DrawList, size: [u32; 2]) {
        queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&FrameUniform::new(list, size)));
    }
}

/// Direction of the key light: from the front left, well above.
const TOWARDS_LIGHT: Vec3 = Vec3::new(-0.45, -0.60, 1.10);
/// Darkness of shadows, 0 to 1.
const SHADOW_STRENGTH: f32 = 0.92;
/// Places that make a shadow soft.
const SHADOW_TAPS: f32 = 13.0;
const FAST_SHADOW_TAPS: f32 = 4.0;
/// Direction of the rim light: to the right, up and back towards the eye, as the camera sees it; and its strength.
const TOWARDS_RIM: Vec3 = Vec3::new(0.55, 0.60, -0.58);
const RIM_STRENGTH: f32 = 0.55;

impl FrameUniform {
    fn new(list: &DrawList, [width, height]: [u32; 2]) -> Self {
        let (width, height) = (width as f32, height as f32);
        let camera = &list.camera;
        let towards_light = TOWARDS_LIGHT.normalize();
        let (centre, radius) = list.shadow_bounds;
        let [top, bottom] = list.backdrop.map(|colour| Vec3::from(colour.to_linear()).extend(1.0));
        let flag = if camera.parallel { 1.0 } else { 0.0 };
        let [right, up, back] = camera.axes();
        let towards_rim = (right * TOWARDS_RIM.x + up * TOWARDS_RIM.y + back * TOWARDS_RIM.z).normalize();
        let half_height =
            if camera.parallel { 0.5 * camera.height_at_target() } else { (0.5 * camera.angle_of_view).tan() };
        let taps = match list.detail {
            Detail::Full => SHADOW_TAPS,
            Detail::Fast => FAST_SHADOW_TAPS,
        };
        let light = |strength: Vec3| strength.extend(0.0).to_array();
        Self {
            clip_from_world: camera.clip_from_world(width / height).to_cols_array(),
            light_from_world: light_from_world(towards_light, centre, radius).to_cols_array(),
            eye: camera.eye().extend(flag).to_array(),
            key: towards_light.extend(SHADOW_STRENGTH).to_array(),
            back: back.extend(0.0).to_array(),
            lens: [half_height * width / height, half_height, taps, 0.0],
            rim: towards_rim.extend(RIM_STRENGTH).to_array(),
            middle: camera.target.extend(0.0).to_array(),
            sky_light: light(Vec3::new(0.40, 0.43, 0.49)),
            ground_light: light(Vec3::new(0.19, 0.17, 0.16)),
            key_light: light(Vec3::new(0.72, 0.69, 0.63)),
            backdrop_top: top.to_array(),
            backdrop_bottom: bottom.to_array(),
            viewport: Vec4::new(width, height, 1.0 / width, 1.0 / height).to_array(),
        }
    }
}
