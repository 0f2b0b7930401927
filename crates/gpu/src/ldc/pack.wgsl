// Samples with sixteen bits of depth: `trace/src/ldc/samples.rs`. They are made, peeled and sorted with f32 before.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> samples: array<u32>;
@group(0) @binding(3) var<storage, read_write> packed: array<u32>;

// The share of a direction's depth in sixteen bits.
fn stored(share: f32) -> u32 {
    if frame.depth == U16_DEPTH {
        return u32(clamp(share, 0.0, 1.0) * 65535.0 + 0.5);
    }
    return pack2x16float(vec2f(share, 0.0)) & 0xffffu;
}

@compute @workgroup_size(64)
fn pack(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
        @builtin(local_invocation_index) local: u32) {
    let texel = thread_index(group, groups, local, 64u);
    if texel >= frame.first_texel.w {
        return;
    }
    let axis = select(select(0u, 1u, texel >= frame.first_texel.y), 2u, texel >= frame.first_texel.z);
    for (var s = starts[texel]; s < starts[texel + 1u]; s++) {
        let share = bitcast<f32>(samples[SAMPLE * s + 1u]) / f32(frame.size[axis]);
        packed[PACKED * s] = samples[SAMPLE * s];
        packed[PACKED * s + 1u] = samples[SAMPLE * s + 2u] | (stored(share) << 16u);
    }
}
