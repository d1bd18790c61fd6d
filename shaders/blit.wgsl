// Puts the finished picture into a window: the picture holds sRGB texels, the window wants encoded values.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4<f32>(corner.x * 2.0 - 1.0, 1.0 - corner.y * 2.0, 0.0, 1.0), corner);
}

fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3<f32>(0.0031308));
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    let colour = textureSampleLevel(picture, picture_sampler, corner.uv, 0.0);
    return vec4<f32>(srgb_from_linear(colour.rgb), 1.0);
}

// For windows whose surface encodes by itself.
@fragment
fn fragment_srgb(corner: Corner) -> @location(0) vec4<f32> {
    let colour = textureSampleLevel(picture, picture_sampler, corner.uv, 0.0);
    return vec4<f32>(colour.rgb, 1.0);
}
