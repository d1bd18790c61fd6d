//! Pipelines that cover a whole target with one triangle, whose vertex entry is `vertex`.

use wgpu::{Device, PipelineLayout, RenderPipeline, ShaderModule, TextureFormat};

/// A pipeline that draws into a target of this format by a fragment entry of the shader.
pub(crate) fn screen_pipeline(
    device: &Device,
    layout: &PipelineLayout,
    shader: &ShaderModule,
    entry: &str,
    format: TextureFormat,
) -> RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(entry),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
