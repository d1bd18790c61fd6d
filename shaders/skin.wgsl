// A soft finger: a skin over a chain of frames, pushed in where its taxels are, coloured by their pressure.
// Mirrored by `SkinUniform` in passes/skin.rs.

const RINGS: u32 = 128u;

struct Ring {
    // xyz on the neutral axis, w arc length
    position: vec4<f32>,
    along: vec4<f32>,
    inward: vec4<f32>,
}

struct Skin {
    rings: array<Ring, RINGS>,
    // linear colours: bellows, pad
    bellows: vec4<f32>,
    pad: vec4<f32>,
    // rows, columns, pressure of the brightest colour, finger length
    taxels: vec4<f32>,
    // translucent stretch: shares of the length where it begins and ends, clearness
    veil: vec4<f32>,
    // flex strips: share of the length where each begins and ends, twice
    strips: vec4<f32>,
    strip_colours: array<vec4<f32>, 2>,
    // number of pads, width of the finger (m), half the width of a strip as a share of it
    sensors: vec4<f32>,
    // colours of the pads' outlines near the palm and near the tip
    pad_colours: array<vec4<f32>, 2>,
    // the pressure map, linear colours
    map: array<vec4<f32>, 17>,
}

@group(1) @binding(0) var<uniform> skin: Skin;
// For each taxel: pressure, and how far it is pushed in.
@group(1) @binding(1) var taxels: texture_2d<f32>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    // place on the pad: across and along, 0 to 1; z 1 on the pad, 0 on the bellows
    @location(2) place: vec3<f32>,
}

fn taxel(x: i32, y: i32) -> vec2<f32> {
    let last = vec2<i32>(skin.taxels.yx) - 1;
    return textureLoad(taxels, clamp(vec2<i32>(x, y), vec2<i32>(0), last), 0).xy;
}

// Pressure and indentation at a place on the pad: each taxel's own value at its middle, blended in between.
fn load_at(place: vec2<f32>) -> vec2<f32> {
    let at = place * skin.taxels.yx - 0.5;
    let cell = vec2<i32>(floor(at));
    let t = smoothstep(vec2<f32>(0.0), vec2<f32>(1.0), at - floor(at));
    let near = mix(taxel(cell.x, cell.y), taxel(cell.x + 1, cell.y), t.x);
    let far = mix(taxel(cell.x, cell.y + 1), taxel(cell.x + 1, cell.y + 1), t.x);
    return mix(near, far, t.y);
}

// Share of full scale at a place; none off the pad.
fn share_at(place: vec3<f32>) -> f32 {
    return select(0.0, load_at(place.xy).x / skin.taxels.z, place.z > 0.5);
}

// How much of a place is data: below 2 % of full scale it is the silicone's own.
fn data_weight(share: f32) -> f32 {
    return smoothstep(0.015, 0.06, share);
}

fn place_vertex(ring: f32, offset: vec2<f32>, place: vec3<f32>, indentation: f32) -> vec3<f32> {
    let r = skin.rings[u32(ring)];
    let across = cross(r.inward.xyz, r.along.xyz);
    var height = offset.y;
    if (place.z > 0.0 && height > 0.0) {
        // Never deeper than the pad, and full at the face only.
        height -= min(indentation, 0.8 * height) * place.z;
    }
    return r.position.xyz + across * offset.x + r.inward.xyz * height;
}

@vertex
fn vertex(
    @location(0) ring: f32,
    @location(1) offset: vec2<f32>,
    @location(2) normal: vec3<f32>,
    @location(3) place: vec3<f32>,
) -> Corner {
    let r = skin.rings[u32(ring)];
    let across = cross(r.inward.xyz, r.along.xyz);
    let load = load_at(place.xy);
    let world = place_vertex(ring, offset, place, load.y);
    let turned = across * normal.x + r.inward.xyz * normal.y + r.along.xyz * normal.z;
    // Behind a veil, the loaded face of the pad is seen in front of what presses into it.
    let loaded = data_weight(load.x / skin.taxels.z) * step(0.5, place.z);
    let ahead = 0.004 * skin.veil.z * step(0.002, offset.y) * loaded;
    let seen = world + towards_eye(world) * ahead;
    return Corner(frame.clip_from_world * vec4<f32>(seen, 1.0), world, turned, place);
}

@vertex
fn vertex_shadow(
    @location(0) ring: f32,
    @location(1) offset: vec2<f32>,
    @location(2) normal: vec3<f32>,
    @location(3) place: vec3<f32>,
) -> @builtin(position) vec4<f32> {
    return frame.light_from_world * vec4<f32>(place_vertex(ring, offset, place, load_at(place.xy).y), 1.0);
}

fn mapped(share: f32) -> vec3<f32> {
    let at = clamp(share, 0.0, 1.0) * 16.0;
    let low = min(u32(at), 15u);
    return mix(skin.map[low].rgb, skin.map[low + 1u].rgb, at - f32(low));
}

// How clear the skin is along the finger, but for its data.
fn clearness(along: f32) -> f32 {
    let begins = smoothstep(skin.veil.x - 0.06, skin.veil.x, along);
    return begins * (1.0 - smoothstep(skin.veil.y, skin.veil.y + 0.06, along)) * skin.veil.z;
}

// Silicone: light goes around and a little way into it. `drawn` is a sensor on it, with its opacity.
fn silicone(corner: Corner, outward: vec3<f32>, own: vec3<f32>, drawn: vec4<f32>) -> vec3<f32> {
    let base = mix(own, drawn.rgb, drawn.a);
    return shade(Surface(base, outward, 0.35, 0.14, 24.0, 0.35), corner.world, corner.clip.xy);
}

fn within(x: f32, low: f32, high: f32, edge: f32) -> f32 {
    return smoothstep(low - edge, low + edge, x) * (1.0 - smoothstep(high - edge, high + edge, x));
}

// The flex strip along the back, with its opacity; `edge` is the size of a pixel.
fn strip(place: vec2<f32>, edge: vec2<f32>) -> vec4<f32> {
    let lies = within(abs(place.x - 0.5), -1.0, skin.sensors.z, edge.x);
    let first = within(place.y, skin.strips.x, skin.strips.y, edge.y);
    let second = within(place.y, skin.strips.z, skin.strips.w, edge.y);
    let colour = mix(skin.strip_colours[0].rgb, skin.strip_colours[1].rgb, second);
    return vec4<f32>(colour, 0.92 * lies * max(first, second));
}

// The outline of each pad, half a millimetre wide, just within the edge of the face.
fn outline(place: vec2<f32>, edge: vec2<f32>) -> vec4<f32> {
    let count = skin.sensors.x;
    let aside = abs(place.x - 0.5);
    let line = vec2<f32>(0.0005 / skin.sensors.y, 0.0005 / skin.taxels.w);
    let beside = within(aside, 0.445 - line.x, 0.445 + line.x, edge.x);
    let along = fract(place.y * count) / max(count, 1.0);
    let to_end = min(along, 1.0 / max(count, 1.0) - along);
    let across = (1.0 - smoothstep(line.y, line.y + 2.0 * edge.y, to_end)) * step(aside, 0.445);
    let colour = mix(skin.pad_colours[0].rgb, skin.pad_colours[1].rgb, step(0.5, place.y) * step(1.5, count));
    return vec4<f32>(colour, 0.9 * max(beside, across) * step(0.5, count));
}

fn pixel_of(place: vec2<f32>) -> vec2<f32> {
    return max(fwidth(place), vec2<f32>(1e-4));
}

// How opaque clear silicone is where it turns away from the eye.
fn rim_of(corner: Corner, outward: vec3<f32>) -> f32 {
    let edge = 1.0 - abs(dot(outward, towards_eye(corner.world)));
    return 0.12 + 0.45 * edge * edge;
}

// The bellows, where they are not clear.
@fragment
fn fragment_bellows(corner: Corner) -> @location(0) vec4<f32> {
    let edge = pixel_of(corner.place.xy);
    if (clearness(corner.place.y) > 0.0) {
        discard;
    }
    let drawn = strip(corner.place.xy, edge);
    return vec4<f32>(silicone(corner, normalize(corner.normal), skin.bellows.rgb, drawn), 1.0);
}

// The clear part of the bellows, with a visible edge and a trace of the strip.
@fragment
fn fragment_bellows_veil(corner: Corner) -> @location(0) vec4<f32> {
    let edge = pixel_of(corner.place.xy);
    let clear = clearness(corner.place.y);
    if (clear <= 0.0) {
        discard;
    }
    let drawn = strip(corner.place.xy, edge);
    let outward = normalize(corner.normal);
    let opacity = max(rim_of(corner, outward), 0.25 * drawn.a);
    return vec4<f32>(silicone(corner, outward, skin.bellows.rgb, drawn), mix(1.0, opacity, clear));
}

// The pad: data keeps its colour, at most 15 % of it is shading.
fn pad(corner: Corner, outward: vec3<f32>, drawn: vec4<f32>, share: f32) -> vec3<f32> {
    let shading = 0.88 + 0.12 * max(dot(outward, frame.key.xyz), 0.0);
    return mix(silicone(corner, outward, skin.pad.rgb, drawn), mapped(share) * shading, data_weight(share));
}

// The pad, where it is loaded or not clear.
@fragment
fn fragment_pad(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let edge = pixel_of(corner.place.xy);
    let share = share_at(corner.place);
    let clear = clearness(corner.place.y) * (1.0 - data_weight(share));
    if (clear > 0.0) {
        discard;
    }
    let outward = normalize(select(-corner.normal, corner.normal, front));
    return vec4<f32>(pad(corner, outward, outline(corner.place.xy, edge), share), 1.0);
}

// The clear part of the pad: its outline stays.
@fragment
fn fragment_pad_veil(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let edge = pixel_of(corner.place.xy);
    let share = share_at(corner.place);
    let clear = clearness(corner.place.y) * (1.0 - data_weight(share));
    if (clear <= 0.0) {
        discard;
    }
    let outward = normalize(select(-corner.normal, corner.normal, front));
    let drawn = outline(corner.place.xy, edge);
    let opacity = max(rim_of(corner, outward), drawn.a);
    // Its inside comes to be seen as the silicone clears.
    return vec4<f32>(pad(corner, outward, drawn, share), mix(select(0.0, 1.0, front), opacity, clear));
}

@fragment
fn fragment_distance(corner: Corner) -> @location(0) vec4<f32> {
    if (clearness(corner.place.y) > 0.0) {
        discard;
    }
    return distance_colour(corner.world);
}
