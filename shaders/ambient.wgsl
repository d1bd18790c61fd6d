// Ambient occlusion: how much of its surroundings a place sees, from the distances of the picture alone. Corners, folds and
// gaps between finger and object turn dark. Drawn at half the picture's size, then smoothed.
// After McGuire et al., "The Alchemy Screen-Space Ambient Obscurance Algorithm", HPG 2011.

@group(1) @binding(0) var distances: texture_2d<f32>;
@group(1) @binding(1) var rough: texture_2d<f32>;

// Farthest that a surface darkens another (m), and the slope below which neighbours on the same surface do not (share).
const REACH: f32 = 0.011;
const BIAS: f32 = 0.06;
const STRENGTH: f32 = 1.5;
const SAMPLES: i32 = 9;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let x = f32((index << 1u) & 2u) * 2.0 - 1.0;
    let y = f32(index & 2u) * 2.0 - 1.0;
    return vec4<f32>(x, y, 0.0, 1.0);
}

fn distance_at(pixel: vec2<i32>) -> f32 {
    let last = vec2<i32>(textureDimensions(distances)) - 1;
    let colour = textureLoad(distances, clamp(pixel, vec2<i32>(0), last), 0).xyz;
    return dot(colour, vec3<f32>(65536.0, 256.0, 1.0)) * (255.0 / 16777215.0 * FARTHEST);
}

// Place of a pixel, seen from the eye: x right, y up, z back.
fn place(pixel: vec2<i32>) -> vec3<f32> {
    let away = distance_at(pixel);
    let size = vec2<f32>(textureDimensions(distances));
    let at = (vec2<f32>(pixel) + 0.5) / size * 2.0 - 1.0;
    let scale = mix(away, 1.0, frame.eye.w);
    return vec3<f32>(at.x * frame.lens.x * scale, -at.y * frame.lens.y * scale, -away);
}

// The shorter of the steps to both neighbours: the other may lie beyond an edge.
fn shorter(forward: vec3<f32>, backward: vec3<f32>) -> vec3<f32> {
    return select(backward, forward, abs(forward.z) < abs(backward.z));
}

@fragment
fn fragment_rough(@builtin(position) clip: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(clip.xy);
    let here = place(pixel);
    if (-here.z > 0.99 * FARTHEST) {
        return vec4<f32>(1.0);
    }
    let to_right = shorter(place(pixel + vec2<i32>(1, 0)) - here, here - place(pixel - vec2<i32>(1, 0)));
    let upward = shorter(place(pixel - vec2<i32>(0, 1)) - here, here - place(pixel + vec2<i32>(0, 1)));
    let normal = normalize(cross(to_right, upward));
    let height = f32(textureDimensions(distances).y);
    let scale = mix(-here.z, 1.0, frame.eye.w);
    let reach = clamp(0.5 * height * REACH / (frame.lens.y * scale), 2.0, 0.12 * height);
    // A turn that differs between neighbours, which the smoothing averages.
    let turn = 6.2831853 * fract(52.9829189 * fract(dot(floor(clip.xy), vec2<f32>(0.06711056, 0.00583715))));
    var hidden = 0.0;
    for (var k = 0; k < SAMPLES; k++) {
        let share = (f32(k) + 0.5) / f32(SAMPLES);
        let angle = turn + 2.3999632 * f32(k);
        let step = vec2<f32>(cos(angle), sin(angle)) * share * reach;
        let there = place(pixel + vec2<i32>(round(step))) - here;
        let squared = dot(there, there);
        let near = max(1.0 - squared / (REACH * REACH), 0.0);
        hidden += near * max(dot(there, normal) * inverseSqrt(squared + 1e-9) - BIAS, 0.0);
    }
    return vec4<f32>(max(1.0 - 2.0 * STRENGTH * hidden / f32(SAMPLES), 0.0));
}

@fragment
fn fragment_smooth(@builtin(position) clip: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(clip.xy);
    let away = distance_at(pixel);
    let last = vec2<i32>(textureDimensions(rough)) - 1;
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -2; y < 2; y++) {
        for (var x = -2; x < 2; x++) {
            let at = clamp(pixel + vec2<i32>(x, y), vec2<i32>(0), last);
            let weight = max(1.0 - abs(distance_at(at) - away) * 200.0, 0.001);
            sum += weight * textureLoad(rough, at, 0).x;
            weights += weight;
        }
    }
    return vec4<f32>(sum / weights);
}
