// Flat shapes and text over the picture, in pixels from the top left.

@group(1) @binding(0) var glyphs: texture_2d<f32>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) colour: vec4<f32>,
    // place in the glyph atlas in texels; negative for plain shapes
    @location(1) glyph: vec2<f32>,
}

@vertex
fn vertex(@location(0) position: vec2<f32>, @location(1) glyph: vec2<f32>, @location(2) colour: vec4<f32>) -> Corner {
    let at = position * frame.viewport.zw * 2.0 - 1.0;
    return Corner(vec4<f32>(at.x, -at.y, 0.0, 1.0), colour, glyph);
}

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3<f32>(2.4)), c / 12.92, c <= vec3<f32>(0.04045));
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    var coverage = 1.0;
    if (corner.glyph.x >= 0.0) {
        coverage = textureLoad(glyphs, vec2<i32>(corner.glyph), 0).x;
    }
    return vec4<f32>(linear_from_srgb(corner.colour.rgb), corner.colour.a * coverage);
}
