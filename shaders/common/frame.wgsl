// What all passes share: the camera, the light, the shadow of the light. Mirrored by `FrameUniform` in frame.rs.

struct Frame {
    clip_from_world: mat4x4<f32>,
    light_from_world: mat4x4<f32>,
    // xyz position of the eye; w 1 for parallel projection
    eye: vec4<f32>,
    // xyz direction from which the key light comes; w strength of shadows
    key: vec4<f32>,
    // xyz direction towards the eye in parallel projection; w unused
    back: vec4<f32>,
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
