// Light and soft shadow: a key light with a percentage-closer shadow, and light from all around that is brighter from
// above. Needs common/frame.wgsl.

@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;

// Half the width of the shadow's edge, in shadow-map coordinates: about 4 mm in a scene 300 mm across.
const SHADOW_SOFTNESS: f32 = 0.0065;

fn shadow_tap(at: vec3<f32>, x: f32, y: f32) -> f32 {
    let uv = at.xy + vec2<f32>(x, y) * SHADOW_SOFTNESS;
    return textureSampleCompareLevel(shadow_map, shadow_sampler, uv, at.z);
}

// Share of the key light that arrives, 0 to 1.
fn lit_share(world: vec3<f32>, normal: vec3<f32>) -> f32 {
    // A step along the normal keeps a surface from shading itself.
    let lifted = world + normal * 0.0012;
    let clip = frame.light_from_world * vec4<f32>(lifted, 1.0);
    let at = vec3<f32>(clip.x * 0.5 + 0.5, 0.5 - clip.y * 0.5, clip.z - 0.0008);
    if (any(at.xy < vec2<f32>(0.0)) || any(at.xy > vec2<f32>(1.0)) || at.z > 1.0) {
        return 1.0;
    }
    // Four corners first: where they agree, the edge is elsewhere.
    var sum = shadow_tap(at, -0.9, -0.9) + shadow_tap(at, 0.9, -0.9) + shadow_tap(at, -0.9, 0.9) + shadow_tap(at, 0.9, 0.9);
    if (sum > 0.0 && sum < 4.0) {
        sum += shadow_tap(at, 0.0, 0.0)
            + shadow_tap(at, -0.45, -0.30) + shadow_tap(at, 0.45, 0.30)
            + shadow_tap(at, -0.30, 0.45) + shadow_tap(at, 0.30, -0.45)
            + shadow_tap(at, -0.95, 0.10) + shadow_tap(at, 0.95, -0.10)
            + shadow_tap(at, 0.10, 0.95) + shadow_tap(at, -0.10, -0.95);
        sum = sum * (4.0 / 13.0);
    }
    return mix(1.0, sum * 0.25, frame.key.w);
}

// Colour of a matt surface (linear), with a highlight of strength `gloss`.
fn shade(base: vec3<f32>, world: vec3<f32>, normal: vec3<f32>, gloss: f32) -> vec3<f32> {
    let eye = towards_eye(world);
    let facing = dot(normal, frame.key.xyz);
    let arriving = max(facing, 0.0) * lit_share(world, normal);
    let around = mix(frame.ground_light.rgb, frame.sky_light.rgb, normal.z * 0.5 + 0.5);
    // A weak light from the eye models what faces away from the key.
    let fill = 0.10 * max(dot(normal, eye), 0.0);
    let halfway = normalize(frame.key.xyz + eye);
    let highlight = gloss * pow(max(dot(normal, halfway), 0.0), 40.0) * arriving;
    return base * (around + fill + frame.key_light.rgb * arriving) + frame.key_light.rgb * highlight;
}
