// Rays in and answers out, of all ways to trace them.

// 48 bytes. In texel coordinates; the largest component of `dir` is 1 or -1, so `t` counts texels.
struct Ray {
    // Where the ray is within the cube first.
    origin: vec3f,
    // Where it leaves the cube.
    end: f32,
    dir: vec3f,
    // Hits at or before it do not count.
    t_min: f32,
    // Hits beyond it do not count.
    t_max: f32,
    // From the ray's true origin to `origin`, at least 0.
    before: f32,
    // A triangle that is not hit.
    skip: u32,
    pad: u32,
}

// 32 bytes.
struct Found {
    t: f32,
    prim: u32,
    // MISS, HIT or UNSURE.
    state: u32,
    cells: u32,
    texels: u32,
    samples: u32,
    triangles: u32,
    pad: u32,
}

struct Query {
    rays: u32,
    // Of hits by samples: STRICT, INTERVAL or PLANE.
    test: u32,
    // Its tolerance or margin.
    tolerance: f32,
    // 1 if any hit will do.
    any: u32,
}

const MISS: u32 = 0u;
const HIT: u32 = 1u;
const UNSURE: u32 = 2u;
const FAR: f32 = 1e30;

@group(0) @binding(6) var<storage, read> rays: array<Ray>;
@group(0) @binding(7) var<storage, read_write> found: array<Found>;
@group(0) @binding(8) var<uniform> query: Query;

