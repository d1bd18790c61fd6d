//! Rigid things, and ghosts of things, which are translucent and cast no shadow. A mesh is uploaded once and kept as
//! long as pictures keep showing it.

use super::build::{
    Depth, PictureShape, StreamBuffer, UnlitShape, distance_pipeline, fixed_buffer, fixed_uniform, module,
    picture_pipeline, shadow_pipeline, uniform_layout,
};
use super::{Pass, PassSetup, Prepare};
use bytemuck::{Pod, Zeroable};
use palpate_geometry::drawing::{DrawList, Solid};
use palpate_geometry::palette::Rgb;
use palpate_geometry::{Finish, SurfaceMesh, SurfaceVertex};
use std::sync::Arc;
use wgpu::{BindGroup, Buffer, BufferUsages, RenderPass, RenderPipeline, VertexBufferLayout, VertexStepMode};

/// Mirrors `Finish` in shaders/solid.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct FinishUniform {
    /// Grains per metre along each axis of the mesh, and how far they change the colour.
    grain: [f32; 4],
    /// How far grains tilt the surface, wrap, sheen, mirror.
    relief: [f32; 4],
    /// Gloss and power of the highlight.
    highlight: [f32; 4],
}

/// Shading of each finish; tuned by eye on the built-in objects.
fn finish(finish: Finish) -> FinishUniform {
    let (grain, relief, [gloss, power]) = match finish {
        Finish::Plastic => ([0.0; 4], [0.0, 0.0, 0.0, 0.0], [0.34, 90.0]),
        Finish::Matt => ([0.0; 4], [0.0, 0.2, 0.0, 0.0], [0.0, 1.0]),
        Finish::Rubber => ([900.0, 900.0, 900.0, 0.03], [0.03, 0.2, 0.3, 0.0], [0.16, 12.0]),
        // Brushed along y, the long side of the built-in objects.
        Finish::Metal => ([2600.0, 40.0, 2600.0, 0.03], [0.025, 0.0, 0.0, 0.85], [0.5, 50.0]),
        Finish::Felt => ([1500.0, 1500.0, 1500.0, 0.20], [0.22, 0.4, 1.6, 0.0], [0.0, 1.0]),
        Finish::Peel => ([620.0, 620.0, 620.0, 0.04], [0.12, 0.15, 0.0, 0.0], [0.42, 28.0]),
        Finish::Cardboard => ([260.0, 2600.0, 260.0, 0.11], [0.04, 0.1, 0.1, 0.0], [0.0, 1.0]),
        Finish::Wood => ([900.0, 45.0, 900.0, 0.16], [0.04, 0.1, 0.0, 0.0], [0.08, 20.0]),
    };
    FinishUniform { grain, relief, highlight: [gloss, power, 0.0, 0.0] }
}

/// Mirrors `Instance` in shaders/solid.wgsl: the columns of the matrix, and the tint in the w of three of them.
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
    /// Shadow and distance; absent for ghosts.
    unlit: Option<[RenderPipeline; 2]>,
    finishes: BindGroup,
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
    let layout = uniform_layout(setup.device, "finishes");
    let finishes = Finish::ALL.map(finish);
    let (groups, topology) = (&[&layout][..], wgpu::PrimitiveTopology::TriangleList);
    let pipeline = picture_pipeline(
        setup,
        &PictureShape {
            label: if ghosts { "ghost" } else { "solid" },
            shader: &shader,
            vertex: if ghosts { "vertex_ghost" } else { "vertex" },
            fragment: if ghosts { "fragment_ghost" } else { "fragment" },
            buffers: &buffers,
            groups,
            topology,
            depth: if ghosts { Depth::Veil } else { Depth::Solid },
            blends: ghosts,
            culled: None,
        },
    );
    let unlit = UnlitShape { label: "solid, unlit", shader: &shader, buffers: &buffers, groups, topology };
    Box::new(SolidPass {
        pipeline,
        unlit: (!ghosts).then(|| [shadow_pipeline(setup, &unlit), distance_pipeline(setup, &unlit)]),
        finishes: fixed_uniform(setup, "finishes", &layout, bytemuck::cast_slice(&finishes)),
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

    fn draw_by(&self, pipeline: &RenderPipeline, pass: &mut RenderPass<'_>) {
        let Some(instances) = self.instances.get() else { return };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &self.finishes, &[]);
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

fn instance_of(solid: &Solid) -> Instance {
    let mut columns = solid.world_from_mesh.to_cols_array_2d();
    let tint = solid.tint.map_or([-1.0; 3], Rgb::to_linear);
    columns.iter_mut().zip(tint).for_each(|(column, channel)| column[3] = channel);
    Instance { columns }
}

impl Pass for SolidPass {
    fn prepare(&mut self, prepare: &Prepare<'_>) {
        let solids = (self.of)(prepare.list);
        self.meshes.retain(|m| solids.iter().any(|solid| Arc::ptr_eq(&m.mesh, &solid.mesh)));
        self.shown = solids.iter().map(|solid| self.index_of(prepare, solid)).collect();
        let instances: Vec<Instance> = solids.iter().map(instance_of).collect();
        self.instances.write(prepare.device, prepare.queue, bytemuck::cast_slice(&instances));
    }

    fn draw_shadow(&self, pass: &mut RenderPass<'_>) {
        if let Some([shadow, _]) = &self.unlit {
            self.draw_by(shadow, pass);
        }
    }

    fn draw_distance(&self, pass: &mut RenderPass<'_>) {
        if let Some([_, distance]) = &self.unlit {
            self.draw_by(distance, pass);
        }
    }

    fn draw(&self, pass: &mut RenderPass<'_>) {
        self.draw_by(&self.pipeline, pass);
    }
}
