//! Draws a finished picture into a render pass of the caller.

use super::screen::screen_pipeline;
use super::shaders;
use wgpu::{BindGroup, BindGroupLayout, Device, RenderPass, RenderPipeline, Sampler, TextureFormat, TextureView};

/// Copies a picture into a window of one format.
#[derive(Debug)]
pub struct Blit {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
    sampler: Sampler,
    source: Option<(TextureView, BindGroup)>,
}

impl Blit {
    /// For windows whose surface has `format`.
    pub fn new(device: &Device, format: TextureFormat) -> Self {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("blit"),
            entries: &[
                wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D2,
                        multisampled: false,
                    },
                    count: None,
                },
                wgpu::BindGroupLayoutEntry {
                    binding: 1,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                    count: None,
                },
            ],
        });
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("blit"),
            source: wgpu::ShaderSource::Wgsl(shaders::BLIT.into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("blit"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let entry = if format.is_srgb() { "fragment_srgb" } else { "fragment" };
        let pipeline = screen_pipeline(device, &pipeline_layout, &shader, entry, format);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("blit"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self { pipeline, layout, sampler, source: None }
    }

    /// Chooses the picture that [`Blit::draw`] copies.
    pub fn set_source(&mut self, device: &Device, picture: &TextureView) {
        if self.source.as_ref().is_some_and(|(known, _)| known == picture) {
            return;
        }
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("blit"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(picture) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.sampler) },
            ],
        });
        self.source = Some((picture.clone(), group));
    }

    /// Fills the pass's viewport with the picture.
    pub fn draw(&self, pass: &mut RenderPass<'_>) {
        if let Some((_, group)) = &self.source {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
