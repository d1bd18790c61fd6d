//! Building pipelines with the settings that all passes share.

use super::PassSetup;
use crate::ambient::DISTANCE;
use crate::targets::{COLOUR, DEPTH, SAMPLES};
use wgpu::{BindGroupLayout, Buffer, BufferUsages, Device, Queue, RenderPipeline, ShaderModule, VertexBufferLayout};

/// Depth test of a pipeline.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Depth {
    /// Drawn in front of earlier items; depth is written.
    Solid,
    /// Drawn in front of earlier items; depth is not written.
    Veil,
    /// Drawn only where hidden by earlier items, faintly.
    Hidden,
    /// Regardless of depth.
    OnTop,
}

/// A pipeline that draws into the picture.
pub(super) struct PictureShape<'a> {
    pub(super) label: &'a str,
    pub(super) shader: &'a ShaderModule,
    pub(super) vertex: &'a str,
    pub(super) fragment: &'a str,
    pub(super) buffers: &'a [Option<VertexBufferLayout<'a>>],
    pub(super) groups: &'a [&'a BindGroupLayout],
    pub(super) topology: wgpu::PrimitiveTopology,
    pub(super) depth: Depth,
    pub(super) blends: bool,
    /// Faces that are left out.
    pub(super) culled: Option<wgpu::Face>,
}

pub(super) fn module(device: &Device, label: &str, source: &str) -> ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

pub(super) fn picture_pipeline(setup: &PassSetup<'_>, shape: &PictureShape<'_>) -> RenderPipeline {
    let groups: Vec<Option<&BindGroupLayout>> =
        std::iter::once(&setup.frame.lit_layout).chain(shape.groups.iter().copied()).map(Some).collect();
    let layout = setup.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(shape.label),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let (write, compare) = match shape.depth {
        Depth::Solid => (true, wgpu::CompareFunction::Less),
        Depth::Veil => (false, wgpu::CompareFunction::Less),
        Depth::Hidden => (false, wgpu::CompareFunction::GreaterEqual),
        Depth::OnTop => (false, wgpu::CompareFunction::Always),
    };
    setup.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shape.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shape.shader,
            entry_point: Some(shape.vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: shape.buffers,
        },
        primitive: wgpu::PrimitiveState { topology: shape.topology, cull_mode: shape.culled, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: shape.shader,
            entry_point: Some(shape.fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOUR,
                blend: shape.blends.then_some(wgpu::BlendState::ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Pipeline that draws into another texture than the picture.
pub(super) struct UnlitShape<'a> {
    pub(super) label: &'a str,
    pub(super) shader: &'a ShaderModule,
    pub(super) buffers: &'a [Option<VertexBufferLayout<'a>>],
    pub(super) groups: &'a [&'a BindGroupLayout],
    pub(super) topology: wgpu::PrimitiveTopology,
}

/// A pipeline that draws depth alone, seen from the light; its vertex entry is `vertex_shadow`.
pub(super) fn shadow_pipeline(setup: &PassSetup<'_>, shape: &UnlitShape<'_>) -> RenderPipeline {
    unlit_pipeline(setup, shape, "vertex_shadow", None)
}

/// A pipeline that draws the distance from the eye; its fragment entry is `fragment_distance`.
pub(super) fn distance_pipeline(setup: &PassSetup<'_>, shape: &UnlitShape<'_>) -> RenderPipeline {
    let fragment = wgpu::FragmentState {
        module: shape.shader,
        entry_point: Some("fragment_distance"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        targets: &[Some(DISTANCE.into())],
    };
    unlit_pipeline(setup, shape, "vertex", Some(fragment))
}

fn unlit_pipeline(
    setup: &PassSetup<'_>,
    shape: &UnlitShape<'_>,
    vertex: &str,
    fragment: Option<wgpu::FragmentState<'_>>,
) -> RenderPipeline {
    let groups: Vec<Option<&BindGroupLayout>> =
        std::iter::once(&setup.frame.unlit_layout).chain(shape.groups.iter().copied()).map(Some).collect();
    let layout = setup.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(shape.label),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    setup.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shape.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shape.shader,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: shape.buffers,
        },
        primitive: wgpu::PrimitiveState { topology: shape.topology, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment,
        multiview_mask: None,
        cache: None,
    })
}

/// Bind group of one uniform whose contents do not change.
pub(super) fn fixed_uniform(
    setup: &PassSetup<'_>,
    label: &str,
    layout: &BindGroupLayout,
    bytes: &[u8],
) -> wgpu::BindGroup {
    let buffer = fixed_buffer(setup.device, setup.queue, label, BufferUsages::UNIFORM, bytes);
    setup.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    })
}

/// A layout of one uniform for both stages.
pub(super) fn uniform_layout(device: &Device, label: &str) -> BindGroupLayout {
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &[uniform_entry(0)] })
}

pub(super) fn uniform_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

/// A texture whose texels are read one by one, unfiltered.
pub(super) fn texel_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

/// A buffer with contents that do not change.
pub(super) fn fixed_buffer(device: &Device, queue: &Queue, label: &str, usage: BufferUsages, bytes: &[u8]) -> Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: padded(bytes.len()),
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    write_padded(queue, &buffer, bytes);
    buffer
}

/// A buffer that is written anew for every picture and grows when it must.
#[derive(Debug)]
pub(super) struct StreamBuffer {
    label: &'static str,
    usage: BufferUsages,
    buffer: Option<Buffer>,
}

impl StreamBuffer {
    pub(super) fn new(label: &'static str, usage: BufferUsages) -> Self {
        Self { label, usage, buffer: None }
    }

    pub(super) fn write(&mut self, device: &Device, queue: &Queue, bytes: &[u8]) {
        let wanted = padded(bytes.len());
        if self.buffer.as_ref().is_none_or(|b| b.size() < wanted) {
            self.buffer = Some(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(self.label),
                size: wanted.next_power_of_two(),
                usage: self.usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
        if let Some(buffer) = &self.buffer {
            write_padded(queue, buffer, bytes);
        }
    }

    pub(super) fn get(&self) -> Option<&Buffer> {
        self.buffer.as_ref()
    }
}

/// Copies have whole words and buffers are never empty.
fn padded(len: usize) -> u64 {
    (len.max(4)).next_multiple_of(4) as u64
}

fn write_padded(queue: &Queue, buffer: &Buffer, bytes: &[u8]) {
    let whole = bytes.len() / 4 * 4;
    queue.write_buffer(buffer, 0, &bytes[..whole]);
    if whole < bytes.len() {
        let mut last = [0; 4];
        last[..bytes.len() - whole].copy_from_slice(&bytes[whole..]);
        queue.write_buffer(buffer, whole as u64, &last);
    }
}
