// The backdrop: a vertical blend of two colours.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) height: f32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    // One triangle that covers the picture.
    let x = f32((index << 1u) & 2u) * 2.0 - 1.0;
    let y = f32(index & 2u) * 2.0 - 1.0;
    return Corner(vec4<f32>(x, y, 1.0, 1.0), y * 0.5 + 0.5);
}

// A pattern of +-half a step of 8 bits, so that the blend shows no bands.
fn dither(pixel: vec2<f32>) -> f32 {
    return (fract(52.9829189 * fract(dot(pixel, vec2<f32>(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    let share = smoothstep(0.0, 1.0, corner.height);
    let colour = mix(frame.backdrop_bottom.rgb, frame.backdrop_top.rgb, share);
    return vec4<f32>(colour + dither(corner.clip.xy) * 0.4, 1.0);
}
