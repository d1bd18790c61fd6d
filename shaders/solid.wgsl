// Rigid things: the object, the pedestal, the gripper.

// Mirrored by `FinishUniform` in passes/solid.rs.
struct Finish {
    // xyz grains per metre along each axis of the mesh, w how far they change the colour
    grain: vec4<f32>,
    // x how far grains tilt the surface, y wrap, z sheen, w mirror
    relief: vec4<f32>,
    // x gloss, y power
    highlight: vec4<f32>,
}

struct Finishes {
    all: array<Finish, 8>,
}

@group(1) @binding(0) var<uniform> finishes: Finishes;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec3<f32>,
    // place in the mesh, in grains
    @location(3) grains: vec3<f32>,
    @location(4) @interpolate(flat) finish: u32,
}

// The matrix of a solid; the w of its columns hold a colour (linear) in place of the mesh's own, or are negative.
struct Instance {
    @location(3) column_x: vec4<f32>,
    @location(4) column_y: vec4<f32>,
    @location(5) column_z: vec4<f32>,
    @location(6) origin: vec4<f32>,
}

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3<f32>(2.4)), c / 12.92, c <= vec3<f32>(0.04045));
}

fn place_of(instance: Instance) -> mat4x4<f32> {
    return mat4x4<f32>(
        vec4<f32>(instance.column_x.xyz, 0.0),
        vec4<f32>(instance.column_y.xyz, 0.0),
        vec4<f32>(instance.column_z.xyz, 0.0),
        instance.origin,
    );
}

fn corner_of(position: vec3<f32>, normal: vec3<f32>, colour: vec4<f32>, instance: Instance) -> Corner {
    let place = place_of(instance);
    let world = place * vec4<f32>(position, 1.0);
    let turned = (place * vec4<f32>(normal, 0.0)).xyz;
    let finish = min(u32(colour.a * 255.0 + 0.5), 7u);
    let grains = position * finishes.all[finish].grain.xyz;
    let tint = vec3<f32>(instance.column_x.w, instance.column_y.w, instance.column_z.w);
    let own = select(tint, linear_from_srgb(colour.rgb), tint.x < 0.0);
    return Corner(frame.clip_from_world * world, world.xyz, turned, own, grains, finish);
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    instance: Instance,
) -> Corner {
    return corner_of(position, normal, colour, instance);
}

// A ghost lies a little before what it is compared with, so that equal surfaces do not flicker.
@vertex
fn vertex_ghost(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    instance: Instance,
) -> Corner {
    var corner = corner_of(position, normal, colour, instance);
    let ahead = corner.world + towards_eye(corner.world) * 0.003;
    corner.clip = frame.clip_from_world * vec4<f32>(ahead, 1.0);
    return corner;
}

@vertex
fn vertex_shadow(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    instance: Instance,
) -> @builtin(position) vec4<f32> {
    return frame.light_from_world * place_of(instance) * vec4<f32>(position, 1.0);
}

@fragment
fn fragment_distance(corner: Corner) -> @location(0) vec4<f32> {
    return distance_colour(corner.world);
}

// A number of a cell of the grain, -1 to 1.
fn random(cell: vec3<i32>) -> f32 {
    let mixed = bitcast<vec3<u32>>(cell) * vec3<u32>(0x8da6b343u, 0xd8163841u, 0xcb1ab31fu);
    var h = mixed.x ^ mixed.y ^ mixed.z;
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12u)) * 0x297a2d39u;
    return f32((h >> 8u) & 0xffffu) / 32767.5 - 1.0;
}

// Smooth noise: xyz its slope, w its value, -1 to 1.
fn noise(at: vec3<f32>) -> vec4<f32> {
    let cell = vec3<i32>(floor(at));
    let t = at - floor(at);
    let u = t * t * (3.0 - 2.0 * t);
    let du = 6.0 * t * (1.0 - t);
    let c000 = random(cell);
    let c100 = random(cell + vec3<i32>(1, 0, 0));
    let c010 = random(cell + vec3<i32>(0, 1, 0));
    let c110 = random(cell + vec3<i32>(1, 1, 0));
    let c001 = random(cell + vec3<i32>(0, 0, 1));
    let c101 = random(cell + vec3<i32>(1, 0, 1));
    let c011 = random(cell + vec3<i32>(0, 1, 1));
    let c111 = random(cell + vec3<i32>(1, 1, 1));
    let x00 = mix(c000, c100, u.x);
    let x10 = mix(c010, c110, u.x);
    let x01 = mix(c001, c101, u.x);
    let x11 = mix(c011, c111, u.x);
    let y0 = mix(x00, x10, u.y);
    let y1 = mix(x01, x11, u.y);
    let along_x = mix(mix(c100 - c000, c110 - c010, u.y), mix(c101 - c001, c111 - c011, u.y), u.z);
    let along_y = mix(x10 - x00, x11 - x01, u.z);
    return vec4<f32>(vec3<f32>(along_x, along_y, y1 - y0) * du, mix(y0, y1, u.z));
}

@fragment
fn fragment(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let finish = finishes.all[corner.finish];
    // Grains smaller than a pixel would flicker.
    let across = fwidth(corner.grains);
    let seen = 1.0 - smoothstep(0.35, 1.0, max(across.x, max(across.y, across.z)));
    let grain = noise(corner.grains) * seen;
    let outward = normalize(select(-corner.normal, corner.normal, front));
    let tilted = normalize(outward - grain.xyz * finish.relief.x);
    let base = corner.colour * (1.0 + finish.grain.w * grain.w);
    let surface =
        Surface(base, tilted, finish.relief.y, finish.highlight.x, finish.highlight.y, finish.relief.z);
    return vec4<f32>(shade_mirror(surface, finish.relief.w, corner.world, corner.clip.xy), 1.0);
}

// A ghost: the nearer surface only, clearest where it turns away from the eye, so that outlines can be compared.
@fragment
fn fragment_ghost(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    if (!front) {
        discard;
    }
    let edge = 1.0 - abs(dot(normalize(corner.normal), towards_eye(corner.world)));
    return vec4<f32>(corner.colour, 0.15 + 0.72 * edge * edge);
}
