// A triangle over the raster it is routed to (VMV07): `trace/src/ldc/raster.rs` in f32.
//
// Where f32 cannot tell a triangle's plane to 1/32 of a texel over all of its texels, the triangle has no plane: its
// samples then stand for all depths it has.

@group(0) @binding(1) var<storage, read> positions: array<f32>;
// Three corners a triangle; the first is NONE where it does not take part.
@group(0) @binding(2) var<storage, read> indices: array<u32>;

struct Routed {
    axis: u32,
    usable: bool,
    has_plane: bool,
    a: vec3f,
    b: vec3f,
    c: vec3f,
    slopes: vec2f,
    // Least and largest depth.
    depth: vec2f,
}

// How far a plane may be off.
const PLANE_ERROR: f32 = 0.03125;

fn corner(prim: u32, i: u32) -> vec3f {
    let at = 3u * indices[3u * prim + i];
    return vec3f(positions[at], positions[at + 1u], positions[at + 2u]);
}

fn largest(v: vec3f) -> f32 {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

// The direction of a vector's largest component, ties to the lower axis.
fn dominant(v: vec3f) -> u32 {
    let m = abs(v);
    return select(select(0u, 1u, m.y > m.x), 2u, m.z > max(m.x, m.y));
}

fn routed(prim: u32) -> Routed {
    var r: Routed;
    r.usable = indices[3u * prim] != NONE;
    if !r.usable {
        return r;
    }
    let a = corner(prim, 0u);
    let b = corner(prim, 1u);
    let c = corner(prim, 2u);
    let e1 = b - a;
    let e2 = c - a;
    let n = cross(e1, e2);
    let sides = largest(e1) * largest(e2);
    r.axis = dominant(n);
    if largest(n) <= 32.0 * ULP * sides {
        // Rounding has spoilt the normal: where its length is not steep.
        let e3 = e2 - e1;
        var long = select(e1, e2, dot(e2, e2) > dot(e1, e1));
        long = abs(select(long, e3, dot(e3, e3) > dot(long, long)));
        r.axis = select(select(2u, 1u, long.y <= long.z), 0u, long.x <= min(long.y, long.z));
    }
    r.a = turned(a, r.axis);
    r.b = turned(b, r.axis);
    r.c = turned(c, r.axis);
    let extent = max(max(r.a, r.b), r.c) - min(min(r.a, r.b), r.c);
    let steepness = abs(turned(n, r.axis).z);
    // Error of a normal's component: 8 ulp of `sides`; of a slope: twice that by its steepness.
    r.has_plane = 20.0 * ULP * sides * (extent.x + extent.y + 2.0) < PLANE_ERROR * steepness;
    let m = turned(n, r.axis);
    r.slopes = select(vec2f(0.0), -m.xy / m.z, r.has_plane);
    r.depth = vec2f(min(min(r.a.z, r.b.z), r.c.z), max(max(r.a.z, r.b.z), r.c.z));
    return r;
}

// Rows that may have samples, from the first to before the second.
fn rows_of(r: Routed) -> vec2u {
    let end = f32(raster_size(r.axis).y) - 1.0;
    let low = clamp(min(min(r.a.y, r.b.y), r.c.y) - REACH, 0.0, end);
    let high = clamp(max(max(r.a.y, r.b.y), r.c.y) + REACH, 0.0, end);
    return vec2u(u32(low), u32(high) + 1u);
}

fn below(a: vec3f, b: vec3f) -> bool {
    return a.y < b.y || (a.y == b.y && (a.x < b.x || (a.x == b.x && a.z < b.z)));
}

// Extends a range by where an edge crosses v = const; it counts its lower end only.
fn crossing(range: vec2f, p: vec3f, q: vec3f, v: f32) -> vec2f {
    if (p.y <= v) == (q.y <= v) {
        return range;
    }
    // In one order for both triangles at an edge.
    let a = select(q, p, below(p, q));
    let b = select(p, q, below(p, q));
    let u = a.x + (b.x - a.x) * ((v - a.y) / (b.y - a.y));
    return vec2f(min(range.x, u), max(range.y, u));
}

// Columns of a row that get a sample, from the first to before the second.
fn columns_of(r: Routed, row: u32) -> vec2u {
    let end = f32(raster_size(r.axis).x);
    var range = vec2f(1e30, -1e30);
    if frame.conservative == 0u {
        let v = f32(row) + 0.5;
        range = crossing(range, r.a, r.b, v);
        range = crossing(range, r.b, r.c, v);
        range = crossing(range, r.c, r.a, v);
        // Centres at or beyond the lower end and before the upper one.
        let ends = vec2u(clamp(ceil(range - 0.5), vec2f(0.0), vec2f(end)));
        return select(vec2u(0u), ends, range.x < range.y);
    }
    let lines = vec2f(f32(row) - REACH, f32(row) + 1.0 + REACH);
    range = spanned(range, r.a.xy, r.b.xy, lines);
    range = spanned(range, r.b.xy, r.c.xy, lines);
    range = spanned(range, r.c.xy, r.a.xy, lines);
    if range.x > range.y {
        return vec2u(0u);
    }
    let ends = vec2u(clamp(range + vec2f(-REACH, REACH), vec2f(0.0), vec2f(end - 1.0)));
    return vec2u(ends.x, ends.y + 1u);
}

// Depth of the plane at a texel's centre.
fn depth_at(r: Routed, column: u32, row: u32) -> f32 {
    let off = vec2f(f32(column) + 0.5, f32(row) + 0.5) - r.a.xy;
    let depth = r.a.z + dot(r.slopes, off);
    return select(clamp(depth, r.depth.x, r.depth.y), depth, r.has_plane);
}

// Slopes of depth as two signed bytes, 127 for 1.
fn packed_slopes(r: Routed) -> u32 {
    let s = vec2i(clamp(round(r.slopes * 127.0), vec2f(-127.0), vec2f(127.0)));
    let packed = (u32(s.x) & 0xffu) | ((u32(s.y) & 0xffu) << 8u);
    return select(NO_PLANE, packed, r.has_plane);
}
