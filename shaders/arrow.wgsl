// Force arrows: shaft and head, seen faintly through what hides them.

struct Instance {
    // xyz where it begins, w radius of the shaft
    @location(2) origin: vec4<f32>,
    // xyz from there to the point
    @location(3) reach: vec4<f32>,
    @location(4) colour: vec4<f32>,
}

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) colour: vec3<f32>,
    @location(2) world: vec3<f32>,
}

// The unit arrow runs along z from 0 to 1 with radii in units of the shaft's; its head keeps its length.
@vertex
fn vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>, instance: Instance) -> Corner {
    let reach = length(instance.reach.xyz);
    let z = instance.reach.xyz / max(reach, 1e-9);
    let helper = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), abs(z.x) > 0.7);
    let x = normalize(cross(helper, z));
    let y = cross(z, x);
    let radius = instance.origin.w;
    let head = min(6.0 * radius, 0.6 * reach);
    // z of 0..1 is the shaft, 1..2 the head.
    let along = min(position.z, 1.0) * (reach - head) + max(position.z - 1.0, 0.0) * head;
    let world = instance.origin.xyz + (x * position.x + y * position.y) * radius + z * along;
    let turned = x * normal.x + y * normal.y + z * normal.z;
    return Corner(frame.clip_from_world * vec4<f32>(world, 1.0), turned, instance.colour.rgb, world);
}

fn lit(corner: Corner) -> vec3<f32> {
    let normal = normalize(corner.normal);
    let colour = corner.colour * (0.75 + 0.25 * max(dot(normal, frame.key.xyz), 0.0));
    // A dark outline, on any ground.
    let edge = smoothstep(0.52, 0.70, abs(dot(normal, towards_eye(corner.world))));
    return mix(vec3<f32>(0.01), colour, edge);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(lit(corner), 1.0);
}

@fragment
fn fragment_hidden(corner: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(lit(corner), 0.35);
}
