// Shared by all shaders of the cube: its layout, and how a point is turned into a direction's raster.
// Coordinates are texel coordinates of `trace::ldc::CubeFrame`, at most 2048: 2^-14 of a texel is their last bit.

struct Frame {
    // Texels along each axis, whole tiles.
    size: vec3u,
    triangles: u32,
    // First texel of each direction's raster in memory, and the end.
    first_texel: vec4u,
    // Levels above the texels, coarsest first.
    levels: u32,
    // 1 if texels get samples of all that touches them, 0 if of what covers their centre.
    conservative: u32,
    // 1 if cells tell which 64ths of the depth are occupied.
    occupancy: u32,
    // Error of a triangle's test, in ulp of its corners' distance times the cube's size.
    doubt: f32,
    // How depths are stored: F32_DEPTH, U16_DEPTH or F16_DEPTH.
    depth: u32,
    pad_a: u32,
    pad_b: u32,
    pad_c: u32,
    // At 3 * axis + level: first cell, cells in a row, texels of a cell's sides as powers of two.
    cells: array<vec4u, 9>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

const NONE: u32 = 0xffffffffu;
const TILE: u32 = 8u;
// How far beyond its texel a conservative sample reaches.
const REACH: f32 = 0.00390625;
// Half of the last bit of numbers from 1 to 2.
const ULP: f32 = 5.9604645e-8;
// Slopes of a sample without a plane.
const NO_PLANE: u32 = 0x8080u;
// Mesa's software driver leaves all loops of eight or sixteen threads after some 65,000 rounds. So this many samples of a
// texel and entries of a cell are put in order,
const LONGEST: u32 = 1024u;
// and a ray that takes more rounds is unsure.
const MOST_ROUNDS: u32 = 4000u;
// Three words a sample: triangle, depth, slopes. Packed two: triangle, and slopes below sixteen bits of depth.
const SAMPLE: u32 = 3u;
const PACKED: u32 = 2u;
const F32_DEPTH: u32 = 0u;
const U16_DEPTH: u32 = 1u;
const F16_DEPTH: u32 = 2u;

// A point as (u, v, w) of a direction.
fn turned(p: vec3f, axis: u32) -> vec3f {
    return select(select(p, p.zxy, axis == 1u), p.yzx, axis == 0u);
}

fn raster_size(axis: u32) -> vec2u {
    return vec2u(frame.size[(axis + 1u) % 3u], frame.size[(axis + 2u) % 3u]);
}

// A texel in memory order: tiles in rows, texels of a tile in rows.
fn texel_index(axis: u32, column: u32, row: u32) -> u32 {
    let tile = (row / TILE) * (raster_size(axis).x / TILE) + column / TILE;
    return frame.first_texel[axis] + tile * TILE * TILE + (row % TILE) * TILE + column % TILE;
}

// Bound on the error of a stored depth, in texels; conversions to f16 may round either way.
fn depth_error(axis: u32) -> f32 {
    let scale = f32(frame.size[axis]);
    if frame.depth == U16_DEPTH {
        return scale * (0.51 / 65535.0) + 0.015625;
    }
    return select(0.0, scale / 2048.0, frame.depth == F16_DEPTH);
}

// A number as an integer of the same order, and back. 0 is below all numbers.
fn key(value: f32) -> u32 {
    let bits = bitcast<u32>(value);
    return select(bits | 0x80000000u, ~bits, bits >= 0x80000000u);
}

fn unkey(order: u32) -> f32 {
    return bitcast<f32>(select(~order, order & 0x7fffffffu, order >= 0x80000000u));
}

// Bits of the 64ths of the depth between two depths, in two words.
fn slots(low: f32, high: f32, per_texel: f32) -> vec2u {
    let a = u32(clamp(low * per_texel, 0.0, 63.0));
    let b = u32(clamp(high * per_texel, 0.0, 63.0));
    let from_low = select(vec2u(0u, NONE << (a & 31u)), vec2u(NONE << (a & 31u), NONE), a < 32u);
    let to_high = select(vec2u(NONE, NONE >> ((63u - b) & 31u)), vec2u(NONE >> (31u - (b & 31u)), 0u), b < 32u);
    return from_low & to_high;
}

// Where a thread of a two-dimensional dispatch stands among all.
fn thread_index(group: vec3u, groups: vec3u, local: u32, size: u32) -> u32 {
    return (group.y * groups.x + group.x) * size + local;
}
