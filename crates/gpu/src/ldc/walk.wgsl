// Following a ray through one direction of the cube: a 2-D DDA over cells of all levels, `trace/src/ldc/walk.rs` in
// f32. Positions are whole texels and a cell's exit is computed from its edge, so a walk always advances and ends. It
// visits the texels of a line within 2^-10 of a texel of the true one.

@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> samples: array<u32>;
@group(0) @binding(5) var<storage, read> cells: array<u32>;

struct Walk {
    axis: u32,
    origin: vec3f,
    dir: vec3f,
    inverse: vec2f,
    size: vec2i,
    at: vec2i,
    // Index of the level walked on; `frame.levels` for texels.
    depth: u32,
    t: f32,
    // Whether the cell walked on is done with, and how it is left.
    done: bool,
    exit: f32,
    side: u32,
    low: vec2i,
    high: vec2i,
    // The texel found: its samples, and the ray's way through it.
    first: u32,
    last: u32,
    ends: vec2f,
    steps: vec3u,
}

// Rounds of loops that this thread has gone, and after how many it gives up.
var<private> rounds: u32;
var<private> most_rounds: u32 = NONE;

fn spent() -> bool {
    return rounds > most_rounds;
}

fn walk_start(ray: Ray, axis: u32, steps: vec3u) -> Walk {
    var w: Walk;
    w.axis = axis;
    w.origin = turned(ray.origin, axis);
    w.dir = turned(ray.dir, axis);
    // Exits at edges that are never reached lie beyond every end.
    w.inverse = select(vec2f(FAR), 1.0 / w.dir.xy, abs(w.dir.xy) > vec2f(1e-20));
    w.size = vec2i(raster_size(axis));
    w.at = clamp(vec2i(w.origin.xy), vec2i(0), w.size - 1);
    w.steps = steps;
    return w;
}

fn exits(w: Walk) -> vec2f {
    let edge = select(vec2f(w.low), vec2f(w.high), w.dir.xy > vec2f(0.0));
    let t = (edge - w.origin.xy) * w.inverse;
    return select(vec2f(FAR), t, abs(w.dir.xy) > vec2f(1e-20));
}

// Whether the ray's depths over a cell meet what it holds.
fn meets(w: Walk, level: vec4u, ends: vec2f, pad: f32) -> bool {
    let at = vec2u(w.at);
    let cell = 4u * (level.x + (at.y >> level.w) * level.y + (at.x >> level.z));
    if cells[cell + 1u] == 0u {
        return false;
    }
    let depths = w.origin.z + ends * w.dir.z;
    let low = min(depths.x, depths.y) - pad;
    let high = max(depths.x, depths.y) + pad;
    if high < unkey(~cells[cell]) || low > unkey(cells[cell + 1u]) {
        return false;
    }
    let passed = slots(low, high, 64.0 / f32(frame.size[w.axis]));
    return (passed.x & cells[cell + 2u]) != 0u || (passed.y & cells[cell + 3u]) != 0u;
}

// Leaves the cell walked on for the next; false at the raster's end.
fn leave(w: ptr<function, Walk>) -> bool {
    let side = (*w).side;
    let other = 1u - side;
    let was = (*w).at;
    let along = (*w).origin[other] + (*w).exit * (*w).dir[other];
    var at: vec2i;
    at[side] = select((*w).low[side] - 1, (*w).high[side], (*w).dir[side] > 0.0);
    // A cell at the raster's end may reach beyond it.
    let last = min((*w).high[other], (*w).size[other]) - 1;
    at[other] = clamp(i32(along), (*w).low[other], last);
    if at[side] < 0 || at[side] >= (*w).size[side] {
        return false;
    }
    (*w).at = at;
    (*w).t = (*w).exit;
    if (*w).depth > 0u {
        let above = vec2u(frame.cells[3u * (*w).axis + (*w).depth - 1u].zw);
        let moved = (vec2u(was) >> above) != (vec2u(at) >> above);
        (*w).depth -= select(0u, 1u, any(moved));
    }
    return true;
}

// Goes on to the next texel with samples; false if there is none before `t_end`. Cells count as met when the ray
// comes within `pad` of their depths.
fn walk_next(w: ptr<function, Walk>, t_end: f32, pad: f32) -> bool {
    loop {
        rounds += 1u;
        if (*w).done {
            if spent() || (*w).exit > t_end || !leave(w) {
                return false;
            }
            (*w).done = false;
        }
        if (*w).t > t_end {
            return false;
        }
        var level = vec4u(0u);
        if (*w).depth < frame.levels {
            level = frame.cells[3u * (*w).axis + (*w).depth];
        }
        (*w).low = vec2i((vec2u((*w).at) >> level.zw) << level.zw);
        (*w).high = (*w).low + vec2i(vec2u(1u) << level.zw);
        let out = exits(*w);
        (*w).side = select(0u, 1u, out.y < out.x);
        // Rounding must not turn a way around.
        (*w).exit = max(min(out.x, out.y), (*w).t);
        let ends = vec2f((*w).t, min((*w).exit, t_end));
        if (*w).depth < frame.levels {
            (*w).steps.x += 1u;
            if meets(*w, level, ends, pad) {
                (*w).depth += 1u;
            } else {
                (*w).done = true;
            }
            continue;
        }
        (*w).steps.y += 1u;
        (*w).done = true;
        let texel = texel_index((*w).axis, u32((*w).at.x), u32((*w).at.y));
        (*w).first = starts[texel];
        (*w).last = starts[texel + 1u];
        if (*w).first < (*w).last {
            (*w).ends = ends;
            return true;
        }
    }
    return false;
}

// The directions in the order they are searched: most aligned with the ray first.
fn axis_order(dir: vec3f) -> vec3u {
    let d = abs(dir);
    var order = vec3u(0u, 1u, 2u);
    if d.y > d.x {
        order = vec3u(1u, 0u, 2u);
    }
    if d.z > d[order.y] {
        order = vec3u(order.x, 2u, order.y);
    }
    if d[order.y] > d[order.x] {
        order = order.yxz;
    }
    return order;
}

// A sample as it was made, but for the depth's bits.
struct Sample {
    id: u32,
    depth: f32,
    slopes: u32,
}

fn sample_at(s: u32, axis: u32) -> Sample {
    if frame.depth == F32_DEPTH {
        return Sample(samples[SAMPLE * s], bitcast<f32>(samples[SAMPLE * s + 1u]), samples[SAMPLE * s + 2u]);
    }
    let bits = samples[PACKED * s + 1u];
    var share = unpack2x16float(bits).y;
    if frame.depth == U16_DEPTH {
        share = f32(bits >> 16u) / 65535.0;
    }
    return Sample(samples[PACKED * s], share * f32(frame.size[axis]), bits & 0xffffu);
}

fn slopes_of(packed: u32) -> vec2f {
    let bytes = vec2i(vec2u(packed << 24u, packed << 16u)) >> vec2u(24u);
    return select(vec2f(bytes) / 127.0, vec2f(0.0), packed == NO_PLANE);
}

// How far a sample's plane departs from its depth over the texel: slopes are at most 1 either way.
const PLANE_REACH: f32 = 1.015625;

// The samples of the texel found that may count, those within reach of the ray's depths: samples are sorted, but for
// very many. Where what has no plane comes before all others, it counts at any depth.
struct Near {
    next: u32,
    // First of those that are sorted and not below the ray.
    start: u32,
    high: f32,
}

// Whether a sample's depth says where it counts.
fn by_depth(sample: Sample) -> bool {
    return sample.slopes != NO_PLANE || frame.conservative == 0u;
}

fn near_ray(w: Walk, reach: f32) -> Near {
    let depths = w.origin.z + w.ends * w.dir.z;
    let low = min(depths.x, depths.y) - reach;
    var start = w.first;
    var end = w.last;
    rounds += 1u;
    if end - start > LONGEST {
        return Near(start, start, FAR);
    }
    while start < end {
        rounds += 1u;
        let middle = (start + end) / 2u;
        let sample = sample_at(middle, w.axis);
        if sample.id != NONE && (!by_depth(sample) || sample.depth < low) {
            start = middle + 1u;
        } else {
            end = middle;
        }
    }
    return Near(w.first, start, max(depths.x, depths.y) + reach);
}

// The next of them; its id is NONE if there is none.
fn next_near(w: ptr<function, Walk>, near: ptr<function, Near>) -> Sample {
    let nothing = Sample(NONE, 0.0, 0u);
    rounds += 1u;
    if spent() || (*near).next >= (*w).last {
        return nothing;
    }
    var sample = sample_at((*near).next, (*w).axis);
    if by_depth(sample) {
        if (*near).next < (*near).start {
            (*near).next = (*near).start;
            if (*near).next >= (*w).last {
                return nothing;
            }
            sample = sample_at((*near).next, (*w).axis);
        }
        if sample.id == NONE || sample.depth > (*near).high {
            return nothing;
        }
    }
    (*near).next += 1u;
    (*w).steps.z += 1u;
    return sample;
}

// How far a sample's plane lies below the ray at both ends of its way through the sample's texel.
fn above(w: Walk, depth: f32, slopes: vec2f) -> vec2f {
    let centre = vec2f(w.at) + 0.5 - w.origin.xy;
    let enter = w.ends.x * w.dir.xy - centre;
    let leave = w.ends.y * w.dir.xy - centre;
    let below = vec2f(dot(slopes, enter), dot(slopes, leave));
    return w.origin.z + w.ends * w.dir.z - (depth + below);
}
