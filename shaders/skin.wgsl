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

fn place_vertex(ring: f32, offset: vec2<f32>, place: vec3<f32>) -> vec3<f32> {
    let r = skin.rings[u32(ring)];
    let across = cross(r.inward.xyz, r.along.xyz);
    var height = offset.y;
    if (place.z > 0.0 && height > 0.0) {
        // Never deeper than the pad, and full at the face only.
        height -= min(load_at(place.xy).y, 0.8 * height) * place.z;
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
    let world = place_vertex(ring, offset, place);
    let turned = across * normal.x + r.inward.xyz * normal.y + r.along.xyz * normal.z;
    // Behind a veil, the face of the pad is seen in front of what presses into it.
    let ahead = 0.004 * skin.veil.z * place.z * smoothstep(0.002, 0.005, offset.y);
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
    return frame.light_from_world * vec4<f32>(place_vertex(ring, offset, place), 1.0);
}

fn mapped(share: f32) -> vec3<f32> {
    let at = clamp(share, 0.0, 1.0) * 16.0;
    let low = min(u32(at), 15u);
    return mix(skin.map[low].rgb, skin.map[low + 1u].rgb, at - f32(low));
}

// How clear the skin is at a place: all of it but the face of the pad.
fn clearness(place: vec3<f32>) -> f32 {
    if (place.z > 0.5 && abs(place.x - 0.5) < 0.44) {
        return 0.0;
    }
    let within = smoothstep(skin.veil.x - 0.06, skin.veil.x, place.y) * (1.0 - smoothstep(skin.veil.y, skin.veil.y + 0.06, place.y));
    return within * skin.veil.z;
}

// The translucent part: silicone with a clear middle and a visible edge.
@fragment
fn fragment_veil(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let clear = clearness(corner.place);
    if (clear <= 0.0 || !front) {
        discard;
    }
    let outward = normalize(corner.normal);
    let silicone = mix(skin.bellows.rgb, skin.pad.rgb, smoothstep(0.2, 0.8, corner.place.z));
    let edge = 1.0 - abs(dot(outward, towards_eye(corner.world)));
    return vec4<f32>(shade(silicone, corner.world, outward, 0.10), mix(1.0, 0.10 + 0.45 * edge * edge, clear));
}

@fragment
fn fragment(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    if (clearness(corner.place) > 0.0) {
        discard;
    }
    let outward = normalize(select(-corner.normal, corner.normal, front));
    let silicone = mix(skin.bellows.rgb, skin.pad.rgb, smoothstep(0.2, 0.8, corner.place.z));
    let matt = shade(silicone, corner.world, outward, 0.10);
    if (corner.place.z < 0.5) {
        return vec4<f32>(matt, 1.0);
    }
    let share = load_at(corner.place.xy).x / skin.taxels.z;
    // Data keeps its colour: at most 15 % of it is shading. Below 2 % of full scale it is the silicone's own.
    let shading = 0.88 + 0.12 * max(dot(outward, frame.key.xyz), 0.0);
    let data = mapped(share) * shading;
    return vec4<f32>(mix(matt, data, smoothstep(0.015, 0.06, share)), 1.0);
}
