// The ground: a level disc that fades into the backdrop, with a millimetre grid and the shadow of what stands on it.

struct Ground {
    // rgb colour (linear), w height
    colour: vec4<f32>,
    // rgb colour of the grid (linear), w radius at which it has faded
    grid: vec4<f32>,
}

@group(1) @binding(0) var<uniform> ground: Ground;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    let world = vec3<f32>(corner * ground.grid.w, ground.colour.w);
    return Corner(frame.clip_from_world * vec4<f32>(world, 1.0), world);
}

// Coverage of grid lines every `spacing` metres, `width` pixels wide, fading out where they would crowd.
fn lines(at: vec2<f32>, spacing: f32, width: f32) -> f32 {
    let cell = at / spacing;
    let per_pixel = fwidth(cell);
    let away = abs(fract(cell - 0.5) - 0.5) / max(per_pixel, vec2<f32>(1e-6));
    let line = 1.0 - smoothstep(vec2<f32>(0.5 * width - 0.5), vec2<f32>(0.5 * width + 0.5), away);
    let crowding = smoothstep(0.12, 0.4, max(per_pixel.x, per_pixel.y));
    return max(line.x, line.y) * (1.0 - crowding);
}

@fragment
fn fragment(corner: Corner, @builtin(front_facing) from_above: bool) -> @location(0) vec4<f32> {
    let at = corner.world.xy;
    let minor = lines(at, 0.010, 1.0) * 0.16;
    let major = lines(at, 0.050, 1.2) * 0.42;
    let base = mix(ground.colour.rgb, ground.grid.rgb, max(minor, major));
    let share = lit_share(corner.world, vec3<f32>(0.0, 0.0, 1.0));
    let colour = base * mix(0.52, 1.0, share) * mix(0.35, 1.0, openness(corner.clip.xy));
    let away = length(at) / ground.grid.w;
    var opacity = 1.0 - smoothstep(0.30, 1.0, away);
    // Seen from below the ground is a veil, so that it hides nothing.
    if (!from_above) {
        opacity *= 0.25;
    }
    return vec4<f32>(colour, opacity);
}

@fragment
fn fragment_distance(corner: Corner, @builtin(front_facing) from_above: bool) -> @location(0) vec4<f32> {
    if (!from_above) {
        discard;
    }
    return distance_colour(corner.world);
}
