// What all passes share: the camera, the light, the shadow of the light. Mirrored by `FrameUniform` in frame.rs.

struct Frame {
    clip_from_world: mat4x4<f32>,
    light_from_world: mat4x4<f32>,
    // xyz position of the eye; w 1 for parallel projection
    eye: vec4<f32>,
    // xyz direction from which the key light comes; w strength of shadows
    key: vec4<f32>,
    // xyz direction from the target towards the eye; w unused
    back: vec4<f32>,
    // xy half the width and height of the picture: at distance 1, or anywhere in parallel projection; z number of places
    // that make a shadow soft
    lens: vec4<f32>,
    // xyz direction from which the rim light comes, behind the scene; w its strength
    rim: vec4<f32>,
    // xyz the point in the middle of the picture; w unused
    middle: vec4<f32>,
    // linear colours: light from above, light from below, key light
    sky_light: vec4<f32>,
    ground_light: vec4<f32>,
    key_light: vec4<f32>,
    // linear colours of the backdrop, above and below
    backdrop_top: vec4<f32>,
    backdrop_bottom: vec4<f32>,
    // width and height in pixels, and one over each
    viewport: vec4<f32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

fn towards_eye(world: vec3<f32>) -> vec3<f32> {
    return normalize(mix(frame.eye.xyz - world, frame.back.xyz, frame.eye.w));
}

// Greatest distance that is told apart (m).
const FARTHEST: f32 = 8.0;

// Distance from the eye along the direction of view as a colour, in 24 bits: targets of floating point numbers are not
// to be had everywhere.
fn distance_colour(world: vec3<f32>) -> vec4<f32> {
    let away = clamp(dot(frame.eye.xyz - world, frame.back.xyz) / FARTHEST, 0.0, 1.0);
    let steps = u32(away * 16777215.0);
    return vec4<f32>(vec3<f32>(vec3<u32>(steps >> 16u, (steps >> 8u) & 255u, steps & 255u)) / 255.0, 1.0);
}
