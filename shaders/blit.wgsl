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

// The sRGB curve by square roots, to a fifth of a step of 8 bits: powers take long on a software rasteriser.
fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    let s1 = sqrt(c);
    let s2 = sqrt(s1);
    let s3 = sqrt(s2);
    let curve = 0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * c;
    return select(curve, c * 12.92, c <= vec3<f32>(0.0031308));
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
