//! Rigid things, and ghosts of things, which are translucent and cast no shadow. A mesh is uploaded once and kept as
//! long as pictures keep showing it.

use super::build::{Depth, PictureShape, StreamBuffer, fixed_buffer, module, picture_pipeline, shadow_pipeline};
use super::{Pass, PassSetup, Prepare};
use bytemuck::{Pod, Zeroable};
use palpate_geometry::drawing::{DrawList, Solid};
use palpate_geometry::{SurfaceMesh, SurfaceVertex};
use std::sync::Arc;
use wgpu::{Buffer, BufferUsages, RenderPass, RenderPipeline, VertexBufferLayout, VertexStepMode};

/// Mirrors `Instance` in shaders/solid.wgsl: the columns of the matrix, the gloss in the last w.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Instance {
    columns: [[f32; 4]; 4],
}

struct Uploaded {
    mesh: Arc<SurfaceMesh>,
    vertices: Buffer,
    indices: Buffer,
    count: u32,
}

struct SolidPass {
    pipeline: RenderPipeline,
    /// Absent for ghosts.
    shadow: Option<RenderPipeline>,
    /// Part of the draw list that is drawn.
    of: fn(&DrawList) -> &[Solid],
    meshes: Vec<Uploaded>,
    instances: StreamBuffer,
    /// For each solid of the picture, which mesh it shows.
    shown: Vec<usize>,
}

const ATTRIBUTES: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4];
const INSTANCE_ATTRIBUTES: [wgpu::VertexAttribute; 4] =
    wgpu::vertex_attr_array![3 => Float32x4, 4 => Float32x4, 5 => Float32x4, 6 => Float32x4];

pub(super) fn make(setup: &PassSetup<'_>) -> Box<dyn Pass> {
    make_kind(setup, false)
}

/// Drawn after everything solid, so that it shows through them.
pub(super) fn make_ghosts(setup: &PassSetup<'_>) -> Box<dyn Pass> {
    make_kind(setup, true)
}

fn make_kind(setup: &PassSetup<'_>, ghosts: bool) -> Box<dyn Pass> {
    let shader = module(setup.device, "solid", crate::shaders::SOLID);
    let buffers = [
        Some(VertexBufferLayout {
            array_stride: size_of::<SurfaceVertex>() as u64,
            step_mode: VertexStepMode::Vertex,
            attributes: &ATTRIBUTES,
        }),
        Some(VertexBufferLayout {
            array_stride: size_of::<Instance>() as u64,
            step_mode: VertexStepMode::Instance,
            attributes: &INSTANCE_ATTRIBUTES,
        }),
    ];
    let pipeline = picture_pipeline(
        setup,
        &PictureShape {
            label: if ghosts { "ghost" } else { "solid" },
            shader: &shader,
            fragment: if ghosts { "fragment_ghost" } else { "fragment" },
            buffers: &buffers,
            groups: &[],
            topology: wgpu::PrimitiveTopology::TriangleList,
            depth: if ghosts { Depth::Veil } else { Depth::Solid },
            blends: ghosts,
        },
    );
    Box::new(SolidPass {
        pipeline,
        shadow: (!ghosts).then(|| shadow_pipeline(setup, "solid shadow", &shader, &buffers, &[])),
        of: if ghosts { |list| &list.ghosts } else { |list| &list.solids },
        meshes: Vec::new(),
        instances: StreamBuffer::new("solid instances", BufferUsages::VERTEX),
        shown: Vec::new(),
    })
}

impl SolidPass {
    fn index_of(&mut self, prepare: &Prepare<'_>, solid: &Solid) -> usize {
        if let Some(known) = self.meshes.iter().position(|m| Arc::ptr_eq(&m.mesh, &solid.mesh)) {
            return known;
        }
        let (device, queue) = (prepare.device, prepare.queue);
        let vertices = bytemuck::cast_slice(&solid.mesh.vertices);
        let indices = bytemuck::cast_slice(&solid.mesh.indices);
        self.meshes.push(Uploaded {
            mesh: Arc::clone(&solid.mesh),
            vertices: fixed_buffer(device, queue, "mesh", BufferUsages::VERTEX, vertices),
            indices: fixed_buffer(device, queue, "mesh indices", BufferUsages::INDEX, indices),
            count: solid.mesh.indices.len() as u32,
        });
        self.meshes.len() - 1
    }

    fn draw_all(&self, pass: &mut RenderPass<'_>) {
        let Some(instances) = self.instances.get() else { return };
        for (k, mesh) in self.shown.iter().enumerate() {
            let mesh = &self.meshes[*mesh];
            // WebGL2 has no first instance, so each solid's instance is bound by itself.
            let at = (k * size_of::<Instance>()) as u64;
            pass.set_vertex_buffer(0, mesh.vertices.slice(..));
            pass.set_vertex_buffer(1, instances.slice(at..at + size_of::<Instance>() as u64));
            pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..mesh.count, 0, 0..1);
        }
    }
}

impl Pass for SolidPass {
    fn prepare(&mut self, prepare: &Prepare<'_>) {
        let solids = (self.of)(prepare.list);
        self.meshes.retain(|m| solids.iter().any(|solid| Arc::ptr_eq(&m.mesh, &solid.mesh)));
        self.shown = solids.iter().map(|solid| self.index_of(prepare, solid)).collect();
        let instances: Vec<Instance> = solids
            .iter()
            .map(|solid| {
                let mut columns = solid.world_from_mesh.to_cols_array_2d();
                columns[3][3] = solid.gloss;
                Instance { columns }
            })
            .collect();
        self.instances.write(prepare.device, prepare.queue, bytemuck::cast_slice(&instances));
    }

    fn draw_shadow(&self, pass: &mut RenderPass<'_>) {
        if let Some(shadow) = &self.shadow {
            pass.set_pipeline(shadow);
            self.draw_all(pass);
        }
    }

    fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        self.draw_all(pass);
    }
}
