// Light: a key light with a soft shadow, light from all around that is brighter from above and does not reach into
// corners, a weak light from the eye, and a rim light from behind. Needs common/frame.wgsl.

@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;
@group(0) @binding(3) var openness_map: texture_2d<f32>;
@group(0) @binding(4) var openness_sampler: sampler;

// How a surface answers to light.
struct Surface {
    base: vec3<f32>,
    normal: vec3<f32>,
    // how far the key light reaches around, 0 to 1
    wrap: f32,
    // strength and sharpness of the highlight
    gloss: f32,
    power: f32,
    // brightness of fibres towards the outline
    sheen: f32,
}

// Half the width of the shadow's edge, in shadow-map coordinates: about 2 mm in a scene 300 mm across.
const SHADOW_SOFTNESS: f32 = 0.0038;

// Share of the key light that arrives, 0 to 1.
fn lit_share(world: vec3<f32>, normal: vec3<f32>) -> f32 {
    // A step along the normal keeps a surface from shading itself.
    let lifted = world + normal * 0.0012;
    let clip = frame.light_from_world * vec4<f32>(lifted, 1.0);
    let at = vec3<f32>(clip.x * 0.5 + 0.5, 0.5 - clip.y * 0.5, clip.z - 0.0008);
    if (any(at.xy < vec2<f32>(0.0)) || any(at.xy > vec2<f32>(1.0)) || at.z > 1.0) {
        return 1.0;
    }
    // Places on a spiral within the softness, each a golden angle further than the one before.
    var direction = vec2<f32>(1.0, 0.0);
    var sum = 0.0;
    for (var k = 0.5; k < frame.lens.z; k += 1.0) {
        let uv = at.xy + direction * SHADOW_SOFTNESS * sqrt(k / frame.lens.z);
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, uv, at.z);
        direction = vec2<f32>(-0.7373689 * direction.x - 0.6754903 * direction.y, 0.6754903 * direction.x - 0.7373689 * direction.y);
    }
    return mix(1.0, sum / frame.lens.z, frame.key.w);
}

// Share of the surroundings that a place sees, 0 to 1; `pixel` in pixels of the picture.
fn openness(pixel: vec2<f32>) -> f32 {
    return textureSampleLevel(openness_map, openness_sampler, pixel * frame.viewport.zw, 0.0).x;
}

// What a mirror at a place sees: a room whose walls are not far, sky over ground, and lamps.
fn studio(world: vec3<f32>, ray: vec3<f32>) -> vec3<f32> {
    let direction = normalize(ray + (world - frame.middle.xyz) * 9.0);
    let sky = mix(frame.ground_light.rgb * 1.6, frame.sky_light.rgb * 2.2, smoothstep(-0.45, 0.55, direction.z));
    let lamp = smoothstep(0.70, 0.95, dot(direction, frame.key.xyz));
    let strip = smoothstep(0.75, 0.95, dot(direction, frame.rim.xyz));
    // A row of windows at eye level.
    let bearing = dot(direction, normalize(vec3<f32>(frame.key.y, -frame.key.x, 0.35)));
    let windows = smoothstep(0.25, 0.42, abs(fract(bearing * 1.7 + 0.2) - 0.5));
    return sky * mix(0.55, 1.25, windows) + frame.key_light.rgb * (1.2 * lamp + 0.6 * strip);
}

// Light that comes from a surface: of its own colour, and mirrored by its skin.
struct Shaded {
    matt: vec3<f32>,
    glint: vec3<f32>,
    open: f32,
}

fn shaded(surface: Surface, world: vec3<f32>, pixel: vec2<f32>) -> Shaded {
    let eye = towards_eye(world);
    let normal = surface.normal;
    let open = openness(pixel);
    let facing = (dot(normal, frame.key.xyz) + surface.wrap) / (1.0 + surface.wrap);
    let arriving = max(facing, 0.0) * lit_share(world, normal) * mix(0.6, 1.0, open);
    let around = mix(frame.ground_light.rgb, frame.sky_light.rgb, normal.z * 0.5 + 0.5) * open;
    let towards = max(dot(normal, eye), 0.0);
    // A weak light from the eye models what faces away from the key.
    let fill = 0.10 * towards * open;
    let away = 1.0 - towards;
    let grazing = away * away * away;
    let rim = grazing * smoothstep(-0.1, 0.7, dot(normal, frame.rim.xyz)) * frame.rim.w * open;
    let halfway = normalize(frame.key.xyz + eye);
    let highlight = surface.gloss * pow(max(dot(normal, halfway), 0.0), surface.power) * arriving;
    let matt = surface.base * (around + fill + frame.key_light.rgb * arriving + surface.sheen * grazing * around);
    return Shaded(matt, frame.key_light.rgb * (highlight + rim), open);
}

// Colour of a surface that mirrors nothing (linear).
fn shade(surface: Surface, world: vec3<f32>, pixel: vec2<f32>) -> vec3<f32> {
    let light = shaded(surface, world, pixel);
    return light.matt + light.glint;
}

// Colour of a surface of which a share mirrors its surroundings (linear).
fn shade_mirror(surface: Surface, share: f32, world: vec3<f32>, pixel: vec2<f32>) -> vec3<f32> {
    let light = shaded(surface, world, pixel);
    let seen = studio(world, reflect(-towards_eye(world), surface.normal));
    let mirrored = mix(surface.base, vec3<f32>(1.0), 0.25) * seen * mix(0.45, 1.0, light.open);
    return mix(light.matt, mirrored, share) + light.glint;
}
