// VMV07's way: as many passes over the triangles as the fullest texel has samples, each taking the nearest sample
// beyond the pass before. Samples of equal depth collapse to the one of the smallest id. Follows `raster.wgsl`.

// Three words a texel: inverse key of the nearest depth of this pass, inverse id there, key of the pass before.
@group(0) @binding(7) var<storage, read_write> peeled: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read> starts: array<u32>;

@compute @workgroup_size(64)
fn peel_depth(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
              @builtin(local_invocation_index) local: u32) {
    let item = thread_index(group, groups, local, 64u);
    if item >= row_starts[frame.triangles] {
        return;
    }
    let t = row_of(item);
    for (var column = t.columns.x; column < t.columns.y; column++) {
        let at = 3u * texel_index(t.r.axis, column, t.row);
        let depth = key(depth_at(t.r, column, t.row));
        if depth > atomicLoad(&peeled[at + 2u]) {
            atomicMax(&peeled[at], ~depth);
        }
    }
}

@compute @workgroup_size(64)
fn peel_owner(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
              @builtin(local_invocation_index) local: u32) {
    let item = thread_index(group, groups, local, 64u);
    if item >= row_starts[frame.triangles] {
        return;
    }
    let t = row_of(item);
    for (var column = t.columns.x; column < t.columns.y; column++) {
        let at = 3u * texel_index(t.r.axis, column, t.row);
        if ~key(depth_at(t.r, column, t.row)) == atomicLoad(&peeled[at]) {
            atomicMax(&peeled[at + 1u], ~t.prim);
        }
    }
}

@compute @workgroup_size(64)
fn peel_take(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
             @builtin(local_invocation_index) local: u32) {
    let item = thread_index(group, groups, local, 64u);
    if item >= row_starts[frame.triangles] {
        return;
    }
    let t = row_of(item);
    for (var column = t.columns.x; column < t.columns.y; column++) {
        let texel = texel_index(t.r.axis, column, t.row);
        let nearest = atomicLoad(&peeled[3u * texel]);
        let own = ~key(depth_at(t.r, column, t.row)) == nearest;
        if own && ~t.prim == atomicLoad(&peeled[3u * texel + 1u]) {
            write_sample(atomicAdd(&next[texel], 1u), t.r, t.prim, column, t.row);
            bound(t.r, column, t.row);
        }
    }
}

// Readies all texels for the next pass.
@compute @workgroup_size(64)
fn peel_next(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
             @builtin(local_invocation_index) local: u32) {
    let texel = thread_index(group, groups, local, 64u);
    if texel >= frame.first_texel.w {
        return;
    }
    let nearest = atomicExchange(&peeled[3u * texel], 0u);
    atomicStore(&peeled[3u * texel + 1u], 0u);
    if nearest != 0u {
        atomicStore(&peeled[3u * texel + 2u], ~nearest);
    }
}

// Marks what equal depths have left over of a texel's samples.
@compute @workgroup_size(64)
fn peel_end(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
            @builtin(local_invocation_index) local: u32) {
    let texel = thread_index(group, groups, local, 64u);
    if texel >= frame.first_texel.w {
        return;
    }
    for (var at = atomicLoad(&next[texel]); at < starts[texel + 1u]; at++) {
        samples[SAMPLE * at] = NONE;
        samples[SAMPLE * at + 1u] = 0u;
        samples[SAMPLE * at + 2u] = 0u;
    }
}
