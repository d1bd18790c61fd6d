// Rigid things: the object, the pedestal, the gripper.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec3<f32>,
    @location(3) gloss: f32,
}

struct Instance {
    @location(3) column_x: vec4<f32>,
    @location(4) column_y: vec4<f32>,
    @location(5) column_z: vec4<f32>,
    @location(6) origin: vec4<f32>,
}

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3<f32>(2.4)), c / 12.92, c <= vec3<f32>(0.04045));
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    instance: Instance,
) -> Corner {
    // The last column's w carries the gloss.
    let place = mat4x4<f32>(instance.column_x, instance.column_y, instance.column_z, vec4<f32>(instance.origin.xyz, 1.0));
    let world = place * vec4<f32>(position, 1.0);
    let turned = (place * vec4<f32>(normal, 0.0)).xyz;
    return Corner(frame.clip_from_world * world, world.xyz, turned, linear_from_srgb(colour.rgb), instance.origin.w);
}

@vertex
fn vertex_shadow(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    instance: Instance,
) -> @builtin(position) vec4<f32> {
    let place = mat4x4<f32>(instance.column_x, instance.column_y, instance.column_z, vec4<f32>(instance.origin.xyz, 1.0));
    return frame.light_from_world * place * vec4<f32>(position, 1.0);
}

@fragment
fn fragment(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let outward = normalize(select(-corner.normal, corner.normal, front));
    return vec4<f32>(shade(corner.colour, corner.world, outward, corner.gloss), 1.0);
}

// A ghost: the nearer surface only, clearest where it turns away from the eye, so that outlines can be compared.
@fragment
fn fragment_ghost(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    if (!front) {
        discard;
    }
    let edge = 1.0 - abs(dot(normalize(corner.normal), towards_eye(corner.world)));
    return vec4<f32>(corner.colour, 0.32 + 0.60 * edge * edge);
}
