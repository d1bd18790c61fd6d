//! Soft fingers as smooth skins: one mesh in the finger's own coordinates, bent by the vertex shader over 128 rings.

use super::build::{
    Depth, PictureShape, UnlitShape, distance_pipeline, fixed_buffer, module, picture_pipeline, shadow_pipeline,
    texel_entry, uniform_entry,
};
use super::{Pass, PassSetup, Prepare};
use crate::text::upload_texels;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use palpate_geometry::drawing::{Detail, FingerFrame, Section, SensorStrip, SoftFinger};
use palpate_geometry::palette::{PRESSURE_MAP, Rgb, SILICONE};
use std::ops::Range;
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferUsages, Device, Queue, RenderPass, RenderPipeline};
use wgpu::{Texture, VertexBufferLayout, VertexStepMode};

/// As in shaders/skin.wgsl.
const RINGS: usize = 128;
/// Rings from each one that is drawn to the next, in full and in fast detail.
const STRIDES: [usize; 2] = [1, 2];
/// Rings that round off the tip.
const TIP_RINGS: usize = 6;
/// Length over which the tip is rounded (m).
const TIP_ROUNDING: f32 = 0.0022;
/// Bellows along the finger.
const RIBS: f32 = 10.0;
/// The silicone of the bellows.
const BELLOWS: Rgb = Rgb(214, 216, 214);
/// Width of a flex strip (m): that of Spectra Symbol's, 6.4 mm.
const STRIP_WIDTH: f32 = 0.0064;

/// Mirrors `Ring` in the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Ring {
    position: [f32; 4],
    along: [f32; 4],
    inward: [f32; 4],
}

/// Mirrors `Skin` in the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SkinUniform {
    rings: [Ring; RINGS],
    bellows: [f32; 4],
    pad: [f32; 4],
    taxels: [f32; 4],
    veil: [f32; 4],
    strips: [f32; 4],
    strip_colours: [[f32; 4]; 2],
    sensors: [f32; 4],
    pad_colours: [[f32; 4]; 2],
    map: [[f32; 4]; 17],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Vertex {
    ring: f32,
    /// Across, inward (m).
    offset: [f32; 2],
    /// Across, inward, along.
    normal: [f32; 3],
    /// Share of the width, share of the length, 1 on the pad.
    place: [f32; 3],
}

const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
    wgpu::vertex_attr_array![0 => Float32, 1 => Float32x2, 2 => Float32x3, 3 => Float32x3];

/// The mesh of one cross-section and length; fingers that are alike share it.
struct SkinMesh {
    section: Section,
    length: f32,
    vertices: Buffer,
    indices: Buffer,
    /// For full and for fast detail.
    parts: [SkinParts; 2],
}

/// Bellows and pad, whose indices follow each other.
#[derive(Clone, Debug)]
struct SkinParts {
    bellows: SkinPart,
    pad: SkinPart,
}

/// Some indices of a skin: first those between each ring and one `stride` after it, from the palm on.
#[derive(Clone, Debug, PartialEq)]
struct SkinPart {
    indices: Range<u32>,
    per_stride: u32,
    stride: u32,
}

impl SkinPart {
    /// Indices between two rings.
    fn between(&self, rings: &Range<u32>) -> Range<u32> {
        let at = |strides: u32| (self.indices.start + strides * self.per_stride).min(self.indices.end);
        at(rings.start / self.stride)..at(rings.end.div_ceil(self.stride))
    }
}

/// Buffers of one finger.
struct FingerOnDevice {
    uniform: Buffer,
    texels: Texture,
    size: [u32; 2],
    group: BindGroup,
    /// Rings of its translucent part.
    veiled: Range<u32>,
}

struct SkinPass {
    opaque: Pipelines,
    veil: Pipelines,
    shadow: RenderPipeline,
    distance: RenderPipeline,
    layout: BindGroupLayout,
    mesh: Option<SkinMesh>,
    fingers: Vec<FingerOnDevice>,
    shown: usize,
    detail: Detail,
}

/// Pipelines of both parts of a skin: bellows are seen from outside alone, a pad from both sides.
struct Pipelines {
    bellows: RenderPipeline,
    pad: RenderPipeline,
}

pub(super) fn make(setup: &PassSetup<'_>) -> Box<dyn Pass> {
    let layout = setup.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("skin"),
        entries: &[uniform_entry(0), texel_entry(1)],
    });
    let shader = module(setup.device, "skin", crate::shaders::SKIN);
    let buffers = [Some(VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: VertexStepMode::Vertex,
        attributes: &ATTRIBUTES,
    })];
    let pipeline = |label, fragment, depth, culled| {
        let (groups, topology) = (&[&layout][..], wgpu::PrimitiveTopology::TriangleList);
        let (shader, vertex, buffers, blends) = (&shader, "vertex", &buffers, depth == Depth::Veil);
        let shape = PictureShape { label, shader, vertex, fragment, buffers, groups, topology, depth, blends, culled };
        picture_pipeline(setup, &shape)
    };
    let outside = Some(wgpu::Face::Back);
    let opaque = Pipelines {
        bellows: pipeline("bellows", "fragment_bellows", Depth::Solid, outside),
        pad: pipeline("pad", "fragment_pad", Depth::Solid, None),
    };
    let veil = Pipelines {
        bellows: pipeline("bellows veil", "fragment_bellows_veil", Depth::Veil, outside),
        pad: pipeline("pad veil", "fragment_pad_veil", Depth::Veil, None),
    };
    let topology = wgpu::PrimitiveTopology::TriangleList;
    let unlit = UnlitShape { label: "skin, unlit", shader: &shader, buffers: &buffers, groups: &[&layout], topology };
    let (shadow, distance) = (shadow_pipeline(setup, &unlit), distance_pipeline(setup, &unlit));
    let (fingers, detail) = (Vec::new(), Detail::Full);
    Box::new(SkinPass { opaque, veil, shadow, distance, layout, mesh: None, fingers, shown: 0, detail })
}

impl SkinPass {
    /// Draws a part of each finger: some of its indices.
    fn draw_part(&self, pass: &mut RenderPass<'_>, part: impl Fn(&FingerOnDevice, &SkinParts) -> Range<u32>) {
        let Some(mesh) = &self.mesh else { return };
        let parts = &mesh.parts[usize::from(self.detail == Detail::Fast)];
        pass.set_vertex_buffer(0, mesh.vertices.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        for finger in &self.fingers[..self.shown] {
            let indices = part(finger, parts);
            if !indices.is_empty() {
                pass.set_bind_group(1, &finger.group, &[]);
                pass.draw_indexed(indices, 0, 0..1);
            }
        }
    }

    fn update_mesh(&mut self, prepare: &Prepare<'_>, finger: &SoftFinger) {
        let length = finger.frames.last().map_or(0.0, |f| f.arc);
        if self.mesh.as_ref().is_some_and(|m| m.section == finger.section && m.length == length) {
            return;
        }
        let (vertices, indices, parts) = skin_mesh(&finger.section, length);
        let (device, queue) = (prepare.device, prepare.queue);
        self.mesh = Some(SkinMesh {
            section: finger.section,
            length,
            vertices: fixed_buffer(device, queue, "skin", BufferUsages::VERTEX, bytemuck::cast_slice(&vertices)),
            indices: fixed_buffer(device, queue, "skin indices", BufferUsages::INDEX, bytemuck::cast_slice(&indices)),
            parts,
        });
    }
}

/// All indices of a skin: its parts follow each other.
fn whole(_finger: &FingerOnDevice, parts: &SkinParts) -> Range<u32> {
    parts.bellows.indices.start..parts.pad.indices.end
}

/// Share of the length over which a veil begins and ends; as in the shader.
const VEIL_EDGE: f32 = 0.06;

/// Rings between which a finger is translucent.
fn veiled_rings(finger: &SoftFinger) -> Range<u32> {
    let length = finger.frames.last().map_or(0.0, |frame| frame.arc);
    let [from, to] = finger.veil.stretch;
    let reach = from - VEIL_EDGE * length..=to + VEIL_EDGE * length;
    let within = |k: &usize| finger.veil.clearness > 0.0 && reach.contains(&ring_arc(*k, length));
    let mut rings = (0..RINGS).filter(within);
    match (rings.clone().next(), rings.next_back()) {
        (Some(first), Some(last)) => first.saturating_sub(1) as u32..(last + 1).min(RINGS - 1) as u32,
        _ => 0..0,
    }
}

impl Pass for SkinPass {
    fn prepare(&mut self, prepare: &Prepare<'_>) {
        let fingers: Vec<&SoftFinger> = prepare.list.fingers.iter().filter(|f| f.frames.len() >= 2).collect();
        self.shown = fingers.len();
        self.detail = prepare.list.detail;
        for (k, finger) in fingers.into_iter().enumerate() {
            self.update_mesh(prepare, finger);
            let size = [finger.taxels.columns.max(1), finger.taxels.rows.max(1)];
            if self.fingers.get(k).is_none_or(|known| known.size != size) {
                let made = FingerOnDevice::new(prepare.device, &self.layout, size);
                self.fingers.truncate(k);
                self.fingers.push(made);
            }
            self.fingers[k].write(prepare.queue, finger);
            self.fingers[k].veiled = veiled_rings(finger);
        }
    }

    fn draw_shadow(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.shadow);
        self.draw_part(pass, whole);
    }

    fn draw_distance(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.distance);
        self.draw_part(pass, whole);
    }

    fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.opaque.bellows);
        self.draw_part(pass, |_, parts| parts.bellows.indices.clone());
        pass.set_pipeline(&self.opaque.pad);
        self.draw_part(pass, |_, parts| parts.pad.indices.clone());
        // The pad lies behind the bellows that are looked through.
        pass.set_pipeline(&self.veil.pad);
        self.draw_part(pass, |finger, parts| parts.pad.between(&finger.veiled));
        pass.set_pipeline(&self.veil.bellows);
        self.draw_part(pass, |finger, parts| parts.bellows.between(&finger.veiled));
    }
}

impl FingerOnDevice {
    fn new(device: &Device, layout: &BindGroupLayout, size: [u32; 2]) -> Self {
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("skin"),
            size: size_of::<SkinUniform>() as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let texels = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("taxels"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rg32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texels.create_view(&wgpu::TextureViewDescriptor::default());
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("skin"),
            layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
            ],
        });
        Self { uniform, texels, size, group, veiled: 0..0 }
    }

    fn write(&self, queue: &Queue, finger: &SoftFinger) {
        let length = finger.frames.last().map_or(0.0, |f| f.arc);
        let rings = std::array::from_fn(|k| ring_at(&finger.frames, ring_arc(k, length)));
        let linear = |colour: Rgb| Vec3::from(colour.to_linear()).extend(1.0).to_array();
        // A strip without length is not seen.
        let absent = SensorStrip { stretch: [-length; 2], colour: BELLOWS };
        let strip = |k: usize| finger.sensors.strips.get(k).copied().unwrap_or(absent);
        let [[a, b], [c, d]] = [0, 1].map(|k| strip(k).stretch);
        let strips = [a, b, c, d].map(|arc| arc / length);
        let uniform = SkinUniform {
            rings,
            bellows: linear(BELLOWS),
            pad: linear(SILICONE),
            taxels: [self.size[1] as f32, self.size[0] as f32, finger.full_scale, length],
            veil: [finger.veil.stretch[0] / length, finger.veil.stretch[1] / length, finger.veil.clearness, 0.0],
            strips,
            strip_colours: [0, 1].map(|k| linear(strip(k).colour)),
            sensors: [finger.sensors.pads as f32, finger.section.width, 0.5 * STRIP_WIDTH / finger.section.width, 0.0],
            pad_colours: finger.sensors.pad_colours.map(linear),
            map: PRESSURE_MAP.map(linear),
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let mut loads = finger.taxels.loads.clone();
        loads.resize((self.size[0] * self.size[1]) as usize, [0.0; 2]);
        upload_texels(queue, &self.texels, self.size, 8, bytemuck::cast_slice(&loads));
    }
}

/// Arc length of a ring: even along the finger, denser over the rounding of the tip.
fn ring_arc(k: usize, length: f32) -> f32 {
    let straight = RINGS - TIP_RINGS;
    let body = length - TIP_ROUNDING;
    if k < straight {
        body * k as f32 / (straight - 1) as f32
    } else {
        let share = (k + 1 - straight) as f32 / TIP_RINGS as f32;
        body + TIP_ROUNDING * (share * std::f32::consts::FRAC_PI_2).sin()
    }
}

/// The neutral axis between two frames as a cubic that passes through both with their directions (Hermite).
fn ring_at(frames: &[FingerFrame], arc: f32) -> Ring {
    let upper = frames.iter().position(|f| f.arc >= arc).unwrap_or(frames.len() - 1).max(1);
    let (a, b) = (&frames[upper - 1], &frames[upper]);
    let span = (b.arc - a.arc).max(1e-9);
    let t = ((arc - a.arc) / span).clamp(0.0, 1.0);
    let (t2, t3) = (t * t, t * t * t);
    let position = a.position * (2.0 * t3 - 3.0 * t2 + 1.0)
        + a.along * ((t3 - 2.0 * t2 + t) * span)
        + b.position * (3.0 * t2 - 2.0 * t3)
        + b.along * ((t3 - t2) * span);
    let slope = (b.position - a.position) * ((6.0 * t - 6.0 * t2) / span)
        + a.along * (3.0 * t2 - 4.0 * t + 1.0)
        + b.along * (3.0 * t2 - 2.0 * t);
    let along = slope.normalize_or(a.along);
    let inward = a.inward.lerp(b.inward, t);
    let inward = (inward - along * inward.dot(along)).normalize_or(a.inward);
    Ring {
        position: position.extend(arc).to_array(),
        along: along.extend(0.0).to_array(),
        inward: inward.extend(0.0).to_array(),
    }
}

/// Profile of the bellows at an arc length, 0 in a fold to 1 on a rib.
fn rib(arc: f32, length: f32) -> f32 {
    let share = (arc / length) * RIBS;
    let to_fold = (share - share.round()).abs();
    let smooth = |x: f32| {
        let x = x.clamp(0.0, 1.0);
        x * x * (3.0 - 2.0 * x)
    };
    // No folds at the very ends.
    let inside = smooth((arc / length - 0.03) / 0.02) * smooth((0.985 - arc / length) / 0.02);
    1.0 - inside * (1.0 - smooth(to_fold / 0.20))
}

/// One half of the cross-section from the middle of the pad round to the middle of the back: across, inward, and how
/// much of a point belongs to the pad.
fn half_section(section: &Section, arc: f32, length: f32) -> Vec<(Vec2, f32)> {
    let half = 0.5 * section.width;
    let rounding = 0.22 * section.pad;
    let face = |across: f32| section.pad - across * across / (2.0 * section.crown_radius);
    let mut points = Vec::new();
    const ON_FACE: usize = 7;
    for k in 0..ON_FACE {
        let across = (half - rounding) * k as f32 / (ON_FACE - 1) as f32;
        points.push((Vec2::new(across, face(across)), 1.0));
    }
    let shoulder = face(half - rounding) - rounding;
    for k in 1..=4 {
        let (sin, cos) = (std::f32::consts::FRAC_PI_2 * k as f32 / 4.0).sin_cos();
        points.push((Vec2::new(half - rounding + rounding * sin, shoulder + rounding * cos), 1.0));
    }
    let seam = 0.12 * section.pad;
    points.push((Vec2::new(half, seam), 1.0));
    points.push((Vec2::new(half, seam), 0.0));
    let out = rib(arc, length);
    let width = half * (0.90 + 0.09 * out);
    let depth = section.back * (0.66 + 0.34 * out);
    points.push((Vec2::new(width, seam), 0.0));
    const AROUND: usize = 11;
    for k in 1..=AROUND {
        // A squarish ellipse: straight sides, round back.
        let angle = std::f32::consts::FRAC_PI_2 * k as f32 / AROUND as f32;
        let (sin, cos) = angle.sin_cos();
        points.push((Vec2::new(width * cos.max(0.0).powf(0.55), -depth * sin.powf(0.75)), 0.0));
    }
    points
}

/// The whole cross-section, counter-clockwise seen from the tip, scaled where the tip is rounded.
fn section_points(section: &Section, k: usize, length: f32) -> Vec<(Vec2, f32)> {
    let arc = ring_arc(k, length);
    let half = half_section(section, arc, length);
    let into_tip = ((arc - (length - TIP_ROUNDING)) / TIP_ROUNDING).clamp(0.0, 1.0);
    let scale = 1.0 - 0.16 * (1.0 - (1.0 - into_tip * into_tip).max(0.0).sqrt());
    let middle = Vec2::new(0.0, 0.5 * (section.pad - section.back));
    let mirrored = half.iter().rev().skip(1).take(half.len() - 2).map(|(p, w)| (Vec2::new(-p.x, p.y), *w));
    half.iter().copied().chain(mirrored).map(|(p, w)| (middle + (p - middle) * scale, w)).collect()
}

/// The skin in the coordinates of its rings, with a flat end: corners, indices, and which of these are bellows and pad in
/// full and in fast detail.
fn skin_mesh(section: &Section, length: f32) -> (Vec<Vertex>, Vec<u32>, [SkinParts; 2]) {
    let rings: Vec<Vec<(Vec2, f32)>> = (0..RINGS).map(|k| section_points(section, k, length)).collect();
    let around = rings[0].len();
    let place = |k: usize, i: usize| {
        let (p, _) = rings[k][i % around];
        Vec3::new(p.x, p.y, ring_arc(k, length))
    };
    let mut vertices = Vec::new();
    for (k, ring) in rings.iter().enumerate() {
        for (i, (p, weight)) in ring.iter().enumerate() {
            let (before, after) = (neighbour(ring, i, -1), neighbour(ring, i, 1));
            let round = place(k, after) - place(k, before);
            let ahead = place((k + 1).min(RINGS - 1), i) - place(k.saturating_sub(1), i);
            let normal = ahead.cross(round).normalize_or(Vec3::new(p.x, p.y, 0.0).normalize_or(Vec3::Y));
            vertices.push(Vertex {
                ring: k as f32,
                offset: p.to_array(),
                normal: normal.to_array(),
                place: [0.5 + p.x / section.width, ring_arc(k, length) / length, *weight],
            });
        }
    }
    let at = |k: usize, i: usize| (k * around + i % around) as u32;
    let is_pad = |i: usize| rings[0][i % around].1 > 0.5 && rings[0][(i + 1) % around].1 > 0.5;
    let mut indices = Vec::new();
    let mut add = |wanted: bool, stride: usize| {
        let start = indices.len() as u32;
        let chosen: Vec<usize> = (0..around).filter(|i| is_pad(*i) == wanted).collect();
        for k in (0..RINGS - 1).step_by(stride) {
            let next = (k + stride).min(RINGS - 1);
            for i in chosen.iter().copied() {
                indices.extend([at(k, i), at(next, i + 1), at(k, i + 1), at(k, i), at(next, i), at(next, i + 1)]);
            }
        }
        if !wanted {
            close_tip(section, &rings[RINGS - 1], &mut vertices, &mut indices);
        }
        let indices = start..indices.len() as u32;
        SkinPart { indices, per_stride: 6 * chosen.len() as u32, stride: stride as u32 }
    };
    let parts = STRIDES.map(|stride| SkinParts { bellows: add(false, stride), pad: add(true, stride) });
    (vertices, indices, parts)
}

/// The nearest neighbour on a ring that lies elsewhere: the seam has two points at one place.
fn neighbour(ring: &[(Vec2, f32)], i: usize, step: isize) -> usize {
    let n = ring.len() as isize;
    let mut j = i as isize;
    for _ in 0..3 {
        j = (j + step).rem_euclid(n);
        if ring[j as usize].0.distance_squared(ring[i].0) > 1e-14 {
            break;
        }
    }
    j as usize
}

fn close_tip(section: &Section, last: &[(Vec2, f32)], vertices: &mut Vec<Vertex>, indices: &mut Vec<u32>) {
    let flat = |p: Vec2| Vertex {
        ring: (RINGS - 1) as f32,
        offset: p.to_array(),
        normal: [0.0, 0.0, 1.0],
        place: [0.5 + p.x / section.width, 1.0, 0.0],
    };
    let middle = vertices.len() as u32;
    vertices.push(flat(Vec2::new(0.0, 0.5 * (section.pad - section.back))));
    vertices.extend(last.iter().map(|(p, _)| flat(*p)));
    let n = last.len() as u32;
    for i in 0..n {
        indices.extend([middle, middle + 1 + (i + 1) % n, middle + 1 + i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECTION: Section = Section { width: 0.02, pad: 0.008, crown_radius: 0.02, back: 0.012 };

    #[test]
    fn the_skin_is_closed_round_and_faces_outward() {
        let (vertices, indices, parts) = skin_mesh(&SECTION, 0.1);
        let mut end = 0;
        for SkinParts { bellows, pad } in &parts {
            assert_eq!((bellows.indices.start, bellows.indices.end), (end, pad.indices.start));
            assert_eq!(pad.between(&(0..RINGS as u32 - 1)), pad.indices);
            end = pad.indices.end;
        }
        assert_eq!(end as usize, indices.len());
        assert!(
            parts[1].pad.indices.len() < parts[0].pad.indices.len() * 11 / 20,
            "fast detail has half the triangles"
        );
        assert!(indices.iter().all(|i| (*i as usize) < vertices.len()));
        for v in &vertices {
            let n = Vec3::from(v.normal);
            assert!((n.length() - 1.0).abs() < 1e-4, "{n}");
        }
        // The middle of the pad faces inward, the middle of the back away.
        let on_ring =
            |f: &dyn Fn(&Vertex) -> bool| vertices.iter().filter(move |v| v.ring == 60.0).find(|v| f(v)).copied();
        let pad = on_ring(&|v| v.place[2] == 1.0 && v.offset[0] == 0.0).expect("the middle of the pad");
        assert!(pad.normal[1] > 0.99 && (pad.offset[1] - SECTION.pad).abs() < 1e-6);
        let back = on_ring(&|v| v.offset[1] < -0.0075 && v.offset[0].abs() < 1e-6).expect("the middle of the back");
        assert!(back.normal[1] < -0.3, "{:?}", back.normal);
    }

    #[test]
    fn rings_follow_the_frames() {
        // A quarter circle of radius 60 mm from three frames.
        let frame = |angle: f32| FingerFrame {
            arc: 0.06 * angle,
            position: Vec3::new(0.06 * (1.0 - angle.cos()), 0.0, -0.06 * angle.sin()),
            along: Vec3::new(angle.sin(), 0.0, -angle.cos()),
            inward: Vec3::new(angle.cos(), 0.0, angle.sin()),
        };
        let frames: Vec<FingerFrame> = [0.0, 0.4, 0.8].map(frame).into();
        let centre = Vec3::new(0.06, 0.0, 0.0);
        for k in 0..RINGS {
            let ring = ring_at(&frames, ring_arc(k, frames[2].arc));
            let p = Vec3::new(ring.position[0], ring.position[1], ring.position[2]);
            assert!((p.distance(centre) - 0.06).abs() < 2e-5, "ring {k}: {p}");
            let (along, inward) = (ring.along, ring.inward);
            let dot: f32 = (0..3).map(|i| along[i] * inward[i]).sum();
            assert!(dot.abs() < 1e-5);
        }
    }
}
