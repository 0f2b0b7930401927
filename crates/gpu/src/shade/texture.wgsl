// Texels: `crates/render/src/texture/`, filtered in f32 as there.

const NOTHING: u32 = 0xffffffffu;
const REPEAT: u32 = 0u;
const MIRRORED: u32 = 1u;
// Bits of a use's flags; the two lowest are how u wraps, the next how v does.
const MAG_NEAREST: u32 = 16u;
const MIN_NEAREST: u32 = 32u;
const MIPMAPS: u32 = 64u;
const SECOND_SET: u32 = 128u;
const COLOUR: u32 = 256u;

// One use of an image. 48 bytes.
struct Use {
    // Both columns of the linear part of its transform.
    columns: vec4f,
    offset: vec2f,
    density: f32,
    flags: u32,
    first_level: u32,
    levels: u32,
    pad_a: u32,
    pad_b: u32,
}

struct Level {
    width: u32,
    height: u32,
    // Number of its first texel among all.
    first: u32,
    pad: u32,
}

@group(0) @binding(4) var<storage, read> uses: array<Use>;
@group(0) @binding(5) var<storage, read> levels: array<Level>;
// All levels of all images one after the other, in rows that have nothing to do with theirs.
@group(0) @binding(6) var texels: texture_2d_array<u32>;

fn texel(level: Level, x: u32, y: u32, flags: u32) -> vec4f {
    let size = textureDimensions(texels);
    let number = level.first + y * level.width + x;
    let row = number / size.x;
    let bytes = textureLoad(texels, vec2u(number % size.x, row % size.y), row / size.y, 0);
    let alpha = f32(bytes.w) / 255.0;
    if (flags & COLOUR) == 0u {
        return vec4f(vec3f(bytes.xyz) / 255.0, alpha);
    }
    return vec4f(decoded(bytes.x), decoded(bytes.y), decoded(bytes.z), alpha);
}

// Linear light of a byte of a colour.
fn decoded(byte: u32) -> f32 {
    return shading.srgb[byte / 4u][byte % 4u];
}

// A coordinate brought into [0, 1].
fn wrapped(coordinate: f32, wrap: u32) -> f32 {
    if wrap == REPEAT {
        return coordinate - floor(coordinate);
    }
    if wrap == MIRRORED {
        let period = coordinate - 2.0 * floor(0.5 * coordinate);
        return select(period, 2.0 - period, period > 1.0);
    }
    return clamp(coordinate, 0.0, 1.0);
}

struct Neighbours {
    first: u32,
    second: u32,
    weight: f32,
}

// The two texels around a coordinate and the weight of the second.
fn neighbours(coordinate: f32, size: u32, wrap: u32) -> Neighbours {
    let x = wrapped(coordinate, wrap) * f32(size) - 0.5;
    let before = i32(floor(x));
    let last = i32(size) - 1;
    var first = max(before, 0);
    var second = min(before + 1, last);
    if wrap == REPEAT {
        first = select(before, last, before < 0);
        second = select(before + 1, 0, before + 1 > last);
    }
    return Neighbours(u32(clamp(first, 0, last)), u32(clamp(second, 0, last)), clamp(x - floor(x), 0.0, 1.0));
}

fn at_linear(level: Level, uv: vec2f, flags: u32) -> vec4f {
    let x = neighbours(uv.x, level.width, flags & 3u);
    let y = neighbours(uv.y, level.height, (flags >> 2u) & 3u);
    let low = mix(texel(level, x.first, y.first, flags), texel(level, x.second, y.first, flags), x.weight);
    let high = mix(texel(level, x.first, y.second, flags), texel(level, x.second, y.second, flags), x.weight);
    return mix(low, high, y.weight);
}

fn nearest_index(coordinate: f32, size: u32, wrap: u32) -> u32 {
    return min(u32(max(wrapped(coordinate, wrap) * f32(size), 0.0)), size - 1u);
}

fn at_nearest(level: Level, uv: vec2f, flags: u32) -> vec4f {
    let x = nearest_index(uv.x, level.width, flags & 3u);
    let y = nearest_index(uv.y, level.height, (flags >> 2u) & 3u);
    return texel(level, x, y, flags);
}

fn filtered(level: u32, uv: vec2f, flags: u32, nearest: bool) -> vec4f {
    if nearest {
        return at_nearest(levels[level], uv, flags);
    }
    return at_linear(levels[level], uv, flags);
}

fn transformed(image: Use, uv: vec2f) -> vec2f {
    return image.columns.xy * uv.x + image.columns.zw * uv.y + image.offset;
}

// The filtered texel; `area` is that of the pixel's footprint in texture coordinates.
fn sampled(image: Use, uv: vec2f, area: f32) -> vec4f {
    // Without a footprint it is the image itself.
    var level = -1e30;
    if area > 0.0 {
        level = image.density + 0.5 * log2(area);
    }
    let at = transformed(image, uv);
    let minified = level > 0.0;
    let nearest = (image.flags & select(MAG_NEAREST, MIN_NEAREST, minified)) != 0u;
    let last = image.levels - 1u;
    if !minified || (image.flags & MIPMAPS) == 0u || last == 0u {
        return filtered(image.first_level, at, image.flags, nearest);
    }
    let height = min(level, f32(last));
    let fine = u32(height);
    let fraction = height - f32(fine);
    let color = filtered(image.first_level + fine, at, image.flags, nearest);
    if fraction == 0.0 {
        return color;
    }
    return mix(color, filtered(image.first_level + fine + 1u, at, image.flags, nearest), fraction);
}
