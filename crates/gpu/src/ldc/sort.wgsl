// Each texel's samples by depth, then id; with centre coverage those of equal depth are left out but the first. With
// conservative coverage what has no plane, and so may be met at any depth, comes before all others. What is too long
// stays as it is.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read_write> samples: array<u32>;

fn before(a: vec3u, b: vec3u) -> bool {
    let ka = key(bitcast<f32>(a.y));
    let kb = key(bitcast<f32>(b.y));
    if frame.conservative == 1u && (a.z == NO_PLANE) != (b.z == NO_PLANE) {
        return a.z == NO_PLANE;
    }
    return ka < kb || (ka == kb && a.x < b.x);
}

fn load(i: u32) -> vec3u {
    return vec3u(samples[SAMPLE * i], samples[SAMPLE * i + 1u], samples[SAMPLE * i + 2u]);
}

fn store(i: u32, s: vec3u) {
    samples[SAMPLE * i] = s.x;
    samples[SAMPLE * i + 1u] = s.y;
    samples[SAMPLE * i + 2u] = s.z;
}

@compute @workgroup_size(64)
fn sort(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
        @builtin(local_invocation_index) local: u32) {
    let texel = thread_index(group, groups, local, 64u);
    if texel >= frame.first_texel.w {
        return;
    }
    let first = starts[texel];
    let count = starts[texel + 1u] - first;
    if count > LONGEST {
        return;
    }
    shell_sort(first, count);
    if frame.conservative == 1u || count < 2u {
        return;
    }
    var kept = 1u;
    for (var i = 1u; i < count; i++) {
        let sample = load(first + i);
        if sample.y != samples[SAMPLE * (first + kept - 1u) + 1u] {
            store(first + kept, sample);
            kept += 1u;
        }
    }
    for (var i = kept; i < count; i++) {
        store(first + i, vec3u(NONE, 0u, 0u));
    }
}
