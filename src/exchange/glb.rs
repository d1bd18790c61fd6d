//! A grasp as an animated 3-D model for viewers, Blender and slides: a binary file of glTF 2.0 (ISO/IEC 12113).
//!
//! Metres; glTF has y up, so a root node turns the world, whose z is up. A finger is a skin over joints: one at the palm, one in
//! the middle of each segment, one at the tip, each placed in the world. Pressure is colour at the corners of the skin, and how
//! far the pad is pushed in its shape, both as morph targets between which the animation blends. Viewers that know no colours in
//! morph targets show the pressure of the most loaded instant throughout.

use glam::{Mat4, Quat, Vec3};
use palpate_geometry::drawing::{FingerFrame, SoftFinger, TaxelField};
use palpate_geometry::palette::{Rgb, SILICONE, load_colour};
use palpate_lab::picture::{Stage, skin_mesh};
use palpate_sim::frame::Frame;
use serde_json::{Value, json};

/// Most shapes of a pad between which the animation blends: players keep all of them in memory.
const MOST_SHAPES: usize = 32;
/// A corner of the skin is on the face of the pad if its normal leans this far inward; those of the sides do not at all.
const FACE: f32 = 0.5;
/// A pad is never drawn flatter than by this share of its height, as in `shaders/skin.wgsl`.
const DEEPEST: f32 = 0.8;

/// Bytes of a model of these frames, each with its time in the animation (s). `full_scale` has the brightest colour (Pa);
/// `about` is kept with it. None without frames.
pub fn glb(stage: &Stage, frames: &[(f32, &Frame)], full_scale: f32, about: &str) -> Option<Vec<u8>> {
    let first = frames.first()?.1;
    let mut model = Model::default();
    let times: Vec<[f32; 1]> = frames.iter().map(|(t, _)| [*t]).collect();
    let times = model.floats(&times, true);
    let mut children = Vec::new();
    for (place, (name, solid)) in stage.solids(first).into_iter().enumerate() {
        let corners = solid.mesh.vertices.iter();
        let attributes = json!({
            "POSITION": model.floats(&corners.clone().map(|c| c.position).collect::<Vec<_>>(), true),
            "NORMAL": model.floats(&corners.clone().map(|c| c.normal).collect::<Vec<_>>(), false),
            "COLOR_0": model.floats(&corners.map(|c| linear(c.colour)).collect::<Vec<_>>(), false),
        });
        let mesh = model.mesh(name, &attributes, &solid.mesh.indices, &[]);
        let placed = frames.iter().filter_map(|(_, frame)| Some(stage.solids(frame).get(place)?.1.world_from_mesh));
        let node = model.moving(name, &placed.collect::<Vec<_>>(), times);
        model.nodes[node]["mesh"] = json!(mesh);
        children.push(node);
    }
    let hands: Vec<Vec<SoftFinger>> = frames.iter().map(|(_, frame)| stage.fingers(frame, full_scale)).collect();
    let mut scene = Vec::new();
    for (side, name) in ["left", "right"].into_iter().enumerate() {
        let finger: Vec<&SoftFinger> = hands.iter().filter_map(|hand| hand.get(side)).collect();
        scene.push(model.finger(name, &finger, frames, times, &mut children)?);
    }
    let turn = y_up().to_array();
    scene.push(model.node(json!({ "name": "world", "rotation": turn, "children": children })));
    Some(model.file(&scene, &json!({ "about": about, "full_scale_pa": full_scale })))
}

/// From z up to y up.
fn y_up() -> Quat {
    Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2)
}

/// Colours of files are sRGB, those of glTF's corners linear.
fn linear([r, g, b, _]: [u8; 4]) -> [f32; 3] {
    Rgb(r, g, b).to_linear()
}

/// World from a place on the axis of a finger, whose coordinates are across, inward, along.
fn world_from(place: &FingerFrame) -> Mat4 {
    let across = place.inward.cross(place.along);
    Mat4::from_cols(across.extend(0.0), place.inward.extend(0.0), place.along.extend(0.0), place.position.extend(1.0))
}

/// Pressure (Pa) and indentation (m) at shares of width and length: each taxel's own in its middle, blended as in
/// `shaders/skin.wgsl`.
fn load_at(taxels: &TaxelField, across: f32, along: f32) -> [f32; 2] {
    let (columns, rows) = (taxels.columns as usize, taxels.rows as usize);
    let cell = |share: f32, count: usize| {
        let at = share * count as f32 - 0.5;
        let (low, part) = (at.floor(), at - at.floor());
        let index = |k: f32| k.clamp(0.0, count.saturating_sub(1) as f32) as usize;
        (index(low), index(low + 1.0), part * part * (3.0 - 2.0 * part))
    };
    let ((x0, x1, u), (y0, y1, v)) = (cell(across, columns), cell(along, rows));
    let taxel = |x: usize, y: usize| taxels.loads.get(y * columns + x).copied().unwrap_or_default();
    [0, 1].map(|part| {
        let between = |y: usize| taxel(x0, y)[part] + u * (taxel(x1, y)[part] - taxel(x0, y)[part]);
        between(y0) + v * (between(y1) - between(y0))
    })
}

/// The two joints that move a corner of the skin at an arc length, and their weights. Smooth, so that the skin has the joints'
/// own directions where they are.
fn joints_at(arcs: &[f32], arc: f32) -> ([u8; 4], [f32; 4]) {
    let after = arcs.partition_point(|own| *own <= arc).clamp(1, arcs.len() - 1);
    let u = ((arc - arcs[after - 1]) / (arcs[after] - arcs[after - 1])).clamp(0.0, 1.0);
    let weight = u * u * (3.0 - 2.0 * u);
    // A joint without weight has number 0.
    let [before, next] = [(after - 1, 1.0 - weight), (after, weight)].map(|(k, w)| if w > 0.0 { k as u8 } else { 0 });
    ([before, next, 0, 0], [1.0 - weight, weight, 0.0, 0.0])
}

/// A file of glTF as it grows.
#[derive(Default)]
struct Model {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    skins: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

/// Adds an item and returns its number.
fn add(list: &mut Vec<Value>, item: Value) -> usize {
    list.push(item);
    list.len() - 1
}

/// Numbers of glTF: component types, and what a part of the buffer is for.
const FLOAT: u32 = 5126;
const BYTE: u32 = 5121;
const INDEX: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const INDEX_BUFFER: u32 = 34963;

impl Model {
    fn accessor(&mut self, bytes: &[u8], item: Value, target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend(bytes);
        let mut accessor = item;
        accessor["bufferView"] = json!(add(&mut self.views, view));
        add(&mut self.accessors, accessor)
    }

    /// Rows of numbers; `bounds` states the least and the greatest, as glTF wants it for positions and times.
    fn numbers<const N: usize>(&mut self, rows: &[[f32; N]], bounds: bool, target: Option<u32>) -> usize {
        let kind = match N {
            1 => "SCALAR",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        let mut item = json!({ "componentType": FLOAT, "count": rows.len(), "type": kind });
        if bounds {
            let end = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..N).map(|k| rows.iter().map(|row| row[k]).reduce(pick).unwrap_or(0.0)).collect()
            };
            item["min"] = json!(end(f32::min));
            item["max"] = json!(end(f32::max));
        }
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(&bytes, item, target)
    }

    fn floats<const N: usize>(&mut self, rows: &[[f32; N]], bounds: bool) -> usize {
        // Times and what follows them are no attributes of corners.
        self.numbers(rows, bounds, (N != 1).then_some(ARRAY_BUFFER))
    }

    fn node(&mut self, node: Value) -> usize {
        add(&mut self.nodes, node)
    }

    fn mesh(&mut self, name: &str, attributes: &Value, indices: &[u32], targets: &[Value]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let item = json!({ "componentType": INDEX, "count": indices.len(), "type": "SCALAR" });
        let indices = self.accessor(&bytes, item, Some(INDEX_BUFFER));
        let mut primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
        let mut mesh = json!({ "name": name });
        if !targets.is_empty() {
            primitive["targets"] = json!(targets);
            // The first target is the first frame, as the poses of nodes are. F3D 4.0 (VTK) crashes without weights.
            let weights = (0..targets.len()).map(|target| f32::from(u8::from(target == 0)));
            mesh["weights"] = weights.collect();
        }
        mesh["primitives"] = json!([primitive]);
        add(&mut self.meshes, mesh)
    }

    /// Moves a part of a node: `path` of glTF.
    fn channel(&mut self, node: usize, path: &str, times: usize, output: usize) {
        let sampler = add(&mut self.samplers, json!({ "input": times, "output": output, "interpolation": "LINEAR" }));
        self.channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }

    /// A node with a pose for each time; one that does not move is not animated.
    fn moving(&mut self, name: &str, poses: &[Mat4], times: usize) -> usize {
        let parts: Vec<(Quat, Vec3)> =
            poses.iter().map(|pose| pose.to_scale_rotation_translation()).map(|p| (p.1, p.2)).collect();
        let (rotation, position) = parts.first().copied().unwrap_or((Quat::IDENTITY, Vec3::ZERO));
        let node = json!({ "name": name, "rotation": rotation.to_array(), "translation": position.to_array() });
        let node = self.node(node);
        if poses.windows(2).any(|pair| pair[0] != pair[1]) {
            let mut rotations: Vec<Quat> = parts.iter().map(|part| part.0.normalize()).collect();
            // A rotation has two signs; players blend the short way only if neighbours have the same.
            for k in 1..rotations.len() {
                if rotations[k].dot(rotations[k - 1]) < 0.0 {
                    rotations[k] = -rotations[k];
                }
            }
            let rotations: Vec<[f32; 4]> = rotations.iter().map(|rotation| rotation.to_array()).collect();
            let positions: Vec<[f32; 3]> = parts.iter().map(|part| part.1.to_array()).collect();
            let outputs = [
                ("rotation", self.numbers(&rotations, false, None)),
                ("translation", self.numbers(&positions, false, None)),
            ];
            outputs.into_iter().for_each(|(path, output)| self.channel(node, path, times, output));
        }
        node
    }

    /// A finger: its joints, below the world's node, and its skin. `shown` is the finger in each frame.
    fn finger(
        &mut self,
        name: &str,
        shown: &[&SoftFinger],
        frames: &[(f32, &Frame)],
        times: usize,
        children: &mut Vec<usize>,
    ) -> Option<usize> {
        let first = *shown.first()?;
        let palm = first.frames.first()?;
        let arcs: Vec<f32> = first.frames.iter().map(|place| place.arc - palm.arc).collect();
        let length = arcs.last().copied().filter(|length| *length > 0.0)?;
        // The skin as it is bound: straight from the palm of the first frame, y up.
        let bound = Mat4::from_quat(y_up()) * world_from(palm);
        let mut joints = Vec::new();
        for k in 0..arcs.len() {
            let poses: Vec<Mat4> = shown.iter().filter_map(|finger| finger.frames.get(k).map(world_from)).collect();
            joints.push(self.moving(&format!("{name} {}", joint_name(k, arcs.len())), &poses, times));
        }
        let inverse: Vec<[f32; 16]> =
            arcs.iter().map(|arc| (bound * Mat4::from_translation(Vec3::Z * *arc)).inverse().to_cols_array()).collect();
        let inverse = self.numbers(&inverse, false, None);
        let skin = add(&mut self.skins, json!({ "name": name, "joints": joints, "inverseBindMatrices": inverse }));
        children.extend(joints);

        let straight = |arc: &f32| FingerFrame { arc: *arc, position: Vec3::Z * *arc, along: Vec3::Z, inward: Vec3::Y };
        let surface = skin_mesh(&SoftFinger { frames: arcs.iter().map(straight).collect(), ..first.clone() }, SILICONE);
        let corners: Vec<(Vec3, Vec3)> =
            surface.vertices.iter().map(|corner| (corner.position.into(), corner.normal.into())).collect();
        let weights: Vec<([u8; 4], [f32; 4])> = corners.iter().map(|(at, _)| joints_at(&arcs, at.z)).collect();
        let joint_bytes: Vec<u8> = weights.iter().flat_map(|(joints, _)| *joints).collect();
        let joint_item = json!({ "componentType": BYTE, "count": corners.len(), "type": "VEC4" });

        // Shapes and colours of the pad, evenly over the animation.
        let count = shown.len().min(MOST_SHAPES);
        let chosen: Vec<usize> = (0..count).map(|k| k * (shown.len() - 1) / (count - 1).max(1)).collect();
        let look = |finger: &SoftFinger| -> Vec<([f32; 3], [f32; 3])> {
            let of = |(at, normal): &(Vec3, Vec3)| {
                let load = load_at(&finger.taxels, at.x / finger.section.width + 0.5, at.z / length);
                let colour = if normal.y > FACE { load_colour(load[0] / finger.full_scale) } else { SILICONE };
                let depth = if at.y > 0.0 { load[1].min(DEEPEST * at.y) } else { 0.0 };
                (bound.transform_vector3(Vec3::NEG_Y * depth).to_array(), colour.to_linear())
            };
            corners.iter().map(of).collect()
        };
        let total = |k: &usize| shown[*k].taxels.loads.iter().map(|load| load[0]).sum::<f32>();
        let fullest = chosen.iter().copied().max_by(|a, b| total(a).total_cmp(&total(b)))?;
        let base = look(shown[fullest]);
        let mut targets = Vec::new();
        for k in &chosen {
            let own = look(shown[*k]);
            let moved: Vec<[f32; 3]> = own.iter().map(|(moved, _)| *moved).collect();
            let tint = own.iter().zip(&base).map(|((_, own), (_, base))| [0, 1, 2].map(|c| own[c] - base[c]));
            let tint: Vec<[f32; 3]> = tint.collect();
            targets.push(json!({ "POSITION": self.floats(&moved, true), "COLOR_0": self.floats(&tint, false) }));
        }
        let attributes = json!({
            "POSITION": self.floats(&corners.iter().map(|(at, _)| bound.transform_point3(*at).to_array()).collect::<Vec<_>>(), true),
            "NORMAL": self.floats(&corners.iter().map(|(_, n)| bound.transform_vector3(*n).to_array()).collect::<Vec<_>>(), false),
            "COLOR_0": self.floats(&base.iter().map(|(_, colour)| *colour).collect::<Vec<_>>(), false),
            "JOINTS_0": self.accessor(&joint_bytes, joint_item, Some(ARRAY_BUFFER)),
            "WEIGHTS_0": self.floats(&weights.iter().map(|(_, weights)| *weights).collect::<Vec<_>>(), false),
        });
        let mesh = self.mesh(name, &attributes, &surface.indices, &targets);
        let node = self.node(json!({ "name": format!("{name} finger"), "mesh": mesh, "skin": skin }));
        let key_times: Vec<[f32; 1]> = chosen.iter().map(|k| [frames[*k].0]).collect();
        let unit = |row: usize| (0..count).map(move |column| [if row == column { 1.0 } else { 0.0 }]);
        let unit: Vec<[f32; 1]> = (0..count).flat_map(unit).collect();
        let (key_times, unit) = (self.floats(&key_times, true), self.floats(&unit, false));
        self.channel(node, "weights", key_times, unit);
        Some(node)
    }

    /// The whole file: header, JSON, buffer.
    fn file(mut self, scene: &[usize], extras: &Value) -> Vec<u8> {
        let material = json!({
            "name": "matt",
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.6 },
        });
        let document = json!({
            "asset": { "version": "2.0", "generator": format!("Palpate {}", env!("CARGO_PKG_VERSION")), "extras": extras },
            "scene": 0,
            "scenes": [{ "nodes": scene }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "skins": self.skins,
            "materials": [material],
            "animations": [{ "name": "grasp", "samplers": self.samplers, "channels": self.channels }],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes.len() }],
        });
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut file = b"glTF".to_vec();
        let whole = 12 + 8 + text.len() + 8 + self.bytes.len();
        let words = |numbers: &[usize]| numbers.iter().flat_map(|n| (*n as u32).to_le_bytes()).collect::<Vec<u8>>();
        file.extend(words(&[2, whole, text.len()]));
        file.extend(b"JSON");
        file.extend(text);
        file.extend(words(&[self.bytes.len()]));
        file.extend(b"BIN\0");
        file.extend(self.bytes);
        file
    }
}

/// Name of a joint: `palm`, `segment 2` to the last but one, `tip`.
fn joint_name(k: usize, count: usize) -> String {
    match k {
        0 => "palm".to_owned(),
        _ if k + 1 == count => "tip".to_owned(),
        _ => format!("segment {}", k + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_follows_the_joints_beside_it() {
        let arcs = [0.0, 0.01, 0.02];
        assert_eq!(joints_at(&arcs, 0.0), ([0, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]));
        assert_eq!(joints_at(&arcs, 0.02), ([0, 2, 0, 0], [0.0, 1.0, 0.0, 0.0]));
        let (joints, weights) = joints_at(&arcs, 0.015);
        assert_eq!(joints, [1, 2, 0, 0]);
        assert!((weights[0] - 0.5).abs() < 1e-6 && (weights[1] - 0.5).abs() < 1e-6);
    }

    #[test]
    fn a_taxel_has_its_own_load_in_its_middle_and_half_of_it_half_way_to_the_next() {
        let mut taxels = TaxelField { rows: 3, columns: 2, loads: vec![[0.0; 2]; 6] };
        taxels.loads[2] = [8.0, 0.5];
        assert_eq!(load_at(&taxels, 0.25, 0.5), [8.0, 0.5]);
        assert_eq!(load_at(&taxels, 0.5, 0.5), [4.0, 0.25]);
        assert_eq!(load_at(&taxels, 0.0, 0.5), [8.0, 0.5]);
        assert_eq!(load_at(&taxels, 0.25, 5.0 / 6.0), [0.0, 0.0]);
    }
}
