// Triangles to samples: rows of each triangle, samples of each texel counted, then filled in (VMV07's hoped-for
// single sweep). One thread a row of a triangle, so that a large triangle is the work of many.

@group(0) @binding(3) var<storage, read_write> row_starts: array<u32>;
// Samples of each texel so far, then where its next one goes.
@group(0) @binding(4) var<storage, read_write> next: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> samples: array<u32>;
// Four words a cell: keys of the inverse of the least and of the largest depth, occupied 64ths.
@group(0) @binding(6) var<storage, read_write> cells: array<atomic<u32>>;

@compute @workgroup_size(64)
fn rows(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
        @builtin(local_invocation_index) local: u32) {
    let prim = thread_index(group, groups, local, 64u);
    if prim >= frame.triangles {
        return;
    }
    let r = routed(prim);
    let rows = rows_of(r);
    row_starts[prim] = select(0u, rows.y - rows.x, r.usable);
}

// A row of a triangle, and its columns.
struct Row {
    r: Routed,
    prim: u32,
    row: u32,
    columns: vec2u,
}

fn row_of(item: u32) -> Row {
    let prim = owner(item, frame.triangles);
    let r = routed(prim);
    let row = rows_of(r).x + item - row_starts[prim];
    return Row(r, prim, row, columns_of(r, row));
}

@compute @workgroup_size(64)
fn count(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
         @builtin(local_invocation_index) local: u32) {
    let item = thread_index(group, groups, local, 64u);
    if item >= row_starts[frame.triangles] {
        return;
    }
    let t = row_of(item);
    for (var column = t.columns.x; column < t.columns.y; column++) {
        atomicAdd(&next[texel_index(t.r.axis, column, t.row)], 1u);
    }
}

fn write_sample(at: u32, r: Routed, prim: u32, column: u32, row: u32) {
    samples[SAMPLE * at] = prim;
    samples[SAMPLE * at + 1u] = bitcast<u32>(depth_at(r, column, row));
    samples[SAMPLE * at + 2u] = packed_slopes(r);
}

// Adds a sample to the lowest level's cell.
fn bound(r: Routed, column: u32, row: u32) {
    if frame.levels == 0u {
        return;
    }
    let level = frame.cells[3u * r.axis + frame.levels - 1u];
    let cell = 4u * (level.x + (row >> level.w) * level.y + (column >> level.z));
    let spread = (abs(r.slopes.x) + abs(r.slopes.y)) * (0.5 + REACH) + PLANE_ERROR;
    let depth = depth_at(r, column, row);
    // A sample that names its triangle is needed where that is, one that stands for it over all of its texel.
    var range = vec2f(depth - spread, depth + spread);
    if frame.conservative == 1u {
        let near = clamp(depth, r.depth.x, r.depth.y);
        range = vec2f(max(near - spread, r.depth.x), min(near + spread, r.depth.y));
    }
    if !r.has_plane {
        range = r.depth;
    }
    let error = REACH + depth_error(r.axis);
    range += vec2f(-error, error);
    let occupied = slots(range.x, range.y, 64.0 / f32(frame.size[r.axis]));
    atomicMax(&cells[cell], ~key(range.x));
    atomicMax(&cells[cell + 1u], key(range.y));
    atomicOr(&cells[cell + 2u], select(NONE, occupied.x, frame.occupancy == 1u));
    atomicOr(&cells[cell + 3u], select(NONE, occupied.y, frame.occupancy == 1u));
}

@compute @workgroup_size(64)
fn fill(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
        @builtin(local_invocation_index) local: u32) {
    let item = thread_index(group, groups, local, 64u);
    if item >= row_starts[frame.triangles] {
        return;
    }
    let t = row_of(item);
    for (var column = t.columns.x; column < t.columns.y; column++) {
        let at = atomicAdd(&next[texel_index(t.r.axis, column, t.row)], 1u);
        write_sample(at, t.r, t.prim, column, t.row);
        bound(t.r, column, t.row);
    }
}
